"""Light at a probe, by the direction that it comes from: the sphere in free space, or the disk on a surface, that segments of walks pass through.

A sphere: each segment counts by its length inside, as in a voxel, so that segments that begin or end there count by their part. Flux x length
over volume is fluence; over the solid angle of a cell of directions it is the radiance there, a mean over the ball. (Crossings of the ball's
cross section, flux / (pi r²), have the same mean only where light does not vary over the ball and nothing begins or ends inside.)

A disk: each segment that comes through from the front counts. Flux over area is irradiance; over a cell's projected solid angle it is the mean
radiance there, weighted by the cosine, so that radiance times projected solid angle sums to the irradiance exactly.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.arrivals import Arrivals
from queries.errors import QueryError
from queries.inspection import walks_of
from queries.kernels.meters import chords_of_ball, through_disk
from queries.luminance import luminance_of
from queries.regions.rays import TOUCH
from queries.run import Run
from queries.selection import Selection
from queries.shards import Piece, map_shards
from queries.statistics import Units

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
Point = tuple[float, float, float]
MOST_BANDS = 512


@dataclass(frozen=True)
class Probe:
    """A sphere around ``position``; with a ``normal``, the disk around it that light passes from the normal's side. World units.

    A disk lies on a surface that is flat over its radius, or curves away from the normal. Over a hollow one, raise it by radius² / (2 x radius
    of curvature): light that ends before it reaches the disk is not counted. Raises ``QueryError`` for radii that are not above 0 and for
    normals without a length.
    """

    position: Point
    radius: float
    normal: Point | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0 < self.radius < np.inf or not np.isfinite(self.position).all():
            raise QueryError(f"expected a probe at a point, with a radius above 0, found position {list(self.position)}, radius {self.radius}")
        if self.normal is not None and not 0 < float(np.linalg.norm(self.normal)) < np.inf:
            raise QueryError(f"expected the normal of a probe as a direction, found {list(self.normal)}")

    @property
    def axes(self) -> F64:
        """An orthonormal frame (3, 3), rows: two tangents, then the axis, a disk's normal or the world's z axis."""
        if self.normal is None:
            return np.eye(3)
        n = np.array(self.normal, np.float64) / np.linalg.norm(self.normal)
        sign = 1.0 if n[2] >= 0 else -1.0  # duff2017
        a = -1.0 / (sign + n[2])
        b = n[0] * n[1] * a
        return np.array([[1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]], [b, sign + n[1] * n[1] * a, -n[1]], n])

    @property
    def measure(self) -> float:
        """What flux is divided by: the ball's volume (of flux x length), or the disk's area."""
        return 4 / 3 * np.pi * self.radius**3 if self.normal is None else np.pi * self.radius**2

    def passes(self, start: F32, end: F32) -> tuple[I64, F64, F64]:
        """Which segments (n, 3) pass: their rows (k), by what their flux counts (k), and where (k, 3): the middle inside, or the point met."""
        center, at = np.array(self.position, np.float64), np.empty((len(start), 3))
        if self.normal is None:
            chord = np.empty(len(start))
            chords_of_ball(start, end, center, float(self.radius), chord, at)
            rows = np.flatnonzero(chord)
            return rows, chord[rows] / self.measure, at[rows]
        crosses = np.empty(len(start), np.bool_)
        touch = float(TOUCH * (np.abs(center).max() + self.radius))
        through_disk(start, end, center, self.axes[2], float(self.radius), touch, crosses, at)
        rows = np.flatnonzero(crosses)
        return rows, np.full(len(rows), 1.0 / self.measure), at[rows]


@dataclass(frozen=True, eq=False)
class Incident:
    """Light at a probe by direction; directions point to where it comes from.

    ``radiance``: float64 (bands, sectors, 3), flux / (world unit² sr), and ``error`` (bands, sectors), of its luminance. Cells have the same
    ``solid_angle``: bands of equal cosine with the axis, from 1 down, times sectors of equal angle around it. Radiance times ``projected``, the
    cells' solid angles weighted by the cosine (by 1 for a sphere), sums to ``value``: float64 (3), flux / world unit², a sphere's fluence or a
    disk's irradiance; ``value_error``: of its luminance. ``count``: segments. Errors are over independent units (``queries.statistics``), NaN
    where unknown.
    """

    probe: Probe
    radiance: F64
    error: F64
    value: F64
    value_error: float
    count: int

    @property
    def quantity(self) -> str:
        """What ``value`` is: "fluence" or "irradiance"."""
        return "fluence" if self.probe.normal is None else "irradiance"

    @property
    def axes(self) -> F64:
        """The frame of directions, see ``Probe.axes``."""
        return self.probe.axes

    @property
    def solid_angle(self) -> float:
        """Of each cell, sr."""
        bands, sectors = self.error.shape
        return float(_range(self.probe) / bands * 2 * np.pi / sectors)

    @property
    def projected(self) -> F64:
        """The weighted solid angle of each band's cells, sr: float64 (bands)."""
        return _projected(self.probe, *self.error.shape)

    @property
    def directions(self) -> F32:
        """The middle of each cell: unit, world, float32 (bands, sectors, 3)."""
        bands, sectors = self.error.shape
        return self._ways((np.arange(bands) + 0.5) / bands, (np.arange(sectors) + 0.5) / sectors)

    def corners(self) -> F32:
        """The corners of the cells: unit directions, world, float32 (bands + 1, sectors + 1, 3); the last of each band are the first again."""
        bands, sectors = self.error.shape
        return self._ways(np.arange(bands + 1) / bands, np.arange(sectors + 1) % sectors / sectors)

    def _ways(self, bands: F64, sectors: F64) -> F32:
        cosine = (1 - _range(self.probe) * bands)[:, None]
        sine, angle = np.sqrt(np.maximum(1 - cosine * cosine, 0.0)), 2 * np.pi * sectors
        local = np.stack([sine * np.cos(angle), sine * np.sin(angle), np.broadcast_to(cosine, (len(bands), len(sectors)))], axis=-1)
        ways: F32 = (local @ self.axes).astype(np.float32)
        return ways


