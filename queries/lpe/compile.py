"""Text to a compiled expression: tokens, syntax tree, automata, SQL, in the order that the text travels."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from queries.errors import QueryError
from queries.lpe.automaton import Automaton, automaton, matches_some_path
from queries.lpe.describe import explain
from queries.lpe.dfa import Backward, last_symbols, read_backward
from queries.lpe.dialects import from_camera, osl_reading, read
from queries.lpe.events import path_event
from queries.lpe.limits import Work
from queries.lpe.parser import Parsed
from queries.lpe.printer import show
from queries.lpe.sql import Automata, select
from queries.lpe.syntax import Node, Test, steps_of


@dataclass(frozen=True)
class Arrays:
    """A compiled expression as plain arrays, for kernels. See ``Dfa`` and ``Alphabet`` for their meaning."""

    transitions: np.ndarray[tuple[int, ...], np.dtype[np.int32]]  # (states, symbols)
    accepting: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]  # (states)
    passes: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]  # (steps, symbols)


class Expression:
    """A compiled light path expression.

    ``text`` as given, ``tree`` as parsed, ``prefixes`` in the order of ``syntax.PREFIXES``, ``warnings`` for its author. ``dfa`` is minimal;
    ``alphabet`` gives events their symbols. ``tests``: the fields that it tests; ``regions`` and ``crossed``: the regions that vertices
    and segments are tested against.
    """

    def __init__(self, text: str, dialect: str, parsed: Parsed, camera_tree: Node, machine: Automaton, warnings: tuple[str, ...]) -> None:
        self.text = text
        self.dialect = dialect
        self.tree = parsed.tree
        self.prefixes = parsed.prefixes
        self.alphabet = machine.alphabet
        self.dfa = machine.dfa
        self.warnings = warnings
        tests = [test for step in steps_of(camera_tree) for test in step.tests]
        self.tests = frozenset(test.field for test in tests)
        self.regions = _names(tests, "region")
        self.crossed = _names(tests, "crosses")
        self._camera_tree = camera_tree

    def __str__(self) -> str:
        """The expression in the normal form of its own dialect."""
        return self.show(self.dialect)

    def show(self, dialect: str = "std") -> str:
        """The expression in the notation of a dialect. Raises ``ExpressionError`` where that cannot say it."""
        return "".join(f"{prefix};" for prefix in self.prefixes) + show(self.tree, dialect, self.dialect)

    def accepts(self, events: Iterable[Sequence[object]]) -> bool:
        """Whether a path matches: ``(type, scattering or None, labels, facts)`` of each event from the camera outward.

        Labels and facts may be left out; without facts, labels stand for them. ``facts``: pairs ``("object", "floor")`` or texts
        ``"object:floor"``. The depth of an event is its place among them.
        """
        word = [path_event(event) for event in events]
        dfa = self.dfa
        try:
            symbols = self.alphabet.symbols_of(word)
        except QueryError:
            # Some event has two objects at once, or the like, which no run has: symbols are made for it.
            further = automaton(self._camera_tree, Work(), events=word)
            symbols, dfa = further.alphabet.symbols_of(word), further.dfa
        state = 0
        for symbol in symbols:
            state = int(dfa.transitions[state, symbol])
        return bool(dfa.accepting[state])

    def sql(self, table: str = "paths", columns: str = "p.*", light_words: bool = True) -> str:
        """The query text for the matched rows of ``paths`` or ``occluded`` (``p`` in ``columns``), whatever the prefixes.

        ``light_words=False`` gives a shorter text for runs whose paths use no light walks. Raises ``QueryError`` where a region is tested.
        """
        if self.tests & {"region", "crosses"}:
            raise QueryError(
                "positions are not in the words that this query text reads: for an expression with regions, ask `SELECT ... FROM lpe('...')` "
                "(`pathspace sql`, `queries.sql.query`), or make its image with `queries.images`"
            )
        backward = self._backward if light_words else last_symbols(self.dfa)
        return select(Automata(self.alphabet, self.dfa, backward), table, columns)

    @cached_property
    def _backward(self) -> Backward:
        return read_backward(self.dfa, Work())

    def describe(self) -> str:
        """The expression in plain words, its prefixes last."""
        return explain(self.tree, self.prefixes)

    def arrays(self) -> Arrays:
        """The automaton and its alphabet as plain arrays."""
        return Arrays(self.dfa.transitions, self.dfa.accepting, self.alphabet.passes)


def compile(text: str, dialect: str = "std", objects: Collection[str] | None = None, regions: Collection[str] | None = None) -> Expression:
    """Compile a light path expression.

    ``dialect``: ``std``, ``osl`` or ``thesis``. ``objects``: the names of objects, materials and lights that exist, ``regions``: of regions;
    None where they are not known, and any name will do. Raises ``ExpressionError``, with the column and what was expected, where the text
    cannot be read or is too large.

    >>> compile("C D S+ L").accepts([("C", None, ()), ("R", "D", ("floor",)), ("T", "S", ("glass",)), ("L", None, ())])
    True
    >>> compile("C X@object:floor L").accepts([("C", None), ("R", "D", (), ["object:floor"]), ("L", None)])
    True
    """
    parsed = read(text, dialect, objects, regions)
    work = Work()
    tree = from_camera(parsed.tree, dialect, work)
    machine = automaton(tree, work)
    return Expression(text, dialect, parsed, tree, machine, (*parsed.warnings, *_warnings(text, dialect, tree, machine, objects is not None)))


def _warnings(text: str, dialect: str, tree: Node, machine: Automaton, of_a_run: bool) -> list[str]:
    """What the author should know of the compiled expression. ``of_a_run``: it is compiled for a run, none of which has media."""
    found = []
    if not matches_some_path(machine.dfa, machine.alphabet):
        found.append("the expression matches no path: a path is a camera `C`, interactions `R T V`, and a light `L`, `O` or `B`")
    if of_a_run and any(test.field == "medium" for step in steps_of(tree) for test in step.tests):
        found.append("`medium:` matches nothing: runs have no media")
    difference = osl_reading(text, tree) if dialect == "std" else None
    return [*found, difference] if difference else found


def _names(tests: Sequence[Test], field: str) -> tuple[str, ...]:
    return tuple(sorted({name for test in tests if test.field == field for name in test.names}))
