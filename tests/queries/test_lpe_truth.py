"""The standard dialect as a truth table of expressions and paths. A row is an expression, the paths it matches, and those it does not."""

import contextlib
import time

import pytest
from words import word

from queries.errors import ExpressionError
from queries.lpe import compile

TABLE = [
    # symbols, and what they stand for
    ("CL", ["C L"], ["C B", "C O", "C RD L", "L", "C", ""]),
    ("CDL", ["C RD L", "C TD L", "C VD L"], ["C RS L", "C L", "C RD RD L", "C RD O"]),
    ("C<RD>L", ["C RD L"], ["C TD L", "C RG L"]),
    ("CRL", ["C RD L", "C RS L"], ["C TS L"]),
    ("CSL", ["C RS L", "C TS L"], ["C Ts L", "C RD L"]),
    ("CsL", ["C Ts L"], ["C TS L"]),
    ("C.L", ["C RD L", "C V L", "C L L"], ["C L"]),
    ("C<R.>L", ["C RG L"], ["C TG L"]),
    ("C<R>L", ["C RG L"], ["C TG L"]),
    ("C<>L", ["C RG L", "C V:fog L"], ["C L"]),
    ("C<..>L", ["C TG L"], ["C L"]),
    ("<Cx>D<Lx>", ["C RD L"], ["C RD LD"]),
    ("C<Vx>L", ["C V L"], ["C VD L"]),
    ("CXL", ["C RD L", "C TS L", "C V L"], ["C L L", "C O L"]),
    ("ED L", ["C RD L"], ["E RD L", "C RS L"]),
    ("C.*B", ["C B", "C RS B", "C RD TS B"], ["C RD L"]),
    ("C.*O", ["C O", "C RS O"], ["C L"]),
    # sets of symbols
    ("C[DS]L", ["C RD L", "C TS L"], ["C RG L"]),
    ("C[D|S]L", ["C RD L", "C TS L"], ["C RG L"]),
    ("C[D S]L", ["C RD L", "C TS L"], ["C RG L"]),
    ("C[^D]L", ["C RS L", "C TG L", "C V L"], ["C RD L"]),
    ("C[^DS]L", ["C RG L", "C V L"], ["C RD L", "C TS L"]),
    ("C[^R]L", ["C TS L", "C V L"], ["C RD L"]),
    ("C<[RT]S>L", ["C RS L", "C TS L"], ["C VS L", "C RD L"]),
    ("C<[^T][DG]>L", ["C RD L", "C VG L"], ["C TD L", "C RS L"]),
    ("C<.[^D]>L", ["C RS L", "C V L"], ["C TD L"]),
    ("C<[^R].>L", ["C TD L"], ["C RD L"]),
    ("C[<RD><TS>]L", ["C RD L", "C TS L"], ["C RS L", "C TD L"]),
    ("C[D(SS)]L", ["C RD L", "C TS TS L"], ["C TS L"]),
    ("C[^RD]L", ["C RS L", "C TS L"], ["C RD L", "C TD L"]),
    ("C<D>L", [], ["C RD L", "C RS L", "C L"]),
    # repetitions
    ("CD*L", ["C L", "C RD L", "C RD RD RD L"], ["C RS L", "C RD RS L"]),
    ("CD+L", ["C RD L", "C RD RD L"], ["C L"]),
    ("CD?L", ["C L", "C RD L"], ["C RD RD L"]),
    ("CD{2}L", ["C RD RD L"], ["C RD L", "C RD RD RD L", "C L"]),
    ("CD{2,}L", ["C RD RD L", "C RD RD RD L"], ["C RD L"]),
    ("CD{1,2}L", ["C RD L", "C RD RD L"], ["C L", "C RD RD RD L"]),
    ("CD{,2}L", ["C L", "C RD RD L"], ["C RD RD RD L"]),
    ("CD{0}L", ["C L"], ["C RD L"]),
    ("CD{3,2}L", ["C RD RD RD L"], ["C RD RD L"]),
    ("C(DS)*L", ["C L", "C RD RS L", "C RD RS RD TS L"], ["C RD L", "C RD RS RD L"]),
    ("C(D*S)*L", ["C L", "C RS L", "C RD RD RS RS L"], ["C RD L", "C RS RD L"]),
    ("C(D?S?)+L", ["C L", "C RD L", "C RS RD L"], ["C RG L"]),
    ("C(D?){2,3}L", ["C L", "C RD L", "C RD RD RD L"], ["C RD RD RD RD L"]),
    ("C(D{2}){2}L", ["C RD RD RD RD L"], ["C RD RD L", "C RD RD RD L"]),
    ("C(D*){3}L", ["C L", "C RD RD RD RD L"], ["C RS L"]),
    # alternatives bind loosest
    ("CDL|CSL", ["C RD L", "C RS L"], ["C RD L RS L", "C RG L"]),
    ("(CDL)|(CSL)", ["C RD L", "C RS L"], ["C RG L"]),
    ("((CDL)|(CSL))", ["C RD L", "C RS L"], ["C RG L"]),
    ("CD|(SD)L", ["C RD"], ["C RD L", "C RS RD L"]),
    ("C(D|SD)L", ["C RD L", "C RS RD L"], ["C RS L"]),
    ("C(D|<TS>+)L", ["C RD L", "C TS TS L"], ["C RS L", "C TS RD L"]),
    # labels are a set without order
    ("C'a'L", ["C RD:a L", "C RD:a:b L", "C RD:b:a L"], ["C RD:b L", "C RD L"]),
    ("C<RD'b'>L", ["C RD:a:b L", "C RD:b L"], ["C RD:a L", "C TD:b L"]),
    ("C<RD.'b'>L", ["C RD:a:b L", "C RD:b L"], ["C RD:a L", "C RD L"]),
    ("C<RD'b''a'>L", ["C RD:a:b L", "C RD:b:c:a L"], ["C RD:a L", "C RD:b L"]),
    ("C<RD['a''b']>L", ["C RD:a L", "C RD:b L"], ["C RD:c L", "C RD L"]),
    ("C['a''b']L", ["C RS:a L", "C RD:c:b L"], ["C RD:c L", "C RD L"]),
    ("C<RS[^'coat']>L", ["C RS:spec L"], ["C RS:coat L", "C RS L", "C RS:spec:coat L"]),
    ("C[^'a']L", ["C RD:b L"], ["C RD:a L", "C RD L"]),
    ("C[^'a''b']L", ["C RD:c L"], ["C RD:a:c L", "C RD:b L", "C RD L"]),
    ("C!'a'L", ["C RD:b L", "C RD L"], ["C RD:a L", "C RD:b:a L"]),
    ("C<RD!'a''b'>L", ["C RD:b L"], ["C RD:a:b L", "C RD L"]),
    ("C<RD.>L", ["C RD:a L"], ["C RD L", "C TD:a L"]),
    ("C.*<L.'lamp'>", ["C L:lamp", "C RD L:x:lamp"], ["C L", "C L:sun", "C O:lamp"]),
    (r"C'o\'brien'L", ["C RD:o'brien L"], ["C RD:obrien L", "C RD L"]),
    (r"C'a\\b'L", [r"C RD:a\b L"], ["C RD:ab L"]),
    # Boolean combinations of whole expressions
    ("C.*L & C.*S.*L", ["C RS L", "C RD TS L"], ["C RD L", "C L"]),
    ("C.*L - CDL", ["C L", "C RS L", "C RD RD L"], ["C RD L", "C RD B"]),
    ("C.*D.*L ^ C.*S.*L", ["C RD L", "C RS L"], ["C RD RS L", "C L"]),
    ("CDL | CSL & CDL", ["C RD L"], ["C RS L"]),
    ("C.*L - CDL - CSL", ["C L", "C RG L"], ["C RD L", "C RS L"]),
    ("C.*L - (CDL | CSL)", ["C L"], ["C RD L", "C RS L"]),
    ("C.*L - (C.*L - CDL)", ["C RD L"], ["C L", "C RS L"]),
    ("CDL ^ CSL ^ CDL", ["C RS L"], ["C RD L"]),
    ("CDL - CDL | CSL", ["C RS L"], ["C RD L"]),
    ("CDL ^ C.L & CSL", ["C RD L", "C RS L"], ["C RG L"]),
    # light first
    ("LDE", ["C RD L"], ["L RD C", "C RS L"]),
    ("LS+DE", ["C RD TS L", "C RD RS TS L"], ["C TS RD L", "C RD L"]),
    ("LS+DE | CSL", ["C RD TS L", "C RS L"], ["C TS RD L"]),
    ("LDSC", ["C RS RD L"], ["C RD RS L"]),
    (".*DSE", ["C RS RD L", "C RS RD RG L"], ["C RD RS L"]),
    ("[LB]S*E", ["C RS L", "C B"], ["C RD L"]),
    ("L.*DE & L<TS>.*E", ["C RD TS L", "C RD RD TS L"], ["C TS RD L"]),
    # white space
    (" C\tD\n S L ", ["C RD RS L"], ["C RD L"]),
]


