"""The alphabet of an expression: the minterms of its steps, one symbol each.

Events that pass exactly the same steps are the same symbol to every automaton of the expression. The symbols are found by refining
the set of all events field by field: fields are taken as independent, so some symbols may have no event at all.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.lpe.minterms import TYPES, Bits, check_size, columns, distinct
from queries.lpe.syntax import FIELDS, NAMED_FIELDS, PathEvent, Step, Test

CAMERA = PathEvent("C", None, (), frozenset())


class Alphabet:
    """Symbols 0 … count - 1.

    ``passes``: bool (steps, symbols), whether events of the symbol pass the step; ``types``: bool (symbols, event types), whether it has such events.
    ``events``: further events that must have symbols, such as one with two objects, which no run has.
    """

    def __init__(self, steps: Sequence[Step], events: Sequence[PathEvent] = ()) -> None:
        self.steps = tuple(steps)
        used = {test.field for step in self.steps for test in step.tests}
        passes, types = columns(self.steps, "type"), np.eye(len(TYPES), dtype=np.bool_)
        passes, types = _merged(passes, types)
        for field in (field for field in FIELDS if field in used and field != "type"):
            values = columns(self.steps, field)
            cells = passes.shape[1] * values.shape[1]
            check_size(len(self.steps), cells)
            passes = (passes[:, :, None] & values[:, None, :]).reshape(len(self.steps), cells)
            passes, types = _merged(passes, np.repeat(types, values.shape[1], axis=0))
        if events:
            further = [TYPES.index(event.type if event.type in TYPES else TYPES[-1]) for event in events]
            passes, types = _merged(np.hstack([passes, self._passed(events)]), np.vstack([types, np.eye(len(TYPES), dtype=np.bool_)[further]]))
        self.passes: Bits = passes
        self.types: Bits = types
        self._symbols = {column: symbol for symbol, column in enumerate(_keys(self.passes))}

    def __len__(self) -> int:
        """Number of symbols."""
        return int(self.passes.shape[1])

    def symbol(self, event: PathEvent) -> int:
        """The symbol of an event. Raises ``QueryError`` for one that has two objects, materials … that the expression tells apart."""
        return int(self.symbols_of([event])[0])

    def symbols_of(self, events: Sequence[PathEvent]) -> npt.NDArray[np.int32]:
        """The symbol of each event: int32 (events). See ``symbol``."""
        passed = self._passed(events)
        first, kind = distinct(passed)
        keys = _keys(passed[:, first])
        try:
            found = np.array([self._symbols[key] for key in keys], np.int32)
        except KeyError:
            odd = next(i for i, key in zip(first, keys) if key not in self._symbols)
            raise QueryError(f"expected events of one object, material, blocker and technique each, found {events[odd]}") from None
        return found[kind] if len(events) else np.zeros(0, np.int32)

    def _passed(self, events: Sequence[PathEvent]) -> Bits:
        """Whether events pass the steps: bool (steps, events)."""
        answers: dict[Test, Bits] = {}
        passed = np.ones((len(self.steps), len(events)), np.bool_)
        for row, step in zip(passed, self.steps):
            for test in step.tests:
                if test not in answers:
                    answers[test] = _answers(test, events)
                row &= answers[test]
        return passed

    def with_types(self, types: str) -> npt.NDArray[np.int64]:
        """The symbols that some event of one of these types has."""
        return np.flatnonzero(self.types[:, [TYPES.index(letter) for letter in types]].any(axis=1))

    @cached_property
    def signatures(self) -> list[str]:
        """For each symbol, a character for each step: 1 where its events pass the step, else 0."""
        return ["".join("01"[int(bit)] for bit in column) for column in self.passes.T]


def _merged(passes: Bits, types: Bits) -> tuple[Bits, Bits]:
    """Equal columns made one, which has the types of all."""
    first, kind = distinct(passes)
    merged = np.zeros((len(first), types.shape[1]), np.bool_)
    cells, letters = np.nonzero(types)
    merged[kind[cells], letters] = True
    return passes[:, first], merged


def _keys(table: Bits) -> list[bytes]:
    """A key for each column."""
    return [column.tobytes() for column in np.packbits(table, axis=0).T]


def _answers(test: Test, events: Sequence[PathEvent]) -> Bits:
    """Whether each event passes a test: bool (events)."""
    if test.field in NAMED_FIELDS and all(event.facts is not None for event in events):
        wanted = {(test.field, name) for name in test.names}
        carried = np.fromiter((not wanted.isdisjoint(event.facts or ()) for event in events), np.bool_, len(events))
        return carried if test.mode == "in" else ~carried
    return np.fromiter((test.accepts(event) for event in events), np.bool_, len(events))
