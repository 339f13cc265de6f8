"""OSL's notation: a truth table of expressions and paths, and random expressions against Python's regular expressions."""

import contextlib
import re
import time
from typing import NamedTuple

import pytest
from examples import examples
from hypothesis import given
from hypothesis import strategies as st
from words import matches, word

from queries.errors import ExpressionError
from queries.lpe import compile
from queries.lpe.osl import parse
from queries.lpe.printer import show
from queries.lpe.syntax import PathEvent

FIXED = examples(150)

TABLE = [
    # where OSL surprises: the rows of the specification
    ("(CDL)|(CSL)", ["C RD L", "C RS L"], ["C RG L", "C RD L C RS L"]),
    ("((CDL)|(CSL))", ["C RD L", "C RS L"], ["C RG L"]),
    ("CDL|CSL", ["C RD L RS L", "C RD C RS L"], ["C RD L", "C RS L"]),
    ("CD|(SD)L", ["C RD L", "C RS RD L"], ["C RS L", "C RD"]),
    ("C<RS[^'coat']>L", ["C RS:spec L", "C RS:spec:coat L"], ["C RS:coat L", "C RS L"]),
    ("C'a'L", ["C RD:a L", "C RD:a:b L"], ["C RD:b:a L", "C RD L"]),
    ("C<RD.'b'>L", ["C RD:a:b L", "C RD:b:b L", "C RD:a:b:c L"], ["C RD:b L", "C RD:b:a L"]),
    ("C<D>L", [], ["C RD L", "C L"]),
    ("C[^RD]L", ["C RS L", "C TS L"], ["C RD L", "C TD L"]),
    ("CD{3,2}L", ["C RD RD RD L"], ["C RD RD L", "C RD RD RD RD L"]),
    ("CD{0}L", ["C L"], ["C RD L"]),
    ("CD{0,0}L", ["C L"], ["C RD L"]),
    # symbols
    ("CL", ["C L"], ["C B", "C O", "C RD L", "L", "C", ""]),
    ("CDL", ["C RD L", "C TD L", "C VD L"], ["C RS L", "C L"]),
    ("C.L", ["C RD L", "C V L", "C L L"], ["C L"]),
    ("CRL", ["C RD L", "C R L"], ["C TD L"]),
    ("CVB", ["C VD B", "C V B"], ["C VD L"]),
    ("CsO", ["C Ts O"], ["C TS O"]),
    # groups
    ("C<>L", ["C RD L", "C V:fog L"], ["C L"]),
    ("C<R>L", ["C RG L", "C RG:a L"], ["C TG L"]),
    ("C<.S>L", ["C RS L", "C TS L"], ["C RD L"]),
    ("C<.x>L", ["C V L"], ["C VD L"]),
    ("<Cx>D<Lx>", ["C RD L"], ["C RD LD"]),
    ("C<[RT]S>L", ["C RS L", "C TS L"], ["C VS L", "C RD L"]),
    ("C<[R[TV]]S>L", ["C RS L", "C VS L"], ["C OS L", "C RD L"]),
    ("C<[^R].>L", ["C TD L", "C L L"], ["C RD L"]),
    ("C<[V[^RT]]>L", ["C VD L", "C L L"], ["C RD L", "C TD L"]),
    ("C<[R[^RT]]>L", ["C RD L", "C VD L"], ["C TD L"]),
    ("C<[[^RT][^TV]]>L", ["C RD L", "C VD L"], ["C TD L"]),
    ("C<[.R]D>L", ["C TD L", "C RD L"], ["C RS L"]),
    ("C<'R''D'>L", ["C RD L"], ["C RS L"]),
    ("C<.[D'G'x]>L", ["C RD L", "C RG L", "C V L"], ["C RS L"]),
    # labels count by position
    ("C<RD'a''b'>L", ["C RD:a:b L", "C RD:a:b:c L"], ["C RD:b:a L", "C RD:a L", "C RD:a:c:b L"]),
    ("C<RD.>L", ["C RD:a L", "C RD:a:b L"], ["C RD L"]),
    ("C<RD..>L", ["C RD:a:b L"], ["C RD:a L", "C RD L"]),
    ("C<RD'a'.>L", ["C RD:a:b L"], ["C RD:a L", "C RD:b:a L"]),
    ("C<RD['a''b']>L", ["C RD:a L", "C RD:b L"], ["C RD:c:a L", "C RD L"]),
    ("C<RD['a'[^'b''c']]>L", ["C RD:a L", "C RD:d L"], ["C RD:b L", "C RD:c:a L", "C RD L"]),
    ("C<RD['b'[^'b']]>L", ["C RD:a L", "C RD:b L"], ["C RD L"]),
    ("C<RDG>L", ["C RD:G L"], ["C RD:a L", "C RD L"]),
    ("C['a''b']L", ["C RD:a L", "C TS:b:a L"], ["C RD:c:a L", "C RD L"]),
    ("C[^'a']L", ["C RD:b L", "C RD:b:a L"], ["C RD:a L", "C RD L"]),
    ("C'D'L", ["C RS:D L"], ["C RD L"]),
    (r"C'a\'L", ["C RD:a\\ L"], ["C RD:a L"]),
    # lists outside groups
    ("C[DS]L", ["C RD L", "C TS L"], ["C RG L"]),
    ("C[RS]L", ["C RD L", "C TS L"], ["C TD L"]),
    ("C[<RD><TS>]L", ["C RD L", "C TS L"], ["C RS L", "C TD L"]),
    ("C[D(SS)G*]L", ["C RD L", "C TS TS L", "C L", "C RG RG L"], ["C TS L", "C RD RD L"]),
    ("C[^D]L", ["C RS L", "C V L"], ["C RD L"]),
    ("C[^DR]L", ["C TD L"], ["C RS L", "C RD L"]),
    ("C[^'a'D]L", ["C RS:a L", "C V L"], ["C RD L", "C TD:b L"]),
    ("C[^D'a']L", ["C RD:b L"], ["C RD:a L", "C RS:D L", "C RD L"]),
    # repetitions
    ("CD*L", ["C L", "C RD L", "C RD TD RD L"], ["C RS L"]),
    ("CD+L", ["C RD L", "C RD RD L"], ["C L"]),
    ("CD{2}L", ["C RD RD L"], ["C RD L", "C RD RD RD L"]),
    ("CD{2,}L", ["C RD RD L", "C RD RD RD L"], ["C RD L"]),
    ("CD{0,}L", ["C L", "C RD RD L"], ["C RS L"]),
    ("CD{1,2}L", ["C RD L", "C RD RD L"], ["C L", "C RD RD RD L"]),
    ("CD{0,1}L", ["C L", "C RD L"], ["C RD RD L"]),
    ("C(DS)*L", ["C L", "C RD RS RD TS L"], ["C RD L"]),
    ("C(D*S)+L", ["C RS L", "C RD RD RS RS L"], ["C L", "C RS RD L"]),
    # `|` joins its two neighbors, repetitions included
    ("CD|SL", ["C RD L", "C RS L"], ["C RD", "C RG L"]),
    ("CD|S|GL", ["C RD L", "C RS L", "C RG L"], ["C Ts L"]),
    ("CD*|S+L", ["C L", "C RD RD L", "C RS RS L"], ["C RD RS L"]),
    ("C[DS]|GL", ["C RD L", "C RS L", "C RG L"], ["C Ts L"]),
    ("C(D|S)|(GG)L", ["C RD L", "C RS L", "C RG RG L"], ["C RG L"]),
    ("C(DS|G)L", ["C RD RS L", "C RD RG L"], ["C RG L", "C RD L"]),
    # the direction is as written
    ("LDC", ["L RD C"], ["C RD L"]),
    ("(C)DL", ["C RD L"], ["C"]),
]


