"""From a job file to what can be traced: the compiled scene, complete settings, expressions that parse."""

import copy
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from pipeline.errors import JobError
from pipeline.identity import fingerprint, trace_settings
from pipeline.job_file import LoadedJob, load_job
from pipeline.progress import LOG
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
    """Read a job, check its expressions and compile its scene. Raises JobError and SceneError."""
    loaded = load_job(path, overrides)
    check_expressions(loaded)
    scene = compile_scene(loaded)
    for warning in scene.warnings:
        LOG.warning("warning: %s", warning)
    settings = trace_settings(loaded.job, scene)
    return PreparedJob(loaded, scene, settings, fingerprint(settings, scene))


def check_expressions(loaded: LoadedJob) -> None:
    """Compile every AOV's expression now, not after hours of rendering."""
    if loaded.job.aovs and loaded.job.record.share == 0.0:
        place = next(iter(loaded.aov_places.values()))
        raise JobError(
            "`aovs` are computed from the tables, and `record.keep: none` keeps none: record all walks or a fraction, or drop `aovs`", place
        )
    if not loaded.job.aovs:
        return
    from queries.errors import QueryError
    from queries.lpe import compile

    for name, expression in loaded.job.aovs.items():
        try:
            warnings = compile(expression).warnings
        except QueryError as error:
            raise JobError(f"`aovs.{name}`: {error}, in `{expression}`", loaded.aov_places[name]) from None
        for warning in warnings:
            LOG.warning("%s: warning: `aovs.%s`: %s", loaded.aov_places[name], name, warning)


def compile_scene(loaded: LoadedJob) -> Scene:
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
