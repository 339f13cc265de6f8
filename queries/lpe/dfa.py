"""Deterministic automata over an alphabet of symbols: subset construction, minimization, product, and reading backward.

A ``Dfa`` is complete (a state without a way to acceptance takes the rest of the word) and numbered breadth first from the start
state, so equal languages over one alphabet have equal minimal arrays.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from queries.lpe.limits import Work, check_automaton
from queries.lpe.nfa import Nfa, bits
from queries.lpe.syntax import Step


@dataclass(frozen=True)
class Dfa:
    """``transitions``: int32 (states, symbols), the next state; ``accepting``: bool (states). State 0 is the start."""

    transitions: npt.NDArray[np.int32]
    accepting: npt.NDArray[np.bool_]

    @property
    def states(self) -> int:
        """Number of states."""
        return len(self.accepting)


@dataclass(frozen=True)
class Backward:
    """A DFA read from the ends of its words. ``sets[i]`` holds, as bits, the forward states from which the suffix read so far is accepted.

    ``after``: for each symbol, the state after reading it as the last of a word; ``transitions``: int32 (states, symbols).
    """

    sets: list[int]
    after: list[int]
    transitions: npt.NDArray[np.int32]


def explore(start: list[int], symbols: int, move: Callable[[int, int], int]) -> tuple[list[int], list[list[int]]]:
    """All sets of states (as bits) that ``move`` reaches from ``start``, breadth first, and their transitions."""
    numbers = {subset: i for i, subset in enumerate(dict.fromkeys(start))}
    found = list(numbers)
    rows: list[list[int]] = []
    while len(rows) < len(found):
        check_automaton(len(found), symbols)
        subset, row = found[len(rows)], []
        for symbol in range(symbols):
            after = move(subset, symbol)
            if after not in numbers:
                numbers[after] = len(found)
                found.append(after)
            row.append(numbers[after])
        rows.append(row)
    return found, rows


class Letters(Protocol):
    """What words are made of: an ``Alphabet``, or its symbols at classes of depth."""

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps that tell letters apart."""
        ...

    @property
    def passes(self) -> npt.NDArray[np.bool_]:
        """Whether letters pass the steps: bool (steps, letters)."""
        ...

    def __len__(self) -> int:
        """Number of letters."""
        ...


