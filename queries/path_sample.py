"""Some paths of a selection, with all their vertices: what pictures of paths are drawn from.

Two passes over the tables, shard by shard: one draws which paths (``queries.priority``), the other gathers the vertices of those alone.
Memory does not grow with the run: each shard keeps no more candidates than paths are asked for, and a sample has their vertices.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from queries.by_vertices import Emitters, Paths, sensor_origin
from queries.classify import Classifier
from queries.errors import QueryError, RunError
from queries.horizon import Horizon
from queries.kernels.gather import gather_walks
from queries.priority import Candidates, Draw, by_luminance
from queries.ranking.places import INSIDE, Places
from queries.run import Run
from queries.selection import Selection
from queries.shards import Piece, map_shards
from renderer.tables import EMITTER, LENS, NO_OBJECT

Chosen = npt.NDArray[np.bool_]
F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
WAYS = ("uniform", "contribution")
_OF_VERTICES = ("points", "event", "object")
_OF_PATHS = ("owner", "path", "infinite", "contribution", "raster", "scale")
_SIDES = ("camera", "light")
_VALUED = ("unoccluded", "shadows", "nothruput")  # prefixes that count other rows, or other values, than paths have


@dataclass(frozen=True)
class PathSample:
    """``n`` paths in the order of (owner, path), each with its vertices from the emitter to the camera, as light travels.

    Of vertices: ``points``, float32 (m, 3), world; ``event``, uint8 (m), EMITTER first, LENS last; ``object``, int32 (m), NO_OBJECT where there
    is none. ``start``, int64 (n + 1): where each path's vertices begin.

    Of paths: ``owner``, int64 (n), the walk; ``path``, int32 (n), the ordinal in it; ``infinite``, bool (n), whether the emitter is at infinity: its
    vertex then stands where the ray leaves a sphere around the scene (``queries.horizon``); ``contribution``, float32 (n, 3); ``raster``, float32
    (n, 2), pixels; ``scale``, float64 (n), such that sums of scale x value over the sample estimate sums over all paths of the selection.
    ``found``: how many paths the selection has.
    """

    start: I64
    points: F32
    event: U8
    object: I32
    owner: I64
    path: I32
    infinite: npt.NDArray[np.bool_]
    contribution: F32
    raster: F32
    scale: F64
    found: int

    def __len__(self) -> int:
        """How many paths were drawn."""
        return len(self.owner)

    def take(self, paths: I64) -> "PathSample":
        """Some of the paths, by their numbers in the sample, in the order given; ``scale`` and ``found`` stay as they are."""
        length = np.diff(self.start)[paths]
        start = np.concatenate([[0], np.cumsum(length)])
        vertices = np.repeat(self.start[:-1][paths] - start[:-1], length) + np.arange(start[-1])
        columns = {name: getattr(self, name)[vertices] for name in _OF_VERTICES} | {name: getattr(self, name)[paths] for name in _OF_PATHS}
        return replace(self, start=start, **columns)


def sample_paths(run: Run, selection: Selection, most: int, by: str = "uniform", seed: int = 0, threads: int | None = None) -> PathSample:
    """At most ``most`` paths of a selection.

    ``by`` "uniform": each set of so many paths is equally likely; "contribution": the brighter a path, the likelier it is drawn, and those without
    light never are. The sample depends on the run, the selection and ``seed``, not on threads, nor on how the run is cut into shards.
    Sums of ``scale`` x value over the sample are unbiased estimates of sums over all the selection's paths, recorded or not (``record.keep``);
    by contribution, of values that are 0 where there is no light. ``found`` counts recorded paths; where there is none, the sample is empty.

    Raises ``QueryError`` for what cannot be drawn, and where the run recorded no paths.
    """
    _check(run, selection, most, by)
    threads = threads or run.threads
    drawn, threshold, found = _drawn(run, _Chooser(run, selection, by), int(most), seed, threads)
    sample = _gathered(run, drawn, threads)
    sample = sample.take(np.lexsort((sample.path, sample.owner)))
    if by == "uniform":
        scale = np.full(len(sample), found / max(len(sample), 1))
    else:
        weight = by_luminance(sample.contribution)
        scale = np.maximum(weight, threshold) / weight
    return replace(sample, scale=scale / run.settings["keep"], found=found)


def _check(run: Run, selection: Selection, most: int, by: str) -> None:
    if isinstance(most, bool) or not isinstance(most, (int, np.integer)) or most < 1:
        raise QueryError(f"expected the most paths to draw as a whole number of 1 or more, found {most!r}")
    if by not in WAYS:
        raise QueryError(f"expected paths to be drawn by {' or '.join(WAYS)}, found {by!r}")
    run.require_paths("there are none to draw")
    for side in _SIDES:
        if f"{side}_depth" in run.tables["paths"].schema.names and f"{side}_vertices" not in run.tables:
            raise QueryError(f"`{run.path}` did not record the vertices of {side} walks, which its paths lead through: render it again")
    for prefix in selection.expression.prefixes if selection.expression else ():
        if prefix in _VALUED:
            raise QueryError(
                f"`{prefix};` says what an image counts, blocked connections or other values, and a sample is drawn of paths as they are: "
                f"expected an expression without it, found `{selection.expression}`"
            )
    if selection.region is not None:
        selection.region.check(run.geometry)


# --- which paths --------------------------------------------------------------------------------------------------


def _drawn(run: Run, chooser: "_Chooser", most: int, seed: int, threads: int | None) -> tuple[Candidates, float, int]:
    """The paths drawn, the threshold of their priorities (0 where all were drawn), and how many paths the selection has."""
    draw, found = Draw(most + 1, seed), 0  # the one more is the threshold
    work = functools.partial(_draw_shard, chooser, draw, most + 1, seed)
    for count, candidates in map_shards(run.files("paths", *chooser.tables), work, threads):
        draw.add(candidates)
        found += count
    best = draw.best()
    return best.best(most), float(best.priority.min()) if len(best) > most else 0.0, found


def _draw_shard(chooser: "_Chooser", whole: Draw, most: int, seed: int, found: Iterator[Piece]) -> tuple[int, Candidates]:
    """How many paths of the selection a shard has, and the best candidates among them. ``whole``: the run's draw, as far as it is by now."""
    draw, count, first = Draw(most, seed, whole.least), 0, 0
    for piece in found:
        chosen = chooser.select(piece)
        if chosen.any():
            draw.offer(chooser.weights(piece, chosen), piece.owner(), piece.column("paths", "path"), piece.shard, first)
        count += int(np.count_nonzero(chosen))
        first += len(chosen)
        piece.forget()
    return count, draw.best()


