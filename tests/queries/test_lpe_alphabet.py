"""Alphabets and automata: every event has its symbol, symbols are what tests can tell apart, and automata are as small as can be."""

import itertools
import random

import numpy as np
import pytest
from words import dated, matches

from queries.errors import ExpressionError
from queries.lpe import compile
from queries.lpe.alphabet import Alphabet
from queries.lpe.automaton import automaton
from queries.lpe.dfa import Dfa, minimize
from queries.lpe.limits import Work
from queries.lpe.parser import parse
from queries.lpe.syntax import PathEvent, Step, Test, choice, sequence, step, steps_of


def everything(names: dict[str, list[str]], at_most: dict[str, int]) -> list[PathEvent]:
    """Events with every combination of facts, up to so many of each field, on some letters and label lists."""
    choices = [
        [frozenset((field, name) for name in chosen) for size in range(at_most[field] + 1) for chosen in itertools.combinations(found, size)]
        for field, found in names.items()
    ]
    facts = [frozenset().union(*chosen) for chosen in itertools.product(*choices)]
    labels = [(), ("a",), ("b",), ("b", "a"), ("z", "a"), ("z",), ("a", "b", "z")]
    return [PathEvent(letter, kind, carried, known) for letter in "CRTL?" for kind in ("D", "S", None) for carried in labels for known in facts]


TEXTS = [
    "C<RD'a'>X@P@object:ball L@light:lamp",
    "C X@object:ball X@object:cube X@!object:ball@Q L",
    "C X@P@!Q X@crosses:P .@s:1@t:2..3 L@technique:hit",
    "C[^'a'].'b'!'a'@P<R[^D]>@light:lamp@light:shade L",
]


@pytest.mark.parametrize("text", TEXTS)
def test_every_event_has_the_symbol_of_the_steps_that_it_passes(text: str) -> None:
    alphabet = compile(text).alphabet
    names = {"object": ["ball", "cube", "else"], "light": ["lamp", "shade"], "region": ["P", "Q"], "crosses": ["P"], "s": ["1"], "t": ["2", "4"]}
    events = everything(names, {"object": 1, "light": 2, "region": 2, "crosses": 1, "s": 1, "t": 1})
    events = random.Random(5).sample(events, 4000)
    symbols = alphabet.symbols_of(events)
    assert symbols.dtype == np.int32
    expected = np.array([[step.accepts(event) for event in events] for step in alphabet.steps])
    np.testing.assert_array_equal(alphabet.passes[:, symbols], expected)
    assert [alphabet.symbol(event) for event in events[:50]] == symbols[:50].tolist()
    letters = np.array(["CRTVLOB\0".index(event.type if event.type != "?" else "\0") for event in events])
    assert alphabet.types[symbols, letters].all()
    # No two symbols are the same, and most are found among these events.
    assert len(np.unique(alphabet.passes, axis=1).T) == len(alphabet)
    assert len(np.unique(symbols)) > 0.4 * len(alphabet)


def test_positions_of_labels() -> None:
    first_a = step(Test("type", frozenset("R")), Test("label", frozenset("a"), "in", 0))
    second_other = step(Test("label", frozenset("ab"), "other", 1))
    anywhere = step(Test("label", frozenset("a"), "other"))
    alphabet = Alphabet([first_a, second_other, anywhere, step()])
    lists = [labels for size in range(4) for labels in itertools.product("abz", repeat=size)]
    events = [PathEvent(letter, "D", labels, frozenset()) for letter in "RT" for labels in lists]
    symbols = alphabet.symbols_of(events)
    expected = np.array([[s.accepts(event) for event in events] for s in alphabet.steps])
    np.testing.assert_array_equal(alphabet.passes[:, symbols], expected)
    assert len(set(symbols.tolist())) == len(alphabet)  # places are told apart, and no symbol is without an event


def test_no_events_no_symbols() -> None:
    assert compile("CDL").alphabet.symbols_of([]).tolist() == []


@pytest.mark.parametrize(
    ("text", "symbols"),
    [
        ("C.*L", 3),  # a camera, a light, all else
        ("C X@P L", 4),
        ("C[X@object:a X@object:b]L", 5),  # of interactions: a, b, neither
        ("C X@object:a X@object:b L", 5),
        ("C X@P X@Q L", 6),  # of interactions: in none, one, the other, or both
        ("C X@depth:1 L", 4),  # depth is no matter of symbols
        ("C.*L@s:1..2", 3),
        ("C.*L@s:1..2 | C.*L@s:2", 4),
    ],
)
def test_alphabets_are_no_larger_than_need_be(text: str, symbols: int) -> None:
    assert len(compile(text).alphabet) == symbols


def test_names_that_always_come_together_cost_nothing() -> None:
    names = frozenset(f"thing {i}" for i in range(5000))
    tree = sequence([step(Test("type", frozenset("C"))), step(Test("object", names)), step(Test("type", frozenset("L")))])
    machine = automaton(tree, Work())
    assert len(machine.alphabet) == 6
    assert machine.alphabet.symbol(PathEvent("R", "D", (), frozenset({("object", "thing 77")}))) != machine.alphabet.symbol(
        PathEvent("R", "D", (), frozenset({("object", "thing")}))
    )


