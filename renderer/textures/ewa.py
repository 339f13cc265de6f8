"""The elliptical weighted average of a bitmap over a pixel's footprint (greene1986ewa, heckbert1989; thesis 4.4.2).

A texel is weighed by where it lies on the film: its offset from the pixel's center in the texture goes through the inverse of the
footprint's Jacobian. A filter that is round on the film is elliptical in the texture. Without a display the filter is a Gaussian of the
pixel; with one, each channel has its subpixel's center and filter, and one pass over the texels serves all three.

A *cell* is what is weighed: a texel of the level of the pyramid where texels are no larger than ``step`` pixels, or where those of the
bitmap itself are larger, a part of one, interpolated as a lookup does. So magnified bitmaps go over into lookups without a seam. A cell has
one color, and of a separable filter it gets the integral over itself, as wide as its shadow on each axis of the film (root mean square).
At most ``MOST_CELLS`` are visited: beyond, as near a horizon, cells grow past ``step``, which blurs along the footprint's short axis.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import HALF, ONE, TWO, ZERO, Vec3, madd, scale
from renderer.textures.base import NEAREST, Ewa, Memory, Textures
from renderer.textures.footprint import Footprint
from renderer.textures.lookup import Index, wrap

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
Plane = tuple[Any, Any, Any, Any]  # four float32 of a 2 x 2 matrix, by row

MOST_CELLS = np.float32(1024)
DEEPEST = np.float32(24)  # cells are never smaller than 2^-24 texels
LEAST_SHADOW = np.float32(1 / 64)  # pixels: narrower integrals would drown in the rounding of their tables
LEAST_AREA = np.float32(1e-12)  # squared texels of a pixel: smaller ones have no inverse in float32
MOST_TEXELS = np.float32(1e9)  # larger coordinates have no integer
LEAST_SHARE = 0.1  # of the sum of the weights' magnitudes that their sum must reach
FOUR = np.float32(4.0)
SQRT_2 = np.float32(np.sqrt(2))


# --- texels -------------------------------------------------------------------------------------------------------


@kernel
def inside(i: int, size: int, mode: Index) -> int:
    """``wrap`` without a division for the usual case."""
    if i >= 0 and i < size:
        return i
    return wrap(i, size, mode)


class Level(NamedTuple):
    """One level of a bitmap."""

    pixels: F32  # (total, 3) those of all bitmaps and levels
    first: Any  # int64, its first pixel
    width: Any  # int64
    height: Any
    wrap: Any  # int32


@kernel
def level_of(ewa: Ewa, textures: Textures, index: Index, level: Index) -> Level:
    """A level of bitmap ``index``."""
    pyramid = ewa.pyramid
    width, height = np.int64(pyramid.size[index, level, 0]), np.int64(pyramid.size[index, level, 1])
    return Level(pyramid.pixels, pyramid.first[index, level], width, height, textures.mode[index, 1])


@kernel
def texel(image: Level, x: int, y: int) -> Vec3:
    """Pixel (x, y), wrapped."""
    i = np.uint64(image.first + inside(y, image.height, image.wrap) * image.width + inside(x, image.width, image.wrap))
    return (image.pixels[i, 0], image.pixels[i, 1], image.pixels[i, 2])


@kernel
def between_texels(image: Level, mode: Index, x: np.float32, y: np.float32) -> Vec3:
    """The image at (x, y), in its pixels, as a lookup finds it: the nearest pixel's color, or interpolated."""
    if mode == NEAREST:
        return texel(image, int(np.floor(x)), int(np.floor(y)))
    x = x - HALF
    y = y - HALF
    i = int(np.floor(x))
    j = int(np.floor(y))
    fx = np.float32(x - np.floor(x))
    fy = np.float32(y - np.floor(y))
    top = madd(texel(image, i + 1, j), fx, scale(texel(image, i, j), ONE - fx))
    bottom = madd(texel(image, i + 1, j + 1), fx, scale(texel(image, i, j + 1), ONE - fx))
    return madd(bottom, fy, scale(top, ONE - fy))


# --- weights ------------------------------------------------------------------------------------------------------