@pytest.mark.parametrize(("expression", "yes", "no"), TABLE, ids=[row[0] for row in TABLE])
def test_truth_table(expression: str, yes: list[str], no: list[str]) -> None:
    tree = parse(expression).tree
    compiled = compile(expression, dialect="osl")
    for accepts in (compiled.accepts, lambda events: matches(tree, events)):
        assert [text for text in yes if not accepts(word(text))] == []
        assert [text for text in no if accepts(word(text))] == []


ERRORS = [
    ("", 1, "expected a symbol"),
    ("C()L", 3, "found `)`"),
    ("()", 2, "found `)`"),
    ("C[]L", 3, "found `]`"),
    ("C[^]L", 4, "found `]`"),
    ("CD?L", 3, "standard dialect (`std`)"),
    ("C D L", 2, "white space"),
    ("CDL ", 4, "white space"),
    ("C[D|S]L", 4, "standard dialect (`std`)"),
    ("C[^D|S]L", 5, "standard dialect (`std`)"),
    ("C<R*D>L", 4, "repetitions are not allowed inside"),
    ("C<R{2}>L", 4, "repetitions are not allowed inside"),
    ("C<R D>L", 4, "white space"),
    ("C<R|T>L", 4, "found `|`"),
    ("C<R<D>>L", 4, "found `<`"),
    ("C<R(D)>L", 4, "found `(`"),
    ("C<Q>L", 3, "found `Q`"),
    ("C<XD>L", 3, "write `[RTV]`"),
    ("C<'a'>L", 3, "labels come third"),
    ("C<R'x'>L", 4, "labels come third"),
    ("C<RDx>L", 5, "write `'x'`"),
    ("C<R[^x]>L", 6, "`[DGSs]`"),
    ("C<[]>L", 4, "found `]`"),
    ("C<[^.]>L", 5, "found `.`"),
    ("C<RD", 5, "to close the `<` of column 2"),
    ("C<R[DG", 7, "to close the `[` of column 4"),
    ("C[DG", 5, "to close the `[` of column 2"),
    ("C[^DG", 6, "to close the `[` of column 2"),
    ("(CD", 4, "to close the `(` of column 1"),
    ("CDL)", 4, "found `)`"),
    ("C[^.]L", 4, "found `.`"),
    ("CxL", 2, "inside `< >`"),
    ("CXL", 2, "write `[RTV]`"),
    ("LDE", 3, "write `C`"),
    ("CQL", 2, "found `Q`"),
    ("C!'a'L", 2, "absent"),
    ("CX@PL", 2, "write `[RTV]`"),
    ("CD@PL", 3, "regions"),
    ("CDL&CSL", 4, "Boolean"),
    ("CDL-CSL", 4, "Boolean"),
    ("CDL^CSL", 4, "Boolean"),
    ("unoccluded;CDL", 1, "found `u`"),
    ("|CDL", 1, "before `|`"),
    ("C(|D)L", 3, "before `|`"),
    ("CDL|", 5, "end of the expression"),
    ("C||L", 3, "found `|`"),
    ("CD**L", 4, "found a second"),
    ("CD{2}+L", 6, "found a second"),
    ("*L", 1, "found `*`"),
    ("CD{}L", 4, "expected a number"),
    ("CD{,2}L", 4, "`{0,m}`"),
    ("CD{2,1,}L", 7, "to close the `{` of column 3"),
    ("CD{2L", 5, "to close the `{` of column 3"),
    ("CD{1001}L", 4, "at most 1000"),
    ("CD{2," + "9" * 5000 + "}L", 6, "at most 1000"),
    ("C''L", 2, "empty label"),
    ("C'aL", 2, "no closing quote"),
    (r"C'o\'b'L", 6, "found `b`"),
    ("C'a\0'L", 4, "U+0000"),
    ("C\0L", 2, "U+0000"),
    ("CëL", 2, "found `ë`"),
    ("C²L", 2, "found `²`"),
    ("(" * 100, 61, "nested more than"),
    ("[" * 100, 61, "nested more than"),
    ("<" + "[" * 100, 61, "nested more than"),
    ("C" * 30_000, 0, "20,000"),
]


