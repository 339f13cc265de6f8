"""The notations that expressions are read in, and texts that two of them understand differently."""

from collections.abc import Collection
from dataclasses import replace

from queries.errors import ExpressionError
from queries.lpe import parser
from queries.lpe.automaton import Automaton, automaton, matches_some_path
from queries.lpe.describe import describe, ordinal
from queries.lpe.dfa import combine
from queries.lpe.direction import camera_first
from queries.lpe.limits import Work
from queries.lpe.parser import Parsed
from queries.lpe.prefixes import read_prefixes
from queries.lpe.printer import show
from queries.lpe.syntax import Combination, Node, Repeat, Step, step, steps_of

DIALECTS = ("std", "osl", "thesis")
_COMPARED = 200_000  # steps of work that a comparison of two readings may take


def read(text: str, dialect: str, objects: Collection[str] | None, regions: Collection[str] | None) -> Parsed:
    """The syntax tree of a text in one of the dialects, in the order that it is written in."""
    # Dialects import the standard parser, so they are imported when they are needed.
    if dialect == "std":
        return parser.parse(text, objects, regions)
    if dialect == "osl":
        from queries.lpe import osl

        # Prefixes are no part of OSL's notation: they are read here, before it.
        prefixes, start = read_prefixes(text)
        start = len(text) - len(text[start:].lstrip()) if prefixes else start
        try:
            return replace(osl.parse(text[start:]), prefixes=prefixes)
        except ExpressionError as error:
            message = str(error).removeprefix(f"column {error.column}: ")
            raise ExpressionError(message, error.column + start if error.column else 0) from None
    if dialect == "thesis":
        from queries.lpe import thesis

        return thesis.parse(text, objects, regions)
    raise ExpressionError(f"expected one of the dialects {', '.join(DIALECTS)}, found `{dialect}`")


def from_camera(tree: Node, dialect: str, work: Work) -> Node:
    """The tree camera first. OSL knows no other order."""
    return tree if dialect == "osl" else camera_first(tree, work)


def osl_reading(text: str, tree: Node) -> str | None:
    """A warning where a standard text, whose camera-first tree is given, matches other paths when it is read as OSL; None where it does not.

    Texts that OSL refuses, and those that are too large to be compared, are not warned of.
    """
    try:
        other = read(text, "osl", None, None).tree
        if other == tree or not _differ(tree, other):
            return None
    except ExpressionError:
        return None
    label = _label_by_place(other) if _without_places(other) == tree else None
    if label:
        return f"OSL reads labels by place, {label}; here they may stand in any place: say `dialect: osl` if you mean OSL's reading"
    return f"OSL reads this text as {_shown(other, 'osl')}; it is read here as {_shown(tree, 'std')}: say `dialect: osl` if you mean OSL's reading"


def _label_by_place(tree: Node) -> str | None:
    """The first label that a tree looks for in one place of an event's list."""
    placed = [test for one in steps_of(tree) for test in one.tests if test.position is not None and test.names]
    return f"'{min(placed[0].names)}' as an event's {ordinal(placed[0].position or 0)} label" if placed else None


def _without_places(node: Node) -> Node:
    """The tree with its labels in any place."""
    if isinstance(node, Step):
        return step(*(replace(test, position=None) for test in node.tests))
    if isinstance(node, Repeat):
        return replace(node, part=_without_places(node.part))
    if isinstance(node, Combination):  # OSL has none
        return node
    return replace(node, parts=tuple(_without_places(part) for part in node.parts))


def _differ(a: Node, b: Node) -> bool:
    """Whether some path matches one tree and not the other."""
    work = Work(_COMPARED)
    machine: Automaton = automaton(a, work, steps_of(b))
    other: Automaton = automaton(b, work, steps_of(a))
    return matches_some_path(combine(machine.dfa, other.dfa, lambda x, y: x != y, work), machine.alphabet)


def _shown(tree: Node, source: str) -> str:
    """A tree in the standard notation; where that cannot say it, in words."""
    try:
        return f"`{show(tree, 'std', source)}`"
    except ExpressionError:
        return describe(tree)
