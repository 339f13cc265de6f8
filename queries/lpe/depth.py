"""Tests of depth, compiled away: an automaton that counts events knows their depths, so none need be written on them.

Expressions with such tests are first read over letters that are pairs of an event's symbol and a class of depths (depths that no
test tells apart); then the classes are replaced by a counter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from queries.lpe.alphabet import Alphabet
from queries.lpe.dfa import Dfa, alike, explore, minimize, spread
from queries.lpe.limits import Work
from queries.lpe.minterms import Bits, check_size, depths, distinct
from queries.lpe.syntax import Step


@dataclass(frozen=True)
class DatedLetters:
    """``steps`` and ``passes`` (bool (steps, letters)) as of an alphabet; letter ``symbol * classes + class``.

    ``class_of_depth``: the class of each depth, the last of which stands for all deeper ones too.
    """

    steps: tuple[Step, ...]
    passes: Bits
    class_of_depth: list[int]

    def __len__(self) -> int:
        """Number of letters."""
        return int(self.passes.shape[1])


def without_depth(steps: Sequence[Step]) -> list[Step]:
    """The distinct steps without their tests of depth."""
    return list(dict.fromkeys(_bare(step) for step in steps))


def with_depth(steps: Sequence[Step], alphabet: Alphabet) -> DatedLetters:
    """The letters of steps whose bare forms are the alphabet's."""
    table = depths(steps)
    first, kind = distinct(table)
    numbers = {step: i for i, step in enumerate(alphabet.steps)}
    bare = alphabet.passes[[numbers[_bare(step)] for step in steps]]
    check_size(len(steps), len(alphabet) * len(first))
    passes = (bare[:, :, None] & table[:, None, first]).reshape(len(steps), len(alphabet) * len(first))
    return DatedLetters(tuple(steps), passes, kind.tolist())


def count_events(dfa: Dfa, letters: DatedLetters, symbols: int, work: Work) -> Dfa:
    """The automaton over symbols alone, of an automaton over letters: each state knows how many events were read."""
    deepest, classes = len(letters.class_of_depth) - 1, len(letters) // symbols
    by_symbol = dfa.transitions.reshape(dfa.states, symbols, classes)
    chosen, kind = alike(by_symbol.transpose(0, 2, 1).reshape(-1, symbols))
    ways = by_symbol[:, chosen].tolist()

    def move(pair: int, symbol: int) -> int:
        work.spend(1)
        state, depth = divmod(pair, deepest + 1)
        after = int(ways[state][symbol][letters.class_of_depth[depth]])
        return after * (deepest + 1) + min(depth + 1, deepest)

    found, rows = explore([0], len(chosen), move)
    accepting = dfa.accepting[np.array(found) // (deepest + 1)]
    return minimize(Dfa(spread(rows, kind), accepting), work)


def _bare(step: Step) -> Step:
    return Step(tuple(test for test in step.tests if test.field != "depth"))