class _Chooser:
    """Tells which paths of a piece a selection has, and the weights that they are drawn by. ``tables``: what it reads beside the paths."""

    def __init__(self, run: Run, selection: Selection, by: str) -> None:
        self._classifier = Classifier(run, selection.expression) if selection.expression else None
        self._places = Places(run, selection.region, None, "any") if selection.region else None
        self._film, self._by = selection.film, by
        tables = {"camera_vertices", "light_vertices"} if self._places else set[str]()
        self.tables = sorted(tables.union(self._classifier.tables if self._classifier else ()))

    def select(self, piece: Piece) -> Chosen:
        """Whether the selection has each path: bool (rows)."""
        chosen = np.ones(piece.rows("paths"), np.bool_)
        if self._film:
            for axis, low, high in (("x", *self._film[::2]), ("y", *self._film[1::2])):
                raster = piece.column("paths", f"raster_{axis}")
                # Compared in double precision: bounds need not be numbers of single precision
                chosen &= (raster >= np.float64(low)) & (raster < np.float64(high))
        if self._classifier and chosen.any():
            chosen &= self._classifier.select(piece)
        if self._places and chosen.any():
            rows = np.flatnonzero(chosen)
            part = piece if len(rows) == len(chosen) else _only(piece, rows)
            chosen[rows] = self._places.of(part) == INSIDE
            part.forget()
        return chosen

    def weights(self, piece: Piece, chosen: Chosen) -> F64:
        """What each path is drawn by, 0 where it never is: float64 (rows)."""
        if self._by == "uniform":
            return chosen.astype(np.float64)
        return np.where(chosen, by_luminance(_columns(piece, "contribution_", "rgb")), 0.0)


# --- their vertices -----------------------------------------------------------------------------------------------


