"""Classes of paths: every row has the class that its word spells, and the numbers are dense and steady."""

import collections
import pathlib

import numpy as np
import pytest
from enumeration import OnePath, paths_of_synthetic, scatter
from synthetic import SyntheticRun, make_run

from queries import open_run
from queries.classes import PathClasses, _Keys
from queries.errors import RunError
from queries.shards import map_shards


@pytest.fixture(scope="module", params=["path", "light", "both"])
def run_and_paths(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[SyntheticRun, list[OnePath]]:
    run = make_run(tmp_path_factory.mktemp(request.param) / "run", request.param, seed=5, passes=20, occluded=request.param == "path")
    return run, paths_of_synthetic(run, scatter(run))


@pytest.mark.parametrize("with_objects", [False, True])
def test_each_row_has_the_class_of_its_word(run_and_paths: tuple[SyntheticRun, list[OnePath]], with_objects: bool) -> None:
    synthetic, paths = run_and_paths
    with open_run(synthetic.folder) as run:
        classes = PathClasses(run, with_objects)
        numbers = np.concatenate(list(map_shards(run.shard_files, lambda pieces: np.concatenate([classes.of(piece) for piece in pieces]))))
        spelled = [(tuple(classes.letters(i)), tuple(classes.objects(i))) for i in range(len(classes))]
    assert numbers.dtype == np.int32
    assert len(numbers) == len(paths) > 500
    for number, path in zip(numbers, paths, strict=True):
        expected = path.letters, path.objects if with_objects else (None,) * len(path.letters)
        assert spelled[number] == expected
    # Dense, distinct, shorter ones first
    assert sorted(set(numbers.tolist())) == list(range(len(spelled)))
    assert len(set(spelled)) == len(spelled)
    assert classes.lengths.tolist() == [len(letters) for letters, _ in spelled] == sorted(classes.lengths.tolist())


def test_numbers_do_not_depend_on_threads(run_and_paths: tuple[SyntheticRun, list[OnePath]]) -> None:
    with open_run(run_and_paths[0].folder) as run:
        spelled = []
        for threads in (1, 3):
            classes = PathClasses(run, True, threads=threads)
            spelled.append([(classes.letters(i), classes.objects(i)) for i in range(len(classes))])
    assert spelled[0] == spelled[1]
    assert spelled[0]


def test_classes_of_blocked_connections_are_numbered_when_asked_for(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        both, paths = PathClasses(run, True, tables=("paths", "occluded")), PathClasses(run, True)
        numbers = np.concatenate(list(map_shards(run.shard_files, lambda pieces: np.concatenate([both.of(piece, "occluded") for piece in pieces]))))
        assert len(numbers) == len(path_run.occluded) > 0
        for number, word in zip(numbers, path_run.occluded_words, strict=True):
            assert both.letters(number) == [event.type + (event.scattering or "") for event in word]
        assert len(paths) < len(both)
        with pytest.raises(RunError, match="not numbered"):
            list(map_shards(run.shard_files, lambda pieces: [paths.of(piece, "occluded") for piece in pieces]))


def test_words_met_in_other_halves_are_one_class(tmp_path: pathlib.Path) -> None:
    """The same string split at different vertices: classes of two-walk paths, without objects, are few, and each is met in several splits."""
    synthetic = make_run(tmp_path / "run", "both", seed=9, passes=40)
    splits = collections.defaultdict(set)
    for row, word in zip(synthetic.rows, synthetic.words):
        splits[tuple(event.type + (event.scattering or "") for event in word)].add(row["camera_depth"])
    with open_run(synthetic.folder) as run:
        assert len(PathClasses(run)) == len(splits)
    assert sum(len(found) > 1 for found in splits.values()) > 10


def test_a_set_of_keys_grows() -> None:
    generator = np.random.default_rng(1)
    keys = _Keys()
    expected = set()
    for size in (0, 10, 5_000, 100_000):
        added = generator.integers(0, 60_000, size).astype(np.uint64)
        keys.add(added)
        expected |= set(added.tolist())
        assert keys.sorted().tolist() == sorted(expected)
