"""Predicates on vertices, written after a symbol or bracket: ``X@P``, ``<TS>@object:ball``, ``.@!depth:2..4``.

::

    predicate := "@" ["!"] ( region | field ":" value )
    region    := name
    field     := "object" | "material" | "light" | "medium" | "blocker" | "technique" | "region" | "crosses" | "depth" | "s" | "t"
    value     := name | number | number ".." | ".." number | number ".." number     (a number or range of depth, s and t; of the others a name)
    name      := letters, digits and "_" without a digit first, as far as they go | "'" any text "'"

As names run as far as they can, ``CX@PL`` speaks of a region ``PL``: write ``CX@P L``. So do ranges: ``X@depth:2..L`` is depth 2 or more, then ``L``.
"""

from typing import Protocol

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_NAME, MAX_NUMBER
from queries.lpe.names import Known, nearest
from queries.lpe.syntax import NAMED_FIELDS, NUMBERED_FIELDS, Choice, Node, Step, Test, choice, step
from queries.lpe.tokens import Token

TECHNIQUES = ("hit", "sample", "lens", "connection", "merge")  # in the order of renderer.tables.TECHNIQUES
_FIELDS = (*NAMED_FIELDS, *NUMBERED_FIELDS)


class Reader(Protocol):
    """What a parser of tokens offers."""

    @property
    def token(self) -> Token:
        """The next token."""
        ...

    def take(self, *kinds: str) -> Token | None:
        """The next token if it is of one of the kinds, and go past it; else None."""
        ...


def with_predicates(atom: Node, reader: Reader, known: Known) -> Node:
    """The atom with the predicates that follow it, each of which every one of its alternatives must pass."""
    tests: list[Test] = []
    first = reader.token
    while reader.take("@"):
        tests.append(_predicate(reader, known))
    if not tests:
        return atom
    parts = atom.parts if isinstance(atom, Choice) else (atom,)
    if not all(isinstance(part, Step) for part in parts):
        raise ExpressionError(
            "a predicate `@…` speaks of one event: expected it after a symbol, or after a bracket of alternatives of one symbol each", first.column
        )
    return choice([step(*part.tests, *tests) for part in parts if isinstance(part, Step)])


def _predicate(reader: Reader, known: Known) -> Test:
    """The test after an ``@``."""
    mode = "without" if reader.take("!") else "in"
    first = reader.token
    if not reader.take("name", "label"):
        raise ExpressionError(f"expected a region or `object:`, `depth:` … after `@`, found {first}", first.column)
    if not reader.take(":"):
        return Test("region", frozenset({_name("region", first, known)}), mode)
    if first.text not in _FIELDS:
        raise ExpressionError(f"expected one of {', '.join(_FIELDS)} before `:`, found {_shown(first)}{nearest(first.text, _FIELDS)}", first.column)
    value = reader.token
    if first.text in NUMBERED_FIELDS:
        if not reader.take("range"):
            raise ExpressionError(f"expected a number or a range such as 2..4 after `{first.text}:`, found {value}", value.column)
        return Test(first.text, frozenset({_range(value)}), mode)
    if not reader.take("name", "label"):
        fix = ": quote names that do not begin with a letter" if value.kind == "range" else ""
        raise ExpressionError(f"expected a name after `{first.text}:`, found {value}{fix}", value.column)
    return Test(first.text, frozenset({_name(first.text, value, known)}), mode)


def _name(field: str, token: Token, known: Known) -> str:
    """A name that exists, where that is known."""
    if len(token.text) > MAX_NAME:
        raise ExpressionError(f"expected a name of at most {MAX_NAME} characters, found {len(token.text):,}", token.column)
    if field == "technique" and token.text not in TECHNIQUES:
        raise ExpressionError(f"expected one of {', '.join(TECHNIQUES)}, found {_shown(token)}{nearest(token.text, TECHNIQUES)}", token.column)
    known.check(field, token.text, token.column)
    return token.text


def _range(token: Token) -> str:
    """A number or range in normal form: ``02..4`` is ``2..4``, ``3..3`` is ``3``."""
    low, dots, high = token.text.partition("..")
    low, high = (digits.lstrip("0") or "0" if digits else "" for digits in (low, high))
    if not low and not high:
        raise ExpressionError("expected a number before or after `..`", token.column)
    for digits in (low, high):
        if len(digits) > len(str(MAX_NUMBER)) or int(digits or 0) > MAX_NUMBER:
            raise ExpressionError(f"expected a number of at most {MAX_NUMBER}, found a larger one", token.column)
    if low and high and int(low) > int(high):
        raise ExpressionError(f"the range {low}..{high} is empty: did you mean {high}..{low}?", token.column)
    return low if low == high else f"{low}{dots}{high}"


def _shown(token: Token) -> str:
    return f"`{token.text[:60]}`"