class Cell(NamedTuple):
    """How cells look on the film, for reading the tables of filters; pixels and entries of the tables."""

    x_s: Any  # float32, how far right one cell further along s is, pixels
    x_t: Any
    y_s: Any  # float32, down
    y_t: Any
    half_x: Any  # float32, half of its shadow across, pixels
    half_y: Any
    rim_x: Any  # float32, how far beyond its own reach a filter has weight, pixels
    rim_y: Any
    per_x: Any  # float32, entries per pixel
    per_y: Any


class Three(NamedTuple):
    """The filters of a pixel's three subpixels."""

    across: tuple[Any, Any, Any]  # int32, which table
    down: tuple[Any, Any, Any]
    x: Vec3  # right of the pixel's center, pixels
    y: Vec3
    level: Any  # bool: they agree down


@kernel
def tabulated(table: F32, k: Index, at: np.float32) -> np.float32:
    """Row k of a table at ``at`` >= 0, in entries, linear in between, its last entry beyond."""
    last = np.int64(table.shape[1] - 1)
    at = min(at, np.float32(last))
    i = np.uint64(min(np.int64(at), last - 1))
    low = table[k, i]
    value: np.float32 = low + (at - np.float32(i)) * (table[k, i + np.uint64(1)] - low)
    return value


@kernel
def integral(table: F32, k: Index, low: np.float32, high: np.float32) -> np.float32:
    """The integral of an even filter between two places, in entries, by its running integral from 0."""
    below = tabulated(table, k, low) if low >= ZERO else -tabulated(table, k, -low)
    above = tabulated(table, k, high) if high >= ZERO else -tabulated(table, k, -high)
    return np.float32(above - below)


@kernel
def round_weight(across: F32, k: Index, dx: np.float32, dy: np.float32, cell: Cell) -> np.float32:
    """Round filter k at (dx, dy) from its center, pixels; cells that are too large widen it."""
    last = np.float32(across.shape[1] - 1)
    reach = last / cell.per_x
    x = dx / (reach + cell.rim_x)
    y = dy / (reach + cell.rim_y)
    return tabulated(across, k, np.sqrt(x * x + y * y) * last)


@kernel
def weights_of_one(down: F32 | None, across: F32, dx: np.float32, dy: np.float32, cell: Cell) -> Vec3:
    """The same weight in R, G and B, for a cell at (dx, dy) from the pixel's center."""
    if down is None:
        w = round_weight(across, 0, dx, dy, cell)
        return (w, w, w)
    w = integral(down, 0, (dy - cell.half_y) * cell.per_y, (dy + cell.half_y) * cell.per_y)
    w *= integral(across, 0, (dx - cell.half_x) * cell.per_x, (dx + cell.half_x) * cell.per_x)
    return (w, w, w)


@kernel
def weights_of_three(down: F32 | None, across: F32, three: Three, dx: np.float32, dy: np.float32, cell: Cell) -> Vec3:
    """The weights in R, G and B of a cell at (dx, dy) from the pixel's center."""
    a, x, y = three.across, three.x, three.y
    if down is None:
        return (
            round_weight(across, a[0], dx - x[0], dy - y[0], cell),
            round_weight(across, a[1], dx - x[1], dy - y[1], cell),
            round_weight(across, a[2], dx - x[2], dy - y[2], cell),
        )
    low, high = (dy - cell.half_y) * cell.per_y, (dy + cell.half_y) * cell.per_y
    r = integral(down, three.down[0], low - y[0] * cell.per_y, high - y[0] * cell.per_y)
    g, b = r, r
    if not three.level:
        g = integral(down, three.down[1], low - y[1] * cell.per_y, high - y[1] * cell.per_y)
        b = integral(down, three.down[2], low - y[2] * cell.per_y, high - y[2] * cell.per_y)
    low, high = (dx - cell.half_x) * cell.per_x, (dx + cell.half_x) * cell.per_x
    return (
        r * integral(across, a[0], low - x[0] * cell.per_x, high - x[0] * cell.per_x),
        g * integral(across, a[1], low - x[1] * cell.per_x, high - x[1] * cell.per_x),
        b * integral(across, a[2], low - x[2] * cell.per_x, high - x[2] * cell.per_x),
    )


