"""The thesis's light-first notation (Heckbert's with object ids) to a syntax tree, in the order that it is written.

::

    expression := path { "|" path }
    path       := "(" expression ")" | source item* "E"
    source     := emitter | "(" emitter { "|" emitter } ")"
    item       := atom [ "*" | "+" | "?" | "{n}" | "{n,}" | "{,m}" | "{n,m}" ]      ("^*" and "^{*}" are "*", as it is typeset)
    atom       := scatterer | "(" item+ { "|" item+ } ")"
    emitter    := ( "L" | "O" | "B" ) subscript*
    scatterer  := ( "D" | "G" | "S" | "X" ) ( "^R" | "^T" | subscript )* | "V" subscript*
    subscript  := "_name" | "_{any name}"

``X`` is any interaction. A bare ``R`` or ``T`` is no symbol: any reflection is ``X^R``. A subscript's name is an object or a region,
whichever is known; several subscripts must all hold. Where nothing is known, it is a region on ``X`` and an object on ``D G S V``. On an
emitter it is the light's name, or a region if only a region of this name is known. Where only objects or only regions are known, any other
name is taken to be of the other kind. White space ends a name and else means nothing.
Value prefixes may stand before all that, as in ``unoccluded; L D E``.
"""

import difflib
import re
from collections.abc import Collection

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_NESTING, MAX_REPEAT
from queries.lpe.names import Known
from queries.lpe.parser import Parsed
from queries.lpe.prefixes import read_prefixes
from queries.lpe.syntax import EMITTER_TYPES, Node, Repeat, Step, Test, choice, sequence, step
from queries.lpe.thesis_tokens import Name, ThesisToken, tokenize
from queries.lpe.tokens import END, check_length

_INTERACTIONS = frozenset("RTV")
_BOUNDS = re.compile(r"\s*(\d*)\s*(,?)\s*(\d*)\s*", re.ASCII)


def parse(text: str, objects: Collection[str] | None = None, regions: Collection[str] | None = None) -> Parsed:
    """The syntax tree of an expression, light first as written.

    ``objects`` (objects, materials and emitters) and ``regions``: the names that exist; None where they are not known. Raises
    ``ExpressionError`` with the column and what was expected there.

    >>> from queries.lpe.direction import camera_first
    >>> from queries.lpe.limits import Work
    >>> camera_first(parse("L D S E").tree, Work()).parts[1]
    Step(tests=(Test(field='scattering', names=frozenset({'S'}), mode='in', position=None),))
    """
    check_length(text)
    prefixes, start = read_prefixes(text)
    parser = _Parser(tokenize(text, start), objects, regions)
    tree = parser.expression()
    if parser.token.kind != END:
        raise ExpressionError(f"expected `|` or the end of the expression after `E`, found {parser.token}", parser.token.column)
    return Parsed(tree, (), prefixes)


