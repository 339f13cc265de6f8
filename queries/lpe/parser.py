"""Tokens to syntax tree, for the standard notation: one method for each rule of the grammar.

::

    expression := exclusive { "|" exclusive }
    exclusive  := both { "^" both }
    both       := chain { ( "&" | "-" ) chain }
    chain      := item item*
    item       := atom predicate* [ "*" | "+" | "?" | "{n}" | "{n,}" | "{,m}" | "{n,m}" ]
    atom       := "(" expression ")" | "[" item { ["|"] item } "]" | "[^" symbol+ "]" | "<" group ">"
                | letter | "." | label | "!" label
    group      := [ field [ field ( field | "!" label )* ] ]     (event type, scattering type, labels)
    field      := symbol | "." | "[" symbol+ "]" | "[^" symbol+ "]"
    predicate  := "@" …                                          (see ``predicates``)

Before all that may stand value prefixes (see ``prefixes``).
``&``, ``-`` and ``^`` combine whole expressions only. ``X`` is any interaction, ``E`` the eye (the camera).
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_NESTING, MAX_REPEAT
from queries.lpe.names import Known
from queries.lpe.predicates import with_predicates
from queries.lpe.prefixes import read_prefixes
from queries.lpe.syntax import EVENT_TYPES, SCATTERING_TYPES, Choice, Combination, Node, Repeat, Step, Test, choice, sequence, step
from queries.lpe.tokens import END, Token, check_length, tokenize

_INTERACTIONS = frozenset("RTV")
_SYMBOL = "a symbol (C R T V L O B, D G S s, X, E, `.`), a quoted label, `(`, `[` or `<`"
_CHAIN_ENDS = (")", "]", "|", "&", "-", "^", END)


@dataclass(frozen=True)
class Parsed:
    """A tree, what the reader of the text should know about how it was understood, and the value prefixes before it."""

    tree: Node
    warnings: tuple[str, ...]
    prefixes: tuple[str, ...] = ()


def parse(text: str, objects: Collection[str] | None = None, regions: Collection[str] | None = None) -> Parsed:
    """The syntax tree of an expression; raises ``ExpressionError`` with the column and what was expected there.

    ``objects``, ``regions``: the names that exist (see ``Known``).
    """
    check_length(text)
    prefixes, start = read_prefixes(text)
    parser = _Parser(tokenize(text, start), Known(objects, regions))
    tree = parser.expression()
    if parser.token.kind != END:
        raise ExpressionError(f"expected the end of the expression, found {parser.token}{_hint(parser.token)}", parser.token.column)
    return Parsed(tree, tuple(dict.fromkeys(parser.warnings)), prefixes)


def _hint(token: Token) -> str:
    """What to do about a mark that stands in a wrong place."""
    if token.kind == "@":
        return ": predicates come right after a symbol and before its repetition, as in `X@P*` or `.@object:ball`"
    return ": value prefixes and their `;` come before everything else" if token.kind == ";" else ""


def combines(node: Node) -> bool:
    """Whether a tree holds a Boolean combination, which only whole expressions may."""
    return isinstance(node, Combination) or (isinstance(node, Choice) and any(combines(part) for part in node.parts))


class _Parser:
    """Recursive descent with one token of lookahead."""

    def __init__(self, tokens: list[Token], known: Known) -> None:
        self.tokens = tokens
        self.known = known
        self.at = 0
        self.nesting = 0
        self.warnings: list[str] = []

    @property
    def token(self) -> Token:
        """The next token."""
        return self.tokens[self.at]

    def take(self, *kinds: str) -> Token | None:
        """The next token if it is of one of the kinds, and go past it; else None."""
        token = self.token
        if token.kind not in kinds:
            return None
        self.at += 1
        return token

    def expect(self, kind: str, opened: Token) -> None:
        """Go past the closing bracket of ``opened``."""
        if not self.take(kind):
            raise ExpressionError(f"expected `{kind}` to close the `{opened.text}` of column {opened.column}, found {self.token}", self.token.column)

    def enter(self, opened: Token) -> None:
        """Count one more bracket inside a bracket."""
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise ExpressionError(f"brackets are nested more than {MAX_NESTING} deep", opened.column)

    # --- whole expressions ----------------------------------------------------------------------------------------

    def expression(self) -> Node:
        """Alternatives, which bind loosest."""
        parts = [self.exclusive()]
        while self.take("|"):
            parts.append(self.exclusive())
        return choice(parts)

    def exclusive(self) -> Node:
        """Either, not both."""
        return self._combination(("^",), self.both)

    def both(self) -> Node:
        """And; and not."""
        return self._combination(("&", "-"), self.chain)

    def _combination(self, operators: tuple[str, ...], operand: Callable[[], Node]) -> Node:
        first = operand()
        rest: list[tuple[str, Node]] = []
        while operator := self.take(*operators):
            rest.append((operator.kind, operand()))
        return Combination(first, tuple(rest)) if rest else first

    def chain(self) -> Node:
        """Items one after another."""
        start = self.token
        parts = [self.item()]
        while self.token.kind not in _CHAIN_ENDS:
            parts.append(self.item())
        if len(parts) > 1 and any(combines(part) for part in parts):
            raise ExpressionError("`&`, `-` and `^` combine whole expressions (from camera to light), not parts of one", start.column)
        return sequence(parts)

    # --- items ----------------------------------------------------------------------------------------------------

    def item(self) -> Node:
        """An atom and how often it comes."""
        start = self.token
        atom = with_predicates(self.atom(), self, self.known)
        times = self.repetition()
        if times is None:
            return atom
        if combines(atom):
            raise ExpressionError("an expression with `&`, `-` or `^` cannot be repeated", start.column)
        if self.token.kind in ("*", "+", "?", "{"):
            raise ExpressionError(f"expected one repetition, found a second, {self.token}: put the first in brackets", self.token.column)
        return Repeat(atom, *times)

    def atom(self) -> Node:
        """One symbol or bracket."""
        token = self.token
        if opened := self.take("("):
            self.enter(opened)
            inner = self.expression()
            self.expect(")", opened)
            self.nesting -= 1
            return inner
        if opened := self.take("["):
            return self.negated(opened) if self.take("^") else self.alternatives(opened)
        if opened := self.take("<"):
            return self.group(opened)
        if self.take("."):
            return step()
        if self.take("label"):
            return step(Test("label", frozenset({token.text})))
        if self.take("!"):
            return step(self.lacking())
        if self.take("letter"):
            return step(self.bare(token))
        raise ExpressionError(f"expected {_SYMBOL}, found {token}{_hint(token)}", token.column)

    def bare(self, token: Token) -> Test:
        """What a letter outside a group tests."""
        if token.text == "X":
            return Test("type", _INTERACTIONS)
        if token.text == "E":
            return Test("type", frozenset("C"))
        if token.text in EVENT_TYPES:
            return Test("type", frozenset(token.text))
        if token.text == "x":
            raise ExpressionError("`x` (no scattering) is valid only inside `< >`: write `<.x>`", token.column)
        if token.text in SCATTERING_TYPES:
            return Test("scattering", frozenset(token.text))
        raise ExpressionError(f"expected {_SYMBOL}, found {token}", token.column)

    def alternatives(self, opened: Token) -> Node:
        """``[…]``: any one of its items."""
        self.enter(opened)
        if self.token.kind == "]":
            raise ExpressionError(f"expected {_SYMBOL}, found an empty `[]`", opened.column)
        parts: list[Node] = []
        while self.token.kind not in ("]", END):
            start = self.token
            parts.append(self.item())
            if combines(parts[-1]):
                raise ExpressionError("`&`, `-` and `^` cannot stand inside `[ ]`", start.column)
            if self.take("|") and self.token.kind in ("]", END):
                raise ExpressionError(f"expected {_SYMBOL} after `|`, found {self.token}", self.token.column)
        self.expect("]", opened)
        self.nesting -= 1
        return choice(parts)

    def negated(self, opened: Token) -> Node:
        """``[^…]`` outside a group: the kind of its symbols says which field is meant."""
        tokens = self.names(opened)
        if tokens[-1].kind == "label":
            field = "label"
        else:
            letters = [self.bare(token) for token in tokens if token.kind == "letter"]
            field = letters[-1].field
            if any(test.field != field for test in letters):
                shown = "".join(token.text for token in tokens)
                place = f"<.[^{shown}]>" if field == "scattering" else f"<[^{shown}].>"
                self.warnings.append(f"column {opened.column}: `[^{shown}]` mixes event and scattering types; as in OSL it is read as `{place}`")
        return step(self.test(field, tokens, "other"))

    # --- groups ---------------------------------------------------------------------------------------------------

    def group(self, opened: Token) -> Step:
        """``<event scattering label…>``, by position."""
        tests: list[Test | None] = []
        while self.token.kind not in (">", END):
            field = ("type", "scattering", "label")[min(len(tests), 2)]
            tests.append(self.field(field))
            if self.token.kind in ("*", "+", "?", "{"):
                raise ExpressionError(f"repetitions are not allowed inside `< >`, found {self.token}", self.token.column)
        self.expect(">", opened)
        return step(*tests)

    def field(self, field: str) -> Test | None:
        """The test of one field; None where it is ``.``. A ``.`` among the labels asks for some label."""
        token = self.token
        if self.take("."):
            return Test("label", frozenset(), "other") if field == "label" else None
        if opened := self.take("["):
            mode = "other" if self.take("^") else "in"
            return self.test(field, self.names(opened), mode)
        if field == "label" and self.take("!"):
            return self.lacking()
        if self.take("letter", "label"):
            return self.test(field, [token], "in")
        wanted = {"type": "an event type (C R T V L O B)", "scattering": "a scattering type (D G S s x)", "label": "a quoted label"}[field]
        fix = ": predicates come after the `>`" if token.kind == "@" else ""
        raise ExpressionError(f"expected {wanted}, `.`, `[` or `>`, found {token}{fix}", token.column)

    def lacking(self) -> Test:
        """The label after ``!``."""
        token = self.take("label")
        if token is None:
            raise ExpressionError(f"expected a quoted label after `!`, found {self.token}", self.token.column)
        return Test("label", frozenset({token.text}), "without")

    def names(self, opened: Token) -> list[Token]:
        """The symbols up to ``]``."""
        tokens: list[Token] = []
        while token := self.take("letter", "label"):
            tokens.append(token)
            self.take("|")
        if not tokens:
            raise ExpressionError(f"expected a letter or a quoted label, found {self.token}", self.token.column)
        self.expect("]", opened)
        return tokens

    def test(self, field: str, tokens: list[Token], mode: str) -> Test:
        """A test of one field against the names that the tokens spell."""
        names: set[str] = set()
        for token in tokens:
            if (token.kind == "label") != (field == "label"):
                wanted = {"label": "a quoted label", "type": "an event type", "scattering": "a scattering type"}[field]
                fix = f": labels come third, as in `<..{token}>`" if token.kind == "label" else ""
                raise ExpressionError(f"expected {wanted}, found {token}{fix}", token.column)
            names |= self.letter(field, token) if token.kind == "letter" else {token.text}
        return Test(field, frozenset(names), mode)

    def letter(self, field: str, token: Token) -> frozenset[str]:
        """What a letter stands for in a group. A letter of the other field is read as OSL does: it names nothing."""
        if field == "type" and token.text in "XE":
            return _INTERACTIONS if token.text == "X" else frozenset("C")
        own, other = (EVENT_TYPES, SCATTERING_TYPES) if field == "type" else (SCATTERING_TYPES, EVENT_TYPES)
        if token.text not in own + other:
            raise ExpressionError(f"expected one of {' '.join(own)}, found {token}", token.column)
        if token.text in other:
            kind = "an event type" if field == "type" else "a scattering type"
            fix = f"; did you mean `<.{token.text}>`?" if field == "type" else ""
            self.warnings.append(f"column {token.column}: {token} is no {kind.split(' ', 1)[1]}, but stands where {kind} is read{fix}")
        return frozenset(token.text)

    # --- repetitions ----------------------------------------------------------------------------------------------

    def repetition(self) -> tuple[int, int | None] | None:
        """The bounds of a repetition, or None where there is none."""
        if token := self.take("*", "+", "?"):
            return {"*": (0, None), "+": (1, None), "?": (0, 1)}[token.kind]
        opened = self.take("{")
        if opened is None:
            return None
        low = self.number()
        high = low
        if self.take(","):
            high = self.number()
            if low is None and high is None:
                raise ExpressionError(f"expected a number, found {self.token}", self.token.column)
        elif low is None:
            raise ExpressionError(f"expected a number or `,`, found {self.token}", self.token.column)
        self.expect("}", opened)
        low = low or 0
        if high is not None and high < low:
            self.warnings.append(f"column {opened.column}: the range {{{low},{high}}} is empty; as in OSL it is read as {{{low}}}")
            high = low
        return low, high

    def number(self) -> int | None:
        """A repetition's bound, or None where no number stands."""
        token = self.take("number")
        if token is None:
            return None
        digits = token.text.lstrip("0") or "0"
        if len(digits) > 6 or int(digits) > MAX_REPEAT:
            raise ExpressionError(f"expected a repetition of at most {MAX_REPEAT}, found a larger number", token.column)
        return int(digits)
