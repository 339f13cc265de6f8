"""The alphabet of an expression: the minterms of its steps, one symbol each.

Events that pass exactly the same steps are the same symbol to every automaton of the expression. The symbols are found
by trying every combination of event type, scattering type and labels that the expression can tell apart.
"""

from collections.abc import Sequence
from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_CELLS
from queries.lpe.syntax import EVENT_TYPES, SCATTERING_TYPES, PathEvent, Step, Test

_UNNAMED = "\0"  # a label that no expression can name
_MAX_TABLE = 50_000_000  # steps times cells


class Alphabet:
    """Symbols 0 … count - 1. ``passes[i, symbol]`` says whether events of the symbol pass step i."""

    def __init__(self, steps: Sequence[Step]) -> None:
        self.steps = tuple(steps)
        cells = _cells(self.steps)
        if len(self.steps) * len(cells) > _MAX_TABLE:
            raise ExpressionError("the expression tells too many kinds of events apart: use fewer different labels and symbols")
        table = np.zeros((len(self.steps), len(cells)), np.bool_)
        for i, step in enumerate(self.steps):
            table[i] = _passes(step, cells)
        packed = np.packbits(table, axis=0)
        _, chosen = np.unique(packed, axis=1, return_index=True)
        chosen.sort()
        self.passes: npt.NDArray[np.bool_] = table[:, chosen]
        self.examples = [cells[i] for i in chosen]
        self._symbols = {column.tobytes(): symbol for symbol, column in enumerate(np.ascontiguousarray(self.passes.T))}

    def __len__(self) -> int:
        """Number of symbols."""
        return len(self.examples)

    def symbol(self, event: PathEvent) -> int:
        """The symbol of an event."""
        return self._symbols[np.array([step.accepts(event) for step in self.steps], np.bool_).tobytes()]

    @cached_property
    def signatures(self) -> list[str]:
        """For each symbol, a character for each step: 1 where its events pass the step, else 0."""
        return ["".join("01"[int(bit)] for bit in column) for column in self.passes.T]


def _cells(steps: Sequence[Step]) -> list[PathEvent]:
    """One event for each combination that the steps may tell apart."""
    tests: list[Test] = list(dict.fromkeys(test for step in steps for test in step.tests))
    # Letters that are named anywhere stand for themselves, all others for one more.
    types = sorted({name for test in tests if test.field == "type" for name in test.names} & set(EVENT_TYPES)) + [_UNNAMED]
    scatterings = sorted({name for test in tests if test.field == "scattering" for name in test.names} & set(SCATTERING_TYPES)) + [_UNNAMED]
    # Labels that are always named together are one label.
    label_sets = list(dict.fromkeys(test.names for test in tests if test.field == "label"))
    kinds: dict[tuple[bool, ...], str] = {}
    for label in sorted({name for names in label_sets for name in names}):
        kinds.setdefault(tuple(label in names for names in label_sets), label)
    labels = list(kinds.values())
    count = len(types) * len(scatterings) * (2 ** min(len(labels), 63) + (1 if label_sets else 0))
    if count > MAX_CELLS:
        raise ExpressionError(f"{len(labels)} labels that events may carry in any combination make too many kinds of events: use fewer labels")
    carried: list[tuple[str, ...]] = [()] if not label_sets else [(), (_UNNAMED,)]
    for size in range(1, 2 ** len(labels)):
        carried.append(tuple(label for i, label in enumerate(labels) if size >> i & 1))
    return [PathEvent(kind, None if scattering == "x" else scattering, given) for kind, scattering, given in product(types, scatterings, carried)]


def _passes(step: Step, cells: Sequence[PathEvent]) -> npt.NDArray[np.bool_]:
    return np.fromiter((step.accepts(cell) for cell in cells), np.bool_, len(cells))