def test_too_many_kinds_of_events_are_refused() -> None:
    for field, many in (("region", 40), ("light", 400), ("object", 6000)):
        steps = [step(Test(field, frozenset({f"n{i}"}))) for i in range(many)]
        with pytest.raises(ExpressionError, match="too many kinds"):
            automaton(choice(steps), Work())


# --- minimal automata ---------------------------------------------------------------------------------------------


def random_automaton(generator: np.random.Generator, states: int, symbols: int) -> Dfa:
    """An automaton of which each state has a double: half of it is superfluous."""
    ways = generator.integers(0, states, (states, symbols))
    doubled = np.concatenate([ways, ways]) + states * generator.integers(0, 2, (2 * states, symbols))
    accepting = generator.random(states) < 0.2
    return Dfa(doubled.astype(np.int32), np.concatenate([accepting, accepting]))


def moore(dfa: Dfa) -> int:
    """How many states the minimal automaton has, by the plainest method: split classes until none is split."""
    reached = {0}
    while (grown := reached | set(dfa.transitions[sorted(reached)].ravel().tolist())) != reached:
        reached = grown
    kinds = dfa.accepting.astype(np.int64)
    count = 0
    while len(np.unique(kinds)) != count:
        count = len(np.unique(kinds))
        kinds = np.unique(np.column_stack([kinds, kinds[dfa.transitions]]), axis=0, return_inverse=True)[1].ravel()
    return len(np.unique(kinds[sorted(reached)]))


def test_minimization_against_the_plainest_method() -> None:
    generator = np.random.default_rng(3)
    sizes = []
    for states, symbols in [(1, 1), (4, 2), (9, 1), (30, 2), (60, 1), (80, 3)] * 4:
        dfa = random_automaton(generator, states, symbols)
        small = minimize(dfa, Work())
        assert small.states == moore(dfa) == moore(small)
        sizes.append(small.states)
        for _ in range(40):
            state = after = 0
            for symbol in generator.integers(0, symbols, 12):
                state, after = int(dfa.transitions[state, symbol]), int(small.transitions[after, symbol])
                assert dfa.accepting[state] == small.accepting[after]
    assert max(sizes) > 50


@pytest.mark.parametrize(
    ("text", "states"),
    [
        ("C.*L", 4),  # nothing yet; the camera; a light; no way
        ("CR{20}L", 24),  # one split for each repetition
        ("CR{1,20}L", 24),
        ("C(RRR)*L", 6),
        ("C((RR)*|(RRR)*)L", 9),  # counts modulo 6, and start, end, no way
        ("(C(RR)*L)&(C(RRR)*L)", 9),
        ("C[RT]*R[RT]{6}L", 2**7 + 3),
        ("CX*L@depth:9", 12),
    ],
)
def test_known_minimal_sizes(text: str, states: int) -> None:
    # All need many rounds of refinement: a minimizer that stops early merges states that differ.
    compiled = compile(text)
    assert compiled.dfa.states == moore(compiled.dfa)
    assert compiled.dfa.states == states


def test_a_chain_is_split_one_by_one() -> None:
    count = 300
    ways = np.minimum(np.arange(count) + 1, count - 1)[:, None].astype(np.int32)
    assert minimize(Dfa(ways, np.arange(count) == count - 1), Work()).states == count
    ring = (np.arange(count) + 1)[:, None].astype(np.int32) % count
    assert minimize(Dfa(ring, np.arange(count) % 25 == 3), Work()).states == 25


# --- depth --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text", ["C.*D@depth:2.*L", "C[D@!depth:2..3 S@depth:2..]*L", "C.*D@depth:3.*L ^ C.*S@depth:1.*L", "(.@depth:..2|S)*L@depth:4"]
)
def test_depth_against_brute_force(text: str) -> None:
    expression = compile(text)
    steps = steps_of(parse(text).tree)
    assert any(test.field == "depth" for s in steps for test in s.tests)
    answers = []
    for length in range(5):
        for letters in itertools.product("DS", repeat=length):
            word = (PathEvent("C", None), *(PathEvent("R", letter) for letter in letters), PathEvent("L", None))
            answers.append(expression.accepts(word))
            assert answers[-1] == matches(parse(text).tree, dated(word)) == matches(parse(text).tree, word)
    assert 0 < sum(answers) < len(answers)


def test_depth_is_the_place_in_the_path_whatever_facts_say() -> None:
    liar = PathEvent("R", "D", (), frozenset({("depth", "7")}))
    assert compile("CX@depth:1L").accepts([("C", None), liar, ("L", None)])


def test_great_depths_are_counted_or_refused() -> None:
    path = [("C", None), *[("R", "D")] * 299, ("L", None)]
    assert compile("CX*L@depth:300").accepts(path)
    assert not compile("CX*L@depth:301").accepts(path)
    with pytest.raises(ExpressionError, match="automaton needs more"):
        compile("C[RT]*R[RT]{6}L@depth:900")


def test_steps_without_tests() -> None:
    assert automaton(Step(), Work()).dfa.states == 3
