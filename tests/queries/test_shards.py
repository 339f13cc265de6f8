"""Tables as arrays, a piece at a time: whole walks, in order, on any number of threads."""

import pathlib
from collections.abc import Iterator

import numpy as np
import pytest
from placed import PlacedRun, make_placed_run
from synthetic import SyntheticRun

from queries import open_run
from queries.errors import RunError
from queries.shards import Piece, map_shards, pieces


@pytest.fixture(scope="module")
def placed(tmp_path_factory: pytest.TempPathFactory) -> PlacedRun:
    return make_placed_run(tmp_path_factory.mktemp("shards") / "run", "both", 4, shards=6)


def walks(found: Iterator[Piece]) -> list[int]:
    return [int(walk) for piece in found for walk in piece.owner()]


@pytest.mark.parametrize("threads", [1, 2, 7, 40])
def test_answers_come_in_the_order_of_the_shards(placed: PlacedRun, threads: int) -> None:
    with open_run(placed.folder) as run:
        found = list(map_shards(run.shard_files, walks, threads))
    assert len(found) == 6
    assert [walk for part in found for walk in part] == [row["camera_walk"] for row in placed.rows["paths"]]


def test_pieces_hold_whole_walks(placed: PlacedRun) -> None:
    with open_run(placed.folder) as run:
        for shard, files in enumerate(run.shard_files):
            for piece in pieces(files, shard):
                there = set(piece.column("camera_vertices", "walk"))
                assert piece.rows("paths") > 0
                assert set(piece.column("paths", "camera_walk")) <= there
                assert set(piece.column("paths", "light_walk")) <= set(piece.column("light_vertices", "walk"))
                assert not piece.column("paths", "contribution_r").flags.writeable
                assert not piece.has("paths", "nothing")
                assert piece.rows("nothing") == 0


def test_what_a_piece_keeps_is_made_once(placed: PlacedRun) -> None:
    made: list[int] = []
    with open_run(placed.folder) as run:
        piece = next(pieces(run.files("paths")[0], 0))
    assert [piece.once("key", lambda: made.append(1) or len(made)) for _ in range(3)] == [1, 1, 1]  # type: ignore[func-returns-value]
    assert piece.once("other", lambda: 5) == 5
    assert set(piece.batches) == {"paths"}


def test_an_error_in_one_shard_ends_all(placed: PlacedRun) -> None:
    def fail(found: Iterator[Piece]) -> int:
        if next(found).shard == 2:
            raise ValueError("no")
        return 1

    with open_run(placed.folder) as run, pytest.raises(ValueError, match="no"):
        list(map_shards(run.shard_files, fail, 3))


def test_a_damaged_shard_is_named(tmp_path: pathlib.Path, placed: PlacedRun) -> None:
    (tmp_path / "bad.arrow").write_bytes(b"nothing")
    with pytest.raises(RunError, match=r"bad\.arrow"):
        list(map_shards([{"paths": tmp_path / "bad.arrow"}], walks))


def test_owners_of_light_paths(light_run: SyntheticRun) -> None:
    with open_run(light_run.folder) as run:
        found = np.concatenate([np.array(part) for part in map_shards(run.shard_files, walks)])
    assert found.tolist() == [row["light_walk"] for row in light_run.rows]