def _gathered(run: Run, drawn: Candidates, threads: int | None) -> PathSample:
    """The drawn paths, in the order of shards and rows, unscaled."""
    shards, counts = np.unique(drawn.shard, return_counts=True)
    rows = np.split(drawn.row[np.lexsort((drawn.row, drawn.shard))], np.cumsum(counts)[:-1])
    files = run.files("paths", "camera_vertices", "light_vertices")
    work = functools.partial(_gather_shard, _Gatherer(run), rows)
    parts = [part for found in map_shards([files[shard] for shard in shards.tolist()], work, threads) for part in found]
    return _joined(parts)


def _gather_shard(gatherer: "_Gatherer", rows: list[I64], found: Iterator[Piece]) -> list[PathSample]:
    parts, first = [], 0
    for piece in found:
        wanted, end = rows[piece.shard], first + piece.rows("paths")
        here = wanted[np.searchsorted(wanted, first) : np.searchsorted(wanted, end)] - first
        if len(here):
            parts.append(gatherer.paths(piece, here))
        first = end
    return parts


class _Gatherer:
    """Makes samples of rows of paths. Threads may share it."""

    def __init__(self, run: Run) -> None:
        self._path, self._eye, self._emitters, self._horizon = run.path, sensor_origin(run), Emitters(run), Horizon.of(run.geometry)

    def paths(self, piece: Piece, rows: I64) -> PathSample:
        """These rows of a piece, as paths with their vertices."""
        drawn = _only(piece, rows)
        paths = Paths(drawn, "paths", self._eye, self._emitters)
        length = 2 + sum(paths.walks[side].prefixes.length.astype(np.int64) for side in _SIDES)
        start = np.concatenate([[0], np.cumsum(length)])
        first, last = start[:-1], start[1:] - 1

        # ---- the two ends ----
        points, event, thing = np.empty((start[-1], 3), np.float32), np.empty(start[-1], np.uint8), np.full(start[-1], NO_OBJECT, np.int32)
        event[first], thing[first], points[first] = EMITTER, paths.emitter_things, paths.emitter_points
        event[last], points[last] = LENS, paths.camera_points
        infinite = np.flatnonzero(paths.infinite)
        points[first[infinite]] = self._horizon.leave(paths.before_emitters[infinite], paths.ways_to_emitters(infinite))

        # ---- what is between: the light walk onward, the camera walk backward ----
        for side, at, step in (("light", first + 1, 1), ("camera", last - 1, -1)):
            walks = paths.walks[side]
            used, begin = walks.prefixes.length, walks.prefixes.start
            if not used.any():
                continue
            if ((used > 0) & ((begin < 0) | (begin + used > len(walks.event)))).any():
                raise RunError(f"paths of `{self._path}` lead through vertices of {side} walks that are not there: run the job again with --resume")
            gather_walks(walks.event, walks.object, walks.points, walks.prefixes, at, step, event, thing, points)

        owner, path = drawn.owner().astype(np.int64), drawn.column("paths", "path").astype(np.int32)
        contribution, raster = _columns(drawn, "contribution_", "rgb"), _columns(drawn, "raster_", "xy")
        return PathSample(start, points, event, thing, owner, path, paths.infinite, contribution, raster, np.ones(len(rows)), len(rows))


def _columns(piece: Piece, prefix: str, names: str) -> F32:
    """Columns of the paths beside each other: float32 (rows, columns)."""
    return np.stack([piece.column("paths", prefix + name) for name in names], axis=1)


def _only(piece: Piece, rows: I64) -> Piece:
    """A piece with these of its paths alone."""
    return Piece({**piece.batches, "paths": piece.batches["paths"].take(rows)}, piece.shard)


def _joined(parts: list[PathSample]) -> PathSample:
    """One sample of all paths of some."""
    columns = {name: np.concatenate([getattr(part, name) for part in [_nothing(), *parts]]) for name in (*_OF_VERTICES, *_OF_PATHS)}
    start = np.concatenate([[0], *(np.diff(part.start) for part in parts)]).cumsum()
    return PathSample(start=start, found=len(start) - 1, **columns)


def _nothing() -> PathSample:
    """No path."""
    colors, raster, numbers = np.zeros((0, 3), np.float32), np.zeros((0, 2), np.float32), np.zeros(0, np.int32)
    start, event, infinite = np.zeros(1, np.int64), np.zeros(0, np.uint8), np.zeros(0, np.bool_)
    return PathSample(start, colors, event, numbers, start[:0], numbers, infinite, colors, raster, np.zeros(0), 0)
