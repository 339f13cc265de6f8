"""Voxels: what the segments of walks leave in each of a grid, by their exact lengths there."""

import functools
import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.arrivals import Arrivals
from queries.errors import QueryError
from queries.kernels.grid import clip_lengths
from queries.kernels.grid import deposit as deposit_slab
from queries.regions import SceneGeometry
from queries.run import Run
from queries.shards import Piece, cores, map_shards

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
MOST_VOXELS = 256  # along a side
_SLABS = 16  # parts of the grid along x, which threads fill: so many on any number of threads, so that sums have the same bits
_CHANNELS = 4  # that the kernel adds up


@dataclass(frozen=True)
class Grid:
    """A box of equal voxels, its sides along the axes. ``low``, ``high``: opposite corners (3,), world units; ``shape``: voxels along x, y and z."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    shape: tuple[int, int, int]

    def __post_init__(self) -> None:
        """Refuse a box without a volume, or too many voxels."""
        if not all(np.isfinite((*self.low, *self.high))) or not all(low < high for low, high in zip(self.low, self.high)):
            raise QueryError(f"expected a grid whose `low` is below its `high` along x, y and z, found {self.low} and {self.high}")
        if not all(1 <= count <= MOST_VOXELS for count in self.shape):
            raise QueryError(f"expected 1 to {MOST_VOXELS} voxels along each side of a grid, found {self.shape}")

    @classmethod
    def of(cls, low: F64, high: F64, shape: npt.NDArray[np.integer]) -> "Grid":
        """A grid from arrays (3,)."""
        (a, b, c), (x, y, z), (nx, ny, nz) = low.tolist(), high.tolist(), shape.tolist()
        return cls((a, b, c), (x, y, z), (nx, ny, nz))

    @classmethod
    def around(cls, geometry: SceneGeometry, longest: int) -> "Grid":
        """Cubic voxels around all surfaces of a scene, ``longest`` of them along the longest side of its bounds."""
        if not 1 <= longest <= MOST_VOXELS:
            raise QueryError(f"expected 1 to {MOST_VOXELS} voxels along the longest side of a grid, found {longest}")
        caster = geometry.caster
        if not len(caster):
            raise QueryError("the scene has no surfaces that a grid could be put around: say where it begins and ends")
        # Surfaces lie within, however their points were rounded
        size = caster.bounds[1] - caster.bounds[0] + 4 * caster.touch
        cell = max(float(size.max()) / longest, np.finfo(np.float32).tiny)
        shape = np.maximum(np.ceil(size / cell * (1 - 1e-12)), 1).astype(int)
        center = caster.bounds.mean(axis=0)
        return cls.of(center - shape * cell / 2, center + shape * cell / 2, shape)

    @property
    def cell(self) -> F64:
        """The sides of a voxel (3,), world units."""
        sides: F64 = (np.array(self.high) - self.low) / self.shape
        return sides

    @property
    def volume(self) -> float:
        """Of one voxel, cubed world units."""
        return float(np.prod(self.cell))

    def centers(self, axis: int) -> F64:
        """The middle coordinates of the voxels along an axis."""
        found: F64 = self.low[axis] + (np.arange(self.shape[axis]) + 0.5) * self.cell[axis]
        return found


@dataclass(frozen=True)
class Deposit:
    """Sums over segments in a grid, of what each carries times its length there.

    ``sums``: float64 (nx, ny, nz, k); ``total``: float64 (k), their sum; ``clipped``: float64 (k), the same computed without voxels, from the
    lengths of segments within the whole grid; ``segments``: how many pass through it.
    """

    sums: F64
    total: F64
    clipped: F64
    segments: int


Carried = Callable[[Piece, I64, F32, F32], npt.NDArray[Any]]
"""What segments carry: of a piece, the rows, and where their segments start and end, floating (rows, k)."""


def throughput(table: str, piece: Piece, rows: I64, start: F32, end: F32) -> F32:
    """What rows carry as they are recorded: float32 (rows, 3)."""
    return np.stack([piece.column(table, f"throughput_{channel}")[rows] for channel in "rgb"], axis=1)


def deposit(run: Run, arrivals: Arrivals, grid: Grid, channels: int, carried: Carried, threads: int | None = None) -> Deposit:
    """What the segments of all arrivals carry, ``channels`` (1 to 4) numbers each, times their lengths, summed in a grid.

    Memory: 32 bytes for each voxel. The sums have the same bits on any number of threads: one at a time fills a voxel, in the order of rows.
    """
    if not 1 <= channels <= _CHANNELS:
        raise QueryError(f"expected 1 to {_CHANNELS} channels, found {channels}")
    threads = threads or run.threads or cores()
    low, high, shape = np.array(grid.low, np.float64), np.array(grid.high, np.float64), np.array(grid.shape, np.int64)
    slabs = list(itertools.pairwise(np.unique(np.linspace(0, grid.shape[0], _SLABS + 1).astype(int)).tolist()))
    sums = np.zeros((int(shape.prod()), _CHANNELS))
    clipped, segments = np.zeros(_CHANNELS), 0

    def fill(part: _Segments, slab: tuple[int, int]) -> None:
        deposit_slab(part.start, part.end, part.values, low, grid.cell, shape, *slab, sums)

    work = functools.partial(_segments_of, arrivals, channels, carried, low, high)
    with ThreadPoolExecutor(threads) as pool:
        for parts in map_shards(run.files(*arrivals.tables), work, threads):
            for part in parts:
                clipped += part.clipped
                segments += len(part.start)
                list(pool.map(functools.partial(fill, part), slabs))
    return Deposit(sums.reshape(*grid.shape, _CHANNELS)[..., :channels], sums.sum(axis=0)[:channels], clipped[:channels], segments)


@dataclass(frozen=True)
class _Segments:
    """Segments that pass through a grid's bounds. ``start``, ``end``: (n, 3); ``values``: (n, 4); ``clipped``: (4,), values times lengths there."""

    start: F32
    end: F32
    values: F64
    clipped: F64


def _segments_of(arrivals: Arrivals, channels: int, carried: Carried, low: F64, high: F64, found: Iterator[Piece]) -> list[_Segments]:
    """The segments of a shard."""
    parts = []
    for piece in found:
        rows = np.flatnonzero(arrivals.select(piece))
        start, end = arrivals.segments(piece, rows)
        lengths = np.empty(len(rows))
        clip_lengths(start, end, low, high, lengths)
        inside = np.flatnonzero(lengths > 0)
        rows, start, end = rows[inside], start[inside], end[inside]
        values = np.zeros((len(rows), _CHANNELS))
        values[:, :channels] = carried(piece, rows, start, end)
        parts.append(_Segments(start, end, values, lengths[inside] @ values))
        piece.forget()
    return parts
