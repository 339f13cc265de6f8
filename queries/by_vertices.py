"""Paths matched by their vertices: an expression that asks for places is folded over the rows of every path's walks.

Events, from the camera outward: the camera; the camera walk's interactions; the light walk's, last first; the emitter. An event's segment
leads to it from the event before. For an emitter at infinity the segment is the ray toward it, until it has left the scene.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.errors import RunError
from queries.kernels.vertices import Automaton, Prefixes, Vertices, find_walks, fold_paths, mark_used
from queries.lpe import Expression
from queries.run import Run
from queries.shards import Piece
from queries.symbols import Ends, Symbols
from renderer.tables import EMITTER_HIT, EMITTER_SAMPLE, ESCAPED, LENS_SAMPLE, NO_OBJECT

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
Chosen = npt.NDArray[np.bool_]
_XYZ = ("x", "y", "z")


class VertexMatcher:
    """An expression that asks for places, folded over a run's vertices. ``tables``: what it reads of a piece beside the paths."""

    tables: tuple[str, ...] = ("camera_vertices", "light_vertices")

    def __init__(self, run: Run, expression: Expression, symbols: Symbols) -> None:
        self._run, self._places, self._ends = run, symbols.places, Ends(run, symbols)
        self._regions = [run.regions[name] for _, name in self._places]
        self._joint_mask = sum(1 << k for k, (field, _) in enumerate(self._places) if field == "region")
        self._emitters = Emitters(run)
        self._eye = sensor_origin(run)
        eye = self._eye.reshape(1, 3)
        nothing = np.full(1, NO_OBJECT, np.int32)
        at = [field == "region" and bool(region.contains(run.geometry, eye, nothing)[0]) for (field, _), region in zip(self._places, self._regions)]
        camera = symbols.camera[sum(1 << k for k, there in enumerate(at) if there)]
        words = run.words
        table = symbols.interactions(words.event[2:], words.object[2:])
        start = expression.dfa.transitions[0, camera]
        self._automaton = Automaton(table, self._ends.symbols, expression.dfa.transitions, expression.dfa.accepting, np.int32(start))

    def select(self, piece: Piece, table: str) -> Chosen:
        """Whether each row is matched: bool (rows)."""
        paths = piece.once(("paths", table), lambda: Paths(piece, table, self._eye, self._emitters))
        joint, ends = np.zeros(paths.rows, np.uint8), np.zeros(paths.rows, np.uint8)
        bits = {side: np.zeros(piece.rows(f"{side}_vertices"), np.uint8) for side in ("camera", "light")}
        for k, (place, region) in enumerate(zip(self._places, self._regions)):
            for side in ("camera", "light"):
                bits[side] |= piece.once(("vertices", table, side, *place), lambda: self._at(paths.walks[side], place[0], region)) << np.uint8(k)  # noqa: B023
            last, between = piece.once(("ends", table, *place), lambda: self._at_end(paths, place[0], region))  # noqa: B023
            ends |= last << np.uint8(k)
            joint |= between << np.uint8(k)
        matched = np.empty(paths.rows, np.bool_)
        camera, light = (Vertices(paths.walks[side].event, paths.walks[side].object, bits[side]) for side in ("camera", "light"))
        prefixes, suffixes = paths.walks["camera"].prefixes, paths.walks["light"].prefixes
        codes = self._ends.codes(piece, table)
        fold_paths(self._automaton, camera, prefixes, light, suffixes, joint, np.uint8(self._joint_mask), codes, ends, matched)
        return matched

    def _at(self, walks: "Walks", field: str, region: Any) -> U8:
        """For each vertex that some path uses: 1 where it is in the region, or where the segment to it crosses the region."""
        rows = np.flatnonzero(walks.used)
        found = np.zeros(len(walks.used), np.uint8)
        if field == "region":
            found[rows] = region.contains(self._run.geometry, walks.points[rows], walks.things[rows])
        else:
            start, end = walks.segments(rows)
            found[rows] = region.crosses(self._run.geometry, start, end)
        return found

    def _at_end(self, paths: "Paths", field: str, region: Any) -> tuple[U8, U8]:
        """The same for each path's last event, and for the segment between its two walks."""
        geometry, between = self._run.geometry, np.zeros(paths.rows, np.uint8)
        if field == "region":
            inside = region.contains(geometry, paths.emitter_points, paths.emitter_things)
            return (inside & paths.finite).astype(np.uint8), between
        joined = np.flatnonzero(paths.walks["light"].prefixes.length > 0)
        if len(joined):
            between[joined] = region.crosses(geometry, paths.camera_ends[joined], paths.light_ends[joined])
        start, end = paths.last_segments()
        return region.crosses(geometry, start, end).astype(np.uint8), between


