"""Syntax tree to the minimal automaton of the paths that it matches: Boolean combinations and tests of depth included."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from queries.lpe.alphabet import CAMERA, Alphabet
from queries.lpe.depth import count_events, with_depth, without_depth
from queries.lpe.dfa import Dfa, Letters, combine, determinize, minimize
from queries.lpe.limits import Work
from queries.lpe.nfa import build
from queries.lpe.parser import combines
from queries.lpe.syntax import Choice, Combination, Node, PathEvent, Step, choice, steps_of

_BOOLEAN: dict[str, Callable[[bool, bool], bool]] = {
    "|": lambda a, b: a or b,
    "&": lambda a, b: a and b,
    "-": lambda a, b: a and not b,
    "^": lambda a, b: a != b,
}

_OPERAND = 20_000  # steps that one more operand counts for, however small its automaton is


@dataclass(frozen=True)
class Automaton:
    """A minimal DFA, and what its symbols mean."""

    alphabet: Alphabet
    dfa: Dfa


def automaton(tree: Node, work: Work, others: Sequence[Step] = (), events: Sequence[PathEvent] = ()) -> Automaton:
    """The automaton of a tree that is written camera first.

    ``others``: further steps that its symbols tell apart, so that automata of several trees share one alphabet; ``events``: further
    events that have symbols (see ``Alphabet``).
    """
    # In one order, so that the alphabet is the same for all trees that share it.
    steps = sorted({*steps_of(tree), *others}, key=lambda step: [test.order() for test in step.tests]) if others else steps_of(tree)
    alphabet = Alphabet(without_depth(steps), events)
    if not any(test.field == "depth" for step in steps for test in step.tests):
        return Automaton(alphabet, _combined(tree, alphabet, work))
    dated = with_depth(steps, alphabet)
    return Automaton(alphabet, count_events(_combined(tree, dated, work), dated, len(alphabet), work))


def _combined(node: Node, letters: Letters, work: Work) -> Dfa:
    """The minimal automaton of a tree over letters."""
    if isinstance(node, Combination):
        dfa = _combined(node.first, letters, work)
        for operator, operand in node.rest:
            work.spend(_OPERAND)
            dfa = minimize(combine(dfa, _combined(operand, letters, work), _BOOLEAN[operator], work), work)
        return dfa
    if isinstance(node, Choice) and combines(node):
        plain = [part for part in node.parts if not combines(part)]
        operands = [part for part in node.parts if combines(part)] + ([choice(plain)] if plain else [])
        rest = tuple(("|", operand) for operand in operands[1:])
        return _combined(Combination(operands[0], rest) if rest else operands[0], letters, work)
    return minimize(determinize(build(node, work), letters, work), work)


def matches_some_path(dfa: Dfa, alphabet: Alphabet) -> bool:
    """Whether the automaton accepts any word that a path can have."""
    inside = alphabet.with_types("RTV")
    reached = np.zeros(dfa.states, np.bool_)
    reached[dfa.transitions[0, alphabet.symbol(CAMERA)]] = True
    while True:
        grown = reached.copy()
        grown[dfa.transitions[np.ix_(reached, inside)]] = True
        if (grown == reached).all():
            break
        reached = grown
    return bool(dfa.accepting[dfa.transitions[np.ix_(reached, alphabet.with_types("LOB"))]].any())