@pytest.mark.parametrize(("text", "column", "message"), ERRORS, ids=[repr(row[0][:20]) for row in ERRORS])
def test_errors_say_where_and_what_was_expected(text: str, column: int, message: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        parse(text)
    assert raised.value.column == column
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("(CDL)|(CSL)", "column 6: OSL itself drops"),
        ("(CD)*L", "column 5: OSL itself drops"),
        ("C[^RD]L", "column 2: `[^RD]` mixes event types, scattering types or labels; as in OSL the last decides: it is read as `<.[^RD]>`"),
        ("C[^D'a']L", "read as `<..[^D'a']>`"),
        ("C[^'a'D]L", "read as `<.[^'a'D]>`"),
        ("CD{3,2}L", "column 3: the range {3,2} is empty; as in OSL it is read as {3}"),
        ("C<D>L", "column 3: `D` is no event type, but stands where OSL reads one, and no event has it; did you mean `<.D>`?"),
        ("C<[^RD].>L", "column 6: `D` is no event type"),
        ("C<RT>L", "column 4: `T` is no scattering type"),
        ("C<RDG>L", "column 5: `G` stands where a label is read: it is the label 'G'"),
    ],
)
def test_warnings(text: str, warning: str) -> None:
    assert any(warning in found for found in parse(text).warnings)