def alike(columns: npt.NDArray[np.int32] | npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Symbols whose columns are equal need to be looked at once: the first of each kind, in order, and for each symbol its kind."""
    _, first, kind = np.unique(columns, axis=1, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return first[order], place[kind.ravel()]


def spread(rows: list[list[int]], kind: npt.NDArray[np.intp]) -> npt.NDArray[np.int32]:
    """Transitions by symbol, of those by kind of symbol."""
    check_automaton(len(rows), len(kind))
    return np.array(rows, np.int32)[:, kind]


def determinize(nfa: Nfa, alphabet: Letters, work: Work) -> Dfa:
    """The subset construction. A state is the set of positions that may be read next, and one more bit: a word may end here."""
    end = 1 << len(nfa.symbols)
    numbers = {step: i for i, step in enumerate(alphabet.steps)}
    used = {step: alphabet.passes[numbers[step]] for step in dict.fromkeys(nfa.symbols)}
    chosen, kind = alike(np.array(list(used.values()), np.bool_).reshape(len(used), len(alphabet)))
    readers = [0] * len(chosen)  # the positions that read each kind of symbol
    for position, step in enumerate(nfa.symbols):
        for symbol in np.flatnonzero(used[step][chosen]):
            readers[symbol] |= 1 << position
    work.spend(len(nfa.symbols) * len(chosen))
    following = [follow | (end if nfa.last >> i & 1 else 0) for i, follow in enumerate(nfa.follow)]

    def move(subset: int, symbol: int) -> int:
        reading = subset & readers[symbol]
        work.spend(reading.bit_count() + 1)
        after = 0
        for position in bits(reading):
            after |= following[position]
        return after

    found, rows = explore([nfa.first | (end if nfa.nullable else 0)], len(chosen), move)
    return Dfa(spread(rows, kind), np.array([bool(subset & end) for subset in found]))


def combine(a: Dfa, b: Dfa, accepts: Callable[[bool, bool], bool], work: Work) -> Dfa:
    """The product automaton, which accepts where ``accepts`` says so of the two."""
    chosen, kind = alike(np.vstack([a.transitions, b.transitions]))
    ways_a, ways_b = a.transitions[:, chosen].tolist(), b.transitions[:, chosen].tolist()

    def move(pair: int, symbol: int) -> int:
        work.spend(1)
        i, j = divmod(pair, b.states)
        return int(ways_a[i][symbol] * b.states + ways_b[j][symbol])

    found, rows = explore([0], len(chosen), move)
    accepting = [accepts(bool(a.accepting[pair // b.states]), bool(b.accepting[pair % b.states])) for pair in found]
    return Dfa(spread(rows, kind), np.array(accepting))


def minimize(dfa: Dfa, work: Work) -> Dfa:
    """The smallest DFA of the same language, by partition refinement that takes the smaller half (hopcroft1971)."""
    chosen, kind = alike(dfa.transitions)
    ways, symbols = dfa.transitions[:, chosen].tolist(), len(chosen)
    before: list[list[list[int]]] = [[[] for _ in range(dfa.states)] for _ in range(symbols)]
    for state, row in enumerate(ways):
        for symbol, after in enumerate(row):
            before[symbol][after].append(state)

    accepting = set(np.flatnonzero(dfa.accepting).tolist())
    blocks = [block for block in (accepting, set(range(dfa.states)) - accepting) if block]
    block_of = [0] * dfa.states
    for number, block in enumerate(blocks):
        for state in block:
            block_of[state] = number
    pending = {(number, symbol) for number in range(len(blocks)) for symbol in range(symbols)}
    while pending:
        splitter, symbol = pending.pop()
        work.spend(len(blocks[splitter]) + 1)
        # States of each block that the splitter's states come from.
        touched: dict[int, set[int]] = {}
        for after in blocks[splitter]:
            for state in before[symbol][after]:
                touched.setdefault(block_of[state], set()).add(state)
        for number, part in touched.items():
            if len(part) == len(blocks[number]):
                continue
            # The new block gets the part, the old one keeps the rest; whichever is smaller must split others too.
            work.spend(len(part))
            fresh = len(blocks)
            blocks[number] -= part
            blocks.append(part)
            for state in part:
                block_of[state] = fresh
            for other in range(symbols):
                smaller = fresh if len(part) <= len(blocks[number]) else number
                pending.add((fresh if (number, other) in pending else smaller, other))
    members, rows = _renumbered(ways, block_of)
    return Dfa(spread(rows, kind), dfa.accepting[np.array(members)])


def _renumbered(ways: list[list[int]], block_of: list[int]) -> tuple[list[int], list[list[int]]]:
    """The quotient automaton, numbered breadth first from the start state: a member of each new state, and the new transitions."""
    numbers = {block_of[0]: 0}
    members = [0]
    rows: list[list[int]] = []
    while len(rows) < len(members):
        row = []
        for after in ways[members[len(rows)]]:
            if block_of[after] not in numbers:
                numbers[block_of[after]] = len(members)
                members.append(after)
            row.append(numbers[block_of[after]])
        rows.append(row)
    return members, rows


def read_backward(dfa: Dfa, work: Work) -> Backward:
    """The automaton that reads words from their ends: subsets of the forward states."""
    symbols = dfa.transitions.shape[1]
    sources = _sources(dfa)

    def move(subset: int, symbol: int) -> int:
        work.spend(subset.bit_count() + 1)
        return _before(sources[symbol], subset)

    ends = [_before(sources[symbol], mask(dfa.accepting)) for symbol in range(symbols)]
    found, rows = explore(ends, symbols, move)
    numbers = {subset: i for i, subset in enumerate(found)}
    return Backward(found, [numbers[end] for end in ends], np.array(rows, np.int32))


def last_symbols(dfa: Dfa) -> Backward:
    """``read_backward`` for the last symbol alone: no transitions."""
    sources = _sources(dfa)
    ends = [_before(source, mask(dfa.accepting)) for source in sources]
    found = list(dict.fromkeys(ends))
    return Backward(found, [found.index(end) for end in ends], np.zeros((len(found), 0), np.int32))


def mask(states: npt.NDArray[np.bool_]) -> int:
    """A Boolean array as bits of an integer, state 0 lowest."""
    return int.from_bytes(np.packbits(states, bitorder="little").tobytes(), "little")


def _sources(dfa: Dfa) -> list[list[int]]:
    """For each symbol and state, as bits, the states that go there."""
    sources = [[0] * dfa.states for _ in range(dfa.transitions.shape[1])]
    for state, row in enumerate(dfa.transitions.tolist()):
        for symbol, after in enumerate(row):
            sources[symbol][after] |= 1 << state
    return sources


def _before(sources: list[int], subset: int) -> int:
    found = 0
    for state in bits(subset):
        found |= sources[state]
    return found


def alive(dfa: Dfa) -> npt.NDArray[np.bool_]:
    """Whether some word leads from each state to acceptance: bool (states)."""
    living = dfa.accepting.copy()
    while True:
        grown = living | living[dfa.transitions].any(axis=1)
        if (grown == living).all():
            return living
        living = grown
