"""What a job will ask of its run, checked before hours of rendering: regions, expressions, rankings, views."""

import itertools
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, Any

from pipeline.config import Rank
from pipeline.errors import JobError
from pipeline.files import checksum
from pipeline.job_file import LoadedJob
from pipeline.progress import LOG
from renderer.scene.arrays import Scene
from viz.cameras import JOB_CAMERA
from viz.tools.arrows import Arrows
from viz.tools.base import WalkTool

if TYPE_CHECKING:
    from queries.lpe import Expression


def check_questions(loaded: LoadedJob, scene: Scene | None = None) -> None:
    """Check that all regions, expressions and rankings can be answered; with a scene, that what they name exists there.

    Raises JobError with the place in the file. Warnings are given with the scene, once.
    """
    job = loaded.job
    for section, place in (("aovs", loaded.aov_places), ("rank", loaded.rank_places), ("views", loaded.view_places)):
        if place and job.record.share == 0.0:
            raise JobError(
                f"`{section}` is computed from the tables, and `record.keep: none` keeps none: record all walks or a fraction, or drop `{section}`",
                next(iter(place.values())),
            )
    if job.analysis.subpixel is not None and job.record.share == 0.0:
        raise JobError("`analysis.subpixel` filters recorded samples, and `record.keep: none` keeps none: record all walks or a fraction, or drop it")
    _check_regions(loaded, scene)
    _check_expressions(loaded, scene)
    for name, asked in job.rank.items():
        problem = _problem(asked, job.regions)
        if problem:
            raise JobError(f"`rank.{name}`: {problem}", loaded.rank_places[name])
    _check_views(loaded, scene)


def region_terms(loaded: LoadedJob) -> dict[str, Any]:
    """What the job's regions are: their descriptions, and of mesh files the checksums too. Raises OSError where a file is gone."""
    terms = {name: description.model_dump(mode="json") for name, description in loaded.job.regions.items()}
    for name, description in loaded.job.regions.items():
        if description.mesh is not None:
            terms[name]["xxh3"] = checksum(loaded.folder / description.mesh.file)[1]
    return terms


def _problem(asked: Rank, regions: Collection[str]) -> str | None:
    """Why a ranking cannot be made."""
    if asked.region is not None and asked.region not in regions:
        return f"there is no region `{asked.region}` ({_known(regions, 'regions')})"
    if asked.region is None and asked.by != "contribution":
        return "without a `region` there is nothing to compare with: expected `by: contribution`"
    if asked.merge and asked.with_objects:
        return "`merge` gathers classes that `with_objects` would tell apart: choose one of them"
    return None


def _check_regions(loaded: LoadedJob, scene: Scene | None) -> None:
    """Mesh files can be read, and objects exist."""
    if not loaded.job.regions:
        return
    from queries.errors import QueryError
    from queries.regions import region

    for name, description in loaded.job.regions.items():
        place = loaded.region_places[name]
        if scene:  # files were read before the scene was
            _check_objects(scene, [description.object.name] if description.object else [], f"regions.{name}", place)
            continue
        try:
            region(description, loaded.folder).check()
        except QueryError as error:
            raise JobError(f"`regions.{name}`: {error}", place) from None


def _check_expressions(loaded: LoadedJob, scene: Scene | None) -> None:
    """Every AOV's expression compiles, and names what exists."""
    job = loaded.job
    for name, text in job.aovs.items():
        expression = _compiled(loaded, scene, text, job.dialect, f"aovs.{name}", loaded.aov_places[name])
        if {"unoccluded", "shadows"} & set(expression.prefixes) and not job.record.occluded:
            prefix = next(prefix for prefix in expression.prefixes if prefix in ("unoccluded", "shadows"))
            raise JobError(f"`aovs.{name}`: `{prefix};` reads blocked connections: add `record: {{occluded: true}}`", loaded.aov_places[name])


def _check_views(loaded: LoadedJob, scene: Scene | None) -> None:
    """Every view's expression compiles, its region, camera, objects and light walks exist."""
    job = loaded.job
    for name, view in job.views.items():
        place, tool = loaded.view_places[name], view.tool
        key = f"views.{name}.{view.tool_name}"
        if tool.expression is not None:
            expression = _compiled(loaded, scene, tool.expression, tool.dialect or job.dialect, f"{key}.expression", place)
            if set(expression.prefixes) - {"noclamp"}:
                raise JobError(f"`{key}.expression`: a prefix changes what a path counts, and a view draws paths as they are: leave it out", place)
        if tool.region is not None and tool.region not in job.regions:
            raise JobError(f"`{key}.region`: there is no region `{tool.region}` ({_known(job.regions, 'regions')})", place)
        if isinstance(view.camera, str) and view.camera not in (JOB_CAMERA, *job.cameras):
            raise JobError(f"`views.{name}.camera`: there is no camera `{view.camera}` ({_known(job.cameras, 'cameras')})", place)
        if scene:
            _check_objects(scene, view.look.hide, f"views.{name}.look.hide", place)
        if scene and isinstance(tool, Arrows):
            _check_objects(scene, itertools.chain.from_iterable(tool.groups.values()), f"{key}.groups", place)
        if scene and isinstance(tool, WalkTool):
            _check_walks(loaded, tool, scene, key, place)


def _check_objects(scene: Scene, names: Iterable[str], key: str, place: str) -> None:
    """The scene has all objects of these names."""
    objects = [thing.name for thing in scene.objects]
    for name in names:
        if name not in objects:
            raise JobError(f"`{key}`: the scene has no object `{name}` (it has {', '.join(objects)})", place)


def _check_walks(loaded: LoadedJob, tool: WalkTool, scene: Scene, key: str, place: str) -> None:
    """The walks that a tool measures will be recorded."""
    light = (loaded.job.render.method or scene.defaults.method) == "light"
    if tool.walks == "light" and not light and loaded.job.inspection is None:
        raise JobError(f"`{key}` is estimated from light walks: add `inspection: {{samples: 16}}`, or ask for `walks: camera`", place)
    if tool.walks == "camera" and light:
        raise JobError(f"`{key}`: `method: light` traces no camera walks: ask for `walks: light`", place)


def _compiled(loaded: LoadedJob, scene: Scene | None, text: str, dialect: str, key: str, place: str) -> "Expression":
    """An expression of the job; with a scene its names are checked, and its warnings are given. Raises JobError."""
    from queries.errors import QueryError
    from queries.lpe import compile
    from queries.lpe.names import kinds_by_name

    names = None
    if scene:
        names = kinds_by_name((o.name for o in scene.objects), (o.material for o in scene.objects), (e.name for e in scene.emitters))
    try:
        expression = compile(text, dialect, objects=names, regions=set(loaded.job.regions))
    except QueryError as error:
        raise JobError(f"`{key}`: {error}, in `{text}`", place) from None
    for warning in expression.warnings if scene else ():
        LOG.warning("%s: warning: `%s`: %s", place, key, warning)
    return expression


def _known(names: Collection[str], section: str) -> str:
    """What exists of a kind, in words."""
    return f"known: {', '.join(names)}" if names else f"the job has no `{section}`"
