"""The syntax tree of light path expressions: what every notation is parsed to and printed from.

A leaf is a ``Step``: a set of tests that one event of a path must pass. Trees are immutable, compare by value, and are
kept in one normal form by ``sequence`` and ``choice`` (no sequence inside a sequence, no choice inside a choice,
alternatives that test the same field merged into one step).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

EVENT_TYPES = "CRTVLOB"  # camera, reflect, transmit, volume, light, emissive object, background
SCATTERING_TYPES = "DGSsx"  # diffuse, glossy, singular, straight, none
EMITTER_TYPES = frozenset("LOB")


BARE_FIELDS = ("type", "scattering", "label")
NAMED_FIELDS = ("object", "material", "light", "medium", "blocker", "technique", "region", "crosses")
NUMBERED_FIELDS = ("depth", "s", "t")
PREFIXES = ("unoccluded", "noclamp", "nothruput", "shadows")


class PathEvent(NamedTuple):
    """One event of a path: its type, its scattering type (None where light does not scatter), its labels, and what else is known of it.

    ``facts``: pairs (field, name), such as ("object", "floor") or ("region", "spot"). None: nothing but the labels is known, and a
    label stands for an object, a material, a light, a medium or a region of its name. The depth of an event is its place in the path.
    """

    type: str
    scattering: str | None
    labels: tuple[str, ...] = ()
    facts: frozenset[tuple[str, str]] | None = None


@dataclass(frozen=True)
class Test:
    """A test of one field of an event.

    ``field``: ``type``, ``scattering``, ``label``, one of ``NAMED_FIELDS`` (what stands after ``@``) or of ``NUMBERED_FIELDS``.
    ``mode``: ``in``, the field is one of the names (a label: the event carries one of them); ``other``, it is none of them
    (a label: the event carries some label, and none of these); ``without``, the event carries none of these (labels and ``@`` fields).
    ``position``: of a label in the event's list, from 0, as OSL counts them (``in``: the label there is one of the names; ``other``: a
    label is there, and it is none of them); None: anywhere in the list.
    Names of numbered fields are ranges: ``2``, ``2..4``, ``2..``, ``..4``. ``depth`` counts events from the camera's 0; ``s`` and ``t`` are
    the numbers of vertices that were sampled from the light and from the camera (veach1997), known of the path's last event.
    """

    __test__ = False  # tells pytest that this is no test case

    field: str
    names: frozenset[str]
    mode: str = "in"
    position: int | None = None

    def accepts(self, event: PathEvent) -> bool:
        """Whether the event passes. Numbered fields are read from ``facts``."""
        if self.field == "type":
            return (event.type in self.names) == (self.mode == "in")
        if self.field == "scattering":
            return ((event.scattering or "x") in self.names) == (self.mode == "in")
        if self.field in NAMED_FIELDS:
            return any(_carries(event, self.field, name) for name in self.names) == (self.mode == "in")
        if self.field in NUMBERED_FIELDS:
            numbers = [int(value) for field, value in event.facts or () if field == self.field]
            return any(in_range(number, text) for number in numbers for text in self.names) == (self.mode == "in")
        if self.position is not None:
            there = event.labels[self.position : self.position + 1]
            return bool(there) and (there[0] in self.names) == (self.mode == "in")
        if self.mode == "in":
            return not self.names.isdisjoint(event.labels)
        return self.names.isdisjoint(event.labels) and (self.mode == "without" or len(event.labels) > 0)

    def order(self) -> tuple[int, int, str, tuple[str, ...]]:
        """A sorting key: fields in the order that groups spell them."""
        return FIELDS.index(self.field), -1 if self.position is None else self.position, self.mode, tuple(sorted(self.names))


FIELDS = (*BARE_FIELDS, *NAMED_FIELDS, *NUMBERED_FIELDS)


def _carries(event: PathEvent, field: str, name: str) -> bool:
    """Whether a named field of the event has this value."""
    return name in event.labels if event.facts is None else (field, name) in event.facts


def in_range(number: int, text: str) -> bool:
    """Whether a number lies in a range as expressions write it.

    >>> [in_range(3, text) for text in ("3", "1..2", "2..", "..3")]
    [True, False, True, True]
    """
    low, dots, high = text.partition("..")
    return number == int(low) if not dots else (not low or number >= int(low)) and (not high or number <= int(high))


@dataclass(frozen=True)
class Step:
    """One event of a path that passes every test; no test at all is ``.``, any event."""

    tests: tuple[Test, ...] = ()

    def accepts(self, event: PathEvent) -> bool:
        """Whether the event passes every test."""
        return all(test.accepts(event) for test in self.tests)


@dataclass(frozen=True)
class Chain:
    """Parts one after another."""

    parts: tuple["Node", ...]


@dataclass(frozen=True)
class Choice:
    """Any one of the alternatives."""

    parts: tuple["Node", ...]


@dataclass(frozen=True)
class Repeat:
    """A part repeated ``low`` to ``high`` times; ``high`` None is unbounded."""

    part: "Node"
    low: int
    high: int | None


@dataclass(frozen=True)
class Combination:
    """A Boolean combination of whole expressions, taken from left to right: ``&`` and, ``-`` and not, ``^`` either but not both."""

    first: "Node"
    rest: tuple[tuple[str, "Node"], ...]


Node: TypeAlias = Step | Chain | Choice | Repeat | Combination


def step(*tests: Test | None) -> Step:
    """A step of the tests that are not None, in normal order and without duplicates."""
    return Step(tuple(sorted({test for test in tests if test is not None}, key=Test.order)))


def sequence(parts: Sequence[Node]) -> Node:
    """The parts one after another, in normal form. ``parts`` is not empty."""
    flat: list[Node] = []
    for part in parts:
        flat.extend(part.parts if isinstance(part, Chain) else (part,))
    return flat[0] if len(flat) == 1 else Chain(tuple(flat))


def choice(parts: Iterable[Node]) -> Node:
    """Any one of the parts, in normal form. ``parts`` is not empty."""
    merged: dict[Node | tuple[str, int | None], Node] = {}
    for part in _alternatives(parts):
        # Alternatives such as D|G, that only list the values of one field, become one step [DG]; fields after `@` have no such form.
        if isinstance(part, Step) and len(part.tests) == 1 and part.tests[0].mode == "in" and part.tests[0].field in BARE_FIELDS:
            test = part.tests[0]
            place = (test.field, test.position)
            known = merged.get(place)
            names = known.tests[0].names | test.names if isinstance(known, Step) else test.names
            merged[place] = Step((Test(test.field, names, "in", test.position),))
        else:
            merged.setdefault(part, part)
    flat = tuple(merged.values())
    return flat[0] if len(flat) == 1 else Choice(flat)


def _alternatives(parts: Iterable[Node]) -> Iterable[Node]:
    for part in parts:
        if isinstance(part, Choice):
            yield from part.parts
        else:
            yield part


def reverse(node: Node) -> Node:
    """The tree of the same words read backward."""
    if isinstance(node, Chain):
        return Chain(tuple(reverse(part) for part in reversed(node.parts)))
    if isinstance(node, Choice):
        return Choice(tuple(reverse(part) for part in node.parts))
    if isinstance(node, Repeat):
        return Repeat(reverse(node.part), node.low, node.high)
    if isinstance(node, Combination):
        return Combination(reverse(node.first), tuple((operator, reverse(operand)) for operator, operand in node.rest))
    return node


def steps_of(node: Node) -> list[Step]:
    """The distinct steps of a tree, in reading order."""
    found: dict[Step, None] = {}
    pending = [node]
    while pending:
        part = pending.pop()
        if isinstance(part, Step):
            found.setdefault(part)
        elif isinstance(part, Repeat):
            pending.append(part.part)
        elif isinstance(part, Combination):
            pending.extend(operand for _, operand in reversed(part.rest))
            pending.append(part.first)
        else:
            pending.extend(reversed(part.parts))
    return list(found)
