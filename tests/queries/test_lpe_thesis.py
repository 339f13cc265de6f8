"""The thesis's light-first notation: what it means, what it refuses, and that printing and parsing are inverse."""

import contextlib
import time

import pytest
from examples import examples
from hypothesis import given
from hypothesis import strategies as st
from same_paths import differ, same_paths

from queries.errors import ExpressionError
from queries.lpe import compile
from queries.lpe.direction import camera_first
from queries.lpe.limits import Work
from queries.lpe.parser import parse as parse_standard
from queries.lpe.syntax import Chain, Node, Repeat, Step, Test, choice, sequence, step
from queries.lpe.thesis import parse
from queries.lpe.thesis_printer import show

FIXED = examples(80)
OBJECTS = {"j", "glass", "glass ball", "left_wall", "i", "lamp", "a}b", "q\\"}
REGIONS = {"p", "spot", "my region"}

# The thesis's notation and the standard one.
SAME = [
    ("L_i S_j^T S_j^T X_p E", "E X@p <TS>@object:j <TS>@object:j L@light:i"),
    ("L_i S^T_j S^T_j X_p E", "C X@p <TS>@object:j <TS>@object:j L@light:i"),
    ("L(D|G|S)^* X_p E", "C X@p [DGS]* L"),
    ("L(D|G|S)^{*} X_p E", "C X@p [DGS]* L"),
    ("L (S^T)^{+} D^{ ? } E", "C D? <TS>+ L"),
    ("L S^{T}^{+} D E", "C D <TS>+ L"),
    ("LE", "CL"),
    ("LDE", "CDL"),
    ("L S+ D E", "C D S+ L"),
    ("LDSE", "C S D L"),
    ("L D* S? G{2} D{1,2} S{2,} D{,3} E", "C D{0,3} S{2,} D{1,2} G{2} S? D* L"),
    ("LD^RS^TE", "C <TS> <RD> L"),
    ("LD^{R}S^{ T }E", "C <TS> <RD> L"),
    ("L X^R X^T X V E", "C V X T R L"),
    ("L (D S | G)+ E", "C (S D | G)+ L"),
    ("B X E | O S E", "C X B | C S O"),
    ("(L|B) D E", "C D [LB]"),
    ("(L_lamp|B) D E", "C D L@light:lamp | C D B"),
    ("((LDE) | L S E)", "C D L | C S L"),
    ("L D_{glass ball} E", "C D@object:'glass ball' L"),
    ("L D_{a\\}b}_spot E", "C D@object:'a}b'@spot L"),
    ("L X_{my region}^T E", "C T@'my region' L"),
    ("L_spot D E", "C D L@spot"),
    ("L D _ j ^ T { 2 } E", "C <TD>@object:j{2} L"),
    ("L D_left_wall E", "C D@object:left_wall L"),
]


@pytest.mark.parametrize(("text", "standard"), SAME, ids=[row[0] for row in SAME])
def test_means_the_same_as_the_standard_notation(text: str, standard: str) -> None:
    tree = parse(text, OBJECTS, REGIONS).tree
    assert same_paths(tree, parse_standard(standard).tree)


def test_the_tree_is_in_the_order_of_the_text() -> None:
    tree = parse("L_i S_j^T S_j^T X_p E").tree
    glass = step(Test("type", frozenset("T")), Test("scattering", frozenset("S")), Test("object", frozenset({"j"})))
    inside = step(Test("type", frozenset("RTV")), Test("region", frozenset({"p"})))
    assert tree == Chain(
        (step(Test("type", frozenset("L")), Test("light", frozenset({"i"}))), glass, glass, inside, step(Test("type", frozenset("C"))))
    )


def test_compiles_and_accepts() -> None:
    caustic = compile("L_i S_j^T S_j^T X_p E", "thesis", objects=["i", "j"], regions=["p"])
    glass = ("T", "S", (), ["object:j"])
    assert caustic.accepts([("C", None), ("R", "D", (), ["region:p"]), glass, glass, ("L", None, (), ["light:i"])])
    assert not caustic.accepts([("C", None), ("R", "D", (), []), glass, glass, ("L", None, (), ["light:i"])])
    assert not caustic.accepts([("C", None), ("R", "D", (), ["region:p"]), glass, ("L", None, (), ["light:i"])])


