"""Subpixel filters in the report of a run: the analysis that lies in the run folder, told shortly, and its whole page beside the report."""

import json
import pathlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from queries.diagnostics.answers import meanings
from queries.errors import QueryError, RunError
from queries.run import Run
from queries.subpixel.targets import TITLES as IMAGE_TITLES
from renderer.filters.subpixel.methods import TITLES
from viz.report.numbers import UNKNOWN, number, percent
from viz.report.pages import Shown, picture_size
from viz.report.tables import Cell, Column, Table, heading

FOLDER = "subpixel"  # of the run folder and of its report
RESULT = "subpixel.json"  # which the analysis writes last
CONTENTS = "page.json"  # which the page writes: what it consists of
LAYOUT_TITLES = {"rgb_stripe": "RGB stripe", "bgr_stripe": "BGR stripe", "rgbg": "PenTile RGBG", "rgbw": "2-D RGBW"}

# Columns that are shown with the ends of their interval: those, and the heading
_INTERVALS = {
    "scielab": ("low", "high", "S-CIELAB (95 % interval)"),
    "difference": ("difference_low", "difference_high", "difference (95 % interval)"),
}
_HEADINGS = {
    "scielab": "S-CIELAB",
    "scielab_95": "95th percentile",
    "scielab_unclipped": "S-CIELAB unclipped",
    "lightness": "of lightness",
    "chroma": "of chroma",
    "clipped": "clipped",
}
_SHARES = ("clipped",)  # with a bar
_DIFFERENCES = ("scielab", "scielab_95", "scielab_unclipped", "lightness", "chroma")  # of colors
_PERCENT = ("wins", "stability")


@dataclass(frozen=True)
class SubpixelSection:
    """What the report says: ``page``: the whole page, relative to the report; ``figures``: its figures, as thumbnails that lead there."""

    summary: str
    page: str
    tables: Sequence[Table]
    figures: Sequence[tuple[str, Shown]]


def layout_title(name: str) -> str:
    """What a layout is called for people: the shipped ones have titles, others their names.

    >>> layout_title("rgb_stripe"), layout_title("my_display")
    ('RGB stripe', 'my_display')
    """
    return LAYOUT_TITLES.get(name, name)


def method_title(name: str) -> str:
    """What a method is called for people.

    >>> method_title("box")
    'Box per subpixel'
    """
    title = TITLES.get(name, name)
    return title[:1].upper() + title[1:]


def image_title(name: str) -> str:
    """What an image is called for people: the project's own test images have titles, others their names.

    >>> image_title("wire_frame"), image_title("my_run")
    ('Wire frame', 'my_run')
    """
    return IMAGE_TITLES.get(name, name)


# --- tables of answers ---------------------------------------------------------------------------------------------


def scores_table(scores: pa.Table, cut: int) -> Table:
    """All scores; ``cut``: rows that are shown at first."""
    return _table("All scores", scores, cut)


def ranking_tables(methods: Mapping[str, pa.Table]) -> list[Table]:
    """The ranking of methods of each layout."""
    return [_table(f"Methods on {layout_title(name)}{_over(ranked)}, the best first", ranked) for name, ranked in methods.items()]


def layouts_table(layouts: pa.Table) -> Table:
    """The ranking of layouts."""
    return _table(f"Displays{_over(layouts)}, the best first", layouts)


def _over(ranked: pa.Table) -> str:
    """On how many images a ranking rests, which is the same in all of its rows."""
    counts = pc.unique(ranked["images"]).to_pylist()
    return f", judged on {counts[0]} images" if len(counts) == 1 and counts[0] > 1 else ""


def _table(caption: str, answer: pa.Table, cut: int = 0) -> Table:
    """Values whose intervals are there are shown with them; columns that are not known here, as they are."""
    known, names = meanings(answer), set(answer.schema.names)
    ends = {name: (low, high) for name, (low, high, _) in _INTERVALS.items() if {name, low, high} <= names}
    hidden = {end for pair in ends.values() for end in pair} | {"images"}
    columns = [_column(field, ends, known) for field in answer.schema if field.name not in hidden]
    rows = [[_cell(column, row, ends.get(column.name)) for column in columns] for row in answer.to_pylist()]
    return Table(caption, columns, rows, cut=cut if len(rows) > cut else 0)


def _column(field: pa.Field, ends: Mapping[str, tuple[str, str]], known: Mapping[str, str]) -> Column:
    title = _INTERVALS[field.name][2] if field.name in ends else _HEADINGS.get(field.name, heading(field.name))
    meaning = known.get(field.name, "")
    if field.name in ends:
        meaning = f"{meaning}; in parentheses, its 95 % interval" if meaning else "a value and its 95 % interval"
    return Column(field.name, title, meaning, _kind(field))


