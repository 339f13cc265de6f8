"""Syntax tree to nondeterministic automaton: Glushkov's construction, one state for each symbol, no empty moves.

Sets of positions are bits of Python integers. Position i is the i-th symbol of the expression with its repetitions written out.
The construction is that of glushkov1961.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_POSITIONS, Work
from queries.lpe.syntax import Chain, Choice, Node, Repeat, Step


@dataclass
class Nfa:
    """``symbols[i]`` is what position i reads, ``follow[i]`` the positions that can come next."""

    symbols: list[Step] = field(default_factory=list)
    follow: list[int] = field(default_factory=list)
    first: int = 0
    last: int = 0
    nullable: bool = False

    def steps(self, positions: int) -> list[Step]:
        """The distinct steps at a set of positions."""
        return list(dict.fromkeys(self.symbols[i] for i in bits(positions)))


@dataclass(frozen=True)
class _Fragment:
    first: int
    last: int
    nullable: bool


_NOTHING = _Fragment(0, 0, True)


def bits(mask: int) -> Iterator[int]:
    """The positions of the set bits, ascending."""
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def build(node: Node, work: Work) -> Nfa:
    """The automaton of a tree without Boolean combinations."""
    builder = _Builder(work)
    whole = builder.fragment(node)
    nfa = builder.nfa
    nfa.first, nfa.last, nfa.nullable = whole.first, whole.last, whole.nullable
    return nfa


class _Builder:
    """Adds the positions of a tree to one automaton, part by part."""

    def __init__(self, work: Work) -> None:
        self.nfa = Nfa()
        self.work = work

    def fragment(self, node: Node) -> _Fragment:
        """Where words of a part may begin and end."""
        self.work.spend(20)
        if isinstance(node, Step):
            return self._symbol(node)
        if isinstance(node, Chain):
            whole = _NOTHING
            for part in node.parts:
                whole = self._then(whole, self.fragment(part))
            return whole
        if isinstance(node, Choice):
            first, last, nullable = 0, 0, False
            for part in node.parts:
                inner = self.fragment(part)
                first, last, nullable = first | inner.first, last | inner.last, nullable or inner.nullable
            return _Fragment(first, last, nullable)
        if isinstance(node, Repeat):
            return self._repeat(node)
        raise TypeError(f"a {type(node).__name__} has no automaton of its own: combine the automata of its operands")

    def _symbol(self, step: Step) -> _Fragment:
        position = len(self.nfa.symbols)
        if position >= MAX_POSITIONS:
            raise ExpressionError(f"the expression has more than {MAX_POSITIONS:,} symbols once repetitions are written out: use smaller repetitions")
        self.nfa.symbols.append(step)
        self.nfa.follow.append(0)
        return _Fragment(1 << position, 1 << position, False)

    def _link(self, last: int, first: int) -> None:
        """Let every position of ``first`` come after every position of ``last``."""
        self.work.spend(last.bit_count() + 1)
        for position in bits(last):
            self.nfa.follow[position] |= first

    def _then(self, left: _Fragment, right: _Fragment) -> _Fragment:
        self._link(left.last, right.first)
        first = left.first | right.first if left.nullable else left.first
        last = left.last | right.last if right.nullable else right.last
        return _Fragment(first, last, left.nullable and right.nullable)

    def _repeat(self, node: Repeat) -> _Fragment:
        """``low`` copies that must come, then a loop on the last of them, or copies that are nested: p(p(p)?)?."""
        whole = copy = _NOTHING
        for _ in range(node.low if node.high is not None else max(node.low, 1)):
            copy = self.fragment(node.part)
            whole = self._then(whole, copy)
        if node.high is None:
            self._link(copy.last, copy.first)
            return _Fragment(whole.first, whole.last, whole.nullable or node.low == 0)
        first, ends, before = whole.first, whole.last, whole.last
        for i in range(node.high - node.low):
            copy = self.fragment(node.part)
            self._link(before, copy.first)
            if i == 0 and whole.nullable:
                first |= copy.first
            ends |= copy.last
            before = copy.last
        return _Fragment(first, ends, whole.nullable)
