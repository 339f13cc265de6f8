"""Short phrases and the expressions that they stand for: one and the same in both directions."""

import pytest
from examples import examples
from hypothesis import given
from hypothesis import strategies as st
from same_paths import same_paths

from queries.errors import QueryError
from queries.lpe.effects import EFFECTS, Effect, Phrase, Source, Surface, View
from queries.lpe.parser import parse
from queries.lpe.phrases import expression_of, phrase_of, read, words
from queries.lpe.shapes import tree_of
from queries.lpe.thesis import parse as parse_thesis

FIXED = examples(200)

# A phrase, its expression, and how else the same may be written.
TABLE = [
    ("caustic through glass_ball seen in p", "C D@p <TS>@object:glass_ball+ L", ["L <TS>@object:glass_ball+ D@p E"]),
    ("caustic through ball", "C D <TS>@object:ball+ L", ["C D <TS>@object:ball* <TS>@object:ball L"]),
    ("caustic", "C D S+ L", ["L S+ D E", "C D S* S L", "C D S{1,} L"]),
    ("caustic twice", "C D S{2} L", ["C D S S L"]),
    ("caustic through j twice onto any surface from i seen in p", "C X@p <TS>@object:j{2} L@light:i",
     ["C .@p <TS>@object:j <TS>@object:j L@light:i"]),
    ("reflective caustic 2 times or more onto gloss of floor", "C G@object:floor <RS>{2,} L", ["C G@object:floor <RS> <RS> <RS>* L"]),
    ("caustic by way of ball", "C D S@object:ball+ L", []),
    ("direct light from lamp", "C D L@light:lamp", ["L@light:lamp D E"]),
    ("direct light onto floor from the background seen in p", "C D@object:floor@p B", []),
    ("direct glossy light from every source", "C G [LOB]", []),
    ("diffuse indirect light", "C D D+ L", ["C D{2,} L", "C D* D D L", "C D D D* L"]),
    ("glossy indirect light", "C G X+ L", ["C G .+ L"]),
    ("indirect light", "C D X+ L", ["C D .+ L", "C D . .* L"]),
    ("color bleeding from left_wall onto floor", "C D@object:floor D@object:left_wall X* L", []),
    ("one-bounce color bleeding from left_wall", "C D D@object:left_wall L", []),
    ("the emitter lamp seen directly", "C L@light:lamp", []),
    ("the background seen directly", "C B", []),
    ("mirror reflection of floor in mirror", "C <RS>@object:mirror+ X@object:floor X* L", []),
    ("mirror reflection of the emitter lamp", "C <RS>+ L@light:lamp", []),
    ("the emitter lamp seen through glass", "C <TS>@object:glass+ L@light:lamp", []),
    ("light seen through glass", "C <TS>@object:glass+ X* L", []),
    ("light seen in mirrors", "C <RS>+ X* L", []),
    ("view of floor through glass", "C <TS>@object:glass+ X@object:floor X* L", []),
    ("caustic off ring onto table from lamp mirrored in mirror", "C <RS>@object:mirror+ D@object:table <RS>@object:ring+ L@light:lamp", []),
    ("direct light seen through clear objects", "C <TS>+ D L", []),
    ("all scattered light onto floor seen in 'my region'", "C X@object:floor@'my region' X* L", []),
    ("all diffuse, glossy and specular light seen in p", "C X@p [DGS]* L", ["L (D|G|S)* X@p E"]),
    ("all light from lamp", "C X* L@light:lamp", ["C .* L@light:lamp"]),
]  # fmt: skip


@pytest.mark.parametrize(("phrase", "expression", "others"), TABLE, ids=[row[0] for row in TABLE])
def test_phrases_and_expressions(phrase: str, expression: str, others: list[str]) -> None:
    assert expression_of(phrase) == expression
    for text in [expression, *others]:
        tree = parse(text).tree
        assert same_paths(tree, parse(expression).tree)
        assert phrase_of(tree) == phrase


@pytest.mark.parametrize(
    ("text", "phrase"),
    [
        ("L_i S_j^T S_j^T X_p E", "caustic through j twice onto any surface from i seen in p"),
        ("L(D|G|S)^* X_p E", "all diffuse, glossy and specular light seen in p"),
        ("L D D_{left wall} E", None),
        ("L D_{left wall} D E", "one-bounce color bleeding from 'left wall'"),
    ],
)
def test_phrases_of_the_thesis_notation(text: str, phrase: str | None) -> None:
    assert phrase_of(parse_thesis(text).tree) == phrase


@pytest.mark.parametrize(
    "text",
    ["CDL & CSL", "CDL | CSL", "C D? L", "C <RD> L", "C D 'a' L", "C D@!p L", "C D@depth:1 L", "C D D L", "C D S{1,3} L", "C@p D L", "C D .",
     "C D [LB]", "D", "C", "C D L@technique:hit", "C D@p@q L", "C (D S)+ L", "C D D@p L", "L L", "C D@object:a L|C D@object:b L",
     "C S{1000} D{1000} L"],
)  # fmt: skip
def test_no_phrase_where_none_says_exactly_the_same(text: str) -> None:
    assert phrase_of(parse(text).tree) is None


