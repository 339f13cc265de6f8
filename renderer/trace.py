"""``trace(walks) -> tables``: the renderer's only verb (DESIGN §3).

A whole render is all ids, a shard is a range of ids, a replay is the few ids that a query selected: all of them come
through ``Tracer.trace``. A tile of walks advances one bounce at a time: extend (closest hits), interact (one fused
kernel), connect (occlusion), record.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from renderer.accelerators import Accelerators
from renderer.film import Film
from renderer.integrators.buffers import Counters, TileBuffers, grow
from renderer.integrators.connect import connect, keep_blocked
from renderer.integrators.estimators import estimator
from renderer.integrators.record import Recorder, WordColumns, used_words
from renderer.kernel import kernel
from renderer.math.hash import GOLDEN, mix64
from renderer.math.vec import FAR
from renderer.samples import primary_samples
from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings
from renderer.tables import NO_OBJECT, OCCLUDED, PATHS, UNLIT, WORDS
from renderer.textures.pixel_filter import with_memory

TILE = 1 << 15  # walks that advance together: enough to hide Python, few enough for the cache
WARM_UP_WALKS = 256
Write = Callable[[str, pa.RecordBatch], None]
Walks = tuple[int, int] | npt.NDArray[np.uint64]


@dataclass
class TraceCounts:
    """How much a trace did. ``bytes`` is the size of the recorded columns."""

    walks: int = 0
    vertices: int = 0
    paths: int = 0
    bytes: int = 0

    def add(self, other: "TraceCounts") -> None:
        """Add another trace's counts."""
        self.walks += other.walks
        self.vertices += other.vertices
        self.paths += other.paths
        self.bytes += other.bytes


@kernel
def mark_recorded(walk: npt.NDArray[np.uint64], n: int, threshold: np.uint64, recorded: npt.NDArray[np.uint8]) -> None:
    """Record the walks whose hash lies below the threshold."""
    for i in range(n):
        recorded[i] = np.uint8(1) if mix64(walk[i] ^ GOLDEN) < threshold else np.uint8(0)


