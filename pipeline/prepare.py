"""From a job file to what can be traced: the compiled scene, complete settings, questions that can be answered."""

import copy
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.config import Job
from pipeline.errors import JobError
from pipeline.identity import fingerprint, trace_settings
from pipeline.job_file import LoadedJob, load_job
from pipeline.progress import LOG
from pipeline.questions import check_questions
from renderer.errors import SceneError
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.settings import TraceSettings

_SENSORS = ("perspective", "thinlens")


@dataclass(frozen=True)
class PreparedJob:
    """A job that can be traced. ``fingerprint`` is what must be equal for a run folder to be this job's."""

    loaded: LoadedJob
    scene: Scene
    settings: TraceSettings
    fingerprint: dict[str, Any]


def prepare_job(path: pathlib.Path, overrides: Sequence[str] = ()) -> PreparedJob:
    """Read a job, compile its scene, and check its questions. Raises JobError and SceneError."""
    loaded = load_job(path, overrides)
    check_questions(loaded)
    scene = compile_scene(loaded)
    check_questions(loaded, scene)
    for warning in scene.warnings:
        LOG.warning("warning: %s", warning)
    settings = trace_settings(loaded.job, scene)
    return PreparedJob(loaded, scene, settings, fingerprint(settings, scene))


def compile_scene(loaded: LoadedJob) -> Scene:
    """The job's scene, with its film at the job's resolution and the job's filter of textures. Raises JobError and SceneError."""
    return with_texture_filter(compile_film(loaded), loaded.job)


def with_texture_filter(scene: Scene, job: Job) -> Scene:
    """The scene with the filter over bitmaps that the job asks for. Raises JobError for displays whose pixels are no triples of R, G and B."""
    render = job.render
    if render.texture_filter == "point":
        return scene
    from renderer.textures.pixel_filter import triples, with_ewa

    if render.texture_layout is None:
        return with_ewa(scene)
    from queries.subpixel.description import SubpixelDescription, shipped_layouts
    from renderer.filters.subpixel.derive import derive
    from renderer.filters.subpixel.methods import subpixel_filter
    from renderer.filters.subpixel.windowed_sinc import fit

    # The display as the job's analysis describes it, which also says from where it is seen
    asked = job.analysis.subpixel or SubpixelDescription()
    layouts = {**shipped_layouts(), **asked.custom}
    if render.texture_layout not in layouts:
        raise JobError(f"render.texture_layout: there is no layout `{render.texture_layout}`: known are {', '.join(layouts)}")
    layout = layouts[render.texture_layout].layout(render.texture_layout)
    try:
        triples(layout)
        fits = fit(derive(layout, asked.viewing, asked.sensitivity.sensitivity()))
        return with_ewa(scene, subpixel_filter("optimal", layout, fits, asked.zeros))
    except ValueError as error:
        raise JobError(f"render.texture_layout: {error}") from None


def compile_film(loaded: LoadedJob) -> Scene:
    """The job's scene, with its film at the job's resolution."""
    job = loaded.job
    inline = not isinstance(loaded.scene, str)
    folder = (loaded.folder if inline else pathlib.Path(str(loaded.scene)).parent).absolute()
    try:
        scene = load_scene(loaded.scene, parameters={key: str(value) for key, value in job.parameters.items()}, base=folder if inline else None)
        if job.render.resolution is None or job.render.resolution == (scene.defaults.width, scene.defaults.height):
            return scene
        return load_scene(resized(scene.description, *job.render.resolution), base=folder)
    except SceneError as error:
        if error.place and not inline:
            raise
        raise JobError(f"in the scene: {error}", loaded.scene_place) from None


def resized(description: dict[str, Any], width: int, height: int) -> dict[str, Any]:
    """A scene description with another film size (pixels); the sensor's field of view follows its own rules."""
    changed = copy.deepcopy(description)
    for sensor in changed.values():
        if isinstance(sensor, dict) and sensor.get("type") in _SENSORS:
            films = [value for value in sensor.values() if isinstance(value, dict) and str(value.get("type")).endswith("film")]
            film = films[0] if films else sensor.setdefault("film", {"type": "hdrfilm"})
            film["width"], film["height"] = width, height
    return changed
