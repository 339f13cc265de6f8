"""From the wavefront's rows to recorded tables: rows into (walk, depth) order, columns into Arrow batches, no copy after.

Rows come bounce by bounce; a counting sort by lane restores walk order, and keeps the order within a walk.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from renderer.integrators.buffers import NO_LANE, Lanes, PathRows, VertexRows, WordRows
from renderer.kernel import kernel
from renderer.settings import TraceSettings
from renderer.tables import ARROW_TYPES, CAMERA_VERTICES, LIGHT_VERTICES, OCCLUDED, PATHS, UNLIT, WORDS, Table

I64 = npt.NDArray[np.int64]


@kernel
def walk_order(lane: npt.NDArray[np.int32], n: int, lanes: int, recorded: npt.NDArray[np.uint8], start: I64, position: I64) -> np.int64:
    """``position[i]``: the rank of row i in (lane, row) order among recorded lanes, -1 for others; ``start``: first rank of each lane."""
    for j in range(lanes + 1):
        start[j] = 0
    for i in range(n):
        if lane[i] != NO_LANE and recorded[lane[i]]:
            start[lane[i] + 1] += 1
    for j in range(lanes):
        start[j + 1] += start[j]
    for i in range(n):
        position[i] = -1
        if lane[i] != NO_LANE and recorded[lane[i]]:
            position[i] = start[lane[i]]
            start[lane[i]] += 1
    # each start has moved on to the next lane's: move them back
    total: np.int64 = start[lanes]
    for j in range(lanes, 0, -1):
        start[j] = start[j - 1]
    start[0] = 0
    return total


@kernel
def fill_vertices(rows: VertexRows, n: int, lanes: Lanes, position: I64, walk: Any, out: Any) -> None:
    """Scatter the rows of ``n`` vertices into the columns ``out``."""
    depth, event, thing, x, y, z, r, g, b = out
    for i in range(n):
        k = position[i]
        if k < 0:
            continue
        walk[k] = lanes.walk[rows.lane[i]]
        depth[k] = rows.depth[i]
        event[k] = rows.event[i]
        thing[k] = rows.object[i]
        x[k] = rows.position[i, 0]
        y[k] = rows.position[i, 1]
        z[k] = rows.position[i, 2]
        r[k] = rows.beta[i, 0]
        g[k] = rows.beta[i, 1]
        b[k] = rows.beta[i, 2]


@kernel
def fill_surface_points(rows: VertexRows, n: int, position: I64, primitive: Any, u: Any, v: Any) -> None:
    """Scatter the optional columns of ``n`` vertices."""
    for i in range(n):
        k = position[i]
        if k >= 0:
            primitive[k] = rows.primitive[i]
            u[k] = rows.uv[i, 0]
            v[k] = rows.uv[i, 1]


@kernel
def fill_paths(rows: PathRows, n: int, lanes: Lanes, camera: bool, start: I64, position: I64, walk: Any, out: Any) -> None:
    """Scatter the rows of ``n`` paths into the columns ``out``; a camera walk's film position is its lane's."""
    path, technique, depth, event, word, emitter, x, y, z, raster_x, raster_y, r, g, b, weight, blocker = out
    for i in range(n):
        k = position[i]
        if k < 0:
            continue
        lane = rows.lane[i]
        walk[k] = lanes.walk[lane]
        path[k] = k - start[lane]
        technique[k] = rows.technique[i]
        depth[k] = rows.depth[i]
        event[k] = rows.event[i]
        word[k] = rows.word[i]
        emitter[k] = rows.emitter[i]
        x[k] = rows.endpoint[i, 0]
        y[k] = rows.endpoint[i, 1]
        z[k] = rows.endpoint[i, 2]
        if camera:
            raster_x[k] = lanes.raster[lane, 0]
            raster_y[k] = lanes.raster[lane, 1]
        else:
            raster_x[k] = rows.raster[i, 0]
            raster_y[k] = rows.raster[i, 1]
        r[k] = rows.contribution[i, 0]
        g[k] = rows.contribution[i, 1]
        b[k] = rows.contribution[i, 2]
        weight[k] = rows.weight[i]
        blocker[k] = rows.blocker[i]


@kernel
def fill_unlit(lanes: Lanes, n: int, start: I64, walk: Any, raster_x: Any, raster_y: Any) -> np.int64:
    """The recorded walks, of ``n`` lanes, without a path of their own, into the columns: how many they are. ``start``: first path of each lane."""
    k = 0
    for lane in range(n):
        if lanes.recorded[lane] and start[lane + 1] == start[lane]:
            walk[k] = lanes.walk[lane]
            raster_x[k] = lanes.raster[lane, 0]
            raster_y[k] = lanes.raster[lane, 1]
            k += 1
    return np.int64(k)


WordColumns = Sequence[npt.NDArray[Any]]
"""The columns word, parent, event and object of some words."""


class WordCollision(RuntimeError):
    """Two different prefixes of walks with one 64-bit hash: some 2^-64 for each pair of them."""


def distinct_words(columns: WordColumns) -> WordColumns:
    """Each word once, in order of the word. Raises WordCollision."""
    order = np.argsort(columns[0], kind="stable")
    columns = [c[order] for c in columns]
    again = np.zeros(len(order), bool)
    again[1:] = columns[0][1:] == columns[0][:-1]
    for column in columns[1:]:
        clash = np.flatnonzero(again[1:] & (column[1:] != column[:-1]))
        if len(clash):
            raise WordCollision(
                f"two different prefixes of walks share the word {columns[0][clash[0]]:#x}, so they have the same hash of 64 bits: "
                "the tables cannot tell them apart. Lower render.max_depth, or name fewer objects"
            )
    return [c[~again] for c in columns]


class Recorder:
    """Turns one thread's tiles into record batches. Batches alias pooled memory: use them before the next tile."""

    def __init__(self, settings: TraceSettings) -> None:
        self.camera = settings.method == "path"
        self.walk_type = np.uint32 if settings.walks <= 2**32 else np.uint64
        self.vertex_table = CAMERA_VERTICES if self.camera else LIGHT_VERTICES
        self.surface_points = tuple(c.name for c in self.vertex_table.columns if c.optional and c.name in settings.columns)
        self.schemas = recorded_schemas(settings)
        self._columns: dict[str, npt.NDArray[Any]] = {}
        self._start: I64 = np.zeros(0, np.int64)
        self._position: I64 = np.zeros(0, np.int64)

    def vertices(self, rows: VertexRows, n: int, lanes: Lanes, n_lanes: int) -> pa.RecordBatch:
        """The first n vertex rows as a batch."""
        total = self._order(rows.lane, n, n_lanes, lanes.recorded)
        names = [c.name for c in self.vertex_table.columns if not c.optional]
        columns = {name: self._column(self.vertex_table, name, total) for name in names}
        fill_vertices(rows, n, lanes, self._position, columns["walk"], tuple(columns[name] for name in names[1:]))
        if self.surface_points:
            points = {name: self._column(self.vertex_table, name, total) for name in ("primitive", "u", "v")}
            fill_surface_points(rows, n, self._position, points["primitive"], points["u"], points["v"])
            columns |= points
        return self._batch(self.vertex_table.name, columns, total)

    def paths(self, rows: PathRows, n: int, lanes: Lanes, n_lanes: int, table: Table = PATHS) -> pa.RecordBatch:
        """The first n path rows as a batch of ``paths``, or of ``occluded``."""
        total = self._order(rows.lane, n, n_lanes, lanes.recorded)
        side = "camera" if self.camera else "light"
        names = ["path", "technique", f"{side}_depth", f"{side}_event", f"{side}_word", "emitter", "endpoint_x", "endpoint_y", "endpoint_z"]
        names += ["raster_x", "raster_y", "contribution_r", "contribution_g", "contribution_b", "mis_weight", "blocker"]
        columns = {name: self._column(OCCLUDED, name, total) for name in [f"{side}_walk", *names]}
        fill_paths(rows, n, lanes, self.camera, self._start, self._position, columns[f"{side}_walk"], tuple(columns[name] for name in names))
        return self._batch(table.name, columns, total)

    def unlit(self, lanes: Lanes, n_lanes: int) -> pa.RecordBatch:
        """The recorded walks of which the last call of ``paths`` found no row, as a batch."""
        columns = {name: self._column(UNLIT, name, n_lanes) for name in UNLIT.by_name}
        total = int(fill_unlit(lanes, n_lanes, self._start, *columns.values()))
        return self._batch(UNLIT.name, columns, total)

    def words(self, rows: list[WordColumns]) -> pa.RecordBatch:
        """All distinct words of the given columns, in order of the word. Raises WordCollision."""
        columns = [np.concatenate(parts) for parts in zip(*rows)] if rows else [np.zeros(0, t) for t in (np.uint64, np.uint64, np.uint8, np.uint16)]
        return pa.record_batch([pa.array(c) for c in distinct_words(columns)], schema=self.schemas[WORDS.name])

    def _order(self, lane: npt.NDArray[np.int32], n: int, n_lanes: int, recorded: npt.NDArray[np.uint8]) -> int:
        if len(self._position) < n:
            self._position = np.zeros(2 * n, np.int64)
        if len(self._start) < n_lanes + 1:
            self._start = np.zeros(n_lanes + 1, np.int64)
        return int(walk_order(lane, n, n_lanes, recorded, self._start, self._position))

    def _column(self, table: Table, name: str, n: int) -> npt.NDArray[Any]:
        key = f"{table.name}.{name}"
        if key not in self._columns or len(self._columns[key]) < n:
            kind = table.by_name[name].type
            dtype = self.walk_type if kind == "walk" else np.dtype(kind)
            self._columns[key] = np.zeros(max(2 * n, 1), dtype)
        return self._columns[key]

    def _batch(self, table: str, columns: dict[str, npt.NDArray[Any]], n: int) -> pa.RecordBatch:
        schema = self.schemas[table]
        arrays = [pa.Array.from_buffers(f.type, n, [None, pa.py_buffer(columns[f.name][:n])]) for f in schema]
        return pa.RecordBatch.from_arrays(arrays, schema=schema)