class Tracer:
    """Traces walks of one scene with one estimator. One for each thread: it owns the tile's buffers.

    ``accelerators`` may be shared between threads; without it, the tracer builds its own. Raises ValueError where the
    settings' film is not the scene's, since kernels would write outside of it, or where the scene's texture filter is not the settings'.
    """

    def __init__(self, scene: Scene, settings: TraceSettings, accelerators: Accelerators | None = None, tile: int = TILE) -> None:
        sensor = scene.arrays.sensor
        if (sensor.width, sensor.height) != (settings.width, settings.height):
            raise ValueError(f"settings of a {settings.width} x {settings.height} film, but the scene's is {sensor.width} x {sensor.height}")
        if scene.arrays.ewa is not None and settings.texture_filter != "ewa":
            raise ValueError(f"the scene has the texture filter 'ewa', but the settings ask for {settings.texture_filter!r}")
        self.scene = scene
        self.arrays = with_memory(scene.arrays)
        self.settings = settings
        self.accelerators = accelerators or Accelerators(scene)
        self.buffers = TileBuffers(min(tile, max(1, settings.walks)))
        self.recorder = Recorder(settings)
        self.estimator = estimator(settings.method)
        self.samples = primary_samples(settings)

    def schemas(self) -> dict[str, pa.Schema]:
        """The stored schema of every table that is recorded."""
        return self.recorder.schemas

    def warm_up(self) -> float:
        """Compile all kernels, or load them from the disk cache, by tracing a few walks; the seconds it took."""
        start = time.perf_counter()
        spread = np.linspace(0, self.settings.walks_per_pass - 1, WARM_UP_WALKS).astype(np.uint64)
        self.trace(spread, lambda _table, _batch: None, Film(self.settings.width, self.settings.height, self.settings.filter))
        return time.perf_counter() - start

    def trace(self, walks: Walks, write: Write | None, film: Film | None) -> TraceCounts:
        """Trace walks: a range (first, count) or an array of uint64 ids, in the order given.

        ``write(table, batch)`` receives each tile's rows, in (walk, depth) order, and at the end the distinct words; a batch
        must be used before ``write`` returns. ``film`` receives every walk, recorded or not. None: not wanted.
        """
        counts = TraceCounts()
        words: list[WordColumns] = []
        self.buffers.words.seen[:] = 0
        recording = write is not None and self.settings.keep > 0.0
        for ids in tiles(walks, len(self.buffers.lanes.walk)):
            n = len(ids)
            self.buffers.lanes.walk[:n] = ids
            self._mark(n)
            counters, occluded = self._advance(n, recording)
            if film is not None:
                self._expose(film, n, counters)
            counts.walks += n
            if recording and write is not None:
                words.append(used_words(self.buffers.words, counters.words))
                self._record(n, counters, occluded, write, counts)
        if recording and write is not None:
            write(WORDS.name, self.recorder.words(words))
        return counts

    def _mark(self, n: int) -> None:
        """Mark the lanes whose rows are kept."""
        recorded, keep = self.buffers.lanes.recorded, self.settings.keep
        if keep >= 1.0:
            recorded[:n] = 1
        elif keep <= 0.0:
            recorded[:n] = 0
        else:
            mark_recorded(self.buffers.lanes.walk, n, np.uint64(int(keep * 2.0**64)), recorded)

    def _advance(self, n: int, recording: bool) -> tuple[Counters, int]:
        """All bounces of one tile: the numbers of rows, and of occluded rows."""
        buffers, settings = self.buffers, self.settings
        buffers.reserve(Counters(0, 0, 0, 0, 0), n)
        counters = self.estimator.start(
            self.arrays, self.samples, buffers.lanes, buffers.rays, buffers.t, n, settings.max_depth, recording,
            buffers.shadow, buffers.vertices, buffers.paths,
        )  # fmt: skip
        counters, occluded = self._connect(counters, 0, 0, recording)
        depth = 1
        while counters.rays:
            active = counters.rays
            t = buffers.t[:active]
            primitives = self.accelerators.closest(buffers.rays.o[:active], buffers.rays.d[:active], t)
            buffers.reserve(counters, active)
            asked = counters.paths
            counters = self.estimator.interact(
                self.arrays, self.samples, buffers.lanes, buffers.rays, t, primitives, depth, settings.max_depth,
                settings.rr_depth, recording, buffers.next_rays, buffers.shadow, buffers.vertices, buffers.paths, buffers.words,
                counters,
            )  # fmt: skip
            counters, occluded = self._connect(counters, asked, occluded, recording)
            buffers.swap_rays()
            buffers.t[: counters.rays] = FAR
            depth += 1
        return counters, occluded

    def _connect(self, counters: Counters, asked: int, occluded: int, recording: bool) -> tuple[Counters, int]:
        """Test the connections of the path rows from ``asked`` on, and strike out those that are blocked."""
        buffers, m = self.buffers, counters.shadow
        o, d, far = buffers.shadow.o[:m], buffers.shadow.d[:m], buffers.shadow.far[:m]
        blocked = self.accelerators.occluded(o, d, far) if m else NO_RAYS
        if recording and self.settings.occluded and m:
            which = np.flatnonzero(blocked >= 0)
            blocker = np.full(m, NO_OBJECT, np.int32)
            if len(which):
                primitive = self.accelerators.closest(o[which], d[which], far[which])
                met = primitive >= 0  # a grazing ray may be blocked for one query and free for the other
                blocker[which[met]] = self.scene.arrays.geometry.object[primitive[met]]
            buffers.occluded = grow(buffers.occluded, occluded, occluded + counters.paths - asked)
            occluded = keep_blocked(buffers.paths, asked, counters.paths, blocked, blocker, buffers.occluded, occluded)
        connect(buffers.lanes, buffers.paths, asked, counters.paths, blocked)
        # a camera walk's sum is all that its paths leave behind where they are not recorded
        paths = counters.paths if recording or self.settings.method == "light" else 0
        return Counters(counters.rays, 0, counters.vertices, paths, counters.words), occluded

    def _expose(self, film: Film, n: int, counters: Counters) -> None:
        """Add the tile to the film: each camera walk's sum, or each path of light walks where it fell."""
        if self.settings.method == "path":
            film.add(self.buffers.lanes.raster, self.buffers.lanes.radiance, n)
        else:
            film.add(self.buffers.paths.raster, self.buffers.paths.contribution, counters.paths)

    def _record(self, n: int, counters: Counters, occluded: int, write: Write, counts: TraceCounts) -> None:
        """Hand the tile's rows on as batches."""
        buffers, recorder = self.buffers, self.recorder
        vertices = recorder.vertices(buffers.vertices, counters.vertices, buffers.lanes, n)
        write(recorder.vertex_table.name, vertices)
        paths = recorder.paths(buffers.paths, counters.paths, buffers.lanes, n)
        write(PATHS.name, paths)
        counts.vertices += vertices.num_rows
        counts.paths += paths.num_rows
        counts.bytes += vertices.nbytes + paths.nbytes
        if self.settings.method == "path":
            unlit = recorder.unlit(buffers.lanes, n)
            write(UNLIT.name, unlit)
            counts.bytes += unlit.nbytes
        if self.settings.occluded:
            blocked = recorder.paths(buffers.occluded, occluded, buffers.lanes, n, OCCLUDED)
            write(OCCLUDED.name, blocked)
            counts.bytes += blocked.nbytes


NO_RAYS: npt.NDArray[np.int32] = np.zeros(0, np.int32)


def tiles(walks: Walks, size: int) -> Iterator[npt.NDArray[np.uint64]]:
    """The ids in runs of up to ``size``."""
    if isinstance(walks, tuple):
        first, count = walks
        for start in range(first, first + count, size):
            yield np.arange(start, min(start + size, first + count), dtype=np.uint64)
    else:
        for i in range(0, len(walks), size):
            yield np.asarray(walks[i : i + size], np.uint64)
