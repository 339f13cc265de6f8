"""Printing in each notation: the inverse of its parser, the same paths in every notation that can say a tree, and clear refusals where one cannot."""

from itertools import product

import numpy as np
import pytest
from examples import examples
from hypothesis import given
from hypothesis import strategies as st

from queries.errors import ExpressionError
from queries.lpe import compile, osl, parser, thesis
from queries.lpe.automaton import automaton
from queries.lpe.direction import camera_first
from queries.lpe.limits import Work
from queries.lpe.printer import show
from queries.lpe.syntax import (
    EVENT_TYPES,
    NUMBERED_FIELDS,
    SCATTERING_TYPES,
    Chain,
    Combination,
    Node,
    Repeat,
    Step,
    Test,
    choice,
    sequence,
    step,
    steps_of,
)

FIXED = examples(150)

# --- random trees -------------------------------------------------------------------------------------------------

NAMES = ["a", "b", "o'brien", "back\\slash", "two words", "object", "P", "L2", "2", "ümlaut", "a@b", ""]
RANGES = ["0", "2", "2..4", "3..", "..5"]


def lettered(field: str, letters: str) -> st.SearchStrategy[Test | None]:
    """Tests of event or scattering types, one in four with letters of the other field, which parsers take with a warning."""
    names = st.frozensets(st.sampled_from(letters), min_size=1, max_size=3)
    return st.none() | st.builds(Test, st.just(field), names, st.sampled_from(["in", "in", "other"]))


def one_name(names: list[str]) -> st.SearchStrategy[frozenset[str]]:
    return st.sampled_from(names).map(lambda name: frozenset({name}))


some_names = st.frozensets(st.sampled_from(NAMES[:-1]), min_size=1, max_size=3)
types = lettered("type", EVENT_TYPES) | lettered("type", EVENT_TYPES + SCATTERING_TYPES)
scatterings = lettered("scattering", SCATTERING_TYPES) | lettered("scattering", EVENT_TYPES + SCATTERING_TYPES)
labels = st.one_of(
    st.builds(Test, st.just("label"), some_names, st.sampled_from(["in", "other"])),
    st.builds(Test, st.just("label"), one_name(NAMES[:-1]), st.just("without")),
    st.just(Test("label", frozenset(), "other")),
)
predicates = st.one_of(
    st.builds(
        Test,
        st.sampled_from(["region", "crosses", "object", "material", "light", "blocker"]),
        one_name(NAMES[:-1]),
        st.sampled_from(["in", "without"]),
    ),
    st.builds(Test, st.just("technique"), one_name(["hit", "lens"]), st.sampled_from(["in", "without"])),
    st.builds(Test, st.sampled_from(NUMBERED_FIELDS), one_name(RANGES), st.sampled_from(["in", "without"])),
)
std_steps = st.builds(
    lambda kind, how, named, more: step(kind, how, *named, *more),
    types,
    scatterings,
    st.lists(labels, max_size=2),
    st.lists(predicates, max_size=2),
)


def places(tests: list[Test | None]) -> list[Test]:
    """Tests of labels by position, None for any label, as OSL's parser keeps them: a label in one place implies those before it."""
    last = len(tests) - 1
    any_label = Test("label", frozenset(), "other", last or None)
    return [Test("label", test.names, test.mode, i) if test else any_label for i, test in enumerate(tests) if test or i == last]


osl_labels = st.frozensets(st.sampled_from(["a", "b", "two words", "back\\slash", "D"]), min_size=1, max_size=2)
osl_steps = st.builds(
    lambda kind, how, named: step(kind, how, *places(named)),
    types.filter(lambda test: test is None or test.mode == "in" or "x" not in test.names),
    scatterings.filter(lambda test: test is None or test.mode == "in" or "x" not in test.names),
    st.lists(st.none() | st.builds(Test, st.just("label"), osl_labels, st.sampled_from(["in", "other"])), max_size=3),
)
# What both notations can say of an event.
common_steps = st.builds(
    lambda kind, how, named: step(kind, how, Test("label", frozenset(), "other") if named else None),
    lettered("type", EVENT_TYPES),
    lettered("scattering", SCATTERING_TYPES.replace("x", "")) | st.just(Test("scattering", frozenset("x"))),
    st.booleans(),
)


def trees(steps: st.SearchStrategy[Step]) -> st.SearchStrategy[Node]:
    """Sequences, alternatives and repetitions of steps."""
    bounds = st.sampled_from([(0, None), (1, None), (0, 1), (2, 2), (0, 0), (1, 3), (2, None), (0, 2)])
    return st.recursive(
        steps,
        lambda inner: st.one_of(
            st.lists(inner, min_size=2, max_size=4).map(sequence),
            st.lists(inner, min_size=2, max_size=3).map(choice),
            st.builds(lambda part, times: Repeat(part, *times), inner, bounds),
        ),
        max_leaves=8,
    )


