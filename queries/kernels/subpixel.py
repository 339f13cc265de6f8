"""Samples of a film to the subpixels of a display: weighted sums at the positions that hold a subpixel (thesis 4.4.1).

Only those positions are kept, side by side: a row of ``sums`` holds one period's subpixels after the other, with room on both sides for what
falls beside the film. ``sums``: float64 (rows, columns, 2) of one channel, its weighted sum and the weights', or (rows, columns, 4) of
red, green, blue and the weights'. ``magnitudes``: float64 (rows, columns), the sums of the weights' magnitudes, or of no columns where weights
have one sign.

``across``: float64 (patterns' rows, pixels of a period, phases, 2, reach), the weights of the subpixels that a sample reaches, by where in its
pixel the sample lies: at a phase's start, and by how much they change to its end. ``first``: int64 (patterns' rows, pixels of a period),
the first of these subpixels, counted from the first one of the pixel's period. ``channel``: int64 (patterns' rows, pixels of a period, reach), what
each of them shows.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]


@kernel
def phase_weights(table: F64, place: np.float64, weights: F64) -> None:
    """The weights at ``place`` (0 … 1) in a pixel, of a table of (phases, 2, reach), linear within a phase."""
    at = place * len(table)
    phase = np.int64(at)
    share = at - phase
    for k in range(table.shape[2]):
        weights[k] = table[phase, 0, k] + share * table[phase, 1, k]


@kernel
def add_weighted(sums: F64, magnitudes: F64, row: np.int64, start: np.int64, weights: F64, channel: I64, color: tuple[float, float, float]) -> None:
    """Add one sample to the subpixels of a row from ``start`` on. ``channel``: what each shows."""
    r, g, b = color
    if sums.shape[2] == 4:
        for k in range(len(weights)):
            weight = weights[k]
            sums[row, start + k, 0] += weight * r
            sums[row, start + k, 1] += weight * g
            sums[row, start + k, 2] += weight * b
            sums[row, start + k, 3] += weight
    else:
        for k in range(len(weights)):
            weight = weights[k]
            value = r if channel[k] == 0 else g if channel[k] == 1 else b
            sums[row, start + k, 0] += weight * value
            sums[row, start + k, 1] += weight
    if magnitudes.shape[1]:
        for k in range(len(weights)):
            magnitudes[row, start + k] += abs(weights[k])


@kernel
def splat_rows(
    x: F32, y: F32, rgb: F32, width: int, height: int, first_row: int, pad: int, period: int, across: F64, first: I64, channel: I64,
    weights: F64, sums: F64, magnitudes: F64,
) -> None:  # fmt: skip
    """Add samples to the subpixels of their own row of pixels. ``period``: subpixels of one period; ``weights``: scratch, ``reach`` entries."""
    pixels = first.shape[1]
    for i in range(len(x)):
        if not (x[i] >= 0 and x[i] < width and y[i] >= 0 and y[i] < height):
            continue
        pixel, row = np.int64(x[i]), np.int64(y[i]) - first_row
        if row < 0 or row >= len(sums):
            continue
        phase_weights(across[0, pixel % pixels], np.float64(x[i]) - pixel, weights)
        start = pad + pixel // pixels * period + first[0, pixel % pixels]
        color = (np.float64(rgb[i, 0]), np.float64(rgb[i, 1]), np.float64(rgb[i, 2]))
        add_weighted(sums, magnitudes, row, start, weights, channel[0, pixel % pixels], color)


@kernel
def splat_separable(
    x: F32, y: F32, rgb: F32, width: int, height: int, first_row: int, pad: int, period: I64, across: F64, first: I64, channel: I64, down: F64,
    first_down: I64, down_of: I64, weights_across: F64, weights_down: F64, weights: F64, sums: F64, magnitudes: F64,
) -> None:  # fmt: skip
    """Add samples to all subpixels in reach, by a weight across times a weight down.

    ``period``: subpixels of one period in each of the pattern's rows. ``down``: as ``across``, float64 (filters, pixels of a period, phases, 2,
    reach), for rows of positions; ``first_down``: the first row, counted from that of the pixel's period. ``down_of``: int64, shaped as
    ``channel``, the filter down of each subpixel in reach.
    """
    pixels, pixels_down, pattern_rows = first.shape[1], len(first_down), len(period)
    for i in range(len(x)):
        if not (x[i] >= 0 and x[i] < width and y[i] >= 0 and y[i] < height):
            continue
        pixel, line = np.int64(x[i]), np.int64(y[i])
        column, color = pixel % pixels, (np.float64(rgb[i, 0]), np.float64(rgb[i, 1]), np.float64(rgb[i, 2]))
        for d in range(len(down)):
            phase_weights(down[d, line % pixels_down], np.float64(y[i]) - line, weights_down[d])
        top = line // pixels_down * pattern_rows + first_down[line % pixels_down]
        for pattern_row in range(pattern_rows):
            phase_weights(across[pattern_row, column], np.float64(x[i]) - pixel, weights_across)
            start = pad + pixel // pixels * period[pattern_row] + first[pattern_row, column]
            for j in range((pattern_row - top) % pattern_rows, weights_down.shape[1], pattern_rows):
                row = top + j - first_row
                if row < 0 or row >= len(sums):
                    continue
                for k in range(len(weights)):
                    weights[k] = weights_across[k] * weights_down[down_of[pattern_row, column, k], j]
                add_weighted(sums, magnitudes, row, start, weights, channel[pattern_row, column], color)


@kernel
def splat_radial(
    x: F32, y: F32, rgb: F32, width: int, height: int, first_row: int, pad: int, period: I64, first: I64, channel: I64, subpixel: I64, center: F64,
    first_down: I64, center_down: F64, table: F64, squared_radius: F64, weights: F64, sums: F64, magnitudes: F64,
) -> None:  # fmt: skip
    """Add samples to all subpixels in reach, by a weight of the distance.

    ``subpixel``: which one of a period each in reach is, -1 for none; ``center``: float64 of the same shape, where it lies, in pixels from the
    sample's pixel's left; ``center_down`` (pixels of a period, rows in reach), the same for rows. ``table``: float64 (subpixels, entries), weights
    by the distance's square, from 0 to ``squared_radius`` of each subpixel, linear in between.
    """
    pixels, pixels_down, pattern_rows, last = first.shape[1], len(first_down), len(period), table.shape[1] - 1
    for i in range(len(x)):
        if not (x[i] >= 0 and x[i] < width and y[i] >= 0 and y[i] < height):
            continue
        pixel, line = np.int64(x[i]), np.int64(y[i])
        column, color = pixel % pixels, (np.float64(rgb[i, 0]), np.float64(rgb[i, 1]), np.float64(rgb[i, 2]))
        top = line // pixels_down * pattern_rows + first_down[line % pixels_down]
        for j in range(center_down.shape[1]):
            row, pattern_row = top + j - first_row, (top + j) % pattern_rows
            if row < 0 or row >= len(sums):
                continue
            offset_down = np.float64(y[i]) - line - center_down[line % pixels_down, j]
            for k in range(len(weights)):
                weights[k] = 0.0
                which = subpixel[pattern_row, column, k]
                if which >= 0:
                    offset = np.float64(x[i]) - pixel - center[pattern_row, column, k]
                    at = (offset * offset + offset_down * offset_down) / squared_radius[which] * last
                    if at < last:
                        n = np.int64(at)
                        weights[k] = table[which, n] + (at - n) * (table[which, n + 1] - table[which, n])
            start = pad + pixel // pixels * period[pattern_row] + first[pattern_row, column]
            add_weighted(sums, magnitudes, row, start, weights, channel[pattern_row, column], color)


@kernel
def add_to_cells(
    x: F32, y: F32, rgb: F32, across: np.float64, down: np.float64, left: np.float64, top: np.float64, first_row: int, counted: bool, sums: F64
) -> None:
    """Add samples to the cell that they lie in: red, green, blue and, where ``counted``, 1 to ``sums``, float64 (rows, columns, 4).

    A pixel is ``across`` cells wide and ``down`` high; the first cell's corner lies ``left`` and ``top`` cells right of and below the film's.
    """
    rows, columns, _ = sums.shape
    for i in range(len(x)):
        column, row = np.floor(np.float64(x[i]) * across - left), np.floor(np.float64(y[i]) * down - top) - first_row
        if column >= 0 and column < columns and row >= 0 and row < rows:
            j, k = np.int64(row), np.int64(column)
            sums[j, k, 0] += np.float64(rgb[i, 0])
            sums[j, k, 1] += np.float64(rgb[i, 1])
            sums[j, k, 2] += np.float64(rgb[i, 2])
            if counted:
                sums[j, k, 3] += 1.0
