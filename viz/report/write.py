"""Write the report of a run: gather what there is, copy it into one folder, fill the page."""

import os
import pathlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.errors import QueryError, RunError
from queries.pixel_classes import MOST_CELLS, PixelClasses, cell_size, pixel_classes
from queries.run import Run
from viz.report import sections
from viz.report.model import Model, model_page
from viz.report.pages import HERE, Copier, Shown, copy_static, environment, picture_size, slug
from viz.report.picture import Picture, run_views
from viz.report.pixels import class_colors, write_pixels
from viz.report.sections import DrawClass
from viz.report.subpixel import subpixel_section

F32 = npt.NDArray[np.float32]
Answer = tuple[str, pa.Table | str]  # what it shows, and its table or why there is none
MARK = "report.json"  # by which a folder is known for a report, which may be replaced
_STATIC = ("report.css", "report.js", "inspector.js")


def write_report(
    run: Run,
    folder: pathlib.Path,
    *,
    pictures: Sequence[Picture] = (),
    models: Sequence[Model] = (),
    answers: Mapping[str, Answer] | None = None,
    command: str = "",
    draw: DrawClass | None = None,
    top: int = 5,
    threads: int | None = None,
) -> pathlib.Path:
    """Write the report of a run as a folder; the path of its page, ``index.html``, which opens from disk without a network.

    ``pictures``: further pictures beside the run's own views; ``models``: scenes that can be turned; ``answers``: further diagnostics by name;
    ``command``: what makes the run again (default: as far as the run knows); ``draw``: draws a class of a ranking, given a name for it and
    the expression that selects its paths, for the first ``top`` of each ranking. A report that lies in ``folder`` is replaced. The same run gives
    the same bytes. Raises ``QueryError`` where the folder holds something else, or a model is too large; ``RunError`` where the run's image, or one
    of its rankings, cannot be read.
    """
    _refuse_foreign(folder)
    work = folder.with_name(f".{folder.name}.tmp")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    try:
        _fill(work, run, [*run_views(run), *pictures], models, answers or {}, command, draw, top, threads)
        shutil.rmtree(folder, ignore_errors=True)
        os.replace(work, folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return folder / "index.html"


def _refuse_foreign(folder: pathlib.Path) -> None:
    if folder.exists() and not (folder / MARK).is_file() and (not folder.is_dir() or any(folder.iterdir())):
        raise QueryError(f"expected no folder at `{folder}`, or an older report to replace, found something else: name another folder")


def _fill(
    work: pathlib.Path,
    run: Run,
    pictures: Sequence[Picture],
    models: Sequence[Model],
    further: Mapping[str, Answer],
    command: str,
    draw: DrawClass | None,
    top: int,
    threads: int | None,
) -> None:
    """Write everything into an empty folder."""
    copier = Copier(work)
    images = _images(run, copier)
    found = {**sections.answers(run), **further}
    pixels, colors = _write_inspector(work, run, images, threads)
    by_expression = {named.expression: color for named, color in zip(pixels.named, colors)} if pixels else {}
    classes = found["classes"][1]
    charts = _charts(work, run, found)
    job = sections.job_yaml(run)
    if job:
        (work / "job.yaml").write_text(job, "utf-8")
    page = {
        "name": run.manifest.get("name", run.path.name),
        "run": run,
        "stats": run.manifest.get("stats") or {},
        "glance": sections.glance(run, found),
        "beauty": images[0] if images else None,
        "aovs": images[1:],
        "pixels": pixels,
        "block": cell_size(run.settings["width"], run.settings["height"], MOST_CELLS),
        "views": [copier.picture(picture, "view") for picture in pictures],
        "models": _write_models(work, run, models, copier),
        "classes": sections.class_table(classes, by_expression) if isinstance(classes, pa.Table) else None,
        "classes_refused": classes if isinstance(classes, str) else "",
        "rankings": [
            (replace(ranking, pictures=()), [(rank, copier.picture(picture, "class")) for rank, picture in ranking.pictures])
            for ranking in sections.rankings(run, draw, top)
        ],
        "subpixel": subpixel_section(run, work),
        "diagnostics": sections.diagnostics(found, charts),
        "charts": charts,
        "settings": sections.settings_rows(run),
        "job": job,
        "command": command or sections.command_of(run),
        "checksums": sections.checksums(run),
        "digest": sections.run_digest(run),
    }
    (work / "index.html").write_text(environment().get_template("report.html.j2").render(page), "utf-8")
    copy_static(work, _STATIC)
    (work / MARK).write_text('{"report": "pathspace"}\n', "ascii")


# --- pictures ------------------------------------------------------------------------------------------------------


def _images(run: Run, copier: Copier) -> list[Shown]:
    """The image and the AOVs, in the manifest's order, each with what it shows."""
    found: list[Shown | None] = []
    dialect = str((run.manifest.get("job") or {}).get("dialect") or "std")
    name = run.manifest.get("name", run.path.name)
    for key, known in (run.manifest.get("images") or {}).items():
        expression = known.get("expression")
        if key == "beauty":
            alt = f"The rendered image of {name}, {run.settings['width']} by {run.settings['height']} pixels: all light."
            found.insert(0, _image(run, copier, key, "All light.", alt, ""))
        elif expression:
            words = _described(run, expression, dialect)
            alt = f"The image of the light that the expression {expression} selects: {words}"
            found.append(_image(run, copier, key, words, alt, expression))
    return [image for image in found if image is not None]


def _image(run: Run, copier: Copier, name: str, caption: str, alt: str, expression: str) -> Shown | None:
    """Copy one of the run's images; None where it has no picture."""
    source = run.path / "images" / f"{name}.png"
    if not source.is_file():
        return None
    return Shown(name, caption, alt, copier.copy(source, slug(name), "images"), *picture_size(source), expression=expression)


def _described(run: Run, expression: str, dialect: str) -> str:
    """An expression in words; empty where it cannot be read any more."""
    try:
        words = run.compile(expression, dialect).describe()
    except ValueError:
        return ""
    return words[:1].upper() + words[1:]


def _read_image(run: Run) -> F32:
    """The image, linear, float32 (height, width, 3): the run's file, or black where there is none."""
    import OpenImageIO as oiio

    file = run.path / "images" / "beauty.exr"
    source = oiio.ImageInput.open(str(file)) if file.is_file() else None
    if source is None:
        raise RunError(f"`{file}`, the run's image, cannot be read: run the job again with --resume")
    image = np.asarray(source.read_image(oiio.FLOAT), np.float32)[..., :3]
    source.close()
    return image


def _write_inspector(work: pathlib.Path, run: Run, images: Sequence[Shown], threads: int | None) -> tuple[PixelClasses | None, list[str]]:
    """Write what the inspector knows; the classes of pixels, None where the run has no paths, and their colors."""
    block = cell_size(run.settings["width"], run.settings["height"], MOST_CELLS)
    found = pixel_classes(run, threads=threads) if run.settings["keep"] > 0 and "paths" in run.tables else None
    colors = class_colors(len(found.named)) if found else []
    shown = [{"label": image.name, "file": image.file} for image in images]
    write_pixels(work / "data" / "pixels.js", _read_image(run), block, found, colors, shown)
    return found, colors


def _write_models(work: pathlib.Path, run: Run, models: Sequence[Model], copier: Copier) -> list[tuple[Model, str, Shown | None]]:
    """Write a page for each model: the model, its page, and the picture that stands for it."""
    written = []
    templates = environment()
    for model in models:
        page = f"view3d-{slug(model.name)}.html" if len(models) > 1 else "view3d.html"
        frame = templates.get_template("view3d.html.j2").render(model=model, script=(HERE / "static" / "view3d.js").read_text("utf-8"))
        title = str(templates.from_string("{{ title }}").render(title=f"{model.name}, in three dimensions"))
        (work / page).write_text(model_page(model, title, frame), "utf-8")
        still = copier.picture(Picture(model.name, model.caption, model.alt, model.picture), "model") if model.picture else None
        written.append((model, page, still))
    return written


# --- charts --------------------------------------------------------------------------------------------------------


def _charts(work: pathlib.Path, run: Run, found: Mapping[str, Answer]) -> dict[str, str]:
    """Charts of what the run knows of its speed and its accuracy: their files by name."""
    from viz.charts import ConvergenceCurve, convergence_chart, seconds_chart

    charts: dict[str, str] = {}
    stages = {name: float(value) for name, value in ((run.manifest.get("stats") or {}).get("stages") or {}).items() if value > 0}
    if stages:
        charts["stages"] = "charts/stages.png"
        seconds_chart(work / charts["stages"], stages, "Where the time went")
    answer = found["convergence"][1]
    if isinstance(answer, pa.Table):
        rows = [row for row in answer.to_pylist() if row["relative_error"] is not None and row["relative_error"] > 0]
        if len(rows) > 1:
            charts["convergence"] = "charts/convergence.png"
            curve = ConvergenceCurve([row["passes"] for row in rows], [row["relative_error"] for row in rows], rows[-1]["slope"])
            convergence_chart(work / charts["convergence"], curve, "Error of the image's mean luminance")
    return charts
