"""Subpixel filters: what a job asks for, and `pathspace subpixel`: an analysis as pictures, tables and a page, in one folder."""

import os
import pathlib
import shlex
import shutil
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, BinaryIO, cast

import pyarrow as pa

from pipeline.errors import JobError
from pipeline.files import FileRecord, checksum, clear_errors, is_whole, new_file, write_json
from pipeline.images import write_plane
from pipeline.job_file import checked_subpixel
from pipeline.progress import LOG
from pipeline.run_folder import RunFolder
from queries.errors import QueryError
from queries.regions import parse_region
from queries.run import Run, open_run
from queries.sql import write
from queries.subpixel.description import SubpixelDescription, read_layout, shipped_layouts

if TYPE_CHECKING:
    from queries.subpixel.analysis import Analysis, Display
    from viz.report import Picture

FOLDER = "subpixel"  # in a run folder
MARK = "subpixel.json"  # by which a folder is known for an analysis, which may be replaced
SCALE = 3.0  # pixels of an image for each of the display's, as in the thesis's studies (4.5.4)


# --- for a job ----------------------------------------------------------------------------------------------------


def write_job_analysis(folder: RunFolder, asked: SubpixelDescription, known: Mapping[str, Any], threads: int | None) -> dict[str, Any]:
    """Analyze a run's samples into ``subpixel/`` of its folder; what the manifest notes of it.

    An analysis that ``known`` says was made before, of the same description, is kept. Raises QueryError.
    """
    from queries.subpixel.analyze import RunSource, analyze

    question = {"asked": asked.model_dump(mode="json")}
    files = known.get("checksums") or {}
    if files and known.get("asked") == question["asked"] and all(is_whole(folder.path / file, record) for file, record in files.items()):
        return dict(known)
    target = folder.path / FOLDER
    with open_run(folder.path, threads=threads) as run:
        _warn_of_blur(run)
        write_analysis(analyze(RunSource(run, threads=threads), asked), target, f"pathspace subpixel {folder.path.name}")
    written = sorted(file for file in target.rglob("*") if file.is_file())
    return question | {"checksums": {file.relative_to(folder.path).as_posix(): FileRecord(0, *checksum(file)).as_json() for file in written}}


def _warn_of_blur(run: Run) -> None:
    """Bitmaps that were filtered while rendering are blurred once more."""
    if run.settings.get("texture_filter") == "ewa":
        LOG.warning("warning: `%s` was rendered with texture_filter: ewa, so its bitmaps are filtered already and get blurred once more", run.path)


# --- as files -----------------------------------------------------------------------------------------------------


