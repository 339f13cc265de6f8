"""Replay: any subset of walks, in any order, tiling and number of threads, gives the same rows bit for bit."""

import concurrent.futures

import numpy as np
import pyarrow as pa
import pytest
from rendering import Tables, record, settings_of, with_all_features
from scenes.mixed import mixed

from renderer.accelerators import Accelerators
from renderer.film import Film
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.settings import TraceSettings
from renderer.trace import Tracer

OPTIONAL = frozenset({"primitive", "u", "v"})


@pytest.fixture(scope="module")
def scene() -> Scene:
    return with_all_features(load_scene(mixed()))


def settings(scene: Scene, method: str, **changes: object) -> TraceSettings:
    return settings_of(scene, 16, method, columns=OPTIONAL, occluded=True, **changes)


@pytest.fixture(scope="module", params=["path", "light"])
def whole(request: pytest.FixtureRequest, scene: Scene) -> tuple[str, Tables]:
    return request.param, record(scene, settings(scene, request.param))


def owner(table: pa.Table) -> np.ndarray:
    return next(table[name] for name in ("walk", "camera_walk", "light_walk") if name in table.column_names).to_numpy()


def rows_of(table: pa.Table, walks: np.ndarray) -> pa.Table:
    """The rows of some walks, walk by walk in the order given."""
    walk = owner(table)
    first, last = np.searchsorted(walk, walks), np.searchsorted(walk, walks, side="right")
    return table.take(np.concatenate([np.arange(a, b) for a, b in zip(first, last)]) if len(walks) else np.zeros(0, np.int64))


def assert_same_rows(found: Tables, expected: Tables, walks: np.ndarray) -> None:
    """All columns bit for bit; the words that the subset met mean the same."""
    for name in expected:
        if name != "words":
            want = rows_of(expected[name], walks)
            assert found[name].num_rows == want.num_rows
            assert want.num_rows > 0 or (name == "unlit" and len(walks) < 100), "of a few walks all may find light"
            for column in want.column_names:
                a, b = found[name][column].to_numpy(), want[column].to_numpy()
                assert a.tobytes() == b.tobytes(), f"{name}.{column} differs in {(a != b).sum()} of {len(a)} rows"
    words = {row["word"]: row for row in expected["words"].to_pylist()}
    assert found["words"].num_rows > 0
    assert all(words[row["word"]] == row for row in found["words"].to_pylist())


@pytest.mark.parametrize("tile", [77, 1024, 1 << 15])
@pytest.mark.parametrize("share", [0.01, 0.3, 1.0])
def test_a_subset_in_another_order(whole: tuple[str, Tables], scene: Scene, tile: int, share: float) -> None:
    method, tables = whole
    s = settings(scene, method)
    walks = np.random.default_rng([tile, int(100 * share)]).permutation(s.walks)[: int(share * s.walks)].astype(np.uint64)
    assert_same_rows(record(scene, s, walks, tile=tile), tables, walks)


def test_used_buffers_leave_nothing_behind(whole: tuple[str, Tables], scene: Scene) -> None:
    """A tracer that has traced other walks before gives the same rows."""
    method, tables = whole
    s = settings(scene, method)
    tracer = Tracer(scene, s, tile=512)
    tracer.trace((1000, 2000), lambda table, batch: None, None)
    batches: dict[str, list[pa.RecordBatch]] = {}

    def keep(table: str, batch: pa.RecordBatch) -> None:
        copied = pa.ipc.open_stream(stream(batch)).read_all()
        batches.setdefault(table, []).extend(copied.to_batches())

    tracer.trace((300, 700), keep, None)
    found = {name: pa.Table.from_batches(parts) for name, parts in batches.items()}
    assert_same_rows(found, tables, np.arange(300, 1000))


def stream(batch: pa.RecordBatch) -> pa.Buffer:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, batch.schema) as writer:
        writer.write_batch(batch)
    return sink.getvalue()


def test_threads_that_share_accelerators(whole: tuple[str, Tables], scene: Scene) -> None:
    method, tables = whole
    s = settings(scene, method)
    accelerators = Accelerators(scene)
    ranges = np.array_split(np.arange(s.walks, dtype=np.uint64), 6)

    def part(walks: np.ndarray) -> Tables:
        sinks: dict[str, list[bytes]] = {}
        tracer = Tracer(scene, s, accelerators, tile=300)
        tracer.trace(walks, lambda table, batch: sinks.setdefault(table, []).append(stream(batch).to_pybytes()), None)
        return {name: pa.concat_tables([pa.ipc.open_stream(b).read_all() for b in parts]) for name, parts in sinks.items()}

    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        parts = list(pool.map(part, ranges))
    for found, walks in zip(parts, ranges):
        assert_same_rows(found, tables, walks)


def test_a_kept_share_is_the_same_rows(whole: tuple[str, Tables], scene: Scene) -> None:
    """``keep`` picks whole walks by a hash of their ids: about that share, and their rows are those of a full recording."""
    method, tables = whole
    vertices = next(name for name in tables if name.endswith("_vertices"))
    shares: list[set[int]] = []
    for keep in (0.1, 0.5):
        s = settings(scene, method, keep=keep)
        found = record(scene, s)
        walks = np.unique(owner(found[vertices]))
        everyone = len(np.unique(owner(tables[vertices])))
        assert abs(len(walks) - keep * everyone) < 4.5 * np.sqrt(everyone * keep * (1 - keep))
        assert_same_rows(found, tables, walks)
        shares.append(set(walks.tolist()))
    assert shares[0] < shares[1], "a smaller share is part of a larger one"


@pytest.mark.parametrize("sampler", ["independent", "sobol"])
def test_more_samples_append(cornell: Scene, sampler: str) -> None:
    """Ids are pass-major: the rows of the first passes do not depend on how many follow."""
    few, many = (record(cornell, settings_of(cornell, n, sampler=sampler), (0, 24 * 24 * 4)) for n in (4, 8))
    assert all(few[name].equals(many[name]) for name in few)


@pytest.mark.parametrize("method", ["path", "light"])
def test_films_add_up_bit_for_bit(scene: Scene, method: str) -> None:
    """Shards' sums added in order are those of one film, whatever the tiles."""
    s = settings_of(scene, 16, method)
    films = []
    for tile in (500, 1 << 15):
        tracer = Tracer(scene, s, tile=tile)
        total = Film(s.width, s.height)
        for first in range(0, s.walks, 1024):
            shard = Film(s.width, s.height)
            tracer.trace((first, 1024), None, shard)
            total.merge(shard.sums)
        films.append(total.sums)
    assert np.array_equal(films[0], films[1])
