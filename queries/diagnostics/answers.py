"""What all diagnostics share: which runs can be asked, and tables whose columns say what they mean."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.run import Run

F64 = npt.NDArray[np.float64]
INTEGER, REAL, TEXT = pa.int64(), pa.float64(), pa.string()


@dataclass(frozen=True)
class Figure:
    """One column of an answer: its Arrow type, and its meaning with its unit (kept as the field's metadata ``meaning``)."""

    name: str
    type: pa.DataType
    meaning: str


def answer(figures: Sequence[Figure], values: Mapping[str, Any]) -> pa.Table:
    """The columns ``figures`` with these values (sequences or arrays), by name; numbers that are not finite become NULL."""
    schema = pa.schema([pa.field(figure.name, figure.type, metadata={"meaning": figure.meaning}) for figure in figures])
    return pa.table([_column(values[figure.name], figure.type) for figure in figures], schema=schema)


def meanings(table: pa.Table) -> dict[str, str]:
    """What each column of an answer means."""
    return {field.name: (field.metadata or {}).get(b"meaning", b"").decode() for field in table.schema}


def require_paths(run: Run) -> None:
    """Raise ``QueryError`` where a run recorded no paths, or is open in part."""
    run.require_paths("nothing can be diagnosed")
    run.require_whole()


def pixels_of(run: Run) -> int:
    """Number of pixels of the film."""
    return int(run.settings["width"]) * int(run.settings["height"])


def _column(values: Any, kind: pa.DataType) -> pa.Array:
    if pa.types.is_floating(kind):
        numbers = np.asarray(values, np.float64)
        return pa.array(numbers, kind, mask=~np.isfinite(numbers))
    return pa.array(values, kind)
