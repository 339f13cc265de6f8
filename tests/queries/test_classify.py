"""Paths that an expression selects: by words and by vertices, as trying every path in plain Python."""

import pathlib

import numpy as np
import pytest
from placed import EYE, PlacedRun, make_placed_run
from words import matches

from queries import open_run
from queries.classify import Classifier, select_all
from queries.errors import QueryError
from queries.kernels.match import match_both_words, match_camera_words
from queries.kernels.vertices import Automaton, Prefixes, Vertices, find_walks, fold_paths, mark_used
from queries.lpe import compile
from queries.lpe.parser import parse
from queries.shards import pieces

KINDS = ("path", "lens", "light", "both")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, PlacedRun]:
    folder = tmp_path_factory.mktemp("placed")
    made = {kind: make_placed_run(folder / kind, kind, seed) for seed, kind in enumerate(("path", "light"))}
    made["lens"] = make_placed_run(folder / "lens", "path", 7, lens=True)
    made["both"] = make_placed_run(folder / "both", "both", 8, walks=240, lens=True)
    return made


def check(run: PlacedRun, text: str, table: str = "paths") -> int:
    """Compare what is selected with what should be; how many rows that is."""
    tree = parse(text).tree
    expected = [matches(tree, word) for word in run.words[table]]
    with open_run(run.folder) as opened:
        expression = opened.compile(text)
        found = {threads: np.concatenate(select_all(opened, expression, table, threads)) for threads in (1, 3)}
    assert found[1].tolist() == expected
    assert found[3].tolist() == expected
    return sum(expected)


