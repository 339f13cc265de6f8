"""Text to a compiled expression: tokens, syntax tree, automata, SQL, in the order that the text travels."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from queries.errors import ExpressionError
from queries.lpe.alphabet import CAMERA, Alphabet
from queries.lpe.describe import describe
from queries.lpe.dfa import Backward, Dfa, combine, determinize, last_symbols, minimize, read_backward
from queries.lpe.direction import camera_first
from queries.lpe.limits import Work
from queries.lpe.nfa import build
from queries.lpe.parser import combines, parse
from queries.lpe.printer import show
from queries.lpe.sql import Automata, select
from queries.lpe.syntax import Choice, Combination, Node, PathEvent, choice, steps_of

DIALECTS = ("std",)
_BOOLEAN: dict[str, Callable[[bool, bool], bool]] = {
    "|": lambda a, b: a or b,
    "&": lambda a, b: a and b,
    "-": lambda a, b: a and not b,
    "^": lambda a, b: a != b,
}


@dataclass(frozen=True)
class Arrays:
    """A compiled expression as plain arrays, for kernels. See ``Dfa`` and ``Alphabet`` for their meaning."""

    transitions: np.ndarray[tuple[int, ...], np.dtype[np.int32]]  # (states, symbols)
    accepting: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]  # (states)
    passes: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]  # (steps, symbols)


class Expression:
    """A compiled light path expression. ``text`` as given, ``tree`` as parsed, ``dfa`` minimal, ``warnings`` for its author."""

    def __init__(self, text: str, dialect: str, tree: Node, alphabet: Alphabet, dfa: Dfa, warnings: tuple[str, ...]) -> None:
        self.text = text
        self.dialect = dialect
        self.tree = tree
        self.alphabet = alphabet
        self.dfa = dfa
        self.warnings = warnings

    def __str__(self) -> str:
        """The expression in normal form."""
        return show(self.tree)

    def accepts(self, events: Iterable[Sequence[object]]) -> bool:
        """Whether a path matches: ``(type, scattering or None, labels)`` of each event from the camera outward; labels may be left out."""
        state = 0
        for event in events:
            state = int(self.dfa.transitions[state, self.alphabet.symbol(_path_event(event))])
        return bool(self.dfa.accepting[state])

    def sql(self, table: str = "paths", columns: str = "p.*", light_words: bool = True) -> str:
        """The query text for the matched rows of ``paths`` or ``occluded`` (``p`` in ``columns``).

        ``light_words=False`` gives a shorter text for runs whose paths use no light walks.
        """
        backward = self._backward if light_words else last_symbols(self.dfa)
        return select(Automata(self.alphabet, self.dfa, backward), table, columns)

    @cached_property
    def _backward(self) -> Backward:
        return read_backward(self.dfa, Work())

    def describe(self) -> str:
        """The expression in plain words."""
        return describe(self.tree)

    def arrays(self) -> Arrays:
        """The automaton and its alphabet as plain arrays."""
        return Arrays(self.dfa.transitions, self.dfa.accepting, self.alphabet.passes)


def compile(text: str, dialect: str = "std") -> Expression:
    """Compile a light path expression.

    Raises ``ExpressionError``, with the column and what was expected, where the text cannot be read or is too large.

    >>> compile("C D S+ L").accepts([("C", None, ()), ("R", "D", ("floor",)), ("T", "S", ("glass",)), ("L", None, ())])
    True
    """
    if dialect not in DIALECTS:
        raise ExpressionError(f"expected one of the dialects {', '.join(DIALECTS)}, found `{dialect}`")
    parsed = parse(text)
    work = Work()
    tree = camera_first(parsed.tree, work)
    alphabet = Alphabet(steps_of(tree))
    dfa = automaton(tree, alphabet, work)
    warnings = parsed.warnings
    if not matches_some_path(dfa, alphabet):
        warnings = (*warnings, "the expression matches no path: a path is a camera `C`, interactions `R T V`, and a light `L`, `O` or `B`")
    return Expression(text, dialect, parsed.tree, alphabet, dfa, warnings)


def automaton(node: Node, alphabet: Alphabet, work: Work) -> Dfa:
    """The minimal automaton of a tree, Boolean combinations included."""
    if isinstance(node, Combination):
        dfa = automaton(node.first, alphabet, work)
        for operator, operand in node.rest:
            dfa = minimize(combine(dfa, automaton(operand, alphabet, work), _BOOLEAN[operator], work), work)
        return dfa
    if isinstance(node, Choice) and combines(node):
        plain = [part for part in node.parts if not combines(part)]
        operands = [part for part in node.parts if combines(part)] + ([choice(plain)] if plain else [])
        rest = tuple(("|", operand) for operand in operands[1:])
        return automaton(Combination(operands[0], rest) if rest else operands[0], alphabet, work)
    return minimize(determinize(build(node, work), alphabet, work), work)


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


def _path_event(event: Sequence[object]) -> PathEvent:
    """One event as the caller wrote it."""
    if isinstance(event, str) or not 1 <= len(event) <= 3 or not isinstance(event[0], str):
        raise TypeError(f"expected an event (type, scattering or None, labels), found {event!r}")
    scattering = event[1] if len(event) > 1 else None
    labels = event[2] if len(event) > 2 else ()
    if not (scattering is None or isinstance(scattering, str)) or isinstance(labels, str) or not isinstance(labels, Iterable):
        raise TypeError(f"expected an event (type, scattering or None, labels), found {event!r}")
    return PathEvent(event[0], scattering, tuple(str(label) for label in labels))