def recorded_schemas(settings: TraceSettings) -> dict[str, pa.Schema]:
    """The stored schema of every table that these settings record, by name."""
    camera = settings.method == "path"
    side, other = ("camera", "light") if camera else ("light", "camera")
    vertices = CAMERA_VERTICES if camera else LIGHT_VERTICES
    skipped = {f"{other}_walk", f"{other}_depth", f"{other}_event", f"{other}_word"}
    if not camera:
        skipped.add("mis_weight")  # one technique alone: the weight is 1
    tables = {
        vertices.name: vertices.schema(tuple(c.name for c in vertices.columns if not c.optional or c.name in settings.columns)),
        PATHS.name: PATHS.schema(tuple(c.name for c in PATHS.columns if c.name not in skipped)),
        WORDS.name: WORDS.schema(tuple(c.name for c in WORDS.columns)),
    }
    if camera:
        tables[UNLIT.name] = UNLIT.schema(tuple(UNLIT.by_name))
    if settings.occluded:
        tables[OCCLUDED.name] = OCCLUDED.schema(tuple(c.name for c in OCCLUDED.columns if c.name not in skipped))
    if settings.keep == 0.0:
        return {}
    if settings.walks > 2**32:
        wide = {f"{side}_walk", "walk"}
        return {name: pa.schema([f.with_type(pa.uint64()) if f.name in wide else f for f in schema]) for name, schema in tables.items()}
    assert ARROW_TYPES["walk"] == pa.uint32()
    return tables


def used_words(rows: WordRows, n: int) -> WordColumns:
    """Copies of the first n words' columns."""
    return rows.word[:n].copy(), rows.parent[:n].copy(), rows.event[:n].copy(), rows.object[:n].copy()
