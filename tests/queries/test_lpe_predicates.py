"""Predicates on vertices and value prefixes: a truth table, errors, names that a run knows, and how callers write facts."""

import re

import pytest
from words import matches, word

from queries.errors import ExpressionError, QueryError
from queries.lpe import compile
from queries.lpe.parser import parse
from queries.lpe.syntax import PathEvent

TABLE = [
    # regions and segments
    ("C X@P L", ["C RD@P L", "C TS@P@Q L"], ["C RD@Q L", "C RD@ L", "C L@P", "C@P RD@ L"]),
    ("CX@!P L", ["C RD@Q L", "C RD@ L"], ["C RD@P L", "C RD@P@Q L"]),
    ("CX@P@Q L", ["C RD@P@Q L"], ["C RD@P L", "C RD@Q L"]),
    ("CX@P@!Q L", ["C RD@P L"], ["C RD@P@Q L", "C RD@ L"]),
    ("C@P.*L", ["C@P RD L@"], ["C@Q RD L", "C@ L"]),
    ("C.*L@P", ["C RD L@P"], ["C RD L@", "C@P RD L@Q"]),
    ("C.*X@'my region'L", ["C RD@ RD@region:my\u00a0region L"], ["C RD@my L"]),
    ("CX@crosses:P L", ["C RD@crosses:P L"], ["C RD@P L", "C RD@crosses:Q L"]),
    ("C.*L@!crosses:P", ["C RD@crosses:P L@"], ["C RD L@crosses:P"]),
    ("CX@region:P L", ["C RD@P L"], ["C RD@Q L"]),
    # objects, materials, lights, media, of facts and of labels where nothing else is known
    ("CX@object:ball L", ["C RD@object:ball L", "C RD:ball L"], ["C RD:ball@ L", "C RD@object:floor L", "C RD@material:ball L"]),
    ("CX@!object:ball L", ["C RD@object:floor L", "C RD:floor L", "C RD@ L"], ["C RD@object:ball L", "C RD:ball:x L"]),
    ("CX@material:glass L", ["C RD@material:glass L"], ["C RD@object:glass L"]),
    ("C.*L@light:lamp", ["C L@light:lamp", "C RD L@light:lamp@light:shade", "C L:lamp"], ["C L@light:shade", "C L@object:lamp"]),
    ("C.*L@light:lamp@light:shade", ["C L@light:lamp@light:shade"], ["C L@light:lamp", "C L@light:shade"]),
    ("C<V>@medium:fog L", ["C V@medium:fog L"], ["C V@ L", "C R@medium:fog L"]),
    ("CX@object:'a b'L", ["C RD@object:a\u00a0b L"], ["C RD@object:a L"]),
    # techniques and the vertices that each side sampled
    ("C.*L@technique:sample", ["C L@technique:sample"], ["C L@technique:hit", "C L@", "C L"]),
    ("C.*L@s:1@t:2..", ["C RD L@s:1@t:2", "C RD RD L@s:1@t:3"], ["C RD L@s:0@t:3", "C L@s:1@t:1", "C L@"]),
    ("C.*L@s:2..4", ["C L@s:2", "C L@s:3", "C L@s:4"], ["C L@s:1", "C L@s:5", "C L"]),
    ("C.*L@!s:2..4", ["C L@s:1", "C L@s:5", "C L"], ["C L@s:2", "C L@s:4"]),
    ("C.*L@t:..3", ["C L@t:0", "C L@t:3"], ["C L@t:4"]),
    ("C.*L@blocker:ball", ["C RD L@blocker:ball"], ["C RD@blocker:ball L@", "C RD L@blocker:floor"]),
    # depth counts events from the camera's 0
    ("C.*D@depth:2.*L", ["C RS RD L", "C RD RD L"], ["C RD L", "C RD RS L"]),
    ("CX*L@depth:3", ["C RD RD L"], ["C RD L", "C RD RD RD L"]),
    ("CX*L@depth:2..3", ["C RD L", "C RD RD L"], ["C L", "C RD RD RD L"]),
    ("CX*L@depth:..2", ["C L", "C RD L"], ["C RD RD L"]),
    ("CX*L@!depth:2", ["C L", "C RD RD L"], ["C RD L"]),
    ("C(D@depth:1..2|S@depth:3..)*L", ["C L", "C RD RD L", "C RD RD RS RS L"], ["C RS L", "C RD RS L", "C RD RD RD L"]),
    ("C@depth:0 D L", ["C RD L"], ["C L"]),
    ("C@depth:1 D L", [], ["C RD L"]),
    ("L@depth:2..D*X@depth:1@P E", ["C RS@P L", "C RS@P RD L"], ["C RD RS@P L", "C RS L"]),
    ("C.*L - C.*D@depth:1.*L", ["C RS L", "C RS RD L"], ["C RD L"]),
    # after every kind of symbol and bracket, before a repetition
    ("C<RD>@P L", ["C RD@P L"], ["C TD@P L", "C RD@ L"]),
    ("C[DS]@P L", ["C RD@P L", "C RS@P L"], ["C RG@P L", "C RD@ L"]),
    ("C(D|S)@P L", ["C RD@P L", "C RS@P L"], ["C RG@P L", "C RD@ L"]),
    ("C(D@Q|<TS>)@P L", ["C RD@P@Q L", "C TS@P L"], ["C RD@P L", "C TS@Q L"]),
    ("C[^D]@P L", ["C RS@P L"], ["C RD@P L", "C RS@ L"]),
    ("C'a'@P L", ["C RD:a@P L"], ["C RD:b@P L", "C RD:a@ L"]),
    ("C!'a'@P L", ["C RD:b@P L"], ["C RD:a@P L"]),
    ("C.@P L", ["C RD@P L"], ["C RD@ L"]),
    ("CX@P*L", ["C L", "C RD@P RS@P L"], ["C RD@P RS@ L"]),
    ("CX@P{2}L", ["C RD@P RS@P L"], ["C RD@P L"]),
    ("C[.@P.@Q]L", ["C RD@P L", "C RD@Q L"], ["C RD@ L"]),
    # how far names and ranges run
    ("CX@P.L", ["C RD@P RD L"], ["C RD@P L"]),
    ("CX@P'a'L", ["C RD@P RS:a L"], ["C RD:a@P L"]),
    ("C.@depth:1.L", ["C RD RD L"], ["C RD L"]),
    ("C.@depth:1..L", ["C RD L"], ["C RD RD L"]),
    ("C.@depth:1 ..L", ["C RD RD RS L"], ["C RD L", "C RD RS L"]),
    ("C X @ ! object : ball L", ["C RD@ L"], ["C RD@object:ball L"]),
    ("C.@s:01..01L", ["C RD@s:1 L"], ["C RD@s:2 L"]),
]