WORDS = [
    "C .* L", "C D .* .", "C .* 'floor' .* .", "C .* X@object:floor .* .", "C !'glass' {,3} [LB]", "C .* .@light:lamp", "C .* B - C D .* .",
    "C .* D .* . & C .* S .* .", "C X@material:white .* .", "C .* .@depth:2", "C D@depth:1..2 .* .",
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("text", WORDS)
def test_events_and_objects(runs: dict[str, PlacedRun], kind: str, text: str) -> None:
    assert 0 < check(runs[kind], text) < len(runs[kind].rows["paths"])


LAST = [
    ("path", "C .* .@technique:hit"), ("path", "C .* .@s:1"), ("path", "C .* .@t:3.."), ("path", "C .* L@!technique:sample"),
    ("light", "C .* .@s:2"), ("light", "C .* .@s:2..@light:spot"), ("both", "C .* .@technique:connection"), ("both", "C D .* .@s:1..2@t:2..3"),
    ("both", "C .* .@technique:lens@s:2"), ("both", "C X* .@technique:hit@depth:1..2"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "text"), LAST)
def test_techniques(runs: dict[str, PlacedRun], kind: str, text: str) -> None:
    assert 0 < check(runs[kind], text) < len(runs[kind].rows["paths"])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("text", ["C .* L", "C .* .@blocker:floor", "C .* .@!blocker:wall", "C .* X@ball .* .@blocker:floor", "C .* .@crosses:ball"])
def test_blocked_connections(runs: dict[str, PlacedRun], kind: str, text: str) -> None:
    assert 0 < check(runs[kind], text, "occluded") < len(runs[kind].rows["occluded"])
    if text == "C .* .@blocker:floor":
        assert check(runs[kind], text) == 0  # what is visible has no blocker


PLACES = [
    "C .* X@ball .* .", "C X@crate .* .", "C X@!ball* .", "C .* X@ball X@crate .* .", "C .* .@ball", "C .* L@crate", "C .* <RD>@ball .* L",
    "C@eye X .* .", "C .* X@floor .* .", "C .* X@ball@object:floor .* .", "C .* .@!ball", "C .* X@ball .* . - C X@ball .* .",
    "C .* X@crosses:ball .* .", "C .@crosses:crate .* .", "C .* L@crosses:crate",
    "C .* X@crosses:ball@!ball .* .", "C .@crosses:eye .* .", "C X X@!crosses:crate .* .", "C .* X@ball@depth:2 .* .",
    "C .* X@ball .* .@light:lamp",
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("text", PLACES)
def test_places(runs: dict[str, PlacedRun], kind: str, text: str) -> None:
    assert 0 < check(runs[kind], text) < len(runs[kind].rows["paths"])


BOTH = [("both", "C .* X@ball .* .@technique:connection@t:2"), ("path", "C .* X@ball .* .@technique:hit"), ("light", "C X@ball .* .@s:2..3")]


@pytest.mark.parametrize(("kind", "text"), BOTH)
def test_places_and_techniques(runs: dict[str, PlacedRun], kind: str, text: str) -> None:
    assert 0 < check(runs[kind], text) < len(runs[kind].rows["paths"])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("text", ["C .* .@crosses:far_ball", "C .* B@crosses:far_ball", "C .* B@!crosses:far_ball"])
def test_rays_to_infinity(runs: dict[str, PlacedRun], kind: str, text: str) -> None:
    """The ball lies beyond all vertices: only light from infinitely far away crosses it."""
    assert 0 < check(runs[kind], text) < len(runs[kind].rows["paths"])


def test_the_camera_s_place_is_one_for_all(runs: dict[str, PlacedRun]) -> None:
    for kind in KINDS:
        assert check(runs[kind], "C@eye .*") == len(runs[kind].rows["paths"])
        assert check(runs[kind], "C@ball .*") == 0


def test_pieces_answer_as_the_whole(runs: dict[str, PlacedRun]) -> None:
    with open_run(runs["both"].folder) as run:
        expression = run.compile("C .* X@ball .* .")
        classifier, whole = Classifier(run, expression), select_all(run, expression)
        for shard, files in enumerate(run.shard_files):
            found = [classifier.select(piece) for piece in pieces(files, shard) for _ in range(2)]
            assert all((again == whole[shard]).all() for again in found)


def test_too_many_regions(runs: dict[str, PlacedRun]) -> None:
    with open_run(runs["path"].folder, regions={f"r{i}": {"sphere": {"center": [i, 0, 0], "radius": 1}} for i in range(9)}) as run:
        text = "C (" + " | ".join(f"X@r{i}" for i in range(9)) + ") L"
        with pytest.raises(QueryError, match="tests 9 regions"):
            Classifier(run, run.compile(text))


def test_regions_of_the_job_and_of_the_query(runs: dict[str, PlacedRun]) -> None:
    with open_run(runs["path"].folder, regions={"ball": {"sphere": {"center": list(EYE), "radius": 0.5}}}) as run:
        assert run.regions["crate"].describe().startswith("the box")
        expression = run.compile("C@ball X@crate .* .")
        assert sum(rows.sum() for rows in select_all(run, expression)) > 0
        with pytest.raises(QueryError, match="no region is named"):
            run.compile("C X@nowhere L")
        with pytest.raises(QueryError, match="no object"):
            run.compile("C X@object:flor L")
        assert any("medium" in warning for warning in run.compile("C X@medium:fog L").warnings)


def test_a_table_that_was_not_recorded(tmp_path: pathlib.Path, runs: dict[str, PlacedRun]) -> None:
    with open_run(runs["path"].folder) as run:
        del run.tables["occluded"]
        with pytest.raises(QueryError, match="recorded no `occluded`"):
            select_all(run, compile("C L"), "occluded")


# --- kernels, by hand ---------------------------------------------------------------------------------------------


def test_match_camera_words() -> None:
    matched, states = np.empty(4, np.bool_), np.array([0, 1, -1], np.int32)
    accepted = np.array([[False, True], [True, False]])
    words = np.array([0, 1, 2, -1], np.int32)
    match_camera_words(words, np.array([0], np.int32), states, np.array([1, 0], np.int32), accepted, matched)
    assert matched.tolist() == [True, False, False, False]
    match_camera_words(words, np.array([1, 1, 0, 0], np.int32), states, np.array([1, 0], np.int32), accepted, matched)
    assert matched.tolist() == [False, True, False, False]


def test_match_both_words() -> None:
    matched, states = np.empty(3, np.bool_), np.array([0, 1], np.int32)
    light_states = np.array([[0, 1, -1]], np.int32)
    accepted = np.array([[False, True], [True, False]])
    lights, ends, suffixes = np.array([0, 1, 2], np.int32), np.array([0], np.int32), np.array([0], np.int32)
    match_both_words(np.array([0], np.int32), lights, ends, states, suffixes, light_states, accepted, matched)
    assert matched.tolist() == [False, True, False]
    match_both_words(np.array([1, 1, 1], np.int32), lights, ends, states, suffixes, light_states, accepted, matched)
    assert matched.tolist() == [True, False, False]


def test_find_walks() -> None:
    walk, depth = np.array([3, 3, 3, 5, 9, 9], np.uint32), np.array([0, 1, 2, 1, 1, 2], np.uint8)
    start = np.empty(7, np.int64)
    find_walks(np.array([3, 3, 4, 5, 9, 3, 8], np.uint32), walk, depth, start)
    assert start.tolist() == [1, 1, -1, 3, 4, 1, -1]


def test_mark_used() -> None:
    used = np.zeros(6, np.bool_)
    mark_used(Prefixes(np.array([0, 0, 3, -1]), np.array([1, 2, 0, 5], np.int32), np.zeros(4, np.uint8)), used)
    assert used.tolist() == [True, True, False, False, False, False]


def test_fold_paths() -> None:
    """Events 8 and 9 of one object; the automaton counts the 9s that are in the region (bit 0), and wants exactly one."""
    symbols = np.full((256, 1, 2), -1, np.int32)
    symbols[8, 0], symbols[9, 0] = (0, 0), (0, 1)
    transitions = np.array([[0, 1], [1, 2], [2, 2]], np.int32)
    automaton = Automaton(symbols, np.array([[0, 0]], np.int32), transitions, np.array([False, True, False]), np.int32(0))
    camera = Vertices(np.array([9, 8, 9], np.uint8), np.zeros(3, np.uint16), np.array([1, 1, 1], np.uint8))
    light = Vertices(np.array([9, 9], np.uint8), np.zeros(2, np.uint16), np.array([1, 0], np.uint8))
    paths = [  # camera vertices, their last lobe, light vertices, their last lobe, expected
        (1, 0, 0, 0, True), (2, 0, 0, 0, True), (3, 0, 0, 0, False), (3, 8, 0, 0, True), (0, 0, 0, 0, False),
        (0, 0, 1, 9, True), (0, 0, 2, 9, True), (1, 8, 1, 8, False), (1, 9, 1, 9, False), (4, 0, 0, 0, False), (3, 99, 0, 0, False),
    ]  # fmt: skip
    count = len(paths)
    prefixes = Prefixes(np.zeros(count, np.int64), np.array([p[0] for p in paths], np.int32), np.array([p[1] for p in paths], np.uint8))
    suffixes = Prefixes(np.zeros(count, np.int64), np.array([p[2] for p in paths], np.int32), np.array([p[3] for p in paths], np.uint8))
    none, matched = np.zeros(count, np.uint8), np.empty(count, np.bool_)
    fold_paths(automaton, camera, prefixes, light, suffixes, none, np.uint8(1), np.zeros(1, np.int32), none, matched)
    assert matched.tolist() == [path[4] for path in paths]
