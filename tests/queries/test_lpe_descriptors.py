"""Descriptors are a partition of all classes; the words and the expression of one class."""

import itertools

import numpy as np
import numpy.typing as npt
import pytest
from same_paths import same_paths

from queries.errors import QueryError
from queries.lpe import Expression, compile
from queries.lpe.class_words import event_of
from queries.lpe.descriptors import DESCRIPTORS, class_expression, describe_class, descriptor, descriptor_expression
from queries.lpe.parser import parse
from queries.lpe.syntax import Choice, PathEvent

INSIDE = ["RD", "RG", "RS", "TD", "TG", "TS", "Ts", "V", "VS", "R"]
LIGHTS = ["L", "O", "B"]


def all_classes(longest: int) -> list[list[str]]:
    """Every class of at most ``longest`` letters."""
    words = (word for length in range(longest - 1) for word in itertools.product(INSIDE, repeat=length))
    return [["C", *word, light] for word in words for light in LIGHTS]


def accepted(expression: Expression, classes: list[list[str]]) -> npt.NDArray[np.bool_]:
    """Whether the automaton of an expression accepts each class."""
    symbols = {letter: int(expression.alphabet.symbols_of([event_of(letter)])[0]) for letter in ["C", *INSIDE, *LIGHTS]}
    found = np.empty(len(classes), np.bool_)
    for i, letters in enumerate(classes):
        state = 0
        for letter in letters:
            state = expression.dfa.transitions[state, symbols[letter]]
        found[i] = expression.dfa.accepting[state]
    return found


def test_every_class_up_to_six_letters_has_exactly_one_descriptor() -> None:
    classes = all_classes(6)
    table = np.array([accepted(compile(row.expression), classes) for row in DESCRIPTORS])
    assert (table.sum(axis=0) == 1).all()
    assert table.any(axis=1).all()  # and no descriptor is empty
    names = [DESCRIPTORS[i].name for i in table.argmax(axis=0)]
    assert names == [descriptor(letters) for letters in classes]


def test_descriptors_are_a_partition_of_paths_of_any_length() -> None:
    for a, b in itertools.combinations(DESCRIPTORS, 2):
        both = compile(f"({a.expression}) & ({b.expression})")
        assert any("matches no path" in warning for warning in both.warnings), (a.name, b.name)
    assert same_paths(Choice(tuple(parse(row.expression).tree for row in DESCRIPTORS)), parse("C X* [LOB]").tree)


def test_descriptors_have_no_warnings_and_different_names() -> None:
    assert all(compile(row.expression).warnings == () for row in DESCRIPTORS)
    assert len({row.name for row in DESCRIPTORS}) == len({row.meaning for row in DESCRIPTORS}) == len(DESCRIPTORS)


def test_the_expression_of_a_descriptor() -> None:
    assert all(descriptor_expression(row.name) == row.expression for row in DESCRIPTORS)
    with pytest.raises(QueryError, match=r"expected one of the descriptors emission, .*, found `shine`"):
        descriptor_expression("shine")


@pytest.mark.parametrize(
    ("letters", "name"),
    [
        ("C L", "emission"),
        ("C Ts O", "emission"),
        ("C B", "background"),
        ("C RD L", "direct"),
        ("C Ts TD Ts B", "direct"),
        ("C RG L", "direct glossy"),
        ("C RD RD L", "diffuse indirect"),
        ("C RD TS RD L", "diffuse indirect"),
        ("C RD RG L", "diffuse indirect"),
        ("C RD RD TS L", "diffuse indirect"),
        ("C RG RD B", "glossy indirect"),
        ("C RD RS L", "reflective caustic"),
        ("C RG RS Ts RS L", "reflective caustic"),
        ("C RD TS TS L", "refractive caustic"),
        ("C RD RS TS RS TS L", "refractive caustic"),
        ("C RS L", "reflected emission"),
        ("C Ts RS RS B", "reflected background"),
        ("C RS RD L", "reflection"),
        ("C RS RD RG L", "reflection"),
        ("C RS RD RD TS L", "reflection"),
        ("C RS RD TS L", "reflected caustic"),
        ("C TS TS L", "transmitted emission"),
        ("C TS RS TS B", "transmitted background"),
        ("C RS TS RD L", "transmission"),
        ("C TS TS RD Ts L", "transmission"),
        ("C TS TS RD TS TS L", "transmitted caustic"),
        ("C V L", "volume"),
        ("C RD VD RS B", "volume"),
        ("C R L", "other"),
        ("C RD R RD L", "other"),
    ],
)
def test_what_classes_are_called(letters: str, name: str) -> None:
    assert descriptor(letters.split()) == name


@pytest.mark.parametrize("letters", [[], ["C"], ["L"], ["C", "RD"], ["RD", "L"], ["C", "L", "L"], ["C", "C", "L"], ["C", "B", "RD"]])
def test_what_is_no_path_is_refused(letters: list[str]) -> None:
    with pytest.raises(QueryError, match="expected the letters of a path"):
        descriptor(letters)
    with pytest.raises(QueryError, match="expected the letters of a path"):
        class_expression(letters)
    with pytest.raises(QueryError, match="expected the letters of a path"):
        describe_class(letters)