def write_analysis(analysis: "Analysis", folder: pathlib.Path, command: str) -> pathlib.Path:
    """Write an analysis as a folder that any browser opens; its page. An analysis that lies there is replaced. Raises QueryError.

    ``images/<layout>.exr`` has the drive of every position, not clipped; ``pictures/`` what the display shows; ``scores`` and ``methods``, as
    ``.csv`` and ``.arrow``, the comparison.
    """
    from viz.subpixel import figures
    from viz.subpixel.findings import best, summary
    from viz.subpixel.page import write_page

    _refuse_foreign(folder)
    work = folder.with_name(f".{folder.name}.tmp")
    shutil.rmtree(work, ignore_errors=True)
    (work / "images").mkdir(parents=True)
    (work / "figures").mkdir()
    try:
        pictures = [picture for display in analysis.displays for picture in _write_display(analysis, display, work)]
        _write_tables(analysis, work)
        write_page(work, analysis, figures(analysis, work / "figures"), pictures, command)
        found = {"layouts": [display.layout.name for display in analysis.displays], "best": best(analysis), "summary": summary(analysis)}
        write_json(work / MARK, {**found, "page": "index.html"})
        shutil.rmtree(folder, ignore_errors=True)
        os.replace(work, folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return folder / "index.html"


def _refuse_foreign(folder: pathlib.Path) -> None:
    if folder.exists() and not (folder / MARK).is_file() and (not folder.is_dir() or any(folder.iterdir())):
        raise QueryError(f"expected no folder at `{folder}`, or an older analysis to replace, found something else: name another folder with --out")


def _write_display(analysis: "Analysis", display: "Display", work: pathlib.Path) -> "list[Picture]":
    """The drive of a display as numbers and as a picture; what it shows by the asked method, and then by a box for each pixel, the standard."""
    from queries.subpixel.display import drive_picture, subpixel_picture
    from renderer.filters.subpixel.methods import TITLES
    from viz.pictures import write_png
    from viz.report import Picture
    from viz.report.numbers import percent
    from viz.report.subpixel import layout_title

    layout, method, pictures = display.layout, analysis.description.method, work / "pictures"
    pictures.mkdir(exist_ok=True)
    files = {"exr": work / "images" / f"{layout.name}.exr"}
    write_plane(files["exr"], display.lattice, {"layout": layout.name, "method": method, "source": analysis.name})
    drive = drive_picture(display.lattice, layout)
    if drive is not None:
        files["drive"] = pictures / f"{layout.name}-drive.png"
        write_png(files["drive"], drive)

    # What is seen through a magnifying glass
    clipped = f"{percent(display.clipped)} of the subpixels should be darker than black or brighter than they can be, and are clipped."
    shown = [(layout.name, TITLES[method], display.lattice, clipped, files)]
    if method != "pixel_box":
        shown.append((f"{layout.name}-standard", TITLES["pixel_box"], display.standard, "Standard filtering: one color for each pixel.", {}))
    title, (width, height), found = layout_title(layout.name), analysis.size, []
    for name, by, lattice, caption, belonging in shown:
        write_png(pictures / f"{name}.png", subpixel_picture(lattice, layout))
        alt = f"{analysis.name} on {title}, {by}: {width} × {height} pixels, subpixels in their colors."
        found.append(Picture(f"{title}: {by}", caption, alt, pictures / f"{name}.png", files=belonging))
    return found


def _write_tables(analysis: "Analysis", work: pathlib.Path) -> None:
    """The comparison, for spreadsheets and for programs."""
    if analysis.scores is None:
        return
    ranked = [table.add_column(0, "layout", pa.array([name] * table.num_rows)) for name, table in analysis.methods.items()]
    tables = {"scores": analysis.scores, "methods": pa.concat_tables(ranked)}
    if analysis.layouts is not None:
        tables["layouts"] = analysis.layouts
    for name, table in tables.items():
        for kind in ("csv", "arrow"):
            with new_file(work / f"{name}.{kind}") as file:
                write(table.to_reader(), kind, cast(BinaryIO, file))
                file.commit(table.num_rows)


# --- by hand ------------------------------------------------------------------------------------------------------


def list_layouts() -> None:
    """Print the layouts that are shipped."""
    for name, described in shipped_layouts().items():
        print(f"{name}  ({' / '.join(described.pattern)}; a pixel is {described.cells[0]} x {described.cells[1]} positions)")


def print_analysis(
    target: pathlib.Path,
    layouts: Sequence[str],
    given: Mapping[str, Any],
    settings: Sequence[str],
    scale: float | None,
    expression: str | None,
    define: Sequence[str],
    out: pathlib.Path | None,
) -> None:
    """Analyze a run's samples or an image, write the folder, and print what was found. Raises JobError and QueryError.

    ``layouts``: names, or YAML files with a layout; ``given``: keys of the description; ``settings``: ``key=value`` for any key of it; ``scale``:
    how many of the image's pixels are one of the display's; ``expression``: only light that it selects, of a run.
    """
    from queries.subpixel.analyze import ImageSource, RunSource, analyze
    from queries.subpixel.images import read_image

    if target.is_dir():
        if scale is not None:
            raise JobError("--scale is for images: a run's film has a pixel for each of the display's")
        folder = out or target / FOLDER
        with open_run(target, regions=dict(map(parse_region, define))) as run:
            job = (run.manifest.get("job") or {}).get("analysis") or {}
            asked = _described(job.get("subpixel") or {}, layouts, given, settings)
            _warn_of_blur(run)
            analysis = analyze(RunSource(run, run.compile(expression) if expression else None), asked)
    else:
        if expression is not None or define:
            raise JobError("--expression and --define are for runs: an image does not know its paths")
        folder = out or pathlib.Path(f"{target.stem}-{FOLDER}")
        asked = _described({}, layouts, given, settings)
        analysis = analyze(ImageSource(target.stem, read_image(target), scale or SCALE), asked)
    with clear_errors("writing the analysis", folder.parent):
        folder.parent.mkdir(parents=True, exist_ok=True)
        page = write_analysis(analysis, folder, _command(target, layouts, given, settings, scale, expression, define))
    _print(analysis)
    print(f"page: {page}")


def _described(job: Mapping[str, Any], layouts: Sequence[str], given: Mapping[str, Any], settings: Sequence[str]) -> SubpixelDescription:
    """The description of a job with what was given by hand in its place."""
    described = {**job, **given}
    if layouts:
        custom = {**(described.get("custom") or {}), **{pathlib.Path(name).stem: _file(name) for name in layouts if _is_file(name)}}
        described |= {"layouts": [pathlib.Path(name).stem if _is_file(name) else name for name in layouts], "custom": custom}
    return checked_subpixel(described, settings)


def _is_file(name: str) -> bool:
    return pathlib.PurePath(name).suffix in (".yaml", ".yml")


def _file(name: str) -> dict[str, Any]:
    return read_layout(pathlib.Path(name)).model_dump(mode="json")


def _command(
    target: pathlib.Path,
    layouts: Sequence[str],
    given: Mapping[str, Any],
    settings: Sequence[str],
    scale: float | None,
    expression: str | None,
    define: Sequence[str],
) -> str:
    """What makes the analysis again, for people: files by their names alone."""
    words = ["pathspace", "subpixel", target.name]
    for name in layouts:
        words += ["--layout", pathlib.PurePath(name).name if _is_file(name) else name]
    for text in (*(f"{key}={str(value).lower() if isinstance(value, bool) else value}" for key, value in given.items()), *settings):
        words += ["--set", text]
    if scale is not None:
        words += ["--scale", f"{scale:g}"]
    if expression is not None:
        words += ["--expression", expression]
    for text in define:
        words += ["--define", text]
    return shlex.join(words)


def _print(analysis: "Analysis") -> None:
    """What was found, as text."""
    from renderer.filters.subpixel.methods import TITLES

    width, height = analysis.size
    for display in analysis.displays:
        kernels = display.kernels
        print(f"{display.layout.name}: {width} x {height} pixels, {100 * display.clipped:.3g} % of the subpixels clipped")
        for subpixel, fitted in enumerate(display.fits):
            primary = display.layout.primaries[display.layout.active_primaries[subpixel]]
            print(f"  {primary}: a = {fitted.a:.4g}, b = {fitted.b:.4g} (in positions), residual {fitted.rms:.2g}")
        print(f"  condition number of the derivation {kernels.condition:.3g}")
        for warning in (*kernels.warnings(), *(fitted.warning for fitted in display.fits if fitted.warning)):
            print(f"  warning: {warning}")
        if display.layout.name in analysis.methods:
            for row in analysis.methods[display.layout.name].to_pylist():
                interval = "" if row["low"] is None else f" ({row['low']:.2f} to {row['high']:.2f})"
                print(f"  {row['rank']}. {TITLES[row['method']]}: S-CIELAB {row['scielab']:.2f}{interval}")
