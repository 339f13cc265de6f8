"""Texts that the standard dialect and OSL understand differently: compiling one says so and shows both readings; it says nothing where they agree."""

from itertools import product

import pytest
from examples import examples
from hypothesis import HealthCheck, given
from hypothesis import strategies as st
from words import word

from queries.errors import ExpressionError
from queries.lpe import compile, osl, parser

DIFFER = [  # text, what is said of OSL's reading, of ours, a path that one of them alone matches
    ("CDL|CSL", "`CD[CL]SL`", "`CDL|CSL`", "C RD L"),
    ("CD|(SD)L", "`C(D|SD)L`", "`CD|SDL`", "C RD L"),
    ("CL|C.B", "`C[CL].B`", "`CL|C.B`", "C L"),
    ("C'a'L", "OSL reads labels by place, 'a' as an event's first label", "here they may stand in any place", "C RD:b:a L"),
    ("C<RD'a''b'>L", "labels by place, 'a' as an event's first", "in any place", "C RD:b:a L"),
    ("C<RD.'b'>L", "as the camera, then diffuse reflection whose second label is b", "`C<RD'b'.>L`", "C RD:b L"),
    ("C[^'a']L", "labels by place, 'a' as an event's first", "in any place", "C RD:b:a L"),
    (
        "C.*<RD..>L",
        "the camera, then any event any number of times, then diffuse reflection with a second label",
        "`C.*<RD.>L`",
        "C RD:a L",
    ),
    ("LS+DC", "a light, then specular", "`CDS+L`", "C RD TS L"),
]


def said(text: str) -> list[str]:
    """What compiling a standard text says of OSL's reading."""
    return [warning for warning in compile(text).warnings if "OSL reads" in warning]


@pytest.mark.parametrize(("text", "theirs", "ours", "path"), DIFFER, ids=[row[0] for row in DIFFER])
def test_a_difference_is_told_with_both_readings(text: str, theirs: str, ours: str, path: str) -> None:
    assert compile(text).accepts(word(path)) != compile(text, dialect="osl").accepts(word(path))
    [warning] = said(text)
    assert theirs in warning
    assert ours in warning
    assert len(warning) < 220


@pytest.mark.parametrize(
    "text",
    ["CDL", "C[DS]*L", "C(D|S)L", "C[D(SS)]L", "C[^RD]L", "(CDL)|(CSL)", "((CDL)|(CSL))", "CD{3,2}L", "C<D>L", "C<RD.>L", "C<.x>L", "C.*"],
)
def test_nothing_is_told_where_the_readings_agree(text: str) -> None:
    assert said(text) == []


@pytest.mark.parametrize("text", ["CD?L", "C D L|C S L", "C[D|S]L|B", "C'a'L - CDL", "C!'a'L|B", "CX'a'L", "LS+DE|CSL", r"C'o\'b'L"])
def test_nothing_is_told_of_texts_that_osl_refuses(text: str) -> None:
    with pytest.raises(ExpressionError):
        osl.parse(text)
    assert said(text) == []


@pytest.mark.parametrize("text", [row[0] for row in DIFFER])
def test_a_text_in_osls_notation_is_read_as_osl_reads_it(text: str) -> None:
    assert not [warning for warning in compile(text, dialect="osl").warnings if "OSL reads this text as" in warning]


EVENTS = [("R", "D", ()), ("T", "S", ("a",)), ("V", None, ("b", "a"))]
PATHS = [
    [("C", None), *inner, (light, None, lamp)]
    for length in range(3)
    for inner in product(EVENTS, repeat=length)
    for light, lamp in (("L", ()), ("L", ("a",)), ("B", ()))
]


@examples(150, HealthCheck.filter_too_much)
@given(
    st.lists(
        st.sampled_from(["C", "D", "S", "L", "B", "R", ".", "'a'", "|", "|", "*", "(D|S)", "[DS]", "<RD>", "[^RD]", "CDL", "L*"]),
        min_size=1,
        max_size=7,
    )
)
def test_what_is_told_nothing_of_matches_the_same_paths(pieces: list[str]) -> None:
    text = "".join(pieces)
    try:
        osl.parse(text), parser.parse(text)
    except ExpressionError:
        return
    ours, theirs = compile(text), compile(text, dialect="osl")
    assert bool(said(text)) >= any(ours.accepts(path) != theirs.accepts(path) for path in PATHS)
