"""Recorded samples resolved for the subpixels of a display: any filter, after rendering (thesis 4.4.1).

A subpixel is the weighted mean of the samples around it. A sample is a camera walk, with all that its paths carry, which may be nothing. Light walks
have no samples of that kind: their paths are summed, and divided by the weights that as many even samples would have. Each shard's samples are summed
by themselves and the sums added in the shards' order, so the same bits come out on any number of threads.
"""

import functools
import os
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.images import Opened
from queries.kernels.subpixel import add_to_cells
from queries.lpe import Expression
from queries.run import Run
from queries.shards import Piece, cores, map_shards
from queries.subpixel.accumulate import LEAST_SHARE, Resolved, accumulate_samples, cell_means, lattice_of, stand_in, suspects
from queries.subpixel.expected import expected_weights
from queries.subpixel.samples import SampledRun, sampled
from queries.subpixel.weights import WeightTables, weight_tables
from renderer.filters.subpixel.filter import SubpixelFilter

__all__ = ["Resolved", "accumulate_samples", "grid", "resolve"]

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Floats = npt.NDArray[np.floating]
Window = tuple[int, int, int, int]
_MARGIN = 1  # pixels around a window, for cells that take the mean of their neighbors


def resolve(
    run: Run | str | os.PathLike[str], filter: SubpixelFilter, expression: Expression | str | None = None, threads: int | None = None
) -> Resolved:
    """The lattice of a run's film on a display of as many pixels: float32 (rows, columns), linear.

    ``expression``: of the paths that it matches alone; lattices of expressions that partition the paths sum to that of all, but for clipping and
    layouts with W. Raises ``ExpressionError``, and ``QueryError`` for a run without paths or, of camera walks, without the table ``unlit``.
    """
    with Opened(run, threads) as opened:
        source, threads = sampled(opened, expression), threads or opened.threads or cores()
        tables = weight_tables(filter, opened.settings["width"], opened.settings["height"])
        sums = _sum(source, tables, threads)
        if source.camera:
            weak = suspects(tables, sums[-1], opened.settings["passes"])
            if weak.any() and tables.signed:
                magnitudes = _sum(sampled(opened, None), tables.magnitudes(), threads, np.asarray(weak.any(axis=1)))
                weak &= sums[-1] <= LEAST_SHARE * magnitudes[-1]
        else:
            sums[-1] = expected_weights(tables) * source.expected
            weak = sums[-1] <= 0
        lattice, unknown = lattice_of(tables, sums, weak)
        if unknown.any():
            stand_in(tables, lattice, unknown, grid(opened, 1, 1, expression, threads))
        return Resolved(lattice, int(np.count_nonzero(unknown)))


def _sum(source: SampledRun, tables: WeightTables, threads: int, wanted: npt.NDArray[np.bool_] | None = None) -> Floats:
    """Sums of all samples. ``wanted``: rows of positions, bool; of others, some samples may be left out."""
    sums = tables.allocate(tables.rows, tables.precision(source.expected if source.camera else np.inf))
    work = functools.partial(_sum_shard, source, tables, wanted)
    for first, part in map_shards(source.run.files(*source.tables), work, threads):
        sums[:, first : first + part.shape[1]] += part
    return sums


def _sum_shard(source: SampledRun, tables: WeightTables, wanted: npt.NDArray[np.bool_] | None, found: Iterator[Piece]) -> tuple[int, Floats]:
    """What one shard adds: its first row of positions, and sums from there on."""
    there = list(found)
    first, last = 0, tables.rows
    if source.banded:
        bands = [tables.band(*source.heights(piece)) for piece in there]
        if wanted is not None:
            kept = [i for i, band in enumerate(bands) if wanted[slice(*band)].any()]
            there, bands = [there[i] for i in kept], [bands[i] for i in kept]
        first, last = min((low for low, _ in bands), default=0), max((high for _, high in bands), default=0)
    sums, beside = tables.allocate(last - first, tables.precision(source.most if source.camera else np.inf)), None
    while there:
        piece = there.pop(0)
        if tables.splat_walks and source.camera:
            tables.splat_walks(source.walks(piece), first, sums)
        for samples in source.others(piece) if tables.splat_walks else source.of(piece):
            if samples.counted or not source.camera:
                tables.splat(samples.x, samples.y, samples.color, first, sums)
            else:
                beside = tables.allocate(last - first) if beside is None else beside
                tables.splat(samples.x, samples.y, samples.color, first, beside)
        piece.forget()
    if beside is not None:
        sums[:-1] += beside[:-1]
    return first, sums