@pytest.mark.parametrize("text", ["CDL", "((CDL)|(CSL))", "(CDL)", "C<RD.'b'>+L", "C[^DS]*L", "C[^'a''b']L", "CD|SL", "CD{0}L", "C<.x>L"])
def test_no_warning_without_cause(text: str) -> None:
    assert parse(text).warnings == ()


# --- random expressions -------------------------------------------------------------------------------------------


class Sample(NamedTuple):
    """An expression in OSL's notation and as a regular expression over the symbols of a path, as OSL itself reads paths."""

    text: str
    pattern: str


STOP = r"(?:<\w+>)*;"  # further labels, and the end of the event
SYMBOLS = [
    Sample(".", ".." + STOP),
    Sample("R", "R." + STOP),
    Sample("D", ".D" + STOP),
    Sample("'a'", "..<a>" + STOP),
    Sample("[^'a''b']", r"..<(?!a>|b>)\w+>" + STOP),
    Sample("[^RT]", "[^RT]." + STOP),
    Sample("[^D]", ".[^D]" + STOP),
    Sample("[^RD]", ".[^RD]" + STOP),
    Sample("[^DR]", "[^RD]." + STOP),
]
TYPES = [Sample("R", "R"), Sample(".", "."), Sample("[RT]", "[RT]"), Sample("[^T]", "[^T]"), Sample("[V[^RT]]", "[^RT]"), Sample("D", "D")]
SCATTERINGS = [Sample("S", "S"), Sample(".", "."), Sample("x", "x"), Sample("[D'G']", "[DG]"), Sample("[^D]", "[^D]"), Sample("[.S]", ".")]
LABELS = [
    Sample("'a'", "<a>"),
    Sample(".", r"<\w+>"),
    Sample("['a''b']", "<[ab]>"),
    Sample("[^'a']", r"<(?!a>)\w+>"),
    Sample("['a'[^'a''b']]", r"<(?!b>)\w+>"),
]


def group(fields: tuple[list[Sample], list[Sample]]) -> Sample:
    """``<…>`` of up to two letters and, behind both, labels; what is left out is anything."""
    found = [*fields[0], *(fields[1] if len(fields[0]) == 2 else [])]
    return Sample(f"<{''.join(field.text for field in found)}>", "".join(field.pattern for field in found) + "." * (2 - len(fields[0])) + STOP)


def joined(found: list[tuple[bool, Sample]]) -> Sample:
    """Items one after another, each joined with the one before it by ``|`` where the flag says so."""
    text, patterns = "", []
    for bar, item in found:
        text += ("|" if bar and patterns else "") + item.text
        if bar and patterns:
            patterns[-1] += f"|{item.pattern}"
        else:
            patterns.append(item.pattern)
    return Sample(text, "".join(f"(?:{pattern})" for pattern in patterns))


REPETITIONS = [("*", "*"), ("+", "+"), ("{2}", "{2}"), ("{0}", "{0}"), ("{1,}", "{1,}"), ("{0,2}", "{0,2}"), ("{3,2}", "{3}")]
letters = st.tuples(st.sampled_from(TYPES), st.sampled_from(SCATTERINGS)).map(list)
groups = st.tuples(
    st.builds(lambda pair, count: pair[:count], letters, st.sampled_from([0, 1, 2, 2, 2])), st.lists(st.sampled_from(LABELS), max_size=2)
)
items = st.recursive(
    st.one_of(st.sampled_from(SYMBOLS), groups.map(group)),
    lambda inner: st.one_of(
        st.lists(st.tuples(st.booleans(), inner), min_size=1, max_size=4).map(joined).map(lambda seq: Sample(f"({seq.text})", seq.pattern)),
        st.lists(inner, min_size=1, max_size=3).map(lambda found: Sample(f"[{''.join(i.text for i in found)}]", "|".join(i.pattern for i in found))),
        st.builds(lambda item, times: Sample(f"({item.text}){times[0]}", f"(?:{item.pattern}){times[1]}"), inner, st.sampled_from(REPETITIONS)),
    ),
    max_leaves=6,
)
expressions = st.lists(st.tuples(st.booleans(), items), min_size=1, max_size=4).map(joined)
events = st.builds(
    PathEvent,
    st.sampled_from("RTVRTVCL"),
    st.sampled_from(["D", "G", "S", None]),
    st.lists(st.sampled_from("abc"), max_size=3, unique=True).map(tuple),
)


