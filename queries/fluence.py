"""Fluence: how much light passes through each voxel of a grid, from the segments of walks and their exact lengths there.

A segment that carries flux (power) adds flux times its length within a voxel, over the voxel's volume: the track-length estimator of what all
directions together bring to a point (fluence, or spherical irradiance, in flux per squared world unit).
"""

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.arrivals import Arrivals
from queries.run import Run
from queries.selection import Selection
from queries.voxels import Grid, deposit, throughput

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Fluence:
    """Light in the voxels of a grid.

    ``values``: float32 (nx, ny, nz, 3), linear RGB, flux per squared world unit; ``total``: float64 (3), flux times length in the whole grid;
    ``clipped``: the same, computed without voxels; ``segments``: how many pass through the grid.
    """

    grid: Grid
    values: F32
    total: F64
    clipped: F64
    segments: int


def fluence(run: Run, selection: Selection, grid: Grid, side: str = "light", threads: int | None = None) -> Fluence:
    """The fluence of the selected light in each voxel, estimated from a run's walks (``queries.arrivals``).

    ``side``: "light", or "camera" for importance. Memory: 44 bytes for each voxel, and some shards' segments; it does not grow with the run.
    The result has the same bits on any number of threads.
    """
    arrivals = Arrivals(run, selection, side)
    found = deposit(run, arrivals, grid, 3, functools.partial(throughput, arrivals.table), threads)
    scale = arrivals.per_walk
    values = np.empty(found.sums.shape, np.float32)
    np.multiply(found.sums, scale / grid.volume, out=values, casting="same_kind")
    return Fluence(grid, values, found.total * scale, found.clipped * scale, found.segments)
