"""Expressions in words: every field, and the short phrase first where one says exactly the same."""

import pytest

from queries.lpe import compile
from queries.lpe.describe import describe, explain
from queries.lpe.parser import parse
from queries.lpe.syntax import NAMED_FIELDS, NUMBERED_FIELDS, Step, Test, step
from queries.lpe.thesis import parse as parse_thesis

LONG = [
    ("CDL", "the camera, then diffuse scattering, then a light"),
    ("C<RD!'a'>L", "the camera, then diffuse reflection not labeled a, then a light"),
    ("C<RD[^'a']>L", "the camera, then diffuse reflection with a label, but not a, then a light"),
    ("C[^RD]L", "the camera, then anything but diffuse scattering, then a light"),
    ("C<D>L", "the camera, then no such event (D), then a light"),
    ("CXL", "the camera, then any interaction, then a light"),
    ("C<RD'floor'>+B", "the camera, then diffuse reflection labeled floor once or more, then the background"),
    ("C<Vx>L", "the camera, then volume scattering without a scattering type, then a light"),
    ("CD@object:floor@p L", "the camera, then diffuse scattering on floor in p, then a light"),
    ("CX@!p@material:white L@light:lamp", "the camera, then any interaction of material white not in p, then a light named lamp"),
    ("C.@crosses:slab L@technique:sample", "the camera, then any event reached across slab, then a light found by an emitter sample"),
    ("CD@depth:2.. L", "the camera, then diffuse scattering at depth 2 or more, then a light"),
    ("CL@s:1", "the camera, then a light with s = 1 (vertices sampled from the light)"),
    ("CL@!t:..3", "the camera, then a light not with t = at most 3 (vertices sampled from the camera)"),
    ("CD@!depth:2..4 L@blocker:ball", "the camera, then diffuse scattering not at depth 2 to 4, then a light blocked by ball"),
    ("CV@medium:fog L", "the camera, then volume scattering in medium fog, then a light"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), LONG, ids=[row[0] for row in LONG])
def test_the_long_form(text: str, words: str) -> None:
    assert describe(parse(text).tree) == words


@pytest.mark.parametrize("field", NAMED_FIELDS + NUMBERED_FIELDS)
@pytest.mark.parametrize("mode", ["in", "without"])
def test_every_field_has_words(field: str, mode: str) -> None:
    said = describe(Step((Test(field, frozenset({"7"}), mode),)))
    assert "7" in said
    assert ("not " in said or "without " in said) == (mode == "without")


@pytest.mark.parametrize(
    ("mode", "names", "words"),
    [
        ("in", ["coat"], "any event whose second label is coat"),
        ("other", ["coat"], "any event with a second label other than coat"),
        ("other", [], "any event with a second label"),
    ],
)
def test_labels_by_position(mode: str, names: list[str], words: str) -> None:
    assert describe(step(Test("label", frozenset(names), mode, 1))) == words


def test_the_short_phrase_comes_first() -> None:
    assert explain(parse("C D@object:floor <TS>@object:glass+ L").tree) == (
        "caustic through glass onto floor "
        "(the camera, then diffuse scattering on floor, then specular transmission on glass once or more, then a light)"
    )
    assert explain(parse_thesis("L_i S_j^T S_j^T X_p E").tree).startswith(
        "caustic through j twice onto any surface from i seen in p (a light named i, then"
    )


@pytest.mark.parametrize(
    ("prefixes", "words"),
    [
        ("unoccluded;", "as if nothing cast a shadow"),
        ("shadows;", "blocked connections alone, the light that is missing in shadows"),
        ("noclamp; nothruput;", "without clamping; without the walk's throughput up to the last interaction"),
    ],
)
@pytest.mark.parametrize("dialect", ["std", "osl", "thesis"])
def test_prefixes_are_said_last(prefixes: str, words: str, dialect: str) -> None:
    text = "LDE" if dialect == "thesis" else "CDL"
    expression = compile(f"{prefixes} {text}", dialect)  # a space before the expression, in OSL's notation too
    assert expression.describe() == f"{compile(text, dialect).describe()}; {words}"


@pytest.mark.parametrize("text", ["CD'left_wall'L", "CDL & CSL", "C D? L", "C <RD> L", "L L", "D"])
def test_the_long_form_alone_where_no_phrase_says_the_same(text: str) -> None:
    assert explain(parse(text).tree) == describe(parse(text).tree)
