"""What the automaton of an expression reads for the events of a run: the symbols of interactions, of the camera and of last events.

Regions that an expression tests are bits of an event: bit k is set where the event passes the k-th of ``Symbols.places``.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.lpe import Expression
from queries.lpe.syntax import PathEvent, in_range
from queries.run import Run
from queries.shards import Piece
from renderer.tables import CONNECTION, EMITTER_HIT, EMITTER_SAMPLE, LENS_SAMPLE, MERGE

I32 = npt.NDArray[np.int32]
Facts = Iterable[tuple[str, str]]
MAX_PLACES = 8  # regions that one expression may test, `region` and `crosses` counted apart
TECHNIQUE_NAMES = {EMITTER_HIT: "hit", EMITTER_SAMPLE: "sample", LENS_SAMPLE: "lens", CONNECTION: "connection", MERGE: "merge"}
_PLACES = ("region", "crosses")
_OTHER = "\0"  # stands for all names that the expression does not ask for
_MOST_VERTICES = 512  # bounds s and t


@dataclass(frozen=True)
class Kind:
    """Events that differ in nothing that the expression asks for, save where they are."""

    type: str
    scattering: str | None
    labels: tuple[str, ...]
    facts: frozenset[tuple[str, str]]


class Symbols:
    """The symbols of a run's events. ``places``: the (field, region) tests; ``camera``: int32 (2^places), the symbol by bits."""

    def __init__(self, run: Run, expression: Expression) -> None:
        tests = {test for step in expression.alphabet.steps for test in step.tests}
        self._asked = {field: {name for test in tests if test.field == field for name in test.names} for field in {test.field for test in tests}}
        self._alphabet = expression.alphabet
        self._rows: dict[Kind, list[int]] = {}
        self._run = run
        self.places = sorted((field, name) for field in _PLACES for name in self._asked.get(field, ()))
        if len(self.places) > MAX_PLACES:
            raise QueryError(f"the expression tests {len(self.places)} regions, at most {MAX_PLACES} can be told apart: split it with `|` or `&`")
        self.objects = [(row["name"], row["material"]) for row in sorted(run.tables["objects"].to_pylist(), key=lambda row: row["object"])]
        self._object_facts = [[("object", name), ("material", material)] for name, material in self.objects]
        self.camera: I32 = np.array(self.row("C", None, (), ()), np.int32)

    def asks(self, field: str) -> bool:
        """Whether the expression tests this field."""
        return field in self._asked

    def row(self, type: str, scattering: str | None, labels: Sequence[str | None], facts: Facts) -> list[int]:
        """The symbols of an event by its bits."""
        kind = self.kind(type, scattering, labels, facts)
        if kind not in self._rows:
            self._rows[kind] = [self._symbol(kind, bits) for bits in range(1 << len(self.places))]
        return self._rows[kind]

    def kind(self, type: str, scattering: str | None, labels: Sequence[str | None], facts: Facts) -> Kind:
        """What the expression can tell of an event."""
        named = self._asked.get("label")
        kept = () if named is None else tuple(label if label in named else _OTHER for label in labels if label)
        return Kind(type, scattering, kept, frozenset((field, name) for field, name in facts if self._matters(field, name)))

    def interactions(self, event: I32, thing: I32) -> I32:
        """Symbols by kind of event, object and bits: int32 (events, objects, 2^places), for the given events at objects (-1 elsewhere)."""
        kinds = {row["key"]: row for row in self._run.tables["events"].to_pylist()}
        keys = 1 + max([*kinds, int(event.max(initial=0))])
        table = np.full((keys, len(self.objects), 1 << len(self.places)), -1, np.int32)
        present = np.zeros(table.shape[:2], np.bool_)
        inside = thing < len(self.objects)
        present[event[inside], thing[inside]] = True
        for key, number in zip(*(found.tolist() for found in np.nonzero(present))):
            kind = kinds.get(key)
            if kind is not None:
                labels = (*self.objects[number], kind["lobe"])
                table[key, number] = self.row(kind["type"], kind["scattering"], labels, self._object_facts[number])
        return table

    def emitter(self, row: dict[str, Any]) -> tuple[str, tuple[str | None, ...], list[tuple[str, str]]]:
        """Type, labels and facts of an emitter's row of the catalogue."""
        owner = row["object"]
        facts = [("light", row["name"])] if row["name"] else []
        labels: tuple[str | None, ...] = (row["name"],)
        if owner is not None:
            labels += self.objects[owner]
            facts += [("light", self.objects[owner][0]), *self._object_facts[owner]]
        return row["symbol"], labels, facts

    def classes(self, field: str, count: int, facts: Callable[[int], Facts]) -> tuple[I32, list[Facts]]:
        """Which of the numbers 0 … count - 1 the expression tells apart by this field: the class of each, and the facts of each class."""
        found: dict[frozenset[object], int] = {}
        members: list[Facts] = []
        classes = np.zeros(count, np.int32)
        for number in range(count):
            given = list(facts(number))
            if field in ("s", "t"):
                passed = frozenset[object](text for text in self._asked[field] if in_range(number, text))
            else:
                passed = frozenset[object](fact for fact in given if self._matters(*fact))
            if passed not in found:
                found[passed] = len(found)
                members.append(given)
            classes[number] = found[passed]
        return classes, members

    def _matters(self, field: str, name: str) -> bool:
        return name in self._asked.get(field, ()) or (field in ("s", "t") and field in self._asked)

    def _symbol(self, kind: Kind, bits: int) -> int:
        there = {place for k, place in enumerate(self.places) if bits >> k & 1}
        return self._alphabet.symbol(PathEvent(kind.type, kind.scattering, kind.labels, kind.facts | there))