def _kind(field: pa.Field) -> str:
    if field.name in ("method", "layout"):
        return "class"
    if field.name in _SHARES:
        return "share"
    return "number" if pa.types.is_integer(field.type) or pa.types.is_floating(field.type) else "words"


def _cell(column: Column, row: Mapping[str, Any], ends: tuple[str, str] | None) -> Cell:
    value = row[column.name]
    if value is None:
        return Cell(UNKNOWN, None)
    if column.name == "method":
        return Cell(method_title(value), method_title(value))
    if column.name in ("layout", "image"):
        title = layout_title(value) if column.name == "layout" else image_title(value)
        return Cell(title, title)
    if column.name == "difference" and row.get("verdict") == "reference":
        return Cell(UNKNOWN, 0.0)
    if ends is not None:
        return Cell(interval(value, row[ends[0]], row[ends[1]]), float(value))
    if column.kind == "share":
        return Cell(percent(value), value, min(100.0, max(0.0, round(100 * value, 2))))
    if isinstance(value, str):
        return Cell(value, value)
    if column.name in _DIFFERENCES:
        return Cell(_three(value, value), value)
    return Cell(percent(value, 2) if column.name in _PERCENT else number(value), float(value))


def interval(value: float, low: float | None, high: float | None) -> str:
    """A value and the ends of its interval, where that is known.

    >>> interval(1.23456, 1.1, 1.38), interval(-0.0512, None, None)
    ('1.23 (1.10 … 1.38)', '−0.0512')
    """
    if low is None or high is None:
        return _three(value, value)
    largest = max(abs(value), abs(low), abs(high))
    return f"{_three(value, largest)} ({_three(low, largest)} … {_three(high, largest)})"


def _three(value: float, largest: float) -> str:
    """A number to hundredths, or with three digits where the largest beside it is smaller than a tenth."""
    return f"{value:.2f}".replace("-", "−") if abs(largest) >= 0.1 or value == 0 else number(value, 3)


# --- the section ---------------------------------------------------------------------------------------------------


def subpixel_section(run: Run, work: pathlib.Path) -> SubpixelSection | None:
    """Copy a finished analysis's page into the report's folder, and what the report says of it; None where the run folder holds none.

    Raises RunError where it cannot be read.
    """
    source = run.path / FOLDER
    if not (source / RESULT).is_file():
        return None
    result = _json(source / RESULT)
    page = source / str(result.get("page") or "index.html")
    contents = _json(source / CONTENTS) if page.is_file() else {}
    for file in contents.get("files", ()):
        _copy(source, work / FOLDER, str(file))
    figures = [_thumbnail(work, figure) for figure in contents.get("figures", ())]
    where = f"{FOLDER}/{page.name}" if contents else ""
    return SubpixelSection(str(result.get("summary") or ""), where, ranking_tables(_rankings(source / "methods.arrow")), figures)


def _copy(source: pathlib.Path, target: pathlib.Path, file: str) -> None:
    if not (source / file).resolve().is_relative_to(source.resolve()) or not (target / file).resolve().is_relative_to(target.resolve()):
        raise _unreadable(source / CONTENTS, f"it names `{file}`, which lies elsewhere")
    (target / file).parent.mkdir(parents=True, exist_ok=True)
    try:
        shutil.copyfile(source / file, target / file)
    except OSError as error:
        raise _unreadable(source / file, error.strerror or "") from None


def _thumbnail(work: pathlib.Path, figure: Mapping[str, str]) -> tuple[str, Shown]:
    """A figure of the page, and its anchor there."""
    file = f"{FOLDER}/{figure['file']}"
    return figure["anchor"], Shown(figure["title"], "", figure["alt"], file, *picture_size(work / file))


def _rankings(file: pathlib.Path) -> dict[str, pa.Table]:
    """The rankings of methods by layout; none where methods were not compared."""
    if not file.is_file():
        return {}
    try:
        with pa.OSFile(str(file)) as source:
            whole = (pa.ipc.open_file if source.read(6) == b"ARROW1" else pa.ipc.open_stream)(pa.BufferReader(file.read_bytes())).read_all()
        return {name: whole.filter(pc.equal(whole["layout"], name)).drop_columns("layout") for name in pc.unique(whole["layout"]).to_pylist()}
    except (pa.ArrowException, OSError, KeyError) as error:
        raise _unreadable(file, str(error)) from None


def _json(file: pathlib.Path) -> dict[str, Any]:
    try:
        known = json.loads(file.read_bytes())
    except (OSError, ValueError) as error:
        raise _unreadable(file, str(error)) from None
    if not isinstance(known, dict):
        raise _unreadable(file, "expected an object")
    return known


def _unreadable(file: pathlib.Path, why: str) -> QueryError:
    first = (why.splitlines() or [""])[0]
    return RunError(f"`{file}` cannot be read ({first}): run `pathspace subpixel` on the run again")
