"""The offline report of a run: what the job asks for, and `pathspace report`."""

import pathlib
import tempfile
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pipeline.config import Report
from pipeline.deeper import cut
from pipeline.diagnose import ALL
from pipeline.errors import JobError
from pipeline.files import clear_errors
from pipeline.run_folder import RunFolder
from queries.errors import QueryError
from queries.run import Run, open_run
from renderer.errors import SceneError
from renderer.scene.arrays import Scene

if TYPE_CHECKING:
    from viz.report import Answer


def write_job_report(
    folder: RunFolder, asked: Report, threads: int | None, out: pathlib.Path | None = None, scene: Scene | None = None
) -> pathlib.Path:
    """Write the report of a finished run into ``report/`` of its folder, or into ``out``; returns its page. ``scene``: the run's, if it is at hand.

    Raises QueryError.
    """
    from viz.report import draw_classes, model_of_paths, write_report

    with open_run(folder.path, threads=threads) as run, tempfile.TemporaryDirectory(prefix="pathspace-") as name:
        pictures, recorded = pathlib.Path(name), run.settings["keep"] > 0
        models = [model_of_paths(run, asked.paths, pictures)] if asked.paths and recorded else []
        draw = draw_classes(run, pictures) if asked.top else None
        further = {"cut": _cut(run, scene)} if recorded else {}
        return write_report(run, out or folder.report.parent, models=models, draw=draw, answers=further, top=asked.top, threads=threads)


def _cut(run: Run, scene: Scene | None) -> "Answer":
    """What ``max_depth`` cuts, or why that is not known: the one diagnostic that traces."""
    title = ALL["cut"][1]
    try:
        return title, cut(run, scene=scene)
    except (QueryError, JobError, SceneError) as error:
        return title, str(error)


def print_report(path: pathlib.Path, out: pathlib.Path | None, given: Mapping[str, Any]) -> None:
    """Write a run's report as its job describes it, or a plain one, with what is ``given`` instead, and print where it is.

    Raises JobError and QueryError.
    """
    folder = RunFolder(path)
    with open_run(path) as run:
        described = (run.manifest.get("job") or {}).get("report") or {}
    with clear_errors("writing the report", out or folder.report.parent):
        print(write_job_report(folder, Report.model_validate({**described, **given}), None, out))
