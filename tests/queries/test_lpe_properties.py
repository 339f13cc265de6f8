"""Laws of light path expressions, on random ones: agreement with the plain matcher, algebra, printing, and bounded work."""

import time

import numpy as np
import pytest
from examples import examples
from hypothesis import given
from hypothesis import strategies as st
from words import matches

from queries.errors import ExpressionError
from queries.lpe import compile
from queries.lpe.parser import parse
from queries.lpe.printer import show
from queries.lpe.syntax import PathEvent

FIXED = examples(80)

ATOMS = ["C", "L", "D", "S", "G", "s", ".", "R", "T", "V", "X", "'a'", "!'a'", "['a''b']", "[^'a']", "[DS]", "[^D]", "[^R]", "<RD>", "<TS'b'>",
         "<R.!'a'>", "<.x>", "<[RT][^D]>", "<..'a''b'>", "<R..>", r"'o\'b'"]  # fmt: skip
SUFFIXES = ["@P", "@!P", "@'Q r'", "@crosses:P", "@!crosses:P", "@object:a", "@!object:b", "@material:a", "@light:a", "@light:b", "@medium:m",
            "@technique:sample", r"@blocker:'o\'b'", "@depth:1", "@depth:2..3", "@!depth:..2", "@depth:3..", "@s:1", "@t:2..", "@!t:..3",
            "@P@!object:a", "@depth:2@s:1"]  # fmt: skip
predicated = st.builds(lambda atom, suffix: f"{atom}{suffix} ", st.sampled_from([*ATOMS, "(D|S)", "[RT]", "[.@P 'a']"]), st.sampled_from(SUFFIXES))
REPETITIONS = ["*", "+", "?", "{2}", "{0}", "{1,}", "{,2}", "{1,3}"]
parts = st.recursive(
    st.one_of(st.sampled_from(ATOMS), st.sampled_from(ATOMS), predicated),
    lambda inner: st.one_of(
        st.lists(inner, min_size=2, max_size=4).map("".join),
        st.lists(inner, min_size=2, max_size=3).map(lambda found: f"({'|'.join(found)})"),
        st.lists(inner, min_size=1, max_size=3).map(lambda found: f"[{''.join(found)}]"),
        st.builds(lambda part, times: f"({part}){times}", inner, st.sampled_from(REPETITIONS)),
    ),
    max_leaves=8,
)
lights = st.one_of(st.just("L"), st.sampled_from(SUFFIXES).map(lambda suffix: f"L{suffix}"))
wholes = st.builds(lambda part, light: f"C{part}{light}", parts, lights)  # camera first, so that nothing is turned round
combined = st.recursive(wholes, lambda inner: st.builds(lambda a, op, b: f"({a}){op}({b})", inner, st.sampled_from("|&-^"), inner), max_leaves=4)

ONE_OF = {"object": "ab", "material": "ab", "medium": "m", "blocker": ["o'b", "b"], "technique": ["sample", "hit"], "s": "012", "t": "1234"}
SOME_OF = {"region": ["P", "Q r"], "crosses": "P", "light": "ab"}
facts = st.tuples(
    *(st.sampled_from(names).map(lambda name, field=field: {(field, name)}) | st.just(set()) for field, names in ONE_OF.items()),
    *(st.sets(st.sampled_from(names)).map(lambda found, field=field: {(field, name) for name in found}) for field, names in SOME_OF.items()),
).map(lambda found: frozenset().union(*found))
events = st.builds(
    PathEvent,
    st.sampled_from("RTVCL"),
    st.sampled_from(["D", "G", "S", "s", None]),
    st.lists(st.sampled_from(["a", "b", "c", "o'b"]), max_size=2, unique=True).map(tuple),
    st.one_of(st.none(), facts),
)
paths = st.lists(events, max_size=5).map(lambda inner: (PathEvent("C", None), *inner, PathEvent("L", None)))


@FIXED
@given(combined, st.lists(paths, min_size=4, max_size=8))
def test_agrees_with_the_plain_matcher(text: str, words: list[tuple[PathEvent, ...]]) -> None:
    compiled = compile(text)
    for word in words:
        assert compiled.accepts(word) == matches(parse(text).tree, word)


@FIXED
@given(wholes, wholes, paths)
def test_combinations_partition(a: str, b: str, word: tuple[PathEvent, ...]) -> None:
    in_a, in_b = compile(a).accepts(word), compile(b).accepts(word)
    assert compile(f"{a}|{b}").accepts(word) == (in_a or in_b)
    both, rest = compile(f"{a}&{b}").accepts(word), compile(f"{a}-{b}").accepts(word)
    assert both == (in_a and in_b)
    assert both + rest == in_a
    assert compile(f"{a}^{b}").accepts(word) == (in_a != in_b)


@FIXED
@given(combined)
def test_printing_and_parsing_are_inverse(text: str) -> None:
    tree = parse(text).tree
    assert parse(show(tree)).tree == tree
    assert show(parse(show(tree)).tree) == show(tree)


@FIXED
@given(combined)
def test_equal_languages_have_equal_automata(text: str) -> None:
    once, twice = compile(text), compile(f"({text})|({text})")
    np.testing.assert_array_equal(once.dfa.transitions, twice.dfa.transitions)
    np.testing.assert_array_equal(once.dfa.accepting, twice.dfa.accepting)
    assert compile(f"({text})-({text})").dfa.states == 1


