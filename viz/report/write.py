"""Write the report of a run: gather what there is, copy it into one folder, fill the page."""

import os
import pathlib
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.errors import QueryError, RunError
from queries.pixel_classes import MOST_CELLS, PixelClasses, cell_size, pixel_classes
from queries.run import Run
from viz.report import sections
from viz.report.model import Model, model_page
from viz.report.numbers import number, percent, seconds, size
from viz.report.picture import Picture, run_views
from viz.report.pixels import class_colors, write_pixels
from viz.report.sections import DrawClass
from viz.report.tables import heading

F32 = npt.NDArray[np.float32]
Answer = tuple[str, pa.Table | str]  # what it shows, and its table or why there is none
MARK = "report.json"  # by which a folder is known for a report, which may be replaced
_LARGEST_FILE = 40_000_000  # bytes, of what is copied: larger files stay in the run folder, and are named
_STATIC = ("report.css", "report.js", "inspector.js")


@dataclass(frozen=True)
class Shown:
    """A picture inside the report: ``file`` and ``links`` (label, file, size) are relative to its folder; ``left``: files that were too large."""

    name: str
    caption: str
    alt: str
    file: str
    width: int
    height: int
    expression: str = ""
    figures: Sequence[tuple[str, str]] = ()
    links: Sequence[tuple[str, str, str]] = ()
    left: Sequence[str] = field(default_factory=tuple)


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
    copier = _Copier(work, run)
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
        "diagnostics": sections.diagnostics(found, charts),
        "charts": charts,
        "settings": sections.settings_rows(run),
        "job": job,
        "command": command or sections.command_of(run),
        "checksums": sections.checksums(run),
        "digest": sections.run_digest(run),
    }
    environment = _environment()
    (work / "index.html").write_text(environment.get_template("report.html.j2").render(page), "utf-8")
    for name in _STATIC:
        shutil.copyfile(_here() / "static" / name, work / name)
    (work / MARK).write_text('{"report": "pathspace"}\n', "ascii")


def _here() -> pathlib.Path:
    return pathlib.Path(__file__).parent


def _environment() -> Any:
    """Templates, in which everything is escaped."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_here() / "templates"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"number": number, "percent": percent, "seconds": seconds, "size": size, "slug": slug, "coded": coded}
    return environment


def coded(text: str) -> Any:
    """Text whose parts in backticks are code; all of it escaped."""
    import markupsafe

    parts = [markupsafe.escape(part) for part in text.split("`")]
    return markupsafe.Markup("").join(markupsafe.Markup("<code>{}</code>").format(part) if i % 2 else part for i, part in enumerate(parts))


# --- pictures ------------------------------------------------------------------------------------------------------


def slug(name: str) -> str:
    """A name as a file name and as an anchor: letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "picture"


class _Copier:
    """Copies pictures into the report under names that are free."""

    def __init__(self, work: pathlib.Path, run: Run) -> None:
        self._work, self._run, self._taken = work, run, set[str]()

    def copy(self, source: pathlib.Path, stem: str, folder: str = "pictures") -> str:
        """Copy a file; where it lies now, relative to the report."""
        name, count = f"{stem}{source.suffix.lower()}", 1
        while name in self._taken:
            count += 1
            name = f"{stem}-{count}{source.suffix.lower()}"
        self._taken.add(name)
        (self._work / folder).mkdir(exist_ok=True)
        try:
            shutil.copyfile(source, self._work / folder / name)
        except OSError as error:
            raise QueryError(f"the picture `{source}` cannot be read ({error.strerror}): draw it again") from None
        return f"{folder}/{name}"

    def picture(self, picture: Picture, kind: str) -> Shown:
        """Copy a picture and the files that belong to it."""
        stem = f"{kind}-{slug(picture.name)}"
        file = self.copy(picture.file, stem)
        small = {key: path for key, path in picture.files.items() if path.stat().st_size <= _LARGEST_FILE}
        stems = {key: f"{stem}-{slug(key)}" if path.suffix == ".png" else stem for key, path in small.items()}
        links = [(key, self.copy(path, stems[key]), size(path.stat().st_size)) for key, path in small.items()]
        left = [f"{path.name} ({size(path.stat().st_size)})" for key, path in picture.files.items() if key not in small]
        figures = [(heading(key), number(value) if isinstance(value, (int, float)) else str(value)) for key, value in picture.figures.items()]
        return Shown(picture.name, picture.caption, picture.alt, file, *_size(self._work / file), figures=figures, links=links, left=left)

    def image(self, name: str, caption: str, alt: str, expression: str) -> Shown | None:
        """Copy one of the run's images; None where it has no picture."""
        source = self._run.path / "images" / f"{name}.png"
        if not source.is_file():
            return None
        file = self.copy(source, slug(name), "images")
        return Shown(name, caption, alt, file, *_size(self._work / file), expression=expression)


def _size(file: pathlib.Path) -> tuple[int, int]:
    """Width and height of a picture, pixels."""
    from PIL import Image

    with Image.open(file) as picture:
        return picture.size


def _images(run: Run, copier: _Copier) -> list[Shown]:
    """The image and the AOVs, in the manifest's order, each with what it shows."""
    found: list[Shown | None] = []
    dialect = str((run.manifest.get("job") or {}).get("dialect") or "std")
    name = run.manifest.get("name", run.path.name)
    for key, known in (run.manifest.get("images") or {}).items():
        expression = known.get("expression")
        if key == "beauty":
            alt = f"The rendered image of {name}, {run.settings['width']} by {run.settings['height']} pixels: all light."
            found.insert(0, copier.image(key, "All light.", alt, ""))
        elif expression:
            words = _described(run, expression, dialect)
            found.append(copier.image(key, words, f"The image of the light that the expression {expression} selects: {words}", expression))
    return [image for image in found if image is not None]


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


def _write_models(work: pathlib.Path, run: Run, models: Sequence[Model], copier: _Copier) -> list[tuple[Model, str, Shown | None]]:
    """Write a page for each model: the model, its page, and the picture that stands for it."""
    written = []
    environment = _environment()
    for model in models:
        page = f"view3d-{slug(model.name)}.html" if len(models) > 1 else "view3d.html"
        frame = environment.get_template("view3d.html.j2").render(model=model, script=(_here() / "static" / "view3d.js").read_text("utf-8"))
        title = str(environment.from_string("{{ title }}").render(title=f"{model.name}, in three dimensions"))
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