class Ends:
    """The last events of paths: an emitter, and what is known of the path as a whole. ``symbols``: int32 (codes, 2^places)."""

    def __init__(self, run: Run, symbols: Symbols) -> None:
        emitters = sorted(run.tables["emitters"].to_pylist(), key=lambda row: row["emitter"])
        codes: dict[Kind, int] = {}
        events = []
        self._emitter: I32 = np.zeros(max(1, len(emitters)), np.int32)
        for number, row in enumerate(emitters):
            type, labels, facts = symbols.emitter(row)
            kind = symbols.kind(type, None, labels, facts)
            if kind not in codes:
                codes[kind] = len(codes)
                events.append((type, labels, facts))
            self._emitter[number] = codes[kind]
        # Classes of whatever else is asked, as further digits of the code.
        self._digits: list[tuple[str, I32, list[Facts]]] = []
        if symbols.asks("technique"):
            self._add(symbols, "technique", len(TECHNIQUE_NAMES), lambda number: [("technique", TECHNIQUE_NAMES[number])])
        for field in ("s", "t"):
            if symbols.asks(field):
                self._add(symbols, field, _MOST_VERTICES, lambda number, field=field: [(field, str(number))])  # type: ignore[misc]
        if symbols.asks("blocker"):
            things = symbols.objects
            self._add(symbols, "blocker", len(things) + 1, lambda number: [("blocker", things[number][0])] if number < len(things) else [])
        combined = [(event, ()) for event in events] if events else [(("L", (), []), ())]
        rows: list[tuple[tuple[str, Any, list[tuple[str, str]]], tuple[tuple[str, str], ...]]] = list(combined)
        for _, _, members in self._digits:
            rows = [(event, (*facts, *more)) for event, facts in rows for more in members]
        found = [symbols.row(event[0], None, event[1], [*event[2], *facts]) for event, facts in rows]
        self.symbols: I32 = np.array(found, np.int32)

    def codes(self, piece: Piece, table: str) -> I32:
        """The code of each row's last event; one alone where all rows have the same."""
        if len(self.symbols) == 1:
            return np.zeros(1, np.int32)
        codes = self._emitter[np.minimum(piece.column(table, "emitter"), len(self._emitter) - 1)]
        for field, classes, members in self._digits:
            number = np.minimum(_number(piece, table, field), len(classes) - 1)
            codes = codes * np.int32(len(members)) + classes[number]
        return codes

    def _add(self, symbols: Symbols, field: str, count: int, facts: Callable[[int], Facts]) -> None:
        self._digits.append((field, *symbols.classes(field, count, facts)))


def _number(piece: Piece, table: str, field: str) -> npt.NDArray[Any]:
    """What a digit of the code is made of: the key of a technique, numbers of vertices (s, t), the blocking object."""
    if field == "blocker":
        return piece.column(table, "blocker") if piece.has(table, "blocker") else np.full(piece.rows(table), 0xFFFF)
    technique = piece.column(table, "technique")
    if field == "technique":
        return technique
    # Vertices sampled from each end, the emitter's and the lens point included (veach1997)
    side, other, alone = ("camera", LENS_SAMPLE, 1) if field == "t" else ("light", EMITTER_HIT, 0)
    depth = piece.column(table, f"{side}_depth").astype(np.int32) if piece.has(table, f"{side}_depth") else np.int32(0)
    number = np.where(technique == other, alone, depth + 1)
    return np.where(technique == EMITTER_SAMPLE, 1, number) if field == "s" else number