@pytest.mark.parametrize("letter", ["", "Q", "RDS", "RQ", "rd", "'"])
def test_what_is_no_letter_is_refused(letter: str) -> None:
    for ask in (descriptor, class_expression, describe_class):
        with pytest.raises(QueryError, match="expected an event type"):
            ask(["C", letter, "L"])


WORDS = [
    ("C RD TS TS L", "- floor glass_ball glass_ball lamp", "caustic through glass_ball onto floor from lamp"),
    ("C RD TS RS TS L", "- floor ball ball ball lamp", "caustic through ball onto floor from lamp"),
    ("C RD TS TS L", None, "refractive caustic"),
    ("C RD RS L", "- floor ring -", "caustic off ring onto floor"),
    ("C RD RS L", None, "reflective caustic"),
    ("C RG RS TS L", "- floor a b lamp", "caustic through b, then off a onto floor from lamp"),
    ("C RG RS L", None, "reflective caustic onto gloss"),
    ("C L", "- lamp", "the emitter lamp seen directly"),
    ("C L", None, "every emitter seen directly"),
    ("C B", "- sky", "the background sky seen directly"),
    ("C O", "- sign", "the glowing object sign seen directly"),
    ("C RD L", "- floor lamp", "direct light onto floor from lamp"),
    ("C RD O", "- floor sign", "direct light onto floor from the glowing object sign"),
    ("C RG B", None, "direct glossy light from the background"),
    ("C RS L", "- mirror lamp", "the emitter lamp mirrored in mirror"),
    ("C RS L", None, "every emitter seen in mirrors"),
    ("C TS TS L", "- pane pane lamp", "the emitter lamp seen through pane"),
    ("C RS RD L", "- mirror floor lamp", "direct light onto floor from lamp mirrored in mirror"),
    ("C TS TS RS RD L", "- pane pane mirror floor lamp", "direct light onto floor from lamp mirrored in mirror, then seen through pane"),
    ("C RD RD L", "- floor left_wall lamp", "diffuse indirect light off left_wall onto floor from lamp"),
    ("C RG RD TS L", "- floor wall pane lamp", "glossy indirect light through pane, then off wall onto floor from lamp"),
    ("C RD RD RD L", None, "diffuse indirect light of 3 bounces"),
    ("C Ts RD Ts L", "- leaf floor leaf lamp", "direct light onto floor from lamp"),
    ("C RD L", ["", "my floor", "the"], "direct light onto 'my floor' from 'the'"),
    ("C V L", "- fog lamp", "the camera, then volume scattering without a scattering type on fog, then a light named lamp"),
    ("C RD RD RD RD RD RD L", None, "the camera" + ", then diffuse reflection" * 6 + ", then a light"),
]


@pytest.mark.parametrize(("letters", "objects", "words"), WORDS, ids=[f"{row[0]} ({row[1]})" for row in WORDS])
def test_words_of_a_class(letters: str, objects: str | list[str] | None, words: str) -> None:
    names = objects.split() if isinstance(objects, str) else objects
    assert describe_class(letters.split(), None if names is None else [None if name in ("", "-") else name for name in names]) == words


def test_every_class_has_words() -> None:
    assert all(describe_class(letters) for letters in all_classes(5))


def test_a_class_needs_an_object_for_each_letter() -> None:
    with pytest.raises(QueryError, match="for each of the 3 letters, found 2"):
        describe_class(["C", "RD", "L"], [None, "floor"])


def test_the_expression_of_a_class_selects_it_alone() -> None:
    classes = [letters for letters in all_classes(5) if not set(letters) & {"TD", "TG", "VS", "O"}]
    for chosen in classes[:: max(1, len(classes) // 60)]:
        found = accepted(compile(class_expression(chosen)), classes)
        assert [letters for letters, yes in zip(classes, found, strict=True) if yes] == [chosen]


def test_the_expression_of_a_class_with_objects_selects_it_alone() -> None:
    inside = list(itertools.product(["RD", "TS"], ["floor", "glass ball", "o'b"]))
    last = [("L", "lamp"), ("L", "the sun"), ("B", "sky")]
    classes = [[("C", None), *word, end] for length in range(3) for word in itertools.product(inside, repeat=length) for end in last]
    words = [[_event(letter, name) for letter, name in found] for found in classes]
    for i, chosen in enumerate(classes):
        expression = compile(class_expression([letter for letter, _ in chosen], [name for _, name in chosen]))
        assert [j for j, word in enumerate(words) if expression.accepts(word)] == [i]


def _event(letter: str, name: str | None) -> PathEvent:
    """A letter as a run knows it."""
    field = "light" if letter in LIGHTS else "object"
    return event_of(letter)._replace(facts=frozenset() if name is None else frozenset({(field, name)}))