@kernel
def three_of(centers: F32 | None, ewa: Ewa, row: Index, column: Index) -> Three | None:
    """The filters of the pixel at (row, column) of a period of the display."""
    if centers is None:
        return None
    a, d, c = ewa.filter, ewa.filter_down, centers
    across = (a[row, column, 0], a[row, column, 1], a[row, column, 2])
    down = (d[row, column, 0], d[row, column, 1], d[row, column, 2])
    x = (c[row, column, 0, 0], c[row, column, 1, 0], c[row, column, 2, 0])
    y = (c[row, column, 0, 1], c[row, column, 1, 1], c[row, column, 2, 1])
    level = y[0] == y[1] and y[1] == y[2] and down[0] == down[1] and down[1] == down[2]
    return Three(across, down, x, y, level)


@kernel
def weights_at(three: Three | None, down: F32 | None, across: F32, dx: np.float32, dy: np.float32, cell: Cell) -> Vec3:
    """The weights in R, G and B of a cell at (dx, dy) from the pixel's center, up to scale."""
    if three is None:
        return weights_of_one(down, across, dx, dy, cell)
    return weights_of_three(down, across, three, dx, dy, cell)


@kernel
def rim(down: F32 | None, step: np.float32, shadow: np.float32) -> np.float32:
    """How far beyond its own reach a filter has weight, pixels: an integral by half a cell, a round filter by what cells are too large."""
    if down is None:
        return max(ZERO, shadow - SQRT_2 * step)
    return HALF * shadow


@kernel
def cell_on_film(ewa: Ewa, j: Plane, determinant: np.float32, size_s: np.float32, size_t: np.float32) -> Cell:
    """Cells of a size, in texels, under the inverse of the Jacobian j."""
    x_s, x_t = j[3] / determinant * size_s, -j[1] / determinant * size_t
    y_s, y_t = -j[2] / determinant * size_s, j[0] / determinant * size_t
    shadow_x = max(LEAST_SHADOW, np.sqrt(x_s * x_s + x_t * x_t))
    shadow_y = max(LEAST_SHADOW, np.sqrt(y_s * y_s + y_t * y_t))
    entries = np.float32(ewa.across.shape[1] - 1)
    return Cell(
        x_s, x_t, y_s, y_t, HALF * shadow_x, HALF * shadow_y, rim(ewa.down, ewa.step, shadow_x), rim(ewa.down, ewa.step, shadow_y),
        entries / ewa.reach[0], entries / ewa.reach[1],
    )  # fmt: skip


# --- the sum ------------------------------------------------------------------------------------------------------


@kernel
def exponent(step: np.float32, length: np.float32) -> np.float32:
    """The largest whole n for which 2^n times ``length`` is no more than ``step``."""
    return np.float32(min(max(np.floor(np.log2(step / length)), -DEEPEST), DEEPEST))


@kernel
def cell_size(n: np.float32, level: Index, size: Index, level_size: Index) -> np.float32:
    """How wide a cell of 2^n is, in texels of the bitmap: a part of one at its own level, else one of the level's."""
    if level == 0 and n < ZERO:
        return np.float32(np.exp2(n))
    return np.float32(size) / np.float32(level_size)


@kernel
def choose_cells(ewa: Ewa, index: Index, j: Plane, determinant: np.float32) -> tuple[int, np.float32, np.float32, np.float32, Cell]:
    """Level and size of cells, in texels along both axes, about how many there will be, and how they look, for a Jacobian in texels per pixel.

    The smaller extent decides the level, so an elongated footprint meets many texels; where there are too many, both extents grow.
    """
    pyramid = ewa.pyramid
    top = int(pyramid.top[index])
    n_s = exponent(ewa.step, np.sqrt(j[2] * j[2] + j[3] * j[3]) / abs(determinant))
    n_t = exponent(ewa.step, np.sqrt(j[0] * j[0] + j[1] * j[1]) / abs(determinant))
    level, size_s, size_t, count = 0, ONE, ONE, ZERO
    cell = cell_on_film(ewa, j, determinant, size_s, size_t)
    for _ in range(64):
        level = int(min(max(min(n_s, n_t), ZERO), np.float32(top)))
        size_s = cell_size(n_s, level, pyramid.size[index, 0, 0], pyramid.size[index, level, 0])
        size_t = cell_size(n_t, level, pyramid.size[index, 0, 1], pyramid.size[index, level, 1])

        # What the filter covers, and a cell more on each side
        cell = cell_on_film(ewa, j, determinant, size_s, size_t)
        width, height = ewa.box[2] - ewa.box[0] + TWO * cell.rim_x, ewa.box[3] - ewa.box[1] + TWO * cell.rim_y
        across = (abs(j[0]) * width + abs(j[1]) * height) / size_s
        down = (abs(j[2]) * width + abs(j[3]) * height) / size_t
        count = np.float32(width * height * abs(determinant) / (size_s * size_t) + TWO * (across + down) + FOUR)
        if count <= MOST_CELLS or level == top:
            break
        n_s += ONE
        n_t += ONE
    return level, size_s, size_t, count, cell


