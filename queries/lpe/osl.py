"""OSL's notation to syntax tree: the grammar of Open Shading Language's light path expressions, character by character.

::

    lpe   := seq
    seq   := item { item | "|" item }              ("|" joins only its two neighboring items)
    item  := ( "(" seq ")" | "[" item+ "]" | "[^" sym+ "]" | "<" gitem* ">" | sym ) [ "*" | "+" | "{n}" | "{n,}" | "{n,m}" ]
    gitem := sym | "[" gitem+ "]" | "[^" sym+ "]"  (no repetition inside "<>")
    sym   := character | "." | "'" text "'"        (no escapes, no white space)

``R`` is ``<R.>``, ``D`` is ``<.D>``, ``'a'`` is ``<..'a'>``; ``[^…]`` outside a group tests the field of its last symbol. Labels count by
position: ``<RD'a''b'>`` wants ``a`` first and ``b`` second in the event's list, and lets further labels follow; ``.`` is any label.

Where OSL crashes, or silently matches nothing, this reader differs on purpose:

- ``(CDL)|(CSL)``: OSL drops all that follows a group at the start of the text; here both match, with a warning;
- ``{0}`` and ``{0,0}`` crash OSL and are the empty sequence here; ``()`` crashes it too, and is an error here, as are ``[]`` and ``''``;
- inside ``<>``, OSL takes any character for a symbol that no event has, and reads ``(`` ``)`` as a sequence of fields. Here a letter of the
  wrong field gives a warning, as OSL would match nothing, and anything else is an error;
- further labels may have any name and number. OSL's stop after five, and may not be called ``C``, ``R``, ``D`` or another of its symbols.
"""

from typing import NamedTuple

from queries.errors import ExpressionError
from queries.lpe.limits import MAX_NESTING, MAX_REPEAT
from queries.lpe.parser import Parsed
from queries.lpe.syntax import EVENT_TYPES, SCATTERING_TYPES, Node, Repeat, Step, Test, choice, sequence, step
from queries.lpe.tokens import check_length

_BARE_SCATTERINGS = SCATTERING_TYPES.replace("x", "")
_FIELDS = ("type", "scattering", "label")
_WANTED = {"type": "an event type (C R T V L O B)", "scattering": "a scattering type (D G S s x)", "label": "a quoted label"}
_SYMBOL = "a symbol (C R T V L O B, D G S s, `.`), a quoted label, `(`, `[` or `<`"
_STANDARD = {  # what the standard dialect has and OSL has not
    "?": "OSL's notation has no `?`: write `{0,1}`, or use the standard dialect (`std`)",
    "|": "`|` joins two items outside `[ ]` and `< >`; alternatives inside `[ ]` follow one another, unless in the standard dialect (`std`)",
    "x": "`x` (no scattering) is valid only inside `< >`: write `<.x>`",
    "X": "OSL's notation has no `X`: write `[RTV]`, or use the standard dialect (`std`)",
    "E": "OSL's notation has no `E`: write `C`, or use the standard dialect (`std`)",
    "!": "OSL's notation has no `!`: use the standard dialect (`std`) for labels that are absent",
    "@": "OSL's notation has no `@`: use the standard dialect (`std`) for objects, regions and other predicates",
    ";": "OSL's notation has no prefixes: use the standard dialect (`std`)",
    "\\": "OSL's notation has no escapes: use the standard dialect (`std`)",
    **dict.fromkeys("&-^", "OSL's notation has no Boolean combinations: use the standard dialect (`std`) for `&`, `-` and `^`"),
}


class _Symbol(NamedTuple):
    """A character or quoted text, and where it stands."""

    text: str
    quoted: bool
    column: int

    def __str__(self) -> str:
        return f"'{self.text}'" if self.quoted else f"`{self.text}`"


class _Names(NamedTuple):
    """A set of names, or, where ``negated``, all names but these."""

    names: frozenset[str]
    negated: bool

    def union(self, other: "_Names") -> "_Names":
        """Names that are in either set."""
        if self.negated and other.negated:
            return _Names(self.names & other.names, True)
        if self.negated or other.negated:
            kept, added = (self, other) if self.negated else (other, self)
            return _Names(kept.names - added.names, True)
        return _Names(self.names | other.names, False)