@pytest.mark.parametrize(("expression", "yes", "no"), TABLE, ids=[row[0] for row in TABLE])
def test_truth_table(expression: str, yes: list[str], no: list[str]) -> None:
    compiled = compile(expression)
    assert [text for text in yes if not compiled.accepts(word(text))] == []
    assert [text for text in no if compiled.accepts(word(text))] == []


ERRORS = [
    ("", 1, "expected a symbol"),
    ("   ", 4, "end of the expression"),
    ("CQL", 2, "found `Q`"),
    ("C()L", 3, "found `)`"),
    ("C[]L", 2, "empty `[]`"),
    ("C[^]L", 4, "expected a letter"),
    ("(CDL", 5, "to close the `(` of column 1"),
    ("CDL)", 4, "expected the end"),
    ("C[DL", 5, "to close the `[` of column 2"),
    ("C<RD", 5, "to close the `<` of column 2"),
    ("C<R<D>>L", 4, "found `<`"),
    ("C<R*D>L", 4, "repetitions are not allowed inside"),
    ("C<R(D)>L", 4, "expected a scattering type"),
    ("C<'a'>L", 3, "labels come third"),
    ("C<RDS>L", 5, "expected a quoted label"),
    ("C[D'a'", 7, "to close"),
    ("C[^D'a']L", 4, "expected a quoted label"),
    ("CxL", 2, "inside `< >`"),
    ("C'floor", 2, "no closing quote"),
    ("C''L", 2, "empty label"),
    ("C'a\\", 2, "no closing quote"),
    ("C!DL", 3, "after `!`"),
    ("*L", 1, "found `*`"),
    ("CD**L", 4, "found a second"),
    ("CD{2}+L", 6, "found a second"),
    ("CD{}L", 4, "expected a number"),
    ("CD{,}L", 5, "expected a number"),
    ("CD{2L", 5, "to close the `{` of column 3"),
    ("CD{9999}L", 4, "at most 1000"),
    ("CD{" + "9" * 5000 + "}L", 4, "at most 1000"),
    ("C||L", 3, "expected a symbol"),
    ("C|", 3, "expected a symbol"),
    ("C[D|]L", 5, "after `|`"),
    ("C&", 3, "expected a symbol"),
    ("C(D&S)L", 1, "whole expressions"),
    ("(CDL&C.L)*", 1, "cannot be repeated"),
    ("[(CDL&C.L)]", 2, "inside `[ ]`"),
    ("C=L", 2, "found `=`"),
    ("C\x00L", 2, "U+0000"),
    ("CëL", 2, "found `ë`"),
    ("C,L", 2, "found `,`"),
    ("C3L", 2, "found `3`"),
    ("(" * 100, 61, "nested more than"),
    ("[" * 100, 61, "nested more than"),
    ("C" * 30_000, 0, "20,000"),
]