class _Parser:
    """Recursive descent with one token of lookahead; a bracket at the start of a path looks for the ``E`` inside."""

    def __init__(self, tokens: list[ThesisToken], objects: Collection[str] | None, regions: Collection[str] | None) -> None:
        self.tokens = tokens
        self.objects = None if objects is None else frozenset(objects)
        self.known = Known(objects)
        self.regions = None if regions is None else frozenset(regions)
        self.at = 0
        self.nesting = 0

    @property
    def token(self) -> ThesisToken:
        """The next token."""
        return self.tokens[self.at]

    def take(self, *kinds: str) -> ThesisToken | None:
        """The next token if it is of one of the kinds, and go past it; else None."""
        token = self.token
        if token.kind not in kinds:
            return None
        self.at += 1
        return token

    def open(self) -> ThesisToken | None:
        """The opening bracket if one is next, and go past it."""
        opened = self.take("(")
        self.nesting += opened is not None
        if opened and self.nesting > MAX_NESTING:
            raise ExpressionError(f"brackets are nested more than {MAX_NESTING} deep", opened.column)
        return opened

    def close(self, opened: ThesisToken) -> None:
        """Go past the closing bracket of ``opened``."""
        if not self.take(")"):
            raise ExpressionError(f"expected `)` to close the `(` of column {opened.column}, found {self.token}", self.token.column)
        self.nesting -= 1

    # --- whole paths ----------------------------------------------------------------------------------------------

    def expression(self) -> Node:
        """Alternatives, which bind loosest."""
        parts = [self.path()]
        while self.take("|"):
            parts.append(self.path())
        return choice(parts)

    def path(self) -> Node:
        """From a light to the eye."""
        if self.token.kind == "(" and self.holds_paths():
            opened = self.open()
            assert opened
            inner = self.expression()
            self.close(opened)
            return inner
        parts = [self.source()]
        while not (self.token.kind == "symbol" and self.token.text == "E"):
            if self.token.kind == END:
                wanted = "an interaction (D G S V X), `(` or the eye `E`"
                raise ExpressionError(f"expected {wanted}, found {self.token}{self.swallowed()}", self.token.column)
            parts.append(self.item())
        eye = self.token
        if eye.side or eye.names:
            raise ExpressionError("expected the eye `E` without superscript or subscript", eye.column)
        self.at += 1
        return sequence([*parts, step(Test("type", frozenset("C")))])

    def holds_paths(self) -> bool:
        """Whether the bracket that opens here holds the eye: whole paths, not sources."""
        depth = 0
        for token in self.tokens[self.at :]:
            depth += (token.kind == "(") - (token.kind == ")")
            if depth == 0:
                return False
            if token.kind == "symbol" and token.text == "E":
                return True
        return False

    def swallowed(self) -> str:
        """A hint where the last name may hold the eye: ``X_pE`` is one symbol."""
        before = self.tokens[self.at - 1]
        last = before.names[-1] if before.names else None
        if last is None or last.braced or len(last.text) < 2 or not last.text.endswith("E"):
            return ""
        return f"; the name of column {last.column} is `{last.text}`: put a space where a name ends, `{last.text[:-1]} E`"

    def source(self) -> Node:
        """The emitters that a path may start from."""
        opened = self.open()
        if opened is None:
            return self.emitter()
        parts = [self.emitter()]
        while self.take("|"):
            parts.append(self.emitter())
        self.close(opened)
        if self.token.kind in ("*", "+", "?", "{"):
            raise ExpressionError(f"an emitter comes once, expected no repetition, found {self.token}", self.token.column)
        return choice(parts)

    def emitter(self) -> Step:
        """One light, glowing object or background."""
        token = self.token
        if token.kind != "symbol" or token.text not in EMITTER_TYPES:
            raise ExpressionError(f"expected a light first (L, or O or B), found {token}", token.column)
        if token.side:
            raise ExpressionError(f"expected `{token.text}` without superscript: light does not scatter there", token.column)
        self.at += 1
        if self.token.kind in ("*", "+", "?", "{"):
            raise ExpressionError(f"an emitter comes once, expected no repetition, found {self.token}", self.token.column)
        return step(Test("type", frozenset(token.text)), *(self.named(name, "light", "light") for name in token.names))

    # --- interactions ---------------------------------------------------------------------------------------------

    def item(self) -> Node:
        """An atom and how often it comes."""
        atom = self.atom()
        times = self.repetition()
        if times is None:
            return atom
        if self.token.kind in ("*", "+", "?", "{"):
            raise ExpressionError(f"expected one repetition, found a second, {self.token}: put the first in brackets", self.token.column)
        return Repeat(atom, *times)

    def atom(self) -> Node:
        """One interaction, or a bracket of them."""
        token = self.token
        if opened := self.open():
            parts = [self.items()]
            while self.take("|"):
                parts.append(self.items())
            self.close(opened)
            return choice(parts)
        if token.kind == "symbol" and token.text in "DGSVX":
            self.at += 1
            return self.scatterer(token)
        place = "; emitters stand first and the eye `E` last" if token.kind == "symbol" else ""
        raise ExpressionError(f"expected an interaction (D G S V X) or `(`, found {token}{place}", token.column)

    def items(self) -> Node:
        """Items one after another, inside a bracket."""
        parts = [self.item()]
        while self.token.kind not in ("|", ")", END):
            parts.append(self.item())
        return sequence(parts)

    def scatterer(self, token: ThesisToken) -> Step:
        """An interaction with its superscript and its subscripts."""
        if token.text == "V" and token.side:
            raise ExpressionError("expected `V` without superscript: scattering in a volume is neither reflection nor transmission", token.column)
        types = frozenset(token.side or "V") if token.side or token.text == "V" else _INTERACTIONS if token.text == "X" else None
        kind = Test("scattering", frozenset(token.text)) if token.text in "DGS" else None
        unknown = "region" if token.text == "X" else "object"
        return step(Test("type", types) if types else None, kind, *(self.named(name, "object", unknown) for name in token.names))

    def named(self, name: Name, kind: str, unknown: str) -> Test:
        """The test of a subscript: ``kind`` where the name is known as an object, ``unknown`` where nothing is known."""
        is_object = self.objects is not None and name.text in self.objects
        is_region = self.regions is not None and name.text in self.regions
        wanted = f"expected the name of an object or of a region, found `{name.text}`"
        if is_object and is_region:
            raise ExpressionError(f"{wanted}, which is both: rename the region", name.column)
        if is_object or is_region:
            if is_object:
                self.known.check(kind, name.text, name.column)
            return Test(kind if is_object else "region", frozenset({name.text}))
        if self.objects is not None and self.regions is not None:
            raise ExpressionError(f"{wanted}, which is neither{self.nearest(name)}", name.column)
        # One side is not known, so the name is taken to be of that side.
        if self.objects is not None:
            unknown = "region"
        elif self.regions is not None:
            unknown = kind
        return Test(unknown, frozenset({name.text}))

    def nearest(self, name: Name) -> str:
        """A hint at what the author may have meant."""
        known = sorted((self.objects or frozenset()) | (self.regions or frozenset()))
        started = [other for other in known if not name.braced and name.text.startswith(other) and set(name.text[len(other) :]) <= set("DGSVXE")]
        if started:
            longest = max(started, key=len)
            return f"; put a space where the name ends: `{longest} {name.text[len(longest) :]}`"
        close = difflib.get_close_matches(name.text[:100], known, n=1)
        return f"; did you mean `{close[0]}`?" if close else ""

    # --- repetitions ----------------------------------------------------------------------------------------------

    def repetition(self) -> tuple[int, int | None] | None:
        """The bounds of a repetition, or None where there is none."""
        token = self.take("*", "+", "?", "{")
        if token is None:
            return None
        if token.kind != "{":
            return {"*": (0, None), "+": (1, None), "?": (0, 1)}[token.kind]
        bounds = _BOUNDS.fullmatch(token.text[1:-1])
        if bounds is None or not (bounds[1] or bounds[3]) or (bounds[3] and not bounds[2]):
            raise ExpressionError(f"expected a repetition such as {{2}}, {{2,}}, {{,3}} or {{2,3}}, found `{token.text[:20]}`", token.column)
        low = _number(bounds[1], token.column) if bounds[1] else 0
        high = _number(bounds[3], token.column) if bounds[3] else None if bounds[2] else low
        if high is not None and high < low:
            raise ExpressionError(f"expected a range whose first bound is the smaller one, found `{token.text}`", token.column)
        return low, high


def _number(digits: str, column: int) -> int:
    digits = digits.lstrip("0") or "0"
    if len(digits) > 6 or int(digits) > MAX_REPEAT:
        raise ExpressionError(f"expected a repetition of at most {MAX_REPEAT}, found a larger number", column)
    return int(digits)
