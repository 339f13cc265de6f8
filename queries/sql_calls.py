"""``lpe('…')`` in SQL text: found and replaced by the names of views, before DuckDB reads the text.

The scanner knows just enough of SQL to leave alone what is no code: strings, quoted names, dollar-quoted text and comments.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from queries.errors import QueryError

TABLES = {"lpe": "paths", "lpe_occluded": "occluded"}
_TOKEN = re.compile(
    r"""(?P<space>\s+|--[^\n]*)
      | (?P<comment>/\*)
      | (?P<string>(?:\b[eE])?'(?:[^']|'')*')
      | (?P<name>"(?:[^"]|"")*")
      | (?P<dollar>\$(?:[A-Za-z_\x80-\U0010ffff][\w\x80-\U0010ffff]*)?\$)
      | (?P<word>[^\W\d][\w$]*)
      | (?P<other>\d[\w.]*|.)""",
    re.VERBOSE | re.DOTALL,
)
_ESCAPED = re.compile(r"[eE]'(?:[^'\\]|''|\\.)*'", re.DOTALL)
_COMMENT_MARK = re.compile(r"/\*|\*/")
_CODE = ("string", "name", "dollar", "word", "other")


@dataclass(frozen=True)
class Call:
    """One ``lpe('…')``: which function, the expression, the dialect."""

    function: str
    text: str
    dialect: str = "std"

    @property
    def table(self) -> str:
        """The table whose rows it selects."""
        return TABLES[self.function]


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    start: int
    end: int


def replace_calls(sql: str, view: Callable[[Call, str], str]) -> str:
    """The text with each call replaced by what ``view(call, source text)`` says. Raises QueryError for calls of other arguments.

    >>> replace_calls("SELECT 'lpe(1)' FROM lpe('C D L', 'osl') -- lpe('x')", lambda call, source: f"[{call.text} {call.dialect}]")
    "SELECT 'lpe(1)' FROM [C D L osl] -- lpe('x')"
    """
    tokens = list(_tokens(sql))
    pieces, done, i = [], 0, 0
    while i < len(tokens):
        token = tokens[i]
        following = tokens[i + 1].text if i + 1 < len(tokens) else ""
        before = tokens[i - 1].text if i else ""
        if token.kind == "word" and token.text.lower() in TABLES and following == "(" and before != ".":
            call, last = _call(tokens, i)
            source = sql[token.start : tokens[last].end]
            pieces += [sql[done : token.start], view(call, source)]
            done, i = tokens[last].end, last
        i += 1
    return "".join([*pieces, sql[done:]])


def _call(tokens: list[_Token], first: int) -> tuple[Call, int]:
    """The call that begins at a token, and its last token."""
    function = tokens[first].text.lower()
    arguments: list[str] = []
    at = first + 2
    while at + 1 < len(tokens) and tokens[at].kind in ("string", "dollar") and tokens[at + 1].text in (",", ")") and len(arguments) < 2:
        arguments.append(_value(tokens[at]))
        if tokens[at + 1].text == ")":
            return Call(function, *arguments), at + 1
        at += 2
    raise QueryError(f"expected {function}('expression') or {function}('expression', 'dialect'), both as text in quotes, as in {function}('C D L')")


def _value(token: _Token) -> str:
    """What a string literal means."""
    if token.kind == "dollar":
        mark = token.text[: token.text.index("$", 1) + 1]
        return token.text[len(mark) : -len(mark)]
    if token.text[0] in "eE":
        raise QueryError("expected an expression in plain quotes, as in lpe('C D L'), found a string with escapes")
    return token.text[1:-1].replace("''", "'")


def _tokens(sql: str) -> Iterator[_Token]:
    """Tokens that are code, in order. Text that never ends, such as a string without its quote, is passed over: DuckDB refuses it."""
    at = 0
    while at < len(sql):
        match = _TOKEN.match(sql, at)
        if match is None or match.lastgroup is None:
            return
        kind, end = match.lastgroup, match.end()
        if kind == "string" and sql[at] in "eE":
            escaped = _ESCAPED.match(sql, at)
            if escaped is None:
                return
            end = escaped.end()
        elif kind == "comment":
            end = _comment_end(sql, at)
        elif kind == "dollar":
            closing = sql.find(match.group(), end)
            if closing < 0:
                return
            end = closing + len(match.group())
        elif kind == "other" and sql[at] in "'\"":
            return
        if kind in _CODE:
            yield _Token(kind, sql[at:end], at, end)
        at = end


def _comment_end(sql: str, start: int) -> int:
    """Where a comment ends; comments nest."""
    depth = 0
    for mark in _COMMENT_MARK.finditer(sql, start):
        depth += 1 if mark.group() == "/*" else -1
        if depth == 0:
            return mark.end()
    return len(sql)