def incident(run: Run, selection: Selection, probe: Probe, resolution: int = 16, side: str = "light", threads: int | None = None) -> Incident:
    """Selected light at a probe, by direction. ``resolution``: bands from pole to pole (a disk has half as many), with twice as many sectors.

    The sums have the same bits on any number of threads. Raises ``QueryError`` where the run has no such walks, the expression does not fit them,
    or the probe lies beyond where light is known.
    """
    if not 2 <= resolution <= MOST_BANDS:
        raise QueryError(f"expected a resolution of 2 to {MOST_BANDS} bands of directions, found {resolution}")
    bands, sectors = resolution if probe.normal is None else resolution // 2, 2 * resolution
    with walks_of(run, side) as found:
        arrivals, units = Arrivals(found, selection, side), Units.of_run(found)
        require_reach(arrivals, probe)
        sums, noise, count = np.zeros((bands * sectors, 3)), np.zeros((bands * sectors, units.count)), 0
        work = functools.partial(_sum_shard, arrivals, units, probe, bands, sectors)
        for more, scattered, rows in map_shards(found.files(*arrivals.tables), work, threads or found.threads):
            sums += more
            noise += scattered
            count += rows
    angles = np.repeat(_projected(probe, bands, sectors), sectors)
    cells = units.jackknife(lambda total: total * arrivals.per_walk, noise)
    whole = units.jackknife(lambda total: total * arrivals.per_walk, noise.sum(axis=0))
    radiance = (sums * arrivals.per_walk / angles[:, None]).reshape(bands, sectors, 3)
    return Incident(
        probe, radiance, (cells.error / angles).reshape(bands, sectors), sums.sum(axis=0) * arrivals.per_walk, float(whole.error), count
    )


