"""The tree of words: rows of keys, depths, and folds over it."""

import numpy as np
import pyarrow as pa
import pytest
from synthetic import SyntheticRun

from queries import open_run
from queries.errors import RunError
from queries.kernels.words import fill_slots, find_rows, fold
from queries.word_tree import CAMERA, LIGHT, WordTree
from renderer.tables import CAMERA_ROOT, LIGHT_ROOT, WORDS

SCHEMA = WORDS.schema(tuple(WORDS.by_name))


def test_rows_depths_and_sides(any_run: SyntheticRun) -> None:
    with open_run(any_run.folder) as run:
        tree, table = run.words, run.tables["words"].to_pylist()
        assert len(tree) == len(table) + 2
        assert tree.rows(np.array([row["word"] for row in table], np.uint64)).tolist() == list(range(2, len(tree)))
        assert tree.rows(np.array([CAMERA_ROOT, LIGHT_ROOT, 12345], np.uint64)).tolist() == [CAMERA, LIGHT, -1]
        by_key = {row["word"]: row for row in table}
        for i, row in enumerate(table, start=2):
            above, depth = row["word"], 0
            while above in by_key:
                above, depth = by_key[above]["parent"], depth + 1
            assert (tree.depth[i], tree.side[i]) == (depth, CAMERA if above == CAMERA_ROOT else LIGHT)
        assert sorted(tree.order.tolist()) == list(range(2, len(tree)))
        assert (np.diff(tree.depth[tree.order]) >= 0).all()


def test_fold_counts_letters() -> None:
    """A fold that counts to three: the state after a word is its length."""
    rows = [{"word": key, "parent": parent, "event": 8, "object": 0} for key, parent in ((9, 7), (7, 5), (5, CAMERA_ROOT), (6, LIGHT_ROOT), (4, 5))]
    tree = WordTree(pa.Table.from_pylist(rows, SCHEMA))
    ways = np.array([[1], [2], [3], [3]], np.int32)
    assert tree.fold(ways, np.zeros(len(tree), np.int32), CAMERA, 0).tolist() == [0, -1, 3, 2, 1, -1, 2]
    assert tree.fold(ways, np.zeros(len(tree), np.int32), LIGHT, 1).tolist() == [-1, 1, -1, -1, -1, 2, -1]


def test_a_word_without_its_prefix() -> None:
    with pytest.raises(RunError, match="lacks the prefix"):
        WordTree(pa.Table.from_pylist([{"word": 9, "parent": 7, "event": 8, "object": 0}], SCHEMA))


def test_no_words() -> None:
    tree = WordTree(pa.Table.from_pylist([], SCHEMA))
    assert len(tree) == 2
    assert tree.fold(np.zeros((1, 1), np.int32), np.zeros(2, np.int32), CAMERA, 0).tolist() == [0, -1]


def test_keys_that_share_a_slot() -> None:
    keys = np.array([3, 11, 19, 4, 7, 15], np.uint64)  # of 8 slots: 3, 11 and 19 want the same one, 7 and 15 the last
    slot_key, slot_row = np.zeros(8, np.uint64), np.full(8, -1, np.int32)
    fill_slots(keys, slot_key, slot_row)
    found = np.empty(8, np.int32)
    find_rows(np.array([3, 11, 19, 4, 7, 15, 12, 27], np.uint64), slot_key, slot_row, found)
    assert found.tolist() == [0, 1, 2, 3, 4, 5, -1, -1]


def test_a_parent_without_a_state_passes_that_on() -> None:
    states = np.array([0, -1, -1, -1, -1], np.int32)
    order, parent, symbol = np.array([2, 3, 4], np.int32), np.array([0, 1, 0, 1, 2], np.int32), np.array([0, 0, 1, 1, 0], np.int32)
    fold(order, parent, symbol, np.array([[0, 1], [1, 1]], np.int32), states)
    assert states.tolist() == [0, -1, 1, -1, 1]
