"""Contributions of paths to pixels: the film's sums, made of the rows that were chosen.

Kernels add to ``image``, float64 (rows, width, 3), which is the film from row ``first_row`` on; what falls beside it is left out.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Chosen = npt.NDArray[np.bool_]


@kernel
def splat_box(chosen: Chosen, x: F32, y: F32, r: F32, g: F32, b: F32, first_row: int, image: F64) -> None:
    """Add each chosen row to the pixel that it lies in."""
    rows, width, _ = image.shape
    for i in range(len(chosen)):
        if not chosen[i]:
            continue
        column, row = np.int64(x[i]), np.int64(y[i]) - first_row
        if column >= 0 and column < width and row >= 0 and row < rows:
            image[row, column, 0] += np.float64(r[i])
            image[row, column, 1] += np.float64(g[i])
            image[row, column, 2] += np.float64(b[i])


@kernel
def filter_weight(offset: np.float64, table: F64, radius: np.float64) -> np.float64:
    """The filter at an offset from a pixel's center, linear between the entries of ``table`` (offsets 0 … radius)."""
    last = len(table) - 1
    place = abs(offset) / radius * last
    if not place <= last:
        return np.float64(0.0)
    k = np.int64(place)
    if k == last:
        return np.float64(table[last])
    return np.float64(table[k] + (place - k) * (table[k + 1] - table[k]))


@kernel
def splat_filter(
    chosen: Chosen, x: F32, y: F32, r: F32, g: F32, b: F32, first_row: int, table: F64, radius: np.float64, weights: F64, image: F64
) -> None:
    """Add each chosen row to the pixels whose centers are within the filter's radius. ``weights``: scratch, 2 radius + 1 entries."""
    rows, width, _ = image.shape
    reach = np.int64(2 * radius) + 1
    for i in range(len(chosen)):
        if not chosen[i]:
            continue
        film_x, film_y = np.float64(x[i]) - 0.5, np.float64(y[i]) - 0.5
        first_x, first_y = np.int64(np.ceil(film_x - radius)), np.int64(np.ceil(film_y - radius))
        for k in range(reach):
            weights[k] = filter_weight(first_x + k - film_x, table, radius)
        for j in range(reach):
            row = first_y + j - first_row
            weight_y = filter_weight(first_y + j - film_y, table, radius)
            if row < 0 or row >= rows or weight_y == 0.0:
                continue
            for k in range(reach):
                column = first_x + k
                if column >= 0 and column < width:
                    weight = weight_y * weights[k]
                    image[row, column, 0] += weight * np.float64(r[i])
                    image[row, column, 1] += weight * np.float64(g[i])
                    image[row, column, 2] += weight * np.float64(b[i])


@kernel
def splat_weights(chosen: Chosen, x: F32, y: F32, first_row: int, table: F64, radius: np.float64, weights: F64, sums: F64) -> None:
    """Add the weights of each chosen row, as ``splat_filter`` weighs it, to ``sums``, float64 (rows, width)."""
    rows, width = sums.shape
    reach = np.int64(2 * radius) + 1
    for i in range(len(chosen)):
        if not chosen[i]:
            continue
        film_x, film_y = np.float64(x[i]) - 0.5, np.float64(y[i]) - 0.5
        first_x, first_y = np.int64(np.ceil(film_x - radius)), np.int64(np.ceil(film_y - radius))
        for k in range(reach):
            weights[k] = filter_weight(first_x + k - film_x, table, radius)
        for j in range(reach):
            row = first_y + j - first_row
            weight_y = filter_weight(first_y + j - film_y, table, radius)
            if row < 0 or row >= rows or weight_y == 0.0:
                continue
            for k in range(reach):
                column = first_x + k
                if column >= 0 and column < width:
                    sums[row, column] += weight_y * weights[k]


@kernel
def walk_starts(walk: npt.NDArray[np.unsignedinteger], first: Chosen) -> None:
    """Whether each row is the first of its walk, into ``first``: rows of a walk lie together."""
    for i in range(len(walk)):
        first[i] = i == 0 or walk[i] != walk[i - 1]