class Emitters:
    """What paths need of the catalogue: ``infinite``, bool (emitters), ``object``, int32, ``far``: a way that leaves the scene from anywhere."""

    def __init__(self, run: Run) -> None:
        rows = sorted(run.tables["emitters"].to_pylist(), key=lambda row: row["emitter"])
        self.infinite = np.array([bool(row.get("infinite")) for row in rows] or [False])
        self.object: I32 = np.array([NO_OBJECT if row["object"] is None else row["object"] for row in rows] or [NO_OBJECT], np.int32)
        self.far = np.float32(4.0 * run.geometry.extent)  # regions may lie outside the scene


@dataclass(frozen=True)
class Walks:
    """One side's vertices and what paths use of them. ``points``: float32 (vertices, 3); ``things``: the object of each."""

    event: U8
    object: npt.NDArray[np.uint16]
    points: F32
    prefixes: Prefixes
    used: Chosen
    has_previous: Chosen
    toward_camera: bool
    eye: F32

    @property
    def things(self) -> I32:
        """The object of each vertex."""
        return self.object.astype(np.int32)

    def segments(self, rows: I64) -> tuple[F32, F32]:
        """The segments that lead to these vertices, from the camera outward: (start, end), float32 (rows, 3)."""
        if self.toward_camera:
            after = np.minimum(rows + 1, len(self.points) - 1)
            # The last vertex of a walk is reached by the connection alone: a segment of no length stands for that
            after = np.where(self.has_previous[after], after, rows)
            return self.points[after], self.points[rows]
        before = self.points[np.maximum(rows - 1, 0)]
        before[~self.has_previous[rows]] = self.eye
        return before, self.points[rows]


class Paths:
    """The paths of a piece as vertices: where each one's walks end, and where its emitter is. All points: float32 (rows, 3)."""

    def __init__(self, piece: Piece, table: str, eye: F32, emitters: Emitters) -> None:
        self.rows = piece.rows(table)
        self._piece, self._eye, self._far = piece, eye, emitters.far
        self._technique: U8 = piece.column(table, "technique")
        self._endpoints = _points(piece, table, "endpoint_")
        self.walks = {side: _walks(piece, table, side, self._technique, eye) for side in ("camera", "light")}
        emitter = np.minimum(piece.column(table, "emitter"), len(emitters.object) - 1)
        self.infinite: Chosen = emitters.infinite[emitter]
        self.finite: Chosen = ~self.infinite
        self.emitter_things: I32 = emitters.object[emitter]

    @functools.cached_property
    def emitter_points(self) -> F32:
        """Where the emitter is: the point that was sampled or hit, or the one that the light walk left. A direction where it is at infinity."""
        light = self.walks["light"]
        if not len(light.points):
            return self._endpoints
        first = np.where(self._sampled_here, -1, _row_of_depth_0(self._piece, light, "light"))
        points = self._endpoints.copy()
        points[first >= 0] = light.points[first[first >= 0]]
        return points

    @functools.cached_property
    def camera_points(self) -> F32:
        """Where the camera is: the point of the lens that was sampled, or that the camera walk left."""
        camera = self.walks["camera"]
        points = np.broadcast_to(self._eye, self._endpoints.shape).copy()
        first = _row_of_depth_0(self._piece, camera, "camera")
        points[first >= 0] = camera.points[first[first >= 0]]
        from_light = self._technique == LENS_SAMPLE
        points[from_light] = self._endpoints[from_light]
        return points

    @functools.cached_property
    def camera_ends(self) -> F32:
        """Where the camera's end of the path is: its walk's last vertex, or else the lens."""
        return _put_ends(self.camera_points.copy(), self.walks["camera"])

    @functools.cached_property
    def light_ends(self) -> F32:
        """Where the light's end is: its walk's last vertex, or else the emitter."""
        return _put_ends(self.emitter_points.copy(), self.walks["light"])

    @functools.cached_property
    def before_emitters(self) -> F32:
        """Where the path is last before its emitter, from the camera outward: the interaction that light meets first, or else the lens."""
        light = self.walks["light"]
        return _put_ends(self.camera_ends.copy(), light, 1) if len(light.points) else self.camera_ends

    def ways_to_emitters(self, rows: I64) -> F32:
        """The unit directions from ``before_emitters`` toward the emitters at infinity of these rows: float32 (rows, 3)."""
        start, end = self.before_emitters[rows], self.emitter_points[rows]
        # A light walk left a disk outside the scene: its ray leads there, and on
        ways = np.where(self._sampled_here[rows, None], end, end - start)
        ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), np.float32(1e-30))
        return ways

    def last_segments(self) -> tuple[F32, F32]:
        """The segment or ray that leads to each path's emitter: (start, end)."""
        start, end = self.before_emitters, self.emitter_points
        infinite = np.flatnonzero(self.infinite)
        if len(infinite):
            end = end.copy()
            end[infinite] = start[infinite] + self._far * self.ways_to_emitters(infinite)
        return start, end

    @property
    def _sampled_here(self) -> Chosen:
        """Whether the emitter's point stands in the path's own row."""
        found: Chosen = (self._technique == EMITTER_HIT) | (self._technique == EMITTER_SAMPLE)
        return found


