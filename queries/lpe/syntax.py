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


class PathEvent(NamedTuple):
    """One event of a path: its type, its scattering type (None where light does not scatter) and its labels."""

    type: str
    scattering: str | None
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Test:
    """A test of one field of an event against some names.

    ``mode``: ``in``, the field is one of the names (a label: the event carries one of them); ``other``, it is none of them
    (a label: the event carries some label, and none of these); ``without``, labels only, the event carries none of these.
    """

    __test__ = False  # tells pytest that this is no test case

    field: str  # "type", "scattering" or "label"
    names: frozenset[str]
    mode: str = "in"

    def accepts(self, event: PathEvent) -> bool:
        """Whether the event passes."""
        if self.field == "type":
            return (event.type in self.names) == (self.mode == "in")
        if self.field == "scattering":
            return ((event.scattering or "x") in self.names) == (self.mode == "in")
        if self.mode == "in":
            return not self.names.isdisjoint(event.labels)
        return self.names.isdisjoint(event.labels) and (self.mode == "without" or len(event.labels) > 0)

    def order(self) -> tuple[str, str, tuple[str, ...]]:
        """A sorting key."""
        return self.field, self.mode, tuple(sorted(self.names))


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
    merged: dict[Node | str, Node] = {}
    for part in _alternatives(parts):
        # Alternatives such as D|G, that only list the values of one field, become one step [DG].
        if isinstance(part, Step) and len(part.tests) == 1 and part.tests[0].mode == "in":
            test = part.tests[0]
            known = merged.get(test.field)
            names = known.tests[0].names | test.names if isinstance(known, Step) else test.names
            merged[test.field] = Step((Test(test.field, names),))
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
