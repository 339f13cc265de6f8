"""Answers as tables of a page: what stands in each cell, how it is aligned, what it is sorted by."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from queries.diagnostics.answers import meanings
from queries.errors import QueryError
from queries.lpe.descriptors import descriptor
from viz.report.numbers import UNKNOWN, number, percent, with_error

_SHARES = ("share", "variance_share", "walk_share", "ring_share", "cumulative", "relative_error")
_VERDICTS = ("verdict", "ring_verdict")
_HIDDEN = ("units", "unit", "pixel_y", "expression", "trusted")  # said by another column, or the same in every row
_ERRORS = {"energy": "standard_error", "mean": "standard_error"}  # of columns whose error is not called after them


@dataclass(frozen=True)
class Column:
    """A column: its heading, what it means, and its kind, which decides how cells look: text, words, class, number, share or verdict."""

    name: str
    heading: str
    meaning: str
    kind: str


@dataclass(frozen=True)
class Cell:
    """What a cell shows, and what it is sorted by (None: comes last).

    ``bar``: percent of a bar behind it; ``pixel``: where the image shows it; ``color``: of a swatch before it; ``code``: an expression below it.
    """

    text: str
    key: float | str | None
    bar: float | None = None
    pixel: tuple[int, int] | None = None
    color: str | None = None
    code: str = ""


@dataclass(frozen=True)
class Table:
    """A table of a page. ``caption``: what it lists; ``note``: what is left out; ``cut``: rows that are shown at first (0: all)."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    cut: int = 0


def answer_table(caption: str, answer: pa.Table, most: int = 200, cut: int = 0, explained: Mapping[str, str] | None = None) -> Table:
    """An answer of ``queries``: its first rows and its columns, with errors beside their values and expressions below their words.

    ``explained``: meanings of columns that carry none.
    """
    known = meanings(answer) | dict(explained or {})
    columns = [Column(name, _heading(name, answer), _meaning(name, answer, known), _kind(name, answer)) for name in _shown(answer)]
    rows = [[_cell(column, row) for column in columns] for row in answer.slice(0, most).to_pylist()]
    note = f"The first {most:,} of {answer.num_rows:,} rows." if answer.num_rows > most else ""
    return Table(caption, columns, rows, note, cut if len(rows) > cut else 0)


def short_words(description: str, expression: str) -> str:
    """A description, or what such a class is called and how long it is, where that spells it event by event, as the expression does already.

    >>> short_words("the camera, then diffuse reflection, then diffuse reflection, then a light", "C <RD> <RD> L")
    'diffuse indirect, 2 bounces'
    """
    letters = [token.split("@")[0].strip("<>") for token in re.sub(r"'[^']*'", "_", expression).split()]
    if not description.startswith("the camera, then") or len(letters) < 3:
        return description
    try:
        return f"{descriptor(letters)}, {len(letters) - 2} bounces"
    except QueryError:
        return description


def heading(name: str) -> str:
    """A column's name as words."""
    return name.replace("_", " ")


def _shown(answer: pa.Table) -> list[str]:
    """The columns that are shown, in order: the class stands as far to the left as it can, as it says what a row is about."""
    names = answer.schema.names
    beside = {f"{name}_error" for name in names} | {error for name, error in _ERRORS.items() if name in names}
    shown = [name for name in names if name not in beside and (name not in _HIDDEN or (name == "expression" and "description" not in names))]
    shown = [name for name in shown if name not in _VERDICTS or answer[name].null_count < answer.num_rows]
    if "description" in shown:
        shown.remove("description")
        shown.insert(1 if shown[:1] in (["rank"], ["pixel_x"]) else 0, "description")
    return shown


def _error_of(name: str) -> str:
    return _ERRORS.get(name, f"{name}_error")


def _heading(name: str, answer: pa.Table) -> str:
    if name == "pixel_x":
        return "pixel"
    if name == "description" and "expression" in answer.schema.names:
        return "class and its expression"
    return heading(name) + (" ± standard error" if _error_of(name) in answer.schema.names else "")


def _meaning(name: str, answer: pa.Table, known: Mapping[str, str]) -> str:
    if name == "pixel_x":
        return "column and row of the outlier pixel, from the upper left"
    text = known.get(name, "")
    if name == "description" and "expression" in answer.schema.names:
        text += ", and the expression that selects such paths"
    return text + (", and its standard error" if _error_of(name) in answer.schema.names else "")


def _kind(name: str, answer: pa.Table) -> str:
    """How cells of a column look."""
    if name == "description":
        return "class"
    if name in _VERDICTS:
        return "verdict"
    if name in _SHARES:
        return "share"
    if name == "pixel_x":
        return "text"
    stored = answer.schema.field(name).type
    return "number" if pa.types.is_integer(stored) or pa.types.is_floating(stored) else "words"


def _cell(column: Column, row: Mapping[str, Any]) -> Cell:
    value, error = row[column.name], row.get(_error_of(column.name))
    if column.name == "pixel_x":
        return Cell(f"{value}, {row['pixel_y']}", float(value), pixel=(value, row["pixel_y"]))
    if column.kind == "class":
        words = short_words(str(value), row.get("expression") or "")
        return Cell(words, words, code=row.get("expression") or "")
    if column.kind == "share":
        text = f"{with_error(100 * value, 100 * error)} %" if error and value is not None else percent(value)
        return Cell(text, value, None if value is None else min(100.0, max(0.0, round(100 * value, 2))))
    if isinstance(value, (int, float)):
        return Cell(with_error(value, error) if error is not None else number(value), float(value))
    unknown = "" if column.kind == "verdict" else UNKNOWN
    return Cell(unknown if value is None else str(value), value)
