"""The pass for inspection: light walks beside a run of camera walks, in a run folder of their own inside the run's."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pipeline.config import Analysis, Images
from pipeline.estimate import SizeEstimate, estimate_size
from pipeline.identity import differences, fingerprint
from pipeline.prepare import PreparedJob
from pipeline.run_folder import RunFolder
from queries.inspection import FOLDER
from renderer.textures.pixel_filter import without_ewa
from renderer.trace import Tracer


def inspection_folder(folder: RunFolder) -> RunFolder:
    """Where the pass lies."""
    return RunFolder(folder.path / FOLDER)


def inspection_job(prepared: PreparedJob) -> PreparedJob | None:
    """The pass as a job of its own: the same scene and film, light walks, all kept; None where none is asked for, or the run traces light itself."""
    asked = prepared.loaded.job.inspection
    if asked is None or prepared.settings.method == "light":
        return None
    plain: dict[str, Any] = {"keep": 1.0, "columns": frozenset(), "occluded": False, "texture_filter": "point", "texture_layout": None}
    settings, scene = replace(prepared.settings, method="light", passes=asked.samples, **plain), without_ewa(prepared.scene)
    job = prepared.loaded.job
    bare: dict[str, Any] = {"aovs": {}, "rank": {}, "views": {}, "report": None, "inspection": None, "analysis": Analysis(), "images": Images()}
    render = job.render.model_copy(update={"method": "light", "samples": asked.samples, "texture_filter": "point", "texture_layout": None})
    loaded = replace(prepared.loaded, job=job.model_copy(update={**bare, "render": render}))
    return PreparedJob(loaded, scene, settings, fingerprint(settings, scene))


def size_with_inspection(prepared: PreparedJob, tracer: Tracer) -> SizeEstimate:
    """How large the run will be, the pass included. ``tracer``: of the run itself."""
    size, job = estimate_size(tracer, prepared.settings), inspection_job(prepared)
    if job is None:
        return size
    light = estimate_size(Tracer(job.scene, job.settings), job.settings)
    return SizeEstimate({**size.tables, FOLDER: light.bytes}, size.film)


def trace_inspection(prepared: PreparedJob, folder: RunFolder, run: Callable[[PreparedJob, RunFolder], None]) -> bool:
    """Trace the pass that the job asks for with ``run``, or go on with it; one of other settings is replaced. Returns whether there is one."""
    job = inspection_job(prepared)
    if job is None:
        return False
    inner = inspection_folder(folder)
    old = inner.manifest()
    if old is not None and differences(old.get("fingerprint", {}), job.fingerprint):
        shutil.rmtree(inner.path)
    with inner.locked():
        run(job, inner)
    return True