@dataclass(frozen=True, eq=False)
class Passing:
    """The selected segments of a piece that pass a probe, ``k`` of them.

    ``rows`` of the arrivals' table; ``flux``: float64 (k, 3) as it counts; ``unit``: int32 (k); ``start``: float32 (k, 3), where each begins;
    ``at``: float64 (k, 3), where it passes; ``toward``: float64 (k, 3), unit, to where it comes from.
    """

    rows: I64
    flux: F64
    unit: I32
    start: F32
    at: F64
    toward: F64

    @property
    def luminance(self) -> F64:
        """The luminance of the flux."""
        return luminance_of(self.flux)


def require_reach(arrivals: Arrivals, probe: Probe) -> None:
    """Raise ``QueryError`` for a probe beyond where all light is known (``Arrivals.reach``): it would measure too little."""
    center, radius = arrivals.reach()
    farthest = float(np.linalg.norm(np.array(probe.position) - center)) + probe.radius
    if farthest > radius * (1 + 1e-4) + TOUCH * float(np.abs(center).max()):
        x, y, z = center.tolist()
        raise QueryError(
            f"expected a probe within {radius:.4g} of ({x:.4g}, {y:.4g}, {z:.4g}), where all light is known, found one that reaches {farthest:.4g} "
            "from there: move it or make it smaller, or add a surface to the scene beyond it, as light from infinity is traced around surfaces alone"
        )


def passing(arrivals: Arrivals, units: Units, probe: Probe, piece: Piece) -> Passing:
    """What passes a probe of the light that a selection holds."""
    table = arrivals.table
    rows = np.flatnonzero(arrivals.select(piece))
    start, end = arrivals.segments(piece, rows)
    passed, weight, at = probe.passes(start, end)
    rows, start, end = rows[passed], start[passed], end[passed]
    flux = np.stack([piece.column(table, f"throughput_{c}")[rows].astype(np.float64) for c in "rgb"], axis=1) * weight[:, None]
    toward = start.astype(np.float64) - end
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    return Passing(rows, flux, units.of_walks(piece.column(table, "walk")[rows]), start, at, toward)


def _sum_shard(arrivals: Arrivals, units: Units, probe: Probe, bands: int, sectors: int, found: Iterator[Piece]) -> tuple[F64, F64, int]:
    """Sums by cell (cells, 3), luminance by cell and unit (cells, units), segments."""
    cells, count = bands * sectors, 0
    sums, noise = np.zeros((cells, 3)), np.zeros(cells * units.count)
    for piece in found:
        light = passing(arrivals, units, probe, piece)
        cell = _cells(probe, light.toward, bands, sectors)
        for channel in range(3):
            sums[:, channel] += np.bincount(cell, weights=light.flux[:, channel], minlength=cells)
        noise += np.bincount(cell * units.count + light.unit, weights=light.luminance, minlength=len(noise))
        count += len(light.rows)
        piece.forget()
    return sums, noise.reshape(cells, units.count), count


def _cells(probe: Probe, toward: F64, bands: int, sectors: int) -> I64:
    """The cell of each direction (k, 3)."""
    x, y, z = (toward @ probe.axes.T).T
    band = np.clip(np.floor((1 - z) / _range(probe) * bands), 0, bands - 1).astype(np.int64)
    sector = np.clip(np.floor(np.arctan2(y, x) / (2 * np.pi) % 1.0 * sectors), 0, sectors - 1).astype(np.int64)
    cells: I64 = band * sectors + sector
    return cells


def _range(probe: Probe) -> float:
    """From which cosine on down to which light comes: 1 for the hemisphere over a disk, 2 for all directions."""
    return 2.0 if probe.normal is None else 1.0


def _projected(probe: Probe, bands: int, sectors: int) -> F64:
    edges = 1 - _range(probe) * np.arange(bands + 1) / bands
    found: F64 = 2 * np.pi / sectors * ((edges[:-1] - edges[1:]) if probe.normal is None else (edges[:-1] ** 2 - edges[1:] ** 2) / 2)
    return found