@FIXED
@given(st.lists(st.sampled_from(["D", "S", "<RD>", "<TS'a'>", "G*", "(D|S)+", "(DS)?"]), min_size=1, max_size=5), paths)
def test_light_first_is_the_same_expression_read_backward(items: list[str], word: tuple[PathEvent, ...]) -> None:
    # (DS)? read backward is (SD)?
    forward = "C" + "".join(items) + "L"
    backward = "L" + "".join(item.replace("DS", "SD") for item in reversed(items)) + "E"
    assert compile(forward).accepts(word) == compile(backward).accepts(word)


@FIXED
@given(st.lists(predicated, min_size=1, max_size=4), lights, paths)
def test_predicates_read_light_first(items: list[str], light: str, word: tuple[PathEvent, ...]) -> None:
    # Turned round, the same events are asked the same: depth still counts from the camera.
    forward, backward = "C" + "".join(items) + light, light + " " + "".join(reversed(items)) + "E"
    assert compile(forward).accepts(word) == compile(backward).accepts(word)
    assert compile(f"({forward}) ^ ({backward})").dfa.states == 1


@examples(300)
@given(
    st.text("CDX.@!:;PQ'3.L*(|)[]{}<> \ud800\0", max_size=30),
    st.sampled_from(["", "noclamp;", "C.*"]),
    st.sampled_from([*SUFFIXES, "@depth:", "@object:", "@"]),
)
def test_random_predicates_are_compiled_or_refused(text: str, before: str, suffix: str) -> None:
    for whole in (before + text, f"{before}{text}{suffix}", f"{before}X{suffix}{text}"):
        for known in (None, ["a", "P"]):
            column = refusal_column(whole, known)
            if column is not None:
                assert 0 <= column <= len(whole) + 1
                continue
            compiled = compile(whole, objects=known, regions=known)
            assert parse(compiled.show()).tree == compiled.tree
            assert parse(compiled.show()).prefixes == compiled.prefixes


@examples(400)
@given(st.one_of(st.text(max_size=40), st.text("CDSLGRTVOBxsXE.*+?{}[]()<>|&^-!'\\,0123456789ab \n", max_size=40)))
def test_random_text_is_compiled_or_refused(text: str) -> None:
    column = refusal_column(text)
    if column is None:
        compiled = compile(text)
        assert parse(show(compiled.tree)).tree == compiled.tree
    else:
        assert 0 <= column <= len(text) + 1


def refusal_column(text: str, known: list[str] | None = None) -> int | None:
    """Where a text is refused; None where it compiles."""
    try:
        compiled = compile(text, objects=known, regions=known)
        if not compiled.tests & {"region", "crosses"}:
            assert compiled.sql()
    except ExpressionError as error:
        return error.column
    return None


HEAVY = {
    "nested repetition": "C" + "(" * 50 + "D" + "*)" * 50 + "L",
    "multiplied repetition": "C(((.{1000}){1000}){1000})L",
    "repeated nothing": "C" + "(" * 20 + ".{0}" + "){1000}" * 20 + "L",
    "exponential automaton": "C.*D.{30}L",
    "many optional": "C" + ".?" * 1000 + "L",
    "thousands of alternatives": "|".join(f"C{'DSG'[i % 3] * (i % 40)}L" for i in range(600)),
    "thousands of labels in one set": "C[" + "".join(f"'a{i}'" for i in range(2000)) + "]L",
    "many labels": "|".join(f"C'a{i}'L" for i in range(40)),
    "many combinations": "&".join(f"C.*{'DSG'[i % 3]}.{{{i % 7}}}L" for i in range(60)),
    "long": "C" + "D" * 2900 + "L",
    "too long": "C" + "D" * 19_000 + "L",
    "a thousand predicates": "CX" + "@P@!object:a" * 800 + "L",
    "a thousand different predicates": "CX" + "".join(f"@!object:n{i}" for i in range(1000)) + " L",
    "a thousand regions": "CX" + "".join(f"@!P{i}" for i in range(1000)) + " L",
    "many regions": "C" + "".join(f"X@P{i} " for i in range(30)) + "L",
    "many objects": "C[" + "".join(f".@object:n{i} " for i in range(900)) + "]L",
    "many lights": "C.*[" + "".join(f"L@light:n{i} " for i in range(300)) + "]",
    "many fields": "C.*" + "".join(f"X@P{i}@object:n{i}@depth:{i}@crosses:P{i}@light:n{i}@s:{i} " for i in range(6)) + "L",
    "great depths": "C(.*D@depth:1000..)*S@depth:..999 .*L@depth:500..",
    "many depths": "C[" + "".join(f".@depth:{i} " for i in range(1000)) + "]*L",
    "prefixes": "noclamp;" * 2400 + "CDL",
    "half prefixes": "noclamp " * 2400,
    "dots": "CX@depth:" + "." * 19_000,
    "at signs": "C" + "@" * 19_000,
}


MALFORMED = {"half prefixes": 1, "dots": 10, "at signs": 3}  # where


@pytest.mark.parametrize(("name", "text"), HEAVY.items(), ids=HEAVY.keys())
def test_heavy_expressions_end_soon(name: str, text: str) -> None:
    start = time.process_time()
    assert refusal_column(text) in ((None, 0) if name not in MALFORMED else (MALFORMED[name],))  # 0: the text as a whole is too large
    assert time.process_time() - start < 30  # a guard against exponential work: the bounds themselves count steps, not seconds