def grid(
    run: Run | str | os.PathLike[str],
    across: int,
    down: int,
    expression: Expression | str | None = None,
    threads: int | None = None,
    offset: tuple[float, float] = (0.0, 0.0),
    window: Window | None = None,
) -> F32:
    """Means of the samples in each cell, of which a pixel has ``across`` x ``down``: float32 (height * down, width * across, 3), linear.

    ``offset``: where the first cell's corner lies right of and below the film's, in cells; a layout's origin less 1/2 gives each position its cell.
    ``window``: left, top, right and bottom, whole pixels: that part alone. A cell without samples takes the mean of its eight neighbors that have
    some, or have got some in a round before. Raises as ``resolve`` does.
    """
    with Opened(run, threads) as opened:
        source, threads = sampled(opened, expression), threads or opened.threads or cores()
        width, height = opened.settings["width"], opened.settings["height"]
        left, top, right, bottom = window or (0, 0, width, height)
        if not (0 <= left < right <= width and 0 <= top < bottom <= height and min(across, down) >= 1):
            raise QueryError(f"expected cells and a window within the film's {width} x {height} pixels, found {across} x {down} and {window}")
        inner = left - max(left - _MARGIN, 0), top - max(top - _MARGIN, 0)
        wide = max(left - _MARGIN, 0), max(top - _MARGIN, 0), min(right + _MARGIN, width), min(bottom + _MARGIN, height)
        cells = np.zeros(((wide[3] - wide[1]) * down, (wide[2] - wide[0]) * across, 4))
        work = functools.partial(_grid_shard, source, wide, (across, down), offset)
        for first, part in map_shards(opened.files(*source.tables), work, threads):
            cells[first : first + len(part)] += part
        if not source.camera:
            sizes = [_inside(n, count, at, size) for n, count, at, size in zip(wide[:2], (across, down), offset, (width, height))]
            cells[..., 3] = source.expected * np.multiply.outer(sizes[1][: cells.shape[0]], sizes[0][: cells.shape[1]])
        means = cell_means(cells, source.camera)
        return np.ascontiguousarray(means[inner[1] * down :, inner[0] * across :][: (bottom - top) * down, : (right - left) * across])


def _grid_shard(source: SampledRun, window: Window, cells: tuple[int, int], offset: tuple[float, float], found: Iterator[Piece]) -> tuple[int, F64]:
    """What one shard adds to the cells of a window: the first row, and sums from there on."""
    there = list(found)
    left, top, right, bottom = window
    (across, down), rows = cells, (bottom - top) * cells[1]
    first, last = 0, rows
    if source.banded:
        spans = [source.heights(piece) for piece in there]
        there = [piece for piece, (low, high) in zip(there, spans) if low < bottom + 1 and high >= top - 1]
        low, high = min((low for low, _ in spans), default=0.0), max((high for _, high in spans), default=0.0)
        first = int(np.clip((np.floor(min(low, bottom)) - top) * down - 1 - np.ceil(offset[1]), 0, rows))
        last = int(np.clip((np.floor(max(high, -1)) + 1 - top) * down + 1 - np.floor(offset[1]), first, rows))
    sums = np.zeros((last - first, (right - left) * across, 4))
    corner = np.float64(left * across + offset[0]), np.float64(top * down + offset[1])
    for piece in there:
        for samples in source.of(piece):
            add_to_cells(samples.x, samples.y, samples.color, np.float64(across), np.float64(down), *corner, first, samples.counted, sums)
        piece.forget()
    return first, sums


def _inside(first: int, cells: int, offset: float, size: int) -> F64:
    """How much of a pixel's length each cell from pixel ``first`` on covers within a film of ``size`` pixels, float64."""
    start = (np.arange(first * cells, size * cells) + offset) / cells
    covered: F64 = np.maximum(np.minimum(start + 1 / cells, size) - np.maximum(start, 0.0), 0.0)
    return covered