def parse(text: str) -> Parsed:
    """The syntax tree of an expression in OSL's notation; raises ``ExpressionError`` with the column and what was expected there.

    >>> from queries.lpe.printer import show
    >>> show(parse("CD|SL").tree)
    'C[DS]L'
    >>> parse("(CDL)|(CSL)").warnings[0]
    'column 6: OSL itself drops what follows a group at the start of the text; here it is read'
    """
    check_length(text)
    parser = _Parser(text)
    tree = parser.seq(None)
    return Parsed(tree, tuple(dict.fromkeys(parser.warnings)))


class _Parser:
    """Recursive descent over the characters of the text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.nesting = 0
        self.warnings: list[str] = []

    @property
    def head(self) -> str:
        """The next character; empty at the end."""
        return self.text[self.at : self.at + 1]

    @property
    def column(self) -> int:
        """Where the next character stands, from 1."""
        return self.at + 1

    def warn(self, column: int, message: str) -> None:
        """Tell the author how the text was understood."""
        self.warnings.append(f"column {column}: {message}")

    def unexpected(self, wanted: str, hint: str = "") -> ExpressionError:
        """The error of finding something else at the head; ``hint`` says what to do instead."""
        head = self.head
        if head.isspace():
            return ExpressionError(
                f"expected {wanted}, found white space, which OSL's notation does not have: leave it out, or use the standard dialect (`std`)",
                self.column,
            )
        shown = "the end of the expression" if not head else f"`{head}`" if head.isprintable() else f"U+{ord(head):04X}"
        hint = hint or _STANDARD.get(head, "")
        return ExpressionError(f"expected {wanted}, found {shown}{'. ' if hint else ''}{hint}", self.column)

    def open(self) -> int:
        """Go past an opening bracket; its column."""
        self.nesting += 1
        if self.nesting > MAX_NESTING:
            raise ExpressionError(f"brackets are nested more than {MAX_NESTING} deep", self.column)
        self.at += 1
        return self.at

    def close(self, bracket: str, opened: int, wanted: str) -> None:
        """Go past the bracket that closes the one of column ``opened``."""
        if self.head != bracket:
            raise self.unexpected(f"{wanted} or `{bracket}` to close the `{self.text[opened - 1]}` of column {opened}")
        self.nesting -= 1
        self.at += 1

    # --- sequences and items --------------------------------------------------------------------------------------

    def seq(self, opened: int | None) -> Node:
        """Items up to the end of the text, or up to the ``)`` of the bracket that was ``opened``."""
        parts: list[list[Node]] = []  # the alternatives of each part
        leading = self.at == 0 and self.head == "("
        while self.head and not (self.head == ")" and opened):
            if self.head == "|":
                if not parts:
                    raise self.unexpected(f"{_SYMBOL} before `|`")
                self.at += 1
                parts[-1].append(self.item())
            else:
                parts.append([self.bracketed() if leading and not parts else self.item()])
        if not parts:
            raise self.unexpected(_SYMBOL)
        return sequence([choice(alternatives) if len(alternatives) > 1 else alternatives[0] for alternatives in parts])

    def bracketed(self) -> Node:
        """The item at the start of the text, which is a group: all that OSL itself reads."""
        group = self.atom()
        if self.head:
            self.warn(self.column, "OSL itself drops what follows a group at the start of the text; here it is read")
        return self.repeated(group)

    def item(self) -> Node:
        """An atom and how often it comes."""
        return self.repeated(self.atom())

    def atom(self) -> Node:
        """One symbol or bracket."""
        if self.head == "(":
            opened = self.open()
            inner = self.seq(opened)
            self.close(")", opened, _SYMBOL)
            return inner
        if self.head == "[":
            opened = self.open()
            return self.negated(opened) if self.head == "^" else self.alternatives(opened)
        if self.head == "<":
            return self.group()
        if self.head == ".":
            self.at += 1
            return step()
        if self.head == "'":
            return step(_test("label", _Names(frozenset({self.symbol().text}), False), 0))
        field = self.bare_field()
        self.at += 1
        return step(Test(field, frozenset(self.text[self.at - 1])))

    def bare_field(self) -> str:
        """What the letter at the head tests outside a group."""
        if self.head and self.head in EVENT_TYPES:
            return "type"
        if self.head and self.head in _BARE_SCATTERINGS:
            return "scattering"
        raise self.unexpected(_SYMBOL)

    def alternatives(self, opened: int) -> Node:
        """``[…]`` outside a group: any one of its items."""
        parts: list[Node] = []
        while self.head and self.head != "]":
            parts.append(self.item())
        if not parts:
            raise self.unexpected(_SYMBOL)
        self.close("]", opened, _SYMBOL)
        return choice(parts)

    def negated(self, opened: int) -> Step:
        """``[^…]`` outside a group: the last symbol says which field is meant."""
        self.at += 1
        fields: list[str] = []
        symbols: list[_Symbol] = []
        while self.head and self.head != "]":
            fields.append("label" if self.head == "'" else self.bare_field())
            symbols.append(self.symbol())
        if not symbols:
            raise self.unexpected("a letter or a quoted label")
        self.close("]", opened, "a letter, a quoted label")
        field = fields[-1]
        # Quoted text is no name of an event or scattering type, so leaving it out there changes nothing.
        names = frozenset(symbol.text for symbol in symbols if field == "label" or not symbol.quoted)
        tested = step(_test(field, _Names(names, True), 0))
        if len(set(fields)) > 1:
            letters = "".join(f"'{symbol.text}'" if symbol.quoted else symbol.text for symbol in symbols)
            place = {"type": f"<[^{letters}].>", "scattering": f"<.[^{letters}]>", "label": f"<..[^{letters}]>"}[field]
            self.warn(opened, f"`[^{letters}]` mixes event types, scattering types or labels; as in OSL the last decides: it is read as `{place}`")
        return tested

    # --- groups ---------------------------------------------------------------------------------------------------

    def group(self) -> Step:
        """``<event scattering label…>``, by position."""
        opened = self.open()
        found: list[_Names] = []
        while self.head and self.head != ">":
            found.append(self.field(_FIELDS[min(len(found), 2)]))
            if self.head and self.head in "*+{?":
                raise ExpressionError(f"repetitions are not allowed inside `< >`, found `{self.head}`", self.column)
        self.close(">", opened, _WANTED[_FIELDS[min(len(found), 2)]])
        tests = [_test(_FIELDS[min(i, 2)], names, max(i - 2, 0)) for i, names in enumerate(found)]
        # A label in some place has a label in every place before it, so `.` says something only as the last.
        return step(*(test for test in tests[:-1] if test is None or test.names), *tests[-1:])

    def field(self, field: str) -> _Names:
        """What one field may be."""
        if self.head == ".":
            self.at += 1
            return _Names(frozenset(), True)
        if self.head == "[":
            opened = self.open()
            return self.negated_names(opened, field) if self.head == "^" else self.any_of(opened, field)
        return _Names(self.name(field, False), False)

    def any_of(self, opened: int, field: str) -> _Names:
        """``[…]`` inside a group: any one of what it lists."""
        found = _Names(frozenset(), False)
        while self.head and self.head != "]":
            found = found.union(self.field(field))
        if found == (frozenset(), False):
            raise self.unexpected(f"{_WANTED[field]}, `.` or `[`")
        self.close("]", opened, _WANTED[field])
        return found

    def negated_names(self, opened: int, field: str) -> _Names:
        """``[^…]`` inside a group."""
        self.at += 1
        names: frozenset[str] = frozenset()
        while self.head and self.head != "]":
            names |= self.name(field, True)
        if not names:
            raise self.unexpected(_WANTED[field])
        self.close("]", opened, _WANTED[field])
        return _Names(names, True)

    def name(self, field: str, negated: bool) -> frozenset[str]:
        """The name that one symbol of a group spells. A letter of another field is read as OSL does: it names nothing."""
        if not self.head or self.head in "()<>|]" or (self.head != "'" and not self.head.isalpha()):
            raise self.unexpected(f"{_WANTED[field]}, `.`, `[` or `>`")
        symbol = self.symbol()
        if field == "label":
            return frozenset({self.label(symbol)})
        if symbol.text == "x" and negated:
            raise ExpressionError(
                "expected another letter, found `x`, which OSL does not take after `^`: list the others, as in `[DGSs]`", symbol.column
            )
        if symbol.text not in tuple(EVENT_TYPES + SCATTERING_TYPES) or (symbol.quoted and symbol.text == "x"):
            fix = f": labels come third, as in `<..{symbol}>`" if symbol.quoted else f". {_STANDARD[symbol.text]}" if symbol.text in _STANDARD else ""
            raise ExpressionError(f"expected {_WANTED[field]}, found {symbol}{fix}", symbol.column)
        if symbol.text not in (EVENT_TYPES if field == "type" else SCATTERING_TYPES):
            kind = "event type" if field == "type" else "scattering type"
            fix = f"; did you mean `<.{symbol.text}>`?" if field == "type" else ""
            self.warn(symbol.column, f"{symbol} is no {kind}, but stands where OSL reads one, and no event has it{fix}")
        return frozenset({symbol.text})

    def label(self, symbol: _Symbol) -> str:
        """The label that a symbol in a label's place spells."""
        if symbol == ("x", False, symbol.column):
            raise ExpressionError("expected a quoted label, found `x`, which is no label in OSL: write `'x'` for a label of this name", symbol.column)
        if not symbol.quoted:
            self.warn(symbol.column, f"{symbol} stands where a label is read: it is the label '{symbol.text}'")
        return symbol.text

    def symbol(self) -> _Symbol:
        """The character or quoted text at the head."""
        column = self.column
        if self.head != "'":
            self.at += 1
            return _Symbol(self.text[self.at - 1], False, column)
        end = self.text.find("'", self.at + 1)
        if end < 0:
            raise ExpressionError("the label that opens here has no closing quote `'`", column)
        label = self.text[self.at + 1 : end]
        for i, character in enumerate(label):
            if character == "\0" or 0xD800 <= ord(character) < 0xE000:
                raise ExpressionError(f"a label holds a character that no name can have, U+{ord(character):04X}", column + 1 + i)
        if not label:
            raise ExpressionError("expected a name between the quotes, found an empty label", column)
        self.at = end + 1
        return _Symbol(label, True, column)

    # --- repetitions ----------------------------------------------------------------------------------------------

    def repeated(self, atom: Node) -> Node:
        """The atom with the repetition at the head, if one stands there."""
        if self.head not in ("*", "+", "{"):
            return atom
        mark = self.head
        opened = self.column
        self.at += 1
        low, high = {"*": (0, None), "+": (1, None)}.get(mark) or self.bounds(opened)
        if self.head and self.head in "*+{":
            raise ExpressionError(f"expected one repetition, found a second, `{self.head}`: put the first in brackets", self.column)
        return Repeat(atom, low, high)

    def bounds(self, opened: int) -> tuple[int, int | None]:
        """What stands between ``{`` and ``}``, and go past it."""
        low = self.number()
        if low is None:
            raise self.unexpected("a number", "In OSL's notation `{,m}` of the standard dialect is `{0,m}`" if self.head == "," else "")
        high: int | None = low
        if self.head == ",":
            self.at += 1
            high = self.number()
        if self.head != "}":
            raise self.unexpected(f"`}}` to close the `{{` of column {opened}")
        self.at += 1
        if high is not None and high < low:
            self.warn(opened, f"the range {{{low},{high}}} is empty; as in OSL it is read as {{{low}}}")
            high = low
        return low, high

    def number(self) -> int | None:
        """A repetition's bound, or None where no number stands."""
        start = self.at
        while self.head.isascii() and self.head.isdigit():
            self.at += 1
        digits = self.text[start : self.at]
        if not digits:
            return None
        digits = digits.lstrip("0") or "0"
        if len(digits) > 6 or int(digits) > MAX_REPEAT:
            raise ExpressionError(f"expected a repetition of at most {MAX_REPEAT}, found a larger number", start + 1)
        return int(digits)


def _test(field: str, names: _Names, position: int) -> Test | None:
    """A test of one field; None where it may be anything."""
    mode = "other" if names.negated else "in"
    if field != "label":
        return Test(field, names.names, mode) if names.names or not names.negated else None
    return Test(field, names.names, mode, None if names == (frozenset(), True) and position == 0 else position)
