"""Samples of a film to the subpixels of a display: weighted sums at the positions that hold a subpixel (thesis 4.4.1).

Only those positions are kept, side by side: a row of ``sums`` holds one period's subpixels after the other, with room on both sides for what
falls beside the film. ``sums``: float64 (2, rows, columns) of one channel, its weighted sum and the weights', or (4, rows, columns) of red, green,
blue and the weights'.

``across``: float64 (patterns' rows, pixels of a period, phases, 2, reach), the weights of the subpixels that a sample reaches, by where in its
pixel the sample lies: at a phase's start, and by how much they change to its end. ``first``: int64 (patterns' rows, pixels of a period),
the first of these subpixels, counted from the first one of the pixel's period. ``shows``: float64 (patterns' rows, pixels of a period, 3, reach), 1
for the channel that each of them shows. Inner loops go along contiguous rows, so that they are compiled to vector instructions.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
Walks = npt.NDArray[np.unsignedinteger]
Chosen = npt.NDArray[np.bool_]
Floats = npt.NDArray[np.floating]


@kernel
def splat_walks(
    walk: Walks, chosen: Chosen, x: Floats, y: Floats, red: F32, green: F32, blue: F32, width: int, height: int, first_row: int, pad: int,
    period: I64, across: Floats, first: I64, shows: Floats, sums: Floats,
) -> None:  # fmt: skip
    """Add walks to the subpixels of their own row of pixels, one channel each: rows of a walk lie together, and its chosen rows are the color.

    Tables and sums are all float32 or all float64; tables have no patterns' rows. ``period``: subpixels of one period.
    """
    real = sums.dtype.type
    i, n, pixels, turns, reach = 0, len(walk), len(first), period[0], across.shape[3]
    while i < n:
        # The color of a walk
        place, this, r, g, b = i, walk[i], np.float64(0.0), np.float64(0.0), np.float64(0.0)
        while i < n and walk[i] == this:
            if chosen[i]:
                r += np.float64(red[i])
                g += np.float64(green[i])
                b += np.float64(blue[i])
            i += 1
        if not (x[place] >= 0 and x[place] < width and y[place] >= 0 and y[place] < height):
            continue
        row = np.int64(y[place]) - first_row
        if row < 0 or row >= sums.shape[1]:
            continue

        # Where it lies, and what it reaches from there
        pixel = np.int64(x[place])
        turn, column = pixel, np.int64(0)
        if pixels > 1:
            turn = np.int64(np.uint32(pixel) // np.uint32(pixels))
            column = pixel - turn * pixels
        at = (np.float64(x[place]) - pixel) * across.shape[1]
        phase = np.int64(at)
        share, light_r, light_g, light_b = real(at - phase), real(r), real(g), real(b)
        begin = pad + turn * turns + first[column]

        # All subpixels in reach, in one loop along contiguous values
        start, change = across[column, phase, 0], across[column, phase, 1]
        of_red, of_green, of_blue = shows[column, 0], shows[column, 1], shows[column, 2]
        values, weights = sums[0, row, begin : begin + reach], sums[1, row, begin : begin + reach]
        for k in range(reach):
            w = start[k] + share * change[k]
            values[k] += w * (light_r * of_red[k] + light_g * of_green[k] + light_b * of_blue[k])
            weights[k] += w


@kernel
def splat_separable(
    x: F32, y: F32, rgb: F32, width: int, height: int, first_row: int, pad: int, period: I64, across: F64, first: I64, shows: F64, down: F64,
    first_down: I64, down_of: I64, weights_across: F64, weights_down: F64, weights: F64, sums: F64,
) -> None:  # fmt: skip
    """Add samples to all subpixels in reach, by a weight across times a weight down.

    ``period``: subpixels of one period in each of the pattern's rows. ``down``: as ``across``, float64 (filters, pixels of a period, phases, 2,
    reach), for rows of positions; ``first_down``: the first row, counted from that of the pixel's period. ``down_of``: int64, shaped as
    ``first`` and reach, the filter down of each subpixel in reach.
    """
    pixels, pixels_down, pattern_rows, reach, rows = first.shape[1], len(first_down), len(period), len(weights), sums.shape[1]
    for i in range(len(x)):
        if not (x[i] >= 0 and x[i] < width and y[i] >= 0 and y[i] < height):
            continue
        pixel, line = np.int64(x[i]), np.int64(y[i])
        turn, turn_down = pixel // pixels, line // pixels_down
        column, line_down = pixel - turn * pixels, line - turn_down * pixels_down
        r, g, b = np.float64(rgb[i, 0]), np.float64(rgb[i, 1]), np.float64(rgb[i, 2])

        # Weights down of all rows in reach, by each filter
        at = (np.float64(y[i]) - line) * down.shape[2]
        phase = np.int64(at)
        share = at - phase
        for d in range(len(down)):
            for j in range(weights_down.shape[1]):
                weights_down[d, j] = down[d, line_down, phase, 0, j] + share * down[d, line_down, phase, 1, j]
        top = turn_down * pattern_rows + first_down[line_down]

        # Weights across of each of the pattern's rows
        at = (np.float64(x[i]) - pixel) * across.shape[2]
        phase = np.int64(at)
        share = at - phase
        for pattern_row in range(pattern_rows):
            start, change = across[pattern_row, column, phase, 0], across[pattern_row, column, phase, 1]
            for k in range(reach):
                weights_across[k] = start[k] + share * change[k]
            begin = pad + turn * period[pattern_row] + first[pattern_row, column]
            end = begin + reach

            # All rows of that kind
            for j in range((pattern_row - top) % pattern_rows, weights_down.shape[1], pattern_rows):
                row = top + j - first_row
                if row < 0 or row >= rows:
                    continue
                if len(down) == 1:
                    scale = weights_down[0, j]
                    for k in range(reach):
                        weights[k] = scale * weights_across[k]
                else:
                    which = down_of[pattern_row, column]
                    for k in range(reach):
                        weights[k] = weights_across[k] * weights_down[which[k], j]
                if len(sums) == 2:
                    own = shows[pattern_row, column]
                    values, red, green, blue = sums[0, row, begin:end], own[0], own[1], own[2]
                    for k in range(reach):
                        values[k] += weights[k] * (r * red[k] + g * green[k] + b * blue[k])
                else:
                    add_color(sums[0, row, begin:end], sums[1, row, begin:end], sums[2, row, begin:end], weights, r, g, b)
                total = sums[len(sums) - 1, row, begin:end]
                for k in range(reach):
                    total[k] += weights[k]


@kernel
def splat_radial(
    x: F32, y: F32, rgb: F32, width: int, height: int, first_row: int, pad: int, period: I64, first: I64, shows: F64, subpixel: I64, center: F64,
    first_down: I64, center_down: F64, table: F64, squared_radius: F64, weights: F64, sums: F64,
) -> None:  # fmt: skip
    """Add samples to all subpixels in reach, by a weight of the distance.

    ``subpixel``: which one of a period each in reach is, -1 for none; ``center``: float64 of the same shape, where it lies, in pixels from the
    sample's pixel's left; ``center_down`` (pixels of a period, rows in reach), the same for rows. ``table``: float64 (subpixels, entries), weights
    by the distance's square, from 0 to ``squared_radius`` of each subpixel, linear in between.
    """
    pixels, pixels_down, pattern_rows, reach, rows = first.shape[1], len(first_down), len(period), len(weights), sums.shape[1]
    last = table.shape[1] - 1
    for i in range(len(x)):
        if not (x[i] >= 0 and x[i] < width and y[i] >= 0 and y[i] < height):
            continue
        pixel, line = np.int64(x[i]), np.int64(y[i])
        turn, turn_down = pixel // pixels, line // pixels_down
        column, line_down = pixel - turn * pixels, line - turn_down * pixels_down
        r, g, b = np.float64(rgb[i, 0]), np.float64(rgb[i, 1]), np.float64(rgb[i, 2])
        top = turn_down * pattern_rows + first_down[line_down]
        for j in range(center_down.shape[1]):
            row, pattern_row = top + j - first_row, (top + j) % pattern_rows
            if row < 0 or row >= rows:
                continue
            offset_down = np.float64(y[i]) - line - center_down[line_down, j]
            for k in range(reach):
                weights[k] = 0.0
                which = subpixel[pattern_row, column, k]
                if which >= 0:
                    offset = np.float64(x[i]) - pixel - center[pattern_row, column, k]
                    at = (offset * offset + offset_down * offset_down) / squared_radius[which] * last
                    if at < last:
                        n = np.int64(at)
                        weights[k] = table[which, n] + (at - n) * (table[which, n + 1] - table[which, n])
            begin = pad + turn * period[pattern_row] + first[pattern_row, column]
            end = begin + reach
            if len(sums) == 2:
                own = shows[pattern_row, column]
                values, red, green, blue = sums[0, row, begin:end], own[0], own[1], own[2]
                for k in range(reach):
                    values[k] += weights[k] * (r * red[k] + g * green[k] + b * blue[k])
            else:
                add_color(sums[0, row, begin:end], sums[1, row, begin:end], sums[2, row, begin:end], weights, r, g, b)
            total = sums[len(sums) - 1, row, begin:end]
            for k in range(reach):
                total[k] += weights[k]


@kernel
def add_color(red: F64, green: F64, blue: F64, weights: F64, r: np.float64, g: np.float64, b: np.float64) -> None:
    """Add a weighted color to as many values of each channel."""
    for k in range(len(weights)):
        red[k] += weights[k] * r
    for k in range(len(weights)):
        green[k] += weights[k] * g
    for k in range(len(weights)):
        blue[k] += weights[k] * b


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