def sensor_origin(run: Run) -> F32:
    """Where the sensor stands, world units: float32 (3)."""
    try:
        matrix = np.array(run.manifest["camera"]["to_world"], np.float32)
        return np.ascontiguousarray(matrix[:3, 3])
    except (KeyError, TypeError, ValueError, IndexError):
        raise RunError(f"the manifest of `{run.path}` does not say where the camera stands: run the job again with --resume") from None


def _walks(piece: Piece, table: str, side: str, technique: U8, eye: F32) -> Walks:
    """One side's vertices; none where the run has no such walks."""
    rows, vertices = piece.rows(table), f"{side}_vertices"
    if not piece.rows(vertices) or not piece.has(table, f"{side}_walk"):
        prefixes = Prefixes(np.full(rows, -1, np.int64), _counts(piece, table, side, technique), np.zeros(rows, np.uint8))
        none = np.zeros(0, np.bool_)
        return Walks(np.zeros(0, np.uint8), np.zeros(0, np.uint16), np.zeros((0, 3), np.float32), prefixes, none, none, side == "light", eye)
    start = np.empty(rows, np.int64)
    walk, depth = piece.column(vertices, "walk"), piece.column(vertices, "depth")
    find_walks(piece.column(table, f"{side}_walk"), walk, depth, start)
    count = _counts(piece, table, side, technique)
    # The lobe that a connection evaluates at its end stands in the path's row; a walk that hit an emitter went on by its own lobe
    last = np.where((count == 0) | (technique == EMITTER_HIT), 0, piece.column(table, f"{side}_event")).astype(np.uint8)
    prefixes, used = Prefixes(start, count, last), np.zeros(len(walk), np.bool_)
    mark_used(prefixes, used)
    event, thing = piece.column(vertices, "event"), piece.column(vertices, "object")
    used &= event != ESCAPED
    previous = np.zeros(len(walk), np.bool_)
    previous[1:] = walk[1:] == walk[:-1]
    return Walks(event, thing, _points(piece, vertices, ""), prefixes, used, previous, side == "light", eye)


def _counts(piece: Piece, table: str, side: str, technique: U8) -> I32:
    """How many vertices of the walk scatter light in each path."""
    if not piece.has(table, f"{side}_depth"):
        return np.zeros(piece.rows(table), np.int32)
    depth = piece.column(table, f"{side}_depth").astype(np.int32)
    # A camera walk that hit an emitter ends with a vertex there, which is the path's last event
    return depth - (technique == EMITTER_HIT) if side == "camera" else depth


def _points(piece: Piece, table: str, prefix: str) -> F32:
    return piece.once(("points", table), lambda: np.stack([piece.column(table, prefix + axis) for axis in _XYZ], axis=1))


def _row_of_depth_0(piece: Piece, walks: Walks, side: str) -> I64:
    """The row of the sampled lens point or emitter point of each path's walk; -1 where none was recorded."""
    start = walks.prefixes.start
    depth = piece.column(f"{side}_vertices", "depth") if piece.rows(f"{side}_vertices") else np.ones(1, np.uint8)
    return np.where((start > 0) & (depth[np.maximum(start - 1, 0)] == 0), start - 1, -1)


def _put_ends(points: F32, walks: Walks, most: int = 255) -> F32:
    """The points with those replaced that are a walk's: its last vertex in the path, or the one of depth ``most``."""
    row = walks.prefixes.start + np.minimum(walks.prefixes.length, most) - 1
    there = np.flatnonzero((walks.prefixes.length > 0) & (walks.prefixes.start >= 0) & (row < len(walks.points)))
    points[there] = walks.points[row[there]]
    return points