def combined(whole: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    """Boolean combinations: operators that bind alike stand side by side."""
    return st.recursive(
        whole,
        lambda inner: st.one_of(
            st.builds(lambda first, rest: Combination(first, tuple(rest)), inner, st.lists(st.tuples(st.just("^"), inner), min_size=1, max_size=2)),
            st.builds(
                lambda first, rest: Combination(first, tuple(rest)), inner, st.lists(st.tuples(st.sampled_from("&-"), inner), min_size=1, max_size=2)
            ),
            st.lists(inner, min_size=2, max_size=3).map(choice),
        ),
        max_leaves=4,
    )


CAMERA, LIGHT = Step((Test("type", frozenset("C")),)), Step((Test("type", frozenset("L")),))
common_trees = trees(common_steps).map(lambda inner: sequence([CAMERA, inner, LIGHT]))

# --- printing is the inverse of parsing ---------------------------------------------------------------------------


@FIXED
@given(combined(trees(std_steps)))
def test_standard_trees_are_printed_and_parsed_back(tree: Node) -> None:
    assert parser.parse(show(tree)).tree == tree


@FIXED
@given(trees(osl_steps))
def test_osl_trees_are_printed_and_parsed_back(tree: Node) -> None:
    assert osl.parse(show(tree, "osl")).tree == tree


THESIS_ATOMS = ["D", "G", "S", "V", "X", "S^T", "D^R", "X^T", "S^T_glass", "D_floor", "X_p", "S_{glass}^R_p", "V_fog", "X_{two words}"]
thesis_parts = st.recursive(
    st.sampled_from(THESIS_ATOMS),
    lambda inner: st.one_of(
        st.lists(inner, min_size=1, max_size=3).map(lambda found: f"({' '.join(found)})"),
        st.lists(inner, min_size=2, max_size=3).map(lambda found: f"({' | '.join(found)})"),
        st.builds(lambda part, times: f"({part}){times}", inner, st.sampled_from(["*", "+", "?", "{2}", "{1,3}", "{2,}"])),
    ),
    max_leaves=6,
)
thesis_paths = st.builds(
    lambda source, inner: " ".join([source, *inner, "E"]),
    st.sampled_from(["L", "B", "L_lamp", "(L|B)", "O"]),
    st.lists(thesis_parts, max_size=4),
)
thesis_texts = st.lists(thesis_paths, min_size=1, max_size=2).map(" | ".join)


@FIXED
@given(thesis_texts)
def test_thesis_trees_are_printed_and_parsed_back(text: str) -> None:
    tree = thesis.parse(text, ["glass", "floor", "fog", "lamp"], ["p", "two words"]).tree
    assert thesis.parse(show(tree, "thesis"), ["glass", "floor", "fog", "lamp"], ["p", "two words"]).tree == tree


# --- the same paths in every notation -----------------------------------------------------------------------------


def same_language(a: Node, b: Node) -> None:
    """Minimal automata over one alphabet are equal."""
    one, two = automaton(a, Work(), steps_of(b)), automaton(b, Work(), steps_of(a))
    np.testing.assert_array_equal(one.dfa.transitions, two.dfa.transitions)
    np.testing.assert_array_equal(one.dfa.accepting, two.dfa.accepting)


@FIXED
@given(common_trees)
def test_osl_prints_what_the_standard_notation_says(tree: Node) -> None:
    same_language(compile(show(tree, "osl", source="std"), dialect="osl").tree, tree)
    same_language(compile(show(tree, "std", source="osl")).tree, tree)


INTERACTIONS = [("R", "D", ()), ("R", "S", ("a",)), ("T", "S", ()), ("V", None, ("a", "b"))]
WORDS = [[("C", None), *inner, ("L", None)] for length in range(4) for inner in product(INTERACTIONS, repeat=length)]


@examples(60)
@given(common_trees)
def test_both_notations_match_the_same_paths(tree: Node) -> None:
    a, b = compile(show(tree)), compile(show(tree, "osl", source="std"), dialect="osl")
    assert [word for word in WORDS if a.accepts(word)] == [word for word in WORDS if b.accepts(word)]


@FIXED
@given(thesis_texts)
def test_the_standard_notation_prints_what_the_thesis_says(text: str) -> None:
    tree = thesis.parse(text, ["glass", "floor", "fog", "lamp"], ["p", "two words"]).tree
    same_language(compile(show(tree, "std", source="thesis")).tree, camera_first(tree, Work()))


@FIXED
@given(thesis_texts)
def test_the_thesis_prints_what_the_standard_notation_says(text: str) -> None:
    """Turned camera first on the way: automata of both are equal once they are turned alike."""
    known = (["glass", "floor", "fog", "lamp"], ["p", "two words"])
    standard = parser.parse(show(thesis.parse(text, *known).tree, "std", source="thesis")).tree
    again = thesis.parse(show(standard, "thesis", source="std"), *known).tree
    same_language(camera_first(again, Work()), standard)


@pytest.mark.parametrize(
    ("text", "dialect", "target", "shown"),
    [
        ("CDL|CSL", "std", "osl", "[(CDL)(CSL)]"),
        ("(CD)*L", "std", "osl", "((CD)*L)"),
        ("(CDL)*", "osl", "std", "(CDL)*"),
        ("C X? L", "std", "osl", "C[RTV]{0,1}L"),
        ("CD{,3}L", "std", "osl", "CD{0,3}L"),
        ("LS+DE", "std", "osl", "CDS+L"),
        ("LS+DE|CL", "std", "osl", "[(CDS+L)(CL)]"),
        ("L S^T D_floor E", "thesis", "std", "CD@object:floor <TS>L"),
        ("L D E", "thesis", "osl", "CDL"),
        ("CD|SL", "osl", "std", "C[DS]L"),
        ("C<RD.>L", "osl", "std", "C<RD.>L"),
        ("C[^RD]L", "osl", "std", "C<.[^RD]>L"),
        ("CD|(SG)L", "osl", "thesis", "L (D|G S) E"),
        ("C<RD>X*B", "std", "thesis", "B X* D^R E"),
        ("C X@P L", "std", "std", "CX@P L"),
        ("C D@P{2}L", "std", "std", "CD@P{2}L"),
        ("C X @ 'P' @ ! object : 'floor.001' L", "std", "std", "CX@!object:'floor.001'@P L"),
        ("C <RD> @region:object .@depth:2.. .L", "std", "std", "C<RD>@'object'.@depth:2.. .L"),
        (r"C.@'o\'brien'L", "std", "std", r"C.@'o\'brien'L"),
        ("C(R|T)@P.@crosses:Q@technique:hit", "std", "std", "C[RT]@P .@technique:hit@crosses:Q"),
    ],
)
def test_examples(text: str, dialect: str, target: str, shown: str) -> None:
    assert compile(text, dialect).show(target) == shown


@pytest.mark.parametrize("field", ["object", "region", "depth"])
def test_a_test_of_several_names_is_printed_as_alternatives(field: str) -> None:
    names = frozenset({"2", "3..4"})
    either = sequence([CAMERA, step(Test("type", frozenset("R")), Test(field, names)), LIGHT])
    same_language(parser.parse(show(either)).tree, either)
    neither = sequence([CAMERA, step(Test(field, names, "without")), LIGHT])
    same_language(parser.parse(show(neither)).tree, neither)


# --- refusals -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "dialect", "target", "construct"),
    [
        ("C'a'L", "osl", "std", "labels by position"),
        ("C<RD.[^'b']>L", "osl", "std", "a label other than 'b' in place 2"),
        ("C<RD..>L", "osl", "std", "a label in place 2"),
        ("LDC", "osl", "std", "begins at a light"),
        ("CDL&CSL", "std", "osl", "Boolean combinations (`&`)"),
        ("CDL|C.L-CSL", "std", "osl", "Boolean combinations (`-`)"),
        ("C!'a'L", "std", "osl", "labels that are absent (`!'a'`)"),
        ("C'a'L", "std", "osl", "label at any place in the event's list, and counts places instead: `'a'`"),
        ("CX@P L", "std", "osl", "predicates after a symbol (`@P`)"),
        ("CX@object:floor L", "std", "osl", "(`@object:floor`)"),
        ("C<.[^x]>L", "std", "osl", "`[^x]`"),
        ("L S^T_glass E", "thesis", "osl", "predicates after a symbol (`@"),
        ("CDL-CSL", "std", "thesis", "Boolean combinations"),
        ("C'a'L", "osl", "thesis", "label"),
    ],
)
def test_a_tree_that_a_notation_cannot_say_is_refused(text: str, dialect: str, target: str, construct: str) -> None:
    with pytest.raises(ExpressionError) as raised:
        compile(text, dialect).show(target)
    assert construct in str(raised.value)


def test_quotes_in_labels_are_refused_by_osl() -> None:
    with pytest.raises(ExpressionError, match="escapes, and the label `o'brien` holds a quote"):
        show(Chain((CAMERA, Step((Test("label", frozenset({"o'brien"}), "in", 0),)))), "osl")


def test_the_dialect_is_checked() -> None:
    with pytest.raises(ExpressionError, match="expected one of the dialects std, osl, thesis, found `vray`"):
        compile("CDL").show("vray")