def test_prefixes_stand_first() -> None:
    parsed = parse("noclamp; unoccluded;L D E")
    assert parsed.prefixes == ("unoccluded", "noclamp")
    assert parsed.tree == parse("L D E").tree
    with pytest.raises(ExpressionError, match="column 11: expected a light first"):
        parse("shadows;  D E")


@pytest.mark.parametrize(
    ("text", "objects", "regions", "fields"),
    [
        # nothing is known: a region on X, a light on L, an object on all else
        ("L_n D_n S_n G_n V_n X_n E", None, None, ["light", "object", "object", "object", "object", "region"]),
        # the name says which
        ("L_j D_j X_j D_p X_p E", ["j"], ["p"], ["light", "object", "object", "region", "region"]),
        ("L_p E", ["j"], ["p"], ["region"]),
        # what is not among those that are known is one of the others
        ("L_n D_j D_n X_n E", ["j"], None, ["region", "object", "region", "region"]),
        ("L_n D_p D_n X_n E", None, ["p"], ["light", "region", "object", "object"]),
    ],
)
def test_names(text: str, objects: list[str] | None, regions: list[str] | None, fields: list[str]) -> None:
    tree = parse(text, objects, regions).tree
    assert isinstance(tree, Chain)
    found = [test.field for part in tree.parts if isinstance(part, Step) for test in part.tests if test.field not in ("type", "scattering")]
    assert found == fields


ERRORS = [
    ("", 1, "expected a light first"),
    ("D E", 1, "expected a light first"),
    ("LD", 3, "found the end of the expression"),
    ("L D L E", 5, "emitters stand first"),
    ("LDE E", 5, "expected `|` or the end"),
    ("L{2} D E", 2, "an emitter comes once"),
    ("(L|B)* D E", 6, "an emitter comes once"),
    ("L^R D E", 1, "without superscript"),
    ("L D E_p", 5, "without superscript or subscript"),
    ("L V^R E", 3, "neither reflection nor transmission"),
    ("L D^Q E", 5, "expected the superscript `R`"),
    ("L D^R^T E", 6, "found a second"),
    ("L D^{R", 5, "expected `}`"),
    ("L R E", 3, "`X^R`"),
    ("L T E", 3, "`X^T`"),
    ("C D L", 1, "begins at the light"),
    ("L D ^ E", 6, "expected the superscript"),
    ("(^E", 2, "expected `^R` or `^T` after a symbol"),
    ("L D_ ", 6, "expected a name after `_`"),
    ("L D_+ E", 5, "found `+`"),
    ("L D_{} E", 5, "expected a name between the braces"),
    ("L D_{glass", 5, "expected `}`"),
    ("L D_{a\0} E", 7, "U+0000"),
    ("L D_glas E", 5, "did you mean `glass`?"),
    ("L D_unheard E", 5, "which is neither"),
    ("L X_pSE", 5, "put a space where the name ends: `p SE`"),
    ("L () E", 4, "found `)`"),
    ("L (D|) E", 6, "found `)`"),
    ("L (D E", 6, "expected an interaction"),
    ("L (D", 5, "expected `)` to close the `(` of column 3"),
    ("L D** E", 5, "found a second"),
    ("L D{3,2} E", 4, "smaller"),
    ("L D{} E", 4, "expected a repetition"),
    ("L D{,} E", 4, "expected a repetition"),
    ("L D{2 3} E", 4, "expected a repetition"),
    ("L D{9999} E", 4, "at most 1000"),
    ("L D{" + "9" * 5000 + "} E", 4, "at most 1000"),
    ("L D = E", 5, "found `=`"),
    ("L D; E", 4, "value prefixes and their `;` come before everything else"),
    ("unocluded; L D E", 1, "expected one of the prefixes"),
    ("L D \x01 E", 5, "U+0001"),
    ("L" + "(" * 100, 62, "nested more than"),
    ("(" * 100 + "LDE", 61, "nested more than"),
    ("L" + "D" * 30_000, 0, "20,000"),
]


