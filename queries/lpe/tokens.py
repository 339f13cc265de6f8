"""Text to tokens: the first step of a compilation. White space separates tokens and means nothing, except inside quotes."""

import re
from dataclasses import dataclass

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_TEXT

PUNCTUATION = "()[]<>{}|&-^*+?.,!:;"
END = "end"


@dataclass(frozen=True)
class Token:
    """``kind``: ``letter``, ``label``, ``number``, ``end`` or the mark; after an ``@`` also ``name`` or ``range``; ``column`` counts from 1."""

    kind: str
    text: str
    column: int

    def __str__(self) -> str:
        """How messages quote the token."""
        return "the end of the expression" if self.kind == END else f"'{self.text}'" if self.kind == "label" else f"`{self.text}`"


def check_length(text: str) -> None:
    """Refuse a text that is too long to be read."""
    if len(text) > MAX_TEXT:
        raise ExpressionError(f"the expression has {len(text):,} characters; at most {MAX_TEXT:,} are read")


def tokenize(text: str, start: int = 0) -> list[Token]:
    """The tokens of an expression that begins at ``start`` (from 0), an ``end`` token last.

    >>> [token.kind for token in tokenize("C<RD'floor'>{2}L")]
    ['letter', '<', 'letter', 'letter', 'label', '>', '{', 'number', '}', 'letter', 'end']
    """
    check_length(text)
    tokens: list[Token] = []
    at = start
    while at < len(text):
        character, column = text[at], at + 1
        if character.isspace():
            at += 1
        elif character in PUNCTUATION:
            tokens.append(Token(character, character, column))
            at += 1
        elif character == "@":
            tokens.append(Token("@", "@", column))
            at = _predicate(text, at + 1, tokens)
        elif character == "'":
            label, at = _label(text, at)
            tokens.append(Token("label", label, column))
        elif character.isascii() and character.isdigit():
            end = at
            while end < len(text) and text[end].isascii() and text[end].isdigit():
                end += 1
            tokens.append(Token("number", text[at:end], column))
            at = end
        elif character.isascii() and character.isalpha():
            tokens.append(Token("letter", character, column))
            at += 1
        else:
            shown = character if character.isprintable() else f"U+{ord(character):04X}"
            raise ExpressionError(f"expected a symbol, a quoted label or an operator, found `{shown}`", column)
    tokens.append(Token(END, "", len(text) + 1))
    return tokens


# What may follow `@`, each after any white space; a range is read as far as it goes, `2..` included.
_NAME = r"[A-Za-z_][A-Za-z0-9_]*"
_PREDICATE = (
    (("!", r"!"),),
    (("name", _NAME), ("label", "'")),
    ((":", ":"),),
    (("range", r"[0-9]*\.\.[0-9]*|[0-9]+"), ("name", _NAME), ("label", "'")),
)


def _predicate(text: str, at: int, tokens: list[Token]) -> int:
    """Add the tokens of one predicate, as far as there are such: ``!``, a name, ``:``, a value. Where the text goes on."""
    for place, kinds in enumerate(_PREDICATE):
        begin = at
        while begin < len(text) and text[begin].isspace():
            begin += 1
        for kind, pattern in kinds:
            if found := re.compile(pattern).match(text, begin):
                value, at = _label(text, begin) if kind == "label" else (found.group(), found.end())
                tokens.append(Token(kind, value, begin + 1))
                break
        else:
            if place > 0:  # only the `!` may be left out
                return at
    return at


def _label(text: str, at: int) -> tuple[str, int]:
    """The label whose opening quote is at ``at``, and where the text goes on; a backslash takes the next character as it is."""
    label: list[str] = []
    end = at + 1
    while end < len(text) and text[end] != "'":
        if text[end] == "\\":
            end += 1
        if end < len(text):
            if text[end] == "\0" or 0xD800 <= ord(text[end]) < 0xE000:
                raise ExpressionError(f"a label holds a character that no name can have, U+{ord(text[end]):04X}", end + 1)
            label.append(text[end])
        end += 1
    if end >= len(text):
        raise ExpressionError("the label that opens here has no closing quote `'`", at + 1)
    if not label:
        raise ExpressionError("expected a name between the quotes, found an empty label", at + 1)
    return "".join(label), end + 1
