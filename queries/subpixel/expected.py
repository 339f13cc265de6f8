"""The weights that even samples have: what divides sums where a run has no samples to count."""

import numpy as np
import numpy.typing as npt

from queries.subpixel.weights import WeightTables, weight_tables

F64 = npt.NDArray[np.float64]

SIDE = 24  # even samples along each side of a pixel, one between any two edges of usual subpixels


def expected_weights(tables: WeightTables) -> F64:
    """The sums of weights of one sample a pixel on average, everywhere alike: float64, shaped as the rows and columns of the tables' sums.

    They repeat with the period, but for what the film's edges cut off: a small film has all of them.
    """
    layout = tables.layout
    pixels = layout.pattern.shape[1] // layout.cells[0], layout.pattern.shape[0] // layout.cells[1]
    at = [_periods(size, period, radius) for size, period, radius in zip((tables.width, tables.height), pixels, tables.filter.radius)]
    width, height = at[0][0], at[1][0]
    small = weight_tables(tables.filter, width, height)
    place = (np.arange(SIDE) + 0.5) / SIDE
    x, y = (np.add.outer(np.arange(size), place).ravel() for size in (width, height))
    sums = small.allocate(small.rows)
    for line in y:
        small.splat(x, np.full(len(x), line), np.zeros((len(x), 3), np.float32), 0, sums)
    weights = sums[-1] / SIDE**2
    rows = (at[1][1][:, None] * len(layout.pattern) + np.arange(len(layout.pattern))).ravel()[: tables.rows]
    found = np.zeros((tables.rows, tables.columns))
    for row, count in enumerate(tables.period):
        columns = tables.pad + np.arange(count * len(at[0][1]))
        source = small.pad + (at[0][1][:, None] * count + np.arange(count)).ravel()
        mine = np.arange(row, tables.rows, len(layout.pattern))
        found[np.ix_(mine, columns)] = weights[np.ix_(rows[mine], source)]
    return found


def _periods(size: int, pixels: int, radius: float) -> tuple[int, npt.NDArray[np.int64]]:
    """A film's length of few pixels, and for each period of one of ``size`` pixels the period of the short film that looks like it."""
    edge = int(np.ceil(radius) / pixels) + 2  # periods that a film's end may change
    count = -(-size // pixels)
    if count <= 2 * edge + 2:
        return size, np.arange(count)
    short = 2 * edge + 2
    middle = np.full(count - 2 * edge, edge)
    return size - (count - short) * pixels, np.concatenate([np.arange(edge), middle, np.arange(short - edge, short)])