@pytest.mark.parametrize(("text", "column", "message"), ERRORS, ids=[repr(row[0][:20]) for row in ERRORS])
def test_errors_say_where_and_what_was_expected(text: str, column: int, message: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        parse(text, OBJECTS, REGIONS)
    assert raised.value.column == column
    assert message in str(raised.value)


def test_a_name_that_is_an_object_and_a_region_is_refused() -> None:
    with pytest.raises(ExpressionError, match=r"column 5: .* which is both"):
        parse("L D_p E", ["p"], ["p"])
    with pytest.raises(ExpressionError, match=r"column 3: .* which is both"):
        parse("L_p D E", ["p"], ["p"])


def test_a_name_that_swallows_the_eye_is_explained() -> None:
    with pytest.raises(ExpressionError, match=r"the name of column 5 is `pE`: put a space where a name ends, `p E`"):
        parse("L X_pE")


# --- printing -----------------------------------------------------------------------------------------------------

names = st.sampled_from(sorted(OBJECTS | REGIONS)).map(lambda name: "_{" + name.replace("\\", "\\\\").replace("}", "\\}") + "}")
scripts = st.sampled_from(["", "^R", "^T", "^{R}"])
symbols = st.one_of(
    st.builds(lambda letter, first, side, second: letter + first + side + second, st.sampled_from("DGSX"), st.one_of(st.just(""), names), scripts,
              st.one_of(st.just(""), st.just(""), names)),
    st.builds(lambda name: "V" + name, st.one_of(st.just(""), names)),
    st.sampled_from(["S_j^T ", "X_spot ", "D_left_wall "]),
)  # fmt: skip
inner = st.recursive(
    symbols,
    lambda parts: st.one_of(
        st.lists(parts, min_size=2, max_size=3).map("".join),
        st.lists(parts, min_size=1, max_size=3).map(lambda found: f"({'|'.join(found)})"),
        st.builds(lambda part, times: f"({part}){times}", parts, st.sampled_from(["*", "+", "?", "^*", "{2}", "{0}", "{1,}", "{,2}", "{1,3}"])),
    ),
    max_leaves=8,
)
emitters = st.builds(lambda letter, name: letter + name, st.sampled_from("LOB"), st.one_of(st.just(""), names))
sources = st.one_of(emitters, st.lists(emitters, min_size=1, max_size=3).map(lambda found: f"({'|'.join(found)})"))
wholes = st.lists(st.builds(lambda source, parts: f"{source}{''.join(parts)}E", sources, st.lists(inner, max_size=3)), min_size=1, max_size=3).map(
    " | ".join
)


@FIXED
@given(wholes)
def test_printing_and_parsing_are_inverse(text: str) -> None:
    tree = parse(text, OBJECTS, REGIONS).tree
    assert parse(show(tree), OBJECTS, REGIONS).tree == tree
    assert show(parse(show(tree), OBJECTS, REGIONS).tree) == show(tree)


@FIXED
@given(wholes)
def test_camera_first_trees_are_printed_reversed(text: str) -> None:
    tree = parse(text, OBJECTS, REGIONS).tree
    turned = camera_first(tree, Work())
    assert not differ(parse(show(turned), OBJECTS, REGIONS).tree, tree)


standard_steps = st.builds(
    lambda types, scattering, name, region: step(
        Test("type", frozenset(types)) if types else None,
        Test("scattering", frozenset(scattering)) if scattering else None,
        Test("object", frozenset(name)) if name else None,
        Test("region", frozenset(region)) if region else None,
    ),
    st.sampled_from(["", "R", "T", "RT", "RTV"]),
    st.sampled_from(["", "D", "G", "S", "DS"]),
    st.sampled_from([[], [], ["j"], ["glass ball"]]),
    st.sampled_from([[], [], ["p"], ["my region"]]),
)
standard_parts = st.recursive(
    standard_steps,
    lambda parts: st.one_of(
        st.lists(parts, min_size=2, max_size=3).map(sequence),
        st.lists(parts, min_size=2, max_size=3).map(choice),
        st.builds(Repeat, parts, st.integers(0, 2), st.one_of(st.none(), st.integers(2, 3))),
    ),
    max_leaves=5,
)


@FIXED
@given(st.lists(standard_parts, max_size=3), st.sampled_from(["L", "LB", "O"]))
def test_trees_of_the_standard_notation_keep_their_paths(parts: list[Node], source: str) -> None:
    tree = sequence([step(Test("type", frozenset("C"))), *parts, step(Test("type", frozenset(source)))])
    assert not differ(parse(show(tree), OBJECTS, REGIONS).tree, tree)


@pytest.mark.parametrize(
    ("standard", "construct"),
    [
        ("C 'a' L", r"labels \('a'\)"),
        ("C <RD'a'> L", r"labels \('a'\)"),
        ("C !'a' L", "labels"),
        ("C [^D] L", r"the negation of scattering letters \(D\)"),
        ("C s L", "straight transmission `s`"),
        ("C <Rx> L", "no scattering"),
        ("C <VD> L", "a scattering type in volumes"),
        ("CDL & CSL", "Boolean combinations"),
        ("CDL - CSL | CGL", "Boolean combinations"),
        ("C D@depth:2 L", "`@depth:2`"),
        ("C D@material:white L", "`@material:white`"),
        ("C D@!object:floor L", "`@!object:floor`"),
        ("C D L@technique:hit", "`@technique:hit`"),
        ("C D L@object:lamp", "`@object:lamp`"),
        ("C@p D L", "on the eye"),
        ("C.*", "light stands inside a bracket or is repeated"),
        ("C(DL|SL)", "light stands inside a bracket or is repeated"),
        ("C{2}L", "eye stands inside a bracket or is repeated"),
        ("L", "both a light and the eye"),
        ("CDLDL", "a camera or a light amid a path"),
        ("C X@p X@object:p L", "cannot tell the region `p` from the object"),
    ],
)
def test_what_the_notation_lacks_is_named(standard: str, construct: str) -> None:
    with pytest.raises(ExpressionError, match=construct):
        show(parse_standard(standard).tree)


def test_a_step_of_too_many_symbols_is_refused() -> None:
    many = [Test(field, frozenset(f"{field}{i}" for i in range(40))) for field in ("object", "region")]
    tree = sequence([step(Test("type", frozenset("C"))), step(Test("scattering", frozenset("D")), *many), step(Test("type", frozenset("L")))])
    with pytest.raises(ExpressionError, match="1,600 symbols"):
        show(tree)


# --- any text -----------------------------------------------------------------------------------------------------


def refusal_column(text: str, objects: frozenset[str] | None, regions: frozenset[str] | None) -> tuple[int, Node | None]:
    """Where a text is refused, or its tree."""
    try:
        return 0, parse(text, objects, regions).tree
    except ExpressionError as error:
        return error.column, None


@examples(250)
@given(
    st.one_of(st.text(max_size=40), st.text("LOBDGSVXERT^_{}()|*+?,0123456789 p\\", max_size=40), wholes),
    st.sampled_from([None, frozenset({"p"}), frozenset(OBJECTS)]),
    st.sampled_from([None, frozenset[str](), frozenset(REGIONS)]),
)
def test_random_text_is_parsed_or_refused(text: str, objects: frozenset[str] | None, regions: frozenset[str] | None) -> None:
    column, tree = refusal_column(text, objects, regions)
    assert 0 <= column <= len(text) + 1
    if tree is None:
        return
    if objects is not None and regions is not None:
        assert parse(show(tree), objects, regions).tree == tree


HEAVY = {
    "nested repetition": "L" + "(" * 50 + "D" + "*)" * 50 + "E",
    "multiplied repetition": "L(((X{1000}){1000}){1000})E",
    "exponential automaton": "L X{30} D X* E",
    "thousands of alternatives": "|".join(f"L{'DSG'[i % 3] * (i % 40)}E" for i in range(600)),
    "nested whole paths": "(" * 58 + "LDE" + ")" * 58,
    "brackets in brackets": "(" * 50 + "L|B" * 3000,
    "long name": "L D_" + "a" * 19_000 + " E",
    "many names": "L(" + "|".join(f"D_a{i}" for i in range(1500)) + ")E",
}


@pytest.mark.parametrize("text", HEAVY.values(), ids=HEAVY.keys())
def test_heavy_expressions_end_soon(text: str) -> None:
    start = time.process_time()
    with contextlib.suppress(ExpressionError):
        compile(text, "thesis", objects=[f"b{i}" for i in range(1000)], regions=None)
    assert time.process_time() - start < 30  # a guard against exponential work: the bounds themselves count steps, not seconds