def spelled(path: list[PathEvent]) -> str:
    """The symbols of a path as OSL reads them: type, scattering, labels, stop."""
    return "".join(f"{event.type}{event.scattering or 'x'}{''.join(f'<{label}>' for label in event.labels)};" for event in path)


@FIXED
@given(expressions, st.lists(st.lists(events, max_size=4), min_size=8, max_size=16))
def test_agrees_with_regular_expressions_over_the_symbols(expression: Sample, paths: list[list[PathEvent]]) -> None:
    pattern = re.compile(expression.pattern)
    compiled = compile(expression.text, dialect="osl")
    for path in paths:
        assert compiled.accepts(path) == bool(pattern.fullmatch(spelled(path)))


@FIXED
@given(expressions)
def test_printing_and_parsing_are_inverse(expression: Sample) -> None:
    tree = parse(expression.text).tree
    shown = show(tree, "osl")
    assert parse(shown).tree == tree
    # What is printed means the same to OSL itself: no reading that it warns of.
    assert not any("OSL itself" in warning for warning in parse(shown).warnings)


@examples(500)
@given(
    st.one_of(
        st.text(max_size=40), st.text("CDSLGRTVOBxsXE.*+?{}[]()<>|&^-!@;'\\,0123456789ab \n", max_size=60), st.text("CD.'a[]()<>|^", max_size=60)
    )
)
def test_random_text_is_parsed_or_refused(text: str) -> None:
    column = refusal_column(text)
    assert column is None or 1 <= column <= len(text) + 1


def refusal_column(text: str) -> int | None:
    """Where a text is refused; None where it is parsed, and printed so that it parses again."""
    try:
        tree = parse(text).tree
    except ExpressionError as error:
        return error.column
    assert parse(show(tree, "osl")).tree == tree
    return None


HEAVY = {
    "nested": "(" * 60 + "D" + ")" * 60,
    "nested lists": "C<" + "[" * 59 + "R" + "]" * 59 + "D>L",
    "brackets that never close": "([" * 9_000,
    "alternatives": "|".join("DSG"[i % 3] for i in range(9_999)),
    "alternatives of groups": "|".join(f"<RD'{i}'>" for i in range(1_600)),
    "labels in a list": "C[" + "".join(f"'{i}'" for i in range(2_900)) + "]L",
    "labels in a group": "C<RD[" + "".join(f"'{i}'" for i in range(2_900)) + "]>L",
    "labels by position": "C<RD" + "'a'" * 5_000 + ">L",
    "open quote": "C" + "'" * 19_999,
    "repetitions of repetitions": "C" + "(" * 50 + "D" + "*)" * 50 + "L",
    "long": "C" + "D" * 19_000 + "L",
}


@pytest.mark.parametrize("text", HEAVY.values(), ids=HEAVY.keys())
def test_heavy_texts_are_read_or_refused_soon(text: str) -> None:
    start = time.process_time()
    column = refusal_column(text)
    assert column is None or 1 <= column <= len(text) + 1
    assert time.process_time() - start < 10  # a guard against quadratic work: measured below 0.5 s


@pytest.mark.parametrize("text", HEAVY.values(), ids=HEAVY.keys())
def test_heavy_texts_are_compiled_or_refused_soon(text: str) -> None:
    start = time.process_time()
    with contextlib.suppress(ExpressionError):
        compile(text, dialect="osl")
    assert time.process_time() - start < 30  # a guard against exponential work: the bounds themselves count steps, not seconds
