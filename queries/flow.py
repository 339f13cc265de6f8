"""Where light flows: the light vector at each voxel of a grid, and particles that follow it.

Light of flux w (power) along a segment of length l within a voxel of volume V adds w l d / V, with d its direction, to the light vector (vector
irradiance [gershun1939], flux per squared world unit: its component along a normal is the net flux through a surface there), and w l / V to the
fluence. Their ratio, the anisotropy, is 1 in a parallel beam and 0 where light comes alike from all sides. Where it is small, light has no dominant
direction, and particles stop.
"""

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.arrivals import Arrivals
from queries.kernels.flow import advance
from queries.luminance import luminance_of
from queries.run import Run
from queries.selection import Selection
from queries.shards import Piece
from queries.voxels import Grid, deposit, throughput

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
_CHI_SQUARE_95 = 7.8147  # of three degrees of freedom


@dataclass(frozen=True)
class Flow:
    """The flow of light through the voxels of a grid. All in luminance, but ``rgb``.

    ``vectors``: float32 (nx, ny, nz, 3), the light vector, flux / world unit²; ``fluence``: float32 (nx, ny, nz), the same unit; ``rgb``: float32
    (nx, ny, nz, 3), its color; ``samples``: float32 (nx, ny, nz), the effective number of segments through each voxel, (sum w l)² / (c sum w² l)
    with c a voxel's mean side; ``total``: flux x length in the grid; ``total_vector``: float64 (3), flux x length x direction; ``segments``.
    """

    grid: Grid
    vectors: F32
    fluence: F32
    rgb: F32
    samples: F32
    total: float
    total_vector: F64
    segments: int

    @functools.cached_property
    def anisotropy(self) -> F32:
        """The light vector's length over the fluence, 0 to 1: float32 (nx, ny, nz); 0 where there is no light."""
        length = np.sqrt(np.einsum("...i,...i->...", self.vectors, self.vectors))
        ratio = np.divide(length, self.fluence, out=np.zeros_like(length), where=self.fluence > 0)
        found: F32 = np.minimum(ratio, np.float32(1))
        return found

    @functools.cached_property
    def chance(self) -> F32:
        """The anisotropy that so few segments of light from all sides stay below 95 times of 100: float32 (nx, ny, nz), 1 or less.

        Three times samples times squared anisotropy then has a chi-square distribution of three degrees of freedom (Rayleigh's test [mardia2000]).
        """
        found: F32 = np.sqrt(np.float32(_CHI_SQUARE_95 / 3) / np.maximum(self.samples, np.float32(_CHI_SQUARE_95 / 3)))
        return found

    def directed(self, least: float) -> Bools:
        """Whether light has a dominant direction in each voxel: an anisotropy of ``least`` or more that is no accident. bool (nx, ny, nz)."""
        found: Bools = (self.fluence > 0) & (self.anisotropy >= np.maximum(least, self.chance))
        return found

    def directed_share(self, least: float) -> float:
        """The share of all flux x length that has a dominant direction."""
        whole = float(self.fluence.sum(dtype=np.float64))
        return float(self.fluence[self.directed(least)].sum(dtype=np.float64)) / whole if whole > 0 else 0.0

    def seeds(self, count: int, least: float, seed: int = 0) -> F64:
        """Points (count, 3), float64, drawn at random where light has a dominant direction, as densely as it is bright; none where it has nowhere."""
        weights = np.where(self.directed(least), self.fluence, 0).ravel().astype(np.float64)
        bounds = np.cumsum(weights)
        if not len(bounds) or bounds[-1] <= 0:
            return np.empty((0, 3))
        random = np.random.default_rng(seed)
        # One in each of `count` equal shares of the light, so that they spread evenly
        at = (np.arange(count) + random.random(count)) / count * bounds[-1]
        voxel = np.minimum(np.searchsorted(bounds, at, side="right"), int(np.flatnonzero(weights)[-1]))
        place = np.stack(np.unravel_index(voxel, self.fluence.shape), axis=1) + random.random((count, 3))
        found: F64 = np.array(self.grid.low) + place * self.grid.cell
        return found

    def tracks(self, seeds: F64, length: float, step: float, least: float) -> "Tracks":
        """Follow the light from points (n, 3) for ``length``, in steps of about ``step`` (world units), as far as it has a dominant direction."""
        steps = max(1, round(length / step))
        points = np.empty((len(seeds), steps + 1, 3))
        points[:, 0] = seeds
        count = np.empty(len(seeds), np.int32)
        field = np.concatenate([self.vectors, self.fluence[..., None], self.chance[..., None]], axis=3)
        advance(field, np.array(self.grid.low, np.float64), self.grid.cell, length / steps, least, points, count)
        return Tracks(points, count, length / steps)

    def at(self, points: F64) -> tuple[I64, ...]:
        """The voxel of each point (n, 3), as three indices (n,); the nearest for points outside."""
        place = np.floor((points - np.array(self.grid.low)) / self.grid.cell).astype(np.int64)
        return tuple(np.clip(place, 0, np.array(self.fluence.shape) - 1).T)


@dataclass(frozen=True)
class Tracks:
    """Ways of ``n`` particles.

    ``points``: float64 (n, steps + 1, 3), world; ``count``: int32 (n), how many each has (the last one repeats); ``step``: between two of them.
    """

    points: F64
    count: I32
    step: float

    def __len__(self) -> int:
        """How many particles there are."""
        return len(self.count)


def flow(run: Run, selection: Selection, grid: Grid, side: str = "light", threads: int | None = None) -> Flow:
    """The flow of the selection's light through a grid, from the walks of one side (of camera walks: importance that flows away from the camera).

    Raises ``QueryError``: the run has no such walks (``queries.inspection.walks_of`` finds them).
    """
    arrivals = Arrivals(run, selection, side)
    flowing = deposit(run, arrivals, grid, 4, functools.partial(_flowing, arrivals.table), threads)
    passing = deposit(run, arrivals, grid, 4, functools.partial(_passing, arrivals.table), threads)
    light, scale = flowing.sums[..., 3], arrivals.per_walk / grid.volume
    squares = passing.sums[..., 3] * float(np.mean(grid.cell))
    samples = np.divide(light**2, squares, out=np.zeros_like(light), where=squares > 0)
    vectors, fluence, rgb = ((scale * part).astype(np.float32) for part in (flowing.sums[..., :3], light, passing.sums[..., :3]))
    total = flowing.total * arrivals.per_walk
    return Flow(grid, vectors, fluence, rgb, samples.astype(np.float32), float(total[3]), total[:3], flowing.segments)


def _flowing(table: str, piece: Piece, rows: I64, start: F32, end: F32) -> F64:
    """What segments deposit for each unit of their length: luminance times direction, and luminance; float64 (rows, 4)."""
    way = end.astype(np.float64) - start
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    light = luminance_of(throughput(table, piece, rows, start, end))
    found: F64 = light[:, None] * np.column_stack([way, np.ones(len(rows))])
    return found


def _passing(table: str, piece: Piece, rows: I64, start: F32, end: F32) -> F64:
    """The same: color, and squared luminance; float64 (rows, 4)."""
    rgb = throughput(table, piece, rows, start, end)
    return np.column_stack([rgb, luminance_of(rgb) ** 2])