@kernel
def part_of_row(
    low: np.float32, high: np.float32, slope: np.float32, start: np.float32, first: np.float32, last: np.float32
) -> tuple[np.float32, np.float32]:
    """The p of (low, high) for which first <= slope p + start <= last."""
    if slope == ZERO:
        if start < first or start > last:
            return ONE, -ONE
        return low, high
    a = (first - start) / slope
    b = (last - start) / slope
    return max(low, min(a, b)), min(high, max(a, b))


@kernel
def extremes(a: np.float32, b: np.float32, left: np.float32, right: np.float32, top: np.float32, bottom: np.float32) -> tuple[np.float32, np.float32]:
    """The least and the greatest a x + b y over a rectangle."""
    return min(a * left, a * right) + min(b * top, b * bottom), max(a * left, a * right) + max(b * top, b * bottom)


@kernel
def average(ewa: Ewa, textures: Textures, index: Index, s: np.float32, t: np.float32, j: Plane, row: Index, column: Index) -> Vec3:
    """The filtered color around (s, t), in texels, of bitmap ``index`` with the Jacobian j = (ds/dx, ds/dy, dt/dx, dt/dy).

    ``row`` and ``column`` are the pixel's within a period of the display. Where weights cancel, it is the color at (s, t) itself.
    """
    determinant = j[0] * j[3] - j[1] * j[2]
    level, size_s, size_t, count, cell = choose_cells(ewa, index, j, determinant)
    image = level_of(ewa, textures, index, level)
    if not count <= MOST_CELLS:
        return texel(image, 0, 0)  # of a single pixel, which the footprint holds many times over
    mode = textures.mode[index, 0]
    parts = level == 0 and (size_s < ONE or size_t < ONE)
    down, across, three = ewa.down, ewa.across, three_of(ewa.centers, ewa, row, column)
    s = s / size_s
    t = t / size_t

    # What the filters cover on the film, and the box around it in cells: of a parallelogram
    left, right = ewa.box[0] - cell.rim_x, ewa.box[2] + cell.rim_x
    top, bottom = ewa.box[1] - cell.rim_y, ewa.box[3] + cell.rim_y
    leftmost, rightmost = extremes(j[0] / size_s, j[1] / size_s, left, right, top, bottom)
    lowest, highest = extremes(j[2] / size_t, j[3] / size_t, left, right, top, bottom)

    # Weighted sums, row by row
    sum_r, sum_g, sum_b = 0.0, 0.0, 0.0
    weight_r, weight_g, weight_b = 0.0, 0.0, 0.0
    size_r, size_g, size_b = 0.0, 0.0, 0.0
    for y in range(int(np.ceil(t + lowest - HALF)), int(np.floor(t + highest - HALF)) + 1):
        q = np.float32(y) + HALF - t
        first, last = part_of_row(leftmost, rightmost, cell.x_s, cell.x_t * q, left, right)
        first, last = part_of_row(first, last, cell.y_s, cell.y_t * q, top, bottom)
        for x in range(int(np.ceil(s + first - HALF)), int(np.floor(s + last - HALF)) + 1):
            p = np.float32(x) + HALF - s
            w = weights_at(three, down, across, cell.x_s * p + cell.x_t * q, cell.y_s * p + cell.y_t * q, cell)
            if parts:
                c = between_texels(image, mode, (np.float32(x) + HALF) * size_s, (np.float32(y) + HALF) * size_t)
            else:
                c = texel(image, x, y)
            sum_r += np.float64(w[0]) * np.float64(c[0])
            sum_g += np.float64(w[1]) * np.float64(c[1])
            sum_b += np.float64(w[2]) * np.float64(c[2])
            weight_r += np.float64(w[0])
            weight_g += np.float64(w[1])
            weight_b += np.float64(w[2])
            size_r += np.float64(abs(w[0]))
            size_g += np.float64(abs(w[1]))
            size_b += np.float64(abs(w[2]))

    # Weighted means, never below zero: a path has no negative light. Samples of a pixel that share a color would be cut off there anyway
    base = level_of(ewa, textures, index, 0)
    r, g, b = between_texels(base, mode, s * size_s, t * size_t)
    if weight_r > LEAST_SHARE * size_r:
        r = np.float32(max(sum_r / weight_r, 0.0))
    if weight_g > LEAST_SHARE * size_g:
        g = np.float32(max(sum_g / weight_g, 0.0))
    if weight_b > LEAST_SHARE * size_b:
        b = np.float32(max(sum_b / weight_b, 0.0))
    return (r, g, b)


