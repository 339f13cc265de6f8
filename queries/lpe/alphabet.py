"""The alphabet of an expression: the minterms of its steps, one symbol each.

Events that pass exactly the same steps are the same symbol to every automaton of the expression. The symbols are found
by trying every combination of event type, scattering type and labels that the expression can tell apart.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_CELLS
from queries.lpe.syntax import EVENT_TYPES, SCATTERING_TYPES, PathEvent, Step, Test

CAMERA = PathEvent("C", None)
_UNNAMED = "\0"  # a letter or label that no expression can name
_TYPES = EVENT_TYPES + _UNNAMED
_SCATTERINGS = SCATTERING_TYPES + _UNNAMED
_MAX_TABLE = 20_000_000  # steps times cells


class Alphabet:
    """Symbols 0 … count - 1.

    ``passes``: bool (steps, symbols), whether events of the symbol pass the step; ``types``: bool (symbols, event types), whether it has such events.
    """

    def __init__(self, steps: Sequence[Step]) -> None:
        self.steps = tuple(steps)
        carried = _label_sets(self.steps)
        shape = (len(_TYPES), len(_SCATTERINGS), len(carried))
        cells = int(np.prod(shape))
        if cells > MAX_CELLS or len(self.steps) * cells > _MAX_TABLE:
            raise ExpressionError("the expression tells too many kinds of events apart: use fewer different labels and symbols")
        table = np.zeros((len(self.steps), cells), np.bool_)
        for i, step in enumerate(self.steps):
            table[i] = _passes(step, carried).ravel()
        _, chosen, symbol_of_cell = np.unique(np.packbits(table, axis=0), axis=1, return_index=True, return_inverse=True)
        self.passes: npt.NDArray[np.bool_] = table[:, chosen]
        self.types: npt.NDArray[np.bool_] = np.zeros((len(chosen), len(_TYPES)), np.bool_)
        self.types[symbol_of_cell.ravel(), np.arange(cells) // (cells // len(_TYPES))] = True
        self._symbols = {column.tobytes(): symbol for symbol, column in enumerate(np.ascontiguousarray(self.passes.T))}

    def __len__(self) -> int:
        """Number of symbols."""
        return int(self.passes.shape[1])

    def symbol(self, event: PathEvent) -> int:
        """The symbol of an event."""
        return self._symbols[np.array([step.accepts(event) for step in self.steps], np.bool_).tobytes()]

    def with_types(self, types: str) -> npt.NDArray[np.int64]:
        """The symbols that some event of one of these types has."""
        return np.flatnonzero(self.types[:, [_TYPES.index(letter) for letter in types]].any(axis=1))

    @cached_property
    def signatures(self) -> list[str]:
        """For each symbol, a character for each step: 1 where its events pass the step, else 0."""
        return ["".join("01"[int(bit)] for bit in column) for column in self.passes.T]


def _label_sets(steps: Sequence[Step]) -> list[tuple[str, ...]]:
    """The sets of labels that the steps may tell apart. Labels that are always named together count as one."""
    named = list(dict.fromkeys(test.names for step in steps for test in step.tests if test.field == "label"))
    if not named:
        return [()]
    kinds: dict[tuple[bool, ...], str] = {}
    for label in sorted({name for names in named for name in names}):
        kinds.setdefault(tuple(label in names for names in named), label)
    labels = list(kinds.values())
    if 2 ** len(labels) > MAX_CELLS:
        raise ExpressionError(f"{len(labels)} labels that events may carry in any combination make too many kinds of events: use fewer labels")
    combinations = (tuple(label for i, label in enumerate(labels) if chosen >> i & 1) for chosen in range(1, 2 ** len(labels)))
    return [(), (_UNNAMED,), *combinations]


def _passes(step: Step, carried: Sequence[tuple[str, ...]]) -> npt.NDArray[np.bool_]:
    """Whether events pass a step: bool (types, scattering types, label sets)."""

    def column(field: str, events: list[PathEvent]) -> npt.NDArray[np.bool_]:
        tests: list[Test] = [test for test in step.tests if test.field == field]
        return np.array([all(test.accepts(event) for test in tests) for event in events])

    types = column("type", [PathEvent(letter, None) for letter in _TYPES])
    scatterings = column("scattering", [PathEvent("", None if letter == "x" else letter) for letter in _SCATTERINGS])
    labels = column("label", [PathEvent("", None, given) for given in carried])
    return types[:, None, None] & scatterings[None, :, None] & labels[None, None, :]
