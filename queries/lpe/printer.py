"""Syntax tree to text, in any of the notations: ``parse(show(tree)) == tree`` for every tree that the parser of the notation made.

A tree that a notation cannot spell is refused: the error names the construct that it lacks. This file holds the standard notation.
"""

import re
from itertools import product

from queries.errors import ExpressionError
from queries.lpe.direction import camera_first
from queries.lpe.limits import Work
from queries.lpe.osl_printer import show as show_osl
from queries.lpe.syntax import (
    EVENT_TYPES,
    FIELDS,
    NAMED_FIELDS,
    NUMBERED_FIELDS,
    SCATTERING_TYPES,
    Chain,
    Choice,
    Combination,
    Node,
    Repeat,
    Step,
    Test,
)
from queries.lpe.thesis_printer import show as show_thesis

_ORDER = EVENT_TYPES + SCATTERING_TYPES
_INTERACTIONS = frozenset("RTV")
_PLAIN_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_OPEN_SUFFIX = re.compile(r"@[\w.:!]*$", re.ASCII)  # a name or number that would run into a letter or dot after it


def show(node: Node, dialect: str = "std", source: str | None = None) -> str:
    """The expression in the notation of ``dialect``: ``std``, ``osl`` or ``thesis``.

    ``source``: the dialect that the tree was read in, by default ``dialect``. It matters to trees that are written light first: the
    standard dialect turns them round, OSL does not. Raises ``ExpressionError`` where the notation has no words for the tree.

    >>> from queries.lpe.parser import parse
    >>> show(parse("C (D | G)* <R.'mirror'> L").tree)
    "C[DG]*<R.'mirror'>L"
    >>> show(parse("L D? E").tree, "osl", source="std")
    'CD{0,1}L'
    """
    notations = {"std": _show, "osl": show_osl, "thesis": show_thesis}
    if dialect not in notations:
        raise ExpressionError(f"expected one of the dialects {', '.join(notations)}, found `{dialect}`")
    return notations[dialect](_directed(node, dialect, source or dialect))


def _directed(node: Node, dialect: str, source: str) -> Node:
    """The tree in the direction that the reader of the new text will take it."""
    if dialect == source:
        return node
    if source != "osl":
        return camera_first(node, Work())
    if camera_first(node, Work()) != node:
        raise ExpressionError("the expression begins at a light: OSL reads it as it stands, other notations would turn it round")
    return node


# --- trees --------------------------------------------------------------------------------------------------------


def _show(node: Node) -> str:
    if isinstance(node, Step):
        return show_step(node)
    if isinstance(node, Chain):
        text = ""
        for part in node.parts:
            text += " " * bool(_OPEN_SUFFIX.search(text)) + _inside(part, Choice, Combination)
        return text
    if isinstance(node, Choice):
        return "|".join(_inside(part, Choice, *_loose(part, "|")) for part in node.parts)
    if isinstance(node, Repeat):
        return _inside(node.part, Chain, Choice, Repeat, Combination) + _times(node.low, node.high)
    operators = {operator for operator, _ in node.rest}
    tight = "^" if "^" in operators else "&"
    shown = [_inside(node.first, Choice, *_loose(node.first, tight))]
    for operator, operand in node.rest:
        shown.append(operator + _inside(operand, Choice, *_loose(operand, tight)))
    return "".join(shown)


def _loose(part: Node, operator: str) -> tuple[type, ...]:
    """``(Combination,)`` where the part is a combination that binds no tighter than the operator around it."""
    if not isinstance(part, Combination) or operator == "|":
        return ()
    return () if operator == "^" and part.rest[0][0] != "^" else (Combination,)


def _inside(part: Node, *loose: type) -> str:
    return f"({_show(part)})" if isinstance(part, loose) else _show(part)


def _times(low: int, high: int | None) -> str:
    short = {(0, None): "*", (1, None): "+", (0, 1): "?"}.get((low, high))
    if short:
        return short
    if high is None:
        return f"{{{low},}}"
    return f"{{{low}}}" if low == high else f"{{{low},{high}}}"


# --- steps --------------------------------------------------------------------------------------------------------


def show_step(step: Step) -> str:
    """One step: a symbol or a group ``<type scattering labels>``, and what must hold there, each after an ``@``."""
    suffixes = [_suffixes(test) for test in step.tests if test.field in NAMED_FIELDS + NUMBERED_FIELDS]
    symbol = _symbol([test for test in step.tests if test.field in ("type", "scattering", "label")])
    shown = [symbol + "".join(chosen) for chosen in product(*suffixes)]
    return shown[0] if len(shown) == 1 else f"({'|'.join(shown)})"


def _symbol(tests: list[Test]) -> str:
    """A bare symbol where one field is tested, else a group."""
    if not tests:
        return "."
    test = tests[0]
    if len(tests) == 1 and test == Test("type", _INTERACTIONS):
        return "X"
    if len(tests) == 1 and test.names:
        known = {"type": EVENT_TYPES, "scattering": SCATTERING_TYPES.replace("x", "")}.get(test.field)
        if known is None or test.names <= set(known):
            return show_test(test)
    fields = {test.field: show_test(test) for test in tests if test.field != "label"}
    labels = [show_test(test) for test in tests if test.field == "label"]
    return f"<{fields.get('type', '.')}{fields.get('scattering', '.')}{''.join(labels)}>"


def show_test(test: Test) -> str:
    """One test as it stands in a group: ``D``, ``[DG]``, ``[^D]``, ``'a'``, ``!'a'``."""
    if test.position is not None:
        raise ExpressionError(
            f"the standard notation has no labels by position, which OSL counts: an expression that asks for {_listed(test)} "
            f"in place {test.position + 1} of the event's labels cannot be written in it"
        )
    if not test.names:
        return "."
    if test.field == "label":
        names = [_quote(name) for name in sorted(test.names)]
    else:
        names = sorted(test.names, key=_ORDER.index)
    if test.mode == "without":
        return "".join(f"!{name}" for name in names)
    if test.mode == "other":
        return f"[^{''.join(names)}]"
    return names[0] if len(names) == 1 else f"[{''.join(names)}]"


def _listed(test: Test) -> str:
    names = " or ".join(f"'{name}'" for name in sorted(test.names))
    return names if test.mode == "in" else f"a label other than {names}" if names else "a label"


def _suffixes(test: Test) -> list[str]:
    """The alternatives of an ``@`` test, each as a suffix: ``@P``, ``@!P``, ``@object:floor``, ``@depth:2..4``."""
    field = "" if test.field == "region" else f"{test.field}:"
    names = sorted(test.names)
    if test.field in NAMED_FIELDS:
        names = [name if _PLAIN_NAME.fullmatch(name) and name not in FIELDS else _quote(name) for name in names]
    if test.mode == "in":
        return [f"@{field}{name}" for name in names]
    return ["".join(f"@!{field}{name}" for name in names)]


def _quote(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"
