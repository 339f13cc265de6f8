"""The recorded tables as arrays, a piece at a time: what kernels go through where SQL would be slow.

A ``Piece`` is a run of whole walks: its rows of every table, memory-mapped without a copy. Shards are opened, gone through and
closed, so that memory does not grow with the run, and their answers come in the shards' order, so that sums have the same bits
each time, on any number of threads.
"""

import collections
import os
import pathlib
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

import numpy.typing as npt
import pyarrow as pa

from queries.errors import RunError

T = TypeVar("T")
Array = npt.NDArray[Any]


class Piece:
    """The rows of some whole walks in every recorded table. ``once`` keeps what several questions need of the same rows."""

    def __init__(self, batches: dict[str, pa.RecordBatch], shard: int) -> None:
        self.batches = batches
        self.shard = shard
        self._known: dict[Hashable, Any] = {}

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What ``make`` gives, computed when first asked for under this key."""
        if key not in self._known:
            self._known[key] = make()
        found: T = self._known[key]
        return found

    def forget(self) -> None:
        """Drop what ``once`` kept. What was kept may refer to the piece: dropping it frees the memory at once."""
        self._known.clear()

    def rows(self, table: str) -> int:
        """Number of rows of a table; 0 for one that the run lacks."""
        return self.batches[table].num_rows if table in self.batches else 0

    def has(self, table: str, name: str) -> bool:
        """Whether the run stores this column."""
        return table in self.batches and name in self.batches[table].schema.names

    def column(self, table: str, name: str) -> Array:
        """A stored column, read-only, in stored type. Raises KeyError for one that the run does not store."""
        array: Array = self.batches[table].column(name).to_numpy(zero_copy_only=True)
        return array

    def owner(self, table: str = "paths") -> Array:
        """The walk that owns each path: the camera walk, or the light walk where there is none."""
        return self.column(table, "camera_walk" if self.has(table, "camera_walk") else "light_walk")


def pieces(files: dict[str, pathlib.Path], shard: int) -> Iterator[Piece]:
    """The pieces of one shard, in order."""
    tables = {name: _batches(file) for name, file in files.items()}
    if not _aligned(list(tables.values())):
        tables = {name: _whole(found) for name, found in tables.items()}
    for i in range(min((len(found) for found in tables.values()), default=0)):
        yield Piece({name: found[i] for name, found in tables.items()}, shard)


def map_shards(files: list[dict[str, pathlib.Path]], work: Callable[[Iterator[Piece]], T], threads: int | None = None) -> Iterator[T]:
    """``work`` on each shard's pieces, by so many threads (None: one for each core), the answers in the shards' order."""
    threads = max(1, min(threads or cores(), len(files)))
    if threads == 1:
        yield from (_work_on(work, shard, i) for i, shard in enumerate(files))
        return
    with ThreadPoolExecutor(threads) as pool:
        # A few shards ahead of the reader, no more: answers may be as large as images.
        pending: collections.deque[Future[T]] = collections.deque()
        try:
            for i, shard in enumerate(files):
                pending.append(pool.submit(_work_on, work, shard, i))
                if len(pending) > threads:
                    yield pending.popleft().result()
            while pending:
                yield pending.popleft().result()
        finally:
            for future in pending:
                future.cancel()


def _work_on(work: Callable[[Iterator[Piece]], T], files: dict[str, pathlib.Path], shard: int) -> T:
    return work(pieces(files, shard))


def _batches(file: pathlib.Path) -> list[pa.RecordBatch]:
    """The batches of a file; one without rows where it has none."""
    try:
        reader = pa.ipc.open_file(pa.memory_map(str(file)))
        found = [reader.get_batch(i) for i in range(reader.num_record_batches)]
    except (pa.ArrowException, OSError) as error:
        raise RunError(f"`{file}` cannot be read ({str(error).splitlines()[0]}): run the job again with --resume") from None
    return found or [pa.RecordBatch.from_pylist([], reader.schema)]


def _aligned(tables: list[list[pa.RecordBatch]]) -> bool:
    """Whether the i-th batches of all tables hold the same walks: a tile that adds no rows to a table leaves no batch there."""
    if len({len(found) for found in tables}) != 1:
        return False
    last = -1
    for batches in zip(*tables):
        ends = [_walks(batch) for batch in batches if batch.num_rows]
        if any(first <= last for first, _ in ends):
            return False
        last = max([last, *(end for _, end in ends)])
    return True


def _walks(batch: pa.RecordBatch) -> tuple[int, int]:
    """The first and the last walk of a batch that has rows: rows are in the order of the walks that own them."""
    names = batch.schema.names
    walk = batch.column("walk" if "walk" in names else "camera_walk" if "camera_walk" in names else "light_walk")
    return walk[0].as_py(), walk[-1].as_py()


def _whole(found: list[pa.RecordBatch]) -> list[pa.RecordBatch]:
    """All batches as one, copied."""
    return found if len(found) == 1 else [pa.concat_batches(found)]


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