@pytest.mark.parametrize(("expression", "yes", "no"), TABLE, ids=[row[0] for row in TABLE])
def test_truth_table(expression: str, yes: list[str], no: list[str]) -> None:
    compiled = compile(expression)
    assert [text for text in yes if not compiled.accepts(spaced(text))] == []
    assert [text for text in no if compiled.accepts(spaced(text))] == []
    if not expression.startswith("L"):  # the oracle turns nothing round
        tree = parse(expression).tree
        assert [matches(tree, spaced(text)) for text in (*yes, *no)] == [True] * len(yes) + [False] * len(no)


def spaced(text: str) -> tuple[PathEvent, ...]:
    """A word, in which a no-break space stands for a space in a name."""
    found = word(text.replace("\u00a0", "_NBSP_"))
    return tuple(
        event if event.facts is None else event._replace(facts=frozenset((field, name.replace("_NBSP_", " ")) for field, name in event.facts))
        for event in found
    )


ERRORS = [
    ("CX@", 4, "expected a region"),
    ("CX@3L", 4, "found `3`"),
    ("CX@!", 5, "expected a region"),
    ("CX@''L", 4, "empty label"),
    ("CX@'P", 4, "no closing quote"),
    ("CX@P:Q", 4, "expected one of object, material"),
    ("CX@objekt:ball L", 4, "did you mean `object`?"),
    ("CX@object:L@P:", 13, "expected one of object"),
    ("CX@object:*", 11, "expected a name after `object:`"),
    ("CX@object:3", 11, "quote names"),
    ("CX@depth:deep", 10, "expected a number or a range"),
    ("CX@depth:", 10, "found the end"),
    ("CX@depth:..L", 10, "before or after"),
    ("CX@depth:4..2L", 10, "did you mean 2..4?"),
    ("CX@depth:1001L", 10, "at most 1000"),
    ("CX@depth:" + "9" * 9000, 10, "at most 1000"),
    ("CX@object:" + "a" * 9000, 11, "at most 500 characters"),
    ("CX@technique:sampel L", 14, "did you mean `sample`?"),
    ("C(DS)@P L", 6, "speaks of one event"),
    ("C(D*)@P L", 6, "speaks of one event"),
    ("C(D|SS)@P L", 8, "speaks of one event"),
    ("CD*@P L", 4, "before its repetition"),
    ("@P", 1, "right after a symbol"),
    ("C<RD@P>L", 5, "after the `>`"),
    ("C[^D@P]L", 5, "to close the `[`"),
    ("C:L", 2, "found `:`"),
    ("CX@P:", 4, "expected one of object"),
    ("CX@P\x00L", 5, "U+0000"),
    ("CX@\ud800", 4, "U+D800"),
    ("CX@'\ud800'L", 5, "U+D800"),
    ("CX@ë", 4, "found `ë`"),
    # value prefixes
    ("unocluded;CDL", 1, "did you mean `unoccluded`?"),
    (" noclamp; clamp ;CDL", 11, "expected one of the prefixes unoccluded, noclamp, nothruput, shadows"),
    ("unoccluded;noclamp;shadows;CDL", 20, "has one of them"),
    ("shadows;unoccluded;CDL", 9, "has one of them"),
    ("noclamp;", 9, "expected a symbol"),
    (";CDL", 1, "come before everything else"),
    ("C D L;", 6, "come before everything else"),
    ("CDL;", 1, "expected one of the prefixes"),
    ("(noclamp;CDL)", 2, "expected a symbol"),
]