def test_words_may_be_written_in_any_case_and_spaced_at_will() -> None:
    assert expression_of("  Caustic THROUGH   Glass\nonto floor ") == "C D@object:floor <TS>@object:Glass+ L"


def test_names_are_quoted_where_they_could_be_other_words() -> None:
    for name in [
        "the",
        "Any",
        "mirrors",
        "clear",
        "two words",
        "o'brien",
        "back\\slash",
        "seen",
        "from",
        "object",
        "L",
        "floor.001",
        "twice",
        "a  b",
    ]:
        text = words(Phrase(_effect("caustic through {a}"), {"a": name}, Source("L", name), Surface("D", name, name), View("R", name)))
        found = read(text)
        assert (found.names, found.source.name, found.surface, found.view) == ({"a": name}, name, Surface("D", name, name), View("R", name))
        assert phrase_of(parse(expression_of(text)).tree) == text
    assert words(Phrase(_effect("light seen through {a}"), {"a": "clear"})) == "light seen through 'clear'"


@pytest.mark.parametrize(
    "text", ["", "nonsense", "caustic through", "caustic through glass onto", "direct light seen in", "caustic through the", "all", "C D L"]
)
def test_what_is_no_phrase_is_refused_with_those_that_are(text: str) -> None:
    with pytest.raises(QueryError, match=r"expected one of the phrases: .*caustic through NAME.*onto NAME"):
        expression_of(text)


@pytest.mark.parametrize("text", ["caustic 0 times", "caustic 1001 times or more"])
def test_counts_are_bounded(text: str) -> None:
    with pytest.raises(QueryError, match="expected a count from 1 to 1,000"):
        expression_of(text)


@pytest.mark.parametrize("text", ["caustic through \0", "direct light from 'a\ud800b'"])
def test_names_that_cannot_be_are_refused(text: str) -> None:
    with pytest.raises(QueryError, match="no name can have"):
        expression_of(text)


def _effect(name: str) -> Effect:
    return next(effect for effect in EFFECTS if effect.words == name)


# --- any phrase ---------------------------------------------------------------------------------------------------

names = st.sampled_from(["floor", "glass ball", "p", "the", "seen", "o'b", "clear", "L"])
maybe_names = st.one_of(st.none(), names)


@st.composite
def phrases(draw: st.DrawFn) -> Phrase:
    effect = draw(st.sampled_from(EFFECTS))
    slots = {slot: draw(names) for slot in ("a", "b") if f"{{{slot}}}" in effect.words}
    source = Source(draw(st.sampled_from(["L", "B", "O", "BLO"])), draw(maybe_names))
    surface, view = None, None
    if effect.seen:
        scattering = "G" if effect.seen.scattering == "G" else draw(st.sampled_from(["", "D", "G"]))
        surface = Surface(scattering, draw(maybe_names), draw(maybe_names))
        view = draw(st.one_of(st.none(), st.builds(View, st.sampled_from("RT"), maybe_names)))
    times = draw(st.tuples(st.integers(1, 4), st.booleans())) if effect.counted else (1, True)
    return Phrase(effect, slots, source, surface, view, times)


@FIXED
@given(phrases())
def test_words_are_read_as_what_they_say(phrase: Phrase) -> None:
    assert read(words(phrase)) == phrase


@FIXED
@given(phrases())
def test_expression_and_phrase_are_inverse(phrase: Phrase) -> None:
    tree = parse(expression_of(words(phrase))).tree
    assert tree == tree_of(phrase)
    said = phrase_of(tree)
    assert said is not None
    # another effect may be the better word for the same paths, but it must select them all the same
    assert parse(expression_of(said)).tree == tree or same_paths(parse(expression_of(said)).tree, tree)


pieces = ["caustic", "through", "light", "seen", "in", "the", "emitter", "'", "onto", "glass", "from", "mirrors", "'a b'", "\\", "twice", "9 times"]
almost = st.one_of(st.text(max_size=60), phrases().map(lambda phrase: words(phrase)[:-1]), st.lists(st.sampled_from(pieces)).map(" ".join))


@FIXED
@given(almost)
def test_random_text_is_read_or_refused(text: str) -> None:
    try:
        expression = expression_of(text)
    except QueryError:
        return
    assert phrase_of(parse(expression).tree) is not None


@pytest.mark.parametrize("effect", EFFECTS, ids=[effect.words for effect in EFFECTS])
def test_every_effect_matches_paths_and_says_what_it_is(effect: Effect) -> None:
    plain = Phrase(
        effect, {slot: slot for slot in ("a", "b") if f"{{{slot}}}" in effect.words}, surface=effect.seen and Surface(effect.seen.scattering)
    )
    tree = tree_of(plain)
    assert same_paths(tree, parse(expression_of(words(plain))).tree)
    assert phrase_of(tree) == words(plain)
