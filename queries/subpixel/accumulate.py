"""Weighted means of samples for each subpixel of a display, and what stands in where weights cancel."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.kernels.subpixel import add_to_cells
from queries.subpixel.weights import WeightTables, weight_tables
from renderer.filters.subpixel.filter import SubpixelFilter

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Floats = npt.NDArray[np.floating]
Bools = npt.NDArray[np.bool_]

LEAST_SHARE = 0.1  # of the sum of the weights' magnitudes that their sum must reach: below, a few samples lie mostly on negative lobes


def accumulate_samples(x: npt.NDArray[np.floating], y: npt.NDArray[np.floating], rgb: F32, filter: SubpixelFilter, width: int, height: int) -> F32:
    """The lattice of some samples: float32 (rows, columns) of a display of ``width`` x ``height`` pixels.

    ``x``, ``y``: (samples), pixels right of and below the film's corner; samples beside the film are left out. ``rgb``: (samples, 3), linear.
    A subpixel is the weighted mean of its samples, Σ w γ / Σ w. Where Σ w is less than ``LEAST_SHARE`` of Σ |w|, or there are no samples, it is
    the mean of its pixel's samples, and that of the pixels around where the pixel has none.
    """
    if not len(x) == len(y) == len(rgb) or rgb.shape != (len(x), 3):
        raise QueryError(f"expected as many x, y and colors, found {x.shape}, {y.shape} and {rgb.shape}")
    tables = weight_tables(filter, width, height)
    sums = tables.allocate(tables.rows)
    tables.splat(x, y, rgb, 0, sums)
    cells = np.zeros((height, width, 4))
    add_to_cells(x, y, rgb, np.float64(1), np.float64(1), np.float64(0), np.float64(0), 0, True, cells)
    weak = suspects(tables, sums[-1], float(cells[..., 3].max()))
    if weak.any() and tables.signed:
        magnitudes = tables.magnitudes()
        more = magnitudes.allocate(tables.rows)
        magnitudes.splat(x, y, rgb, 0, more)
        weak &= sums[-1] <= LEAST_SHARE * more[-1]
    lattice, unknown = lattice_of(tables, sums, weak)
    if unknown.any():
        stand_in(tables, lattice, unknown, cell_means(cells))
    return lattice


def suspects(tables: WeightTables, weights: Floats, samples: float) -> Bools:
    """Where sums of weights, (rows, columns), may be too small: with up to ``samples`` samples in a pixel, others are large enough."""
    weak, most = np.zeros(weights.shape, np.bool_), tables.most()
    for row, largest in enumerate(most):
        least = LEAST_SHARE * samples * largest if tables.signed else np.where(largest > 0, 0.0, -np.inf)
        weak[row :: len(most)] = weights[row :: len(most)] <= least
    return weak


def lattice_of(tables: WeightTables, sums: Floats, weak: Bools) -> tuple[F32, Bools]:
    """Weighted means, float32 (rows, columns), and where subpixels have none. ``weak``: sums of which the weights say nothing, (rows, columns)."""
    weights, known = sums[-1], sums[-1] != 0  # beside the display, there are none
    if weak.any():
        known &= ~weak
    zeros = (np.zeros(weights.shape, np.float32) for _ in sums[:-1])
    means = [np.divide(channel, weights, out=out, where=known, casting="same_kind") for channel, out in zip(sums, zeros)]
    return of_primaries(tables, [tables.to_lattice(mean) for mean in means]), tables.to_lattice(weak)


def of_primaries(tables: WeightTables, channels: list[F32]) -> F32:
    """What each position's primary shows of its color: of one channel that itself, of three what the layout makes of them."""
    if len(channels) == 1:
        return channels[0]
    signal = tables.layout.signal(np.stack(channels, axis=-1))
    lattice = np.take_along_axis(signal, np.maximum(primaries(tables), 0)[..., None], axis=-1)[..., 0]
    return np.where(active_positions(tables), lattice, 0.0).astype(np.float32)


def primaries(tables: WeightTables) -> npt.NDArray[np.int64]:
    """The primary at every position, int64 (rows, columns); negative for virtual ones."""
    pattern, columns = tables.layout.pattern, tables.width * tables.layout.cells[0]
    return np.tile(pattern, (-(-tables.rows // len(pattern)), -(-columns // pattern.shape[1])))[: tables.rows, :columns]


def active_positions(tables: WeightTables) -> Bools:
    """Which positions hold a subpixel, bool (rows, columns)."""
    return primaries(tables) >= 0


def stand_in(tables: WeightTables, lattice: F32, weak: Bools, means: F32) -> None:
    """Give weak subpixels what their pixel's mean, of float32 (height, width, 3), makes of their primary."""
    layout = tables.layout
    row, column = np.nonzero(weak)
    x, y = (column + layout.origin[0]) / layout.cells[0], (row + layout.origin[1]) / layout.cells[1]
    color = means[np.minimum(y.astype(np.int64), tables.height - 1), np.minimum(x.astype(np.int64), tables.width - 1)]
    lattice[row, column] = layout.signal(color)[np.arange(len(row)), primaries(tables)[row, column]]


def cell_means(cells: F64, fill: bool = True) -> F32:
    """Means of the samples of each cell, float32 (rows, columns, 3), of sums (rows, columns, 4).

    Where ``fill``, a cell without samples takes the mean of those of its eight neighbors that have some, or have got some in a round before; 0 where
    none has.
    """
    count = cells[..., 3:]
    found = cells[..., :3] / np.where(count > 0, count, 1.0)
    known = count[..., 0] > 0
    while fill and known.any() and not known.all():
        sums, near = np.zeros(found.shape), np.zeros(known.shape)
        values, there = np.pad(np.where(known[..., None], found, 0.0), ((1, 1), (1, 1), (0, 0))), np.pad(known, 1)
        rows, columns = known.shape
        for i in range(3):
            for j in range(3):
                sums += values[i : i + rows, j : j + columns]
                near += there[i : i + rows, j : j + columns]
        filled = ~known & (near > 0)
        found[filled] = sums[filled] / near[filled, None]
        known = known | filled
    return found.astype(np.float32)


@dataclass(frozen=True)
class Resolved:
    """A lattice, float32 (rows, columns); ``weak``: how many of its subpixels took their pixel's mean, as the weights of their samples cancel."""

    lattice: F32
    weak: int