@pytest.mark.parametrize(("text", "column", "message"), ERRORS, ids=[ascii(row[0][:30]) for row in ERRORS])
def test_errors_say_where_and_what_was_expected(text: str, column: int, message: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        compile(text)
    assert (raised.value.column, message in str(raised.value)) == (column, True), str(raised.value)


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        ("CX@object:florr L", 11, "no object, material or light is named `florr`; did you mean `floor`?"),
        ("CX@material:zzz L", 13, "no object, material or light is named `zzz`"),
        ("C.*L@light:lmp", 12, "did you mean `lamp`?"),
        ("C.*L@blocker:lmp", 14, "did you mean `lamp`?"),
        ("CX@PL", 4, "did you mean `@P L`?"),
        ("CX@potx", 4, "did you mean `@pot x`?"),
        ("CX@!spit L", 5, "did you mean `spot`?"),
        ("CX@crosses:spit L", 12, "no region is named `spit`; did you mean `spot`?"),
    ],
)
def test_names_that_do_not_exist(text: str, column: int, message: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        compile(text, objects={"floor", "lamp"}, regions={"P", "spot", "pot"})
    assert (raised.value.column, message in str(raised.value)) == (column, True), str(raised.value)
    compile(text)  # any name will do where none is known


def test_names_that_exist() -> None:
    known = compile("C X@P@object:floor L@light:lamp@!blocker:lamp@crosses:P", objects=["floor", "lamp"], regions=["P"])
    assert known.regions == known.crossed == ("P",)
    assert known.tests == {"type", "region", "object", "light", "blocker", "crosses"}
    with pytest.raises(ExpressionError, match="no region is defined"):
        compile("CX@P L", regions=())


def test_media_are_warned_of_in_runs() -> None:
    assert any("no media" in warning for warning in compile("C<V>@medium:fog L", objects=["floor"]).warnings)
    assert compile("C<V>@medium:fog L").warnings == ()


@pytest.mark.parametrize(
    ("text", "prefixes", "shown"),
    [
        ("C D L", (), "CDL"),
        ("unoccluded;CDL", ("unoccluded",), "unoccluded;CDL"),
        (" noclamp ; unoccluded; noclamp;C D L", ("unoccluded", "noclamp"), "unoccluded;noclamp;CDL"),
        ("shadows;nothruput;CDL|CSL", ("nothruput", "shadows"), "nothruput;shadows;CDL|CSL"),
    ],
)
def test_prefixes(text: str, prefixes: tuple[str, ...], shown: str) -> None:
    compiled = compile(text)
    assert compiled.prefixes == prefixes
    assert compiled.show() == str(compiled) == shown
    assert compile(shown).prefixes == prefixes
    assert compiled.accepts(word("C RD L"))


@pytest.mark.parametrize(
    ("text", "ours", "theirs"),
    [("CDL|CSL", "CDL|CSL", "CD[CL]SL"), ("CD*|SL", "CD*|SL", "CD*"), ("LDC", "CDL", "a light, then")],
)
def test_texts_that_osl_reads_otherwise(text: str, ours: str, theirs: str) -> None:
    [warning] = [warning for warning in compile(text).warnings if "OSL" in warning]
    assert f"`{ours}`" in warning
    assert theirs in warning
    assert not any("it is read here" in warning for warning in compile(text, dialect="osl").warnings)


@pytest.mark.parametrize("text", ["CDL", "C(D|S)L", "C[DS]+L", "C.*<TS>L", "C<RD.>L", "C D|S L", "CD?L", "noclamp;CDL", "C[^D]*L", "CD{2,3}B"])
def test_texts_that_osl_reads_alike_or_not_at_all(text: str) -> None:
    assert compile(text).warnings == ()


def test_prefixes_before_other_notations() -> None:
    for dialect, text in (("osl", "noclamp;CDL"), ("thesis", "noclamp;L D E")):
        compiled = compile(text, dialect=dialect)
        assert compiled.prefixes == ("noclamp",)
        assert compiled.accepts(word("C RD L"))
        assert not compiled.accepts(word("C RS L"))
    with pytest.raises(ExpressionError) as raised:
        compile("noclamp;CQL", dialect="osl")
    assert raised.value.column == 10
    assert str(raised.value).count("column") == 1


@pytest.mark.parametrize("facts", [[("object", "ball")], ("object:ball",), {"object:ball", ("s", 1)}, frozenset({("object", "ball")})])
def test_facts_as_callers_write_them(facts: object) -> None:
    compiled = compile("C X@object:ball L")
    assert compiled.accepts([("C", None), ("R", "D", (), facts), ("L", None, ())])
    assert not compiled.accepts([("C", None), ("R", "D", ("ball",), ()), ("L", None, ())])  # facts are known, and none holds
    assert compiled.accepts([("C", None), ("R", "D", ("ball",), None), ("L", None, ())])


@pytest.mark.parametrize("facts", ["object:ball", 3, ["ball"], [("depht", 2)], [("s", "one")], [("object",)], [3]])
def test_facts_of_the_wrong_shape(facts: object) -> None:
    with pytest.raises(TypeError, match="expected"):
        compile("C X L").accepts([("C", None), ("R", "D", (), facts), ("L", None)])


def test_an_event_may_be_two_things_at_once() -> None:
    # No run has such an event, but labels may say so: the oracle's answer is given, and kernels are told.
    compiled = compile("C X@object:a X@object:b L")
    both = spaced("C RD@object:a@object:b RD@object:a@object:b L")
    assert compiled.accepts(both)
    assert compiled.accepts(word("C RD:a:b RD:b:a L"))
    assert not compiled.accepts(word("C RD:a:b RD:a L"))
    with pytest.raises(QueryError, match="one object"):
        compiled.alphabet.symbols_of(both)


KINDS = {"floor": {"object"}, "white": {"material"}, "lamp": {"object", "light"}, "sun": {"light"}, "glass": ("object", "material")}


@pytest.mark.parametrize("text", ["X@object:floor", "X@material:white", "X@object:glass", "X@material:glass", "X@!object:lamp"])
def test_names_of_the_right_kind(text: str) -> None:
    assert compile(f"C {text} L@light:lamp", objects=KINDS) is not None
    assert compile("C D L@light:sun L@light:lamp@blocker:floor", objects=KINDS) is not None


@pytest.mark.parametrize(
    ("text", "dialect", "column", "message"),
    [
        ("C X@object:white L", "std", 12, "`white` is no object but a material: say `@material:white`"),
        ("C X@material:floor L", "std", 14, "`floor` is no material but an object"),
        ("C X L@light:white", "std", 13, "`white` is no light but a material"),
        ("C X L@blocker:sun", "std", 15, "`sun` is no object but a light"),
        ("L S_white E", "thesis", 5, "`white` is no object but a material"),
        ("L_white D E", "thesis", 3, "`white` is no light but a material"),
    ],
)
def test_names_of_another_kind_are_refused(text: str, dialect: str, column: int, message: str) -> None:
    with pytest.raises(ExpressionError, match=re.escape(message)) as found:
        compile(text, dialect, objects=KINDS, regions=())
    assert found.value.column == column