@kernel
def remembered(
    memory: Memory | None, ewa: Ewa, textures: Textures, index: Index, s: np.float32, t: np.float32, j: Plane, pixel_x: int, pixel_y: int, what: Index
) -> Vec3:  # fmt: skip
    """``average`` for a pixel, computed once where ``what`` it is of (not negative) says that all samples of the pixel share it.

    The color is a function of pixel and ``what`` alone, so who asked first does not show.
    """
    row, column = pixel_y % ewa.filter.shape[0], pixel_x % ewa.filter.shape[1]
    if memory is None:
        return average(ewa, textures, index, s, t, j, row, column)
    if what < 0:
        return average(ewa, textures, index, s, t, j, row, column)
    pixel = np.int64(pixel_y) * memory.width + np.int64(pixel_x)
    slot = pixel % memory.key.shape[0]
    if memory.key[slot, 0] != pixel + 1 or memory.key[slot, 1] != what:
        r, g, b = average(ewa, textures, index, s, t, j, row, column)
        memory.key[slot, 0] = pixel + 1
        memory.key[slot, 1] = what
        memory.rgb[slot, 0] = r
        memory.rgb[slot, 1] = g
        memory.rgb[slot, 2] = b
    return (memory.rgb[slot, 0], memory.rgb[slot, 1], memory.rgb[slot, 2])


@kernel
def filtered(ewa: Ewa, textures: Textures, index: Index, place: Footprint, pixel_x: int, pixel_y: int, primitive: Index, otherwise: Vec3) -> Vec3:
    """The color of bitmap ``index`` over the footprint of pixel (pixel_x, pixel_y) on a primitive; ``otherwise`` where it is no footprint."""
    m = textures.to_uv
    width, height = np.float32(textures.size[index, 0]), np.float32(textures.size[index, 1])
    s = (m[index, 0, 0] * place.u + m[index, 0, 1] * place.v + m[index, 0, 2]) * width
    t = (m[index, 1, 0] * place.u + m[index, 1, 1] * place.v + m[index, 1, 2]) * height
    j = (
        (m[index, 0, 0] * place.u_x + m[index, 0, 1] * place.v_x) * width,
        (m[index, 0, 0] * place.u_y + m[index, 0, 1] * place.v_y) * width,
        (m[index, 1, 0] * place.u_x + m[index, 1, 1] * place.v_x) * height,
        (m[index, 1, 0] * place.u_y + m[index, 1, 1] * place.v_y) * height,
    )
    area = abs(j[0] * j[3] - j[1] * j[2])
    extent = abs(s) + abs(t) + abs(j[0]) + abs(j[1]) + abs(j[2]) + abs(j[3])
    if not (area > LEAST_AREA and extent < MOST_TEXELS):
        return otherwise
    what = np.int64(primitive) * textures.kind.shape[0] + np.int64(index) if place.anchored else np.int64(-1)
    return remembered(ewa.memory, ewa, textures, index, s, t, j, pixel_x, pixel_y, what)
