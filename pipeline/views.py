"""Views that a job asks for, as pictures in the run folder; and one view asked for by hand."""

import json
import pathlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipeline.config import Job
from pipeline.errors import JobError
from pipeline.files import FileRecord, checksum, clear_errors, is_whole
from pipeline.job_file import checked_view
from pipeline.progress import Progress
from pipeline.run_folder import RunFolder
from queries.regions import parse_region
from queries.run import Run, open_run
from viz.description import TOOLS, View


def write_views(
    folder: RunFolder, job: Job, terms: Mapping[str, Any], known: Mapping[str, Any], threads: int, bar: Progress
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Draw every view of a job, as ``views/<name>.png`` and what goes with it; as each is drawn, its name and what the manifest notes of it.

    Those that ``known`` says were drawn before, in the same ``terms`` (regions, cameras, the pass for inspection), are kept. Raises QueryError.
    """
    with open_run(folder.path, threads=threads) as run:
        for name, view in job.views.items():
            question = {"asked": view.model_dump(mode="json"), "terms": dict(terms)}
            before = known.get(name, {})
            if not _is_there(folder, question, before):
                _remove(folder, before)
                yield name, question | _draw(folder, run, view, name)
            bar.advance(1)


def _is_there(folder: RunFolder, question: Mapping[str, Any], known: Mapping[str, Any]) -> bool:
    """Whether the view was drawn before, as it is asked for now, and its files are whole."""
    files = known.get("checksums", {})
    return bool(files) and all(known.get(key) == value for key, value in question.items()) and all(is_whole(folder.path / f, files[f]) for f in files)


def _remove(folder: RunFolder, known: Mapping[str, Any]) -> None:
    """Remove the files of a view that is drawn anew: it may have fewer now."""
    for file in known.get("checksums", {}):
        (folder.path / file).unlink(missing_ok=True)


def _draw(folder: RunFolder, run: Run, view: View, name: str) -> dict[str, Any]:
    """Draw one view; what the manifest notes: caption, figures, files by kind, pictures of a sequence, checksums of all, by path."""
    from viz.view import draw_view

    drawn = draw_view(run, view, folder.views, name)
    files = {kind: path.relative_to(folder.path).as_posix() for kind, path in drawn.files.items()}
    frames = [path.relative_to(folder.path).as_posix() for path in drawn.frames]
    checksums = {file: FileRecord(0, *checksum(folder.path / file)).as_json() for file in [*files.values(), *frames]}
    return {"tool": view.tool_name, "caption": drawn.caption, "figures": drawn.figures, "files": files, "frames": frames, "checksums": checksums}


# --- by hand ------------------------------------------------------------------------------------------------------


def print_view(
    path: pathlib.Path,
    what: str | None,
    given: Mapping[str, Any],
    settings: Sequence[str],
    define: Sequence[str],
    out: pathlib.Path | None,
) -> None:
    """Draw a view of the job, or a tool by its name, into ``out`` (default: ``<what>.png`` here), and print its caption, figures and files.

    ``given``: keys of the tool; ``settings``: ``key=value`` for any key of the view. Without ``what``, list what there is.
    Raises JobError and QueryError.
    """
    with open_run(path, regions=dict(parse_region(text) for text in define)) as run:
        views: Mapping[str, Any] = (run.manifest.get("job") or {}).get("views") or {}
        if what is None:
            _list(views)
            return
        view = _view(what, views, given, settings)
        from viz.view import draw_view

        target = out or pathlib.Path(f"{what}.png")
        if target.suffix != ".png":
            raise JobError(f"expected a picture to write, such as {what}.png, found --out {target}")
        with clear_errors("drawing a view", target.parent):
            drawn = draw_view(run, view, target.parent, target.stem)
    print(drawn.caption)
    for name, value in drawn.figures.items():
        print(f"  {name.replace('_', ' ')}: {value:.6g}" if isinstance(value, float) else f"  {name.replace('_', ' ')}: {value}")
    for kind, file in drawn.files.items():
        print(f"{kind}: {file}")
    if drawn.frames:
        print(f"frames: {drawn.frames[0]} … {drawn.frames[-1].name} ({len(drawn.frames)})")


def _view(what: str, views: Mapping[str, Any], given: Mapping[str, Any], settings: Sequence[str]) -> View:
    """The view of this name, or the tool's, with what was given by hand."""
    if what not in views and what not in TOOLS:
        known = f"the job's views are {', '.join(views)}" if views else "the job has no views"
        raise JobError(f"there is no view or tool `{what}`: {known}; the tools are {', '.join(TOOLS)}")
    described: dict[str, Any] = {what: {}}
    if what in views:
        described = {key: value for key, value in json.loads(json.dumps(views[what])).items() if value is not None}
    tool = next(key for key in described if key in TOOLS)
    described[tool] = {key: value for key, value in described[tool].items() if value is not None} | dict(given)
    return checked_view(what, described, settings)


def _list(views: Mapping[str, Any]) -> None:
    for name, view in views.items():
        print(f"{name}  (a view of the job: {next(key for key in view if key in TOOLS and view[key] is not None)})")
    for name, tool in TOOLS.items():
        print(f"{name}  ({(tool.__doc__ or '').strip().splitlines()[0]})")