@pytest.mark.parametrize(("text", "column", "message"), ERRORS, ids=[repr(row[0][:20]) for row in ERRORS])
def test_errors_say_where_and_what_was_expected(text: str, column: int, message: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        compile(text)
    assert raised.value.column == column
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("C[^RD]L", "mixes event and scattering types"),
        ("C<D>L", "did you mean `<.D>`"),
        ("CD{3,2}L", "is empty"),
        ("LDL", "matches no path"),
        ("DL", "matches no path"),
        ("CDL - C.*L", "matches no path"),
        ("C<.R>L", "no scattering type"),
    ],
)
def test_warnings(text: str, message: str) -> None:
    assert any(message in warning for warning in compile(text).warnings)


@pytest.mark.parametrize("text", ["CDL", "LS+DE", "C.*", "C<RD'a'>L | C.*B", "C.+L - CDL"])
def test_no_warning_without_cause(text: str) -> None:
    assert compile(text).warnings == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("CDL", "direct light (the camera, then diffuse scattering, then a light)"),
        ("C<TS>{2}L", "the camera, then specular transmission 2 times, then a light"),
        ("C<RD'floor'>+B", "the camera, then diffuse reflection labeled floor once or more, then the background"),
        ("CDL - C!'a'L", "(the camera, then diffuse scattering, then a light) but not (the camera, then any event not labeled a, then a light)"),
    ],
)
def test_descriptions(text: str, words: str) -> None:
    assert compile(text).describe() == words


def test_unknown_dialect() -> None:
    with pytest.raises(ExpressionError, match="expected one of the dialects std, osl, thesis"):
        compile("CDL", dialect="vray")


@pytest.mark.parametrize("labels", [["a", "b"], ("b", "a"), {"a", "b"}, frozenset("ab"), {"a": 1, "b": 2}])
@pytest.mark.parametrize("dialect", ["std", "osl"])
def test_labels_of_any_collection(labels: object, dialect: str) -> None:
    assert compile("C<RD[^'c']>L", dialect).accepts([("C", None, None), ["R", "D", labels], ("L", None, None)])


@pytest.mark.parametrize("operator", "&-^|")
def test_thousands_of_operands_are_read_or_refused_at_once(operator: str) -> None:
    start = time.process_time()
    with contextlib.suppress(ExpressionError):
        compile(operator.join(["C.*L"] * 3000))
    with contextlib.suppress(ExpressionError):
        compile(operator.join("C" + "." * count + "L" for count in range(190)))
    assert time.process_time() - start < 4


@pytest.mark.parametrize("events", ["CDL", [("C",), "D"], [("R", "D", "floor")], [(1, None, ())], [()]])
def test_events_of_the_wrong_shape(events: object) -> None:
    with pytest.raises(TypeError, match="expected an event"):
        compile("CDL").accepts(events)  # type: ignore[arg-type]
