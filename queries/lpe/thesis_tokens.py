"""Text in the thesis's notation to tokens: symbols carry their superscripts and subscripts, so the parser sees one token for ``S_j^T``."""

import re
from dataclasses import dataclass

from queries.errors import ExpressionError
from queries.lpe.tokens import END

SYMBOLS = "LOBDGSVXE"
WANTED = "a symbol (L O B first, then D G S V X, last E) or `(`"
_PUNCTUATION = "()|*+?"
_RAISED = re.compile(r"\^\s*(?:([*+?])|\{\s*([*+?])\s*\})")  # a repetition as it is typeset


@dataclass(frozen=True)
class Name:
    """A subscript: its name without braces, and the column where it stands."""

    text: str
    column: int
    braced: bool


@dataclass(frozen=True)
class ThesisToken:
    """``kind``: ``symbol``, ``{`` (a repetition, its bounds in ``text``), ``end``, or the punctuation mark itself; ``column`` counts from 1."""

    kind: str
    text: str
    column: int
    side: str = ""  # the superscript, R or T
    names: tuple[Name, ...] = ()

    def __str__(self) -> str:
        """How messages quote the token."""
        return "the end of the expression" if self.kind == END else f"`{self.text}`"


def tokenize(text: str, start: int = 0) -> list[ThesisToken]:
    """The tokens of an expression that begins at ``start`` (from 0), an ``end`` token last.

    >>> [str(token) for token in tokenize("L_lamp S_{glass ball}^T{2} E")]
    ['`L`', '`S`', '`{2}`', '`E`', 'the end of the expression']
    """
    return _Reader(text, start).tokens()


def is_bare(name: str) -> bool:
    """Whether a subscript needs no braces."""
    return bool(name) and all(_in_name(character) for character in name)


def _in_name(character: str) -> bool:
    return character.isalnum() or character in "_-."


class _Reader:
    """Goes through the text once."""

    def __init__(self, text: str, start: int) -> None:
        self.text = text
        self.at = start

    def tokens(self) -> list[ThesisToken]:
        """All tokens."""
        found: list[ThesisToken] = []
        while character := self.peek():
            column = self.at + 1
            if character in SYMBOLS:
                self.at += 1
                found.append(self.symbol(character, column))
            elif character in _PUNCTUATION:
                self.at += 1
                found.append(ThesisToken(character, character, column))
            elif character == "{":
                found.append(ThesisToken("{", "{" + self.braces() + "}", column))
            elif character == "^":
                found.append(self.typeset_repetition(column))
            else:
                raise ExpressionError(_unexpected(character), column)
        found.append(ThesisToken(END, "", len(self.text) + 1))
        return found

    def peek(self) -> str:
        """The next character that is not white space; empty at the end."""
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        return self.text[self.at : self.at + 1]

    def symbol(self, letter: str, column: int) -> ThesisToken:
        """A letter with its superscript and subscripts, in any order."""
        side, names = "", []
        while mark := self.peek():
            start = self.at + 1
            if mark == "_":
                self.at += 1
                names.append(self.name())
            elif mark == "^" and not self.repeats():
                self.at += 1
                found = self.superscript()
                if side:
                    raise ExpressionError(f"expected one superscript, found a second, `^{found}`", start)
                side = found
            else:
                break
        return ThesisToken("symbol", letter, column, side, tuple(names))

    def superscript(self) -> str:
        """R or T, in braces or not."""
        column = self.at + 1
        if self.peek() == "{":
            found = self.braces().strip()
        else:
            found = self.peek()
            self.at += len(found)
        if found not in ("R", "T"):
            raise ExpressionError(f"expected the superscript `R` (reflection) or `T` (transmission), found {_shown(found)}", column)
        return found

    def name(self) -> Name:
        """A subscript's name: letters, digits, `_`, `-`, `.`, or anything in braces."""
        first, column = self.peek(), self.at + 1
        if first == "{":
            name = self.braces(escapes=True)
            if not name:
                raise ExpressionError("expected a name between the braces, found `{}`", column)
            return Name(name, column, True)
        start = self.at
        while self.at < len(self.text) and _in_name(self.text[self.at]):
            self.at += 1
        if self.at == start:
            raise ExpressionError(
                f"expected a name after `_`, in braces if it has other characters (`_{{glass ball}}`), found {_shown(first)}", column
            )
        return Name(self.text[start : self.at], column, False)

    def braces(self, escapes: bool = False) -> str:
        """What stands in the braces that open here; with ``escapes`` a backslash takes the next character as it is."""
        opened, inside = self.at, []
        self.at += 1
        while self.at < len(self.text) and self.text[self.at] != "}":
            if escapes and self.text[self.at] == "\\":
                self.at += 1
            character = self.text[self.at : self.at + 1]
            if character == "\0" or 0xD800 <= ord(character or " ") < 0xE000:
                raise ExpressionError(f"expected a name, found a character that no name can have, U+{ord(character):04X}", self.at + 1)
            inside.append(character)
            self.at += 1
        if self.at >= len(self.text):
            raise ExpressionError("expected `}` to close the `{` of this column, found the end of the expression", opened + 1)
        self.at += 1
        return "".join(inside)

    def repeats(self) -> bool:
        """Whether the `^` here raises a repetition, as typeset in `(D|G|S)^*` and `(D|G|S)^{*}`, and no superscript."""
        return _RAISED.match(self.text, self.at) is not None

    def typeset_repetition(self, column: int) -> ThesisToken:
        """The repetition that a `^` raises."""
        found = _RAISED.match(self.text, self.at)
        if found is None:
            self.at += 1
            wanted = "`^R` or `^T` after a symbol, or a raised repetition such as `^*`"
            raise ExpressionError(f"expected {wanted}, found `^` and {_shown(self.peek())}", column)
        self.at = found.end()
        mark = found[1] or found[2]
        return ThesisToken(mark, mark, column)


def _shown(found: str) -> str:
    if not found:
        return "the end of the expression"
    return f"`{found[:20]}`" if found.isprintable() else f"U+{ord(found[0]):04X}"


def _unexpected(character: str) -> str:
    if character in "RT":
        return f"expected {WANTED}, found `{character}`: the notation writes it as a superscript, and any scattering of that kind is `X^{character}`"
    if character == "C":
        return f"expected {WANTED}, found `C`: the notation begins at the light and ends at the eye, `E`"
    place = ": value prefixes and their `;` come before everything else" if character == ";" else ""
    return f"expected {WANTED}, found {_shown(character)}{place}"
