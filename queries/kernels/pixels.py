"""What each walk adds to each pixel: sums, sums of squares and the largest of these values, and the rows of walks that stand out.

Rows of one walk are contiguous. A walk's value in a pixel is the luminance of all its rows there together: a light walk may come
back to a pixel, and one connection has a row for each lobe.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.luminance import luminance

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Walk = npt.NDArray[np.generic]
I32 = npt.NDArray[np.int32]


@kernel
def value_from(i: int, end: int, pixel: np.int64, width: int, x: F32, y: F32, r: F32, g: F32, b: F32) -> np.float64:
    """The luminance of those rows of i … end - 1 that lie in a pixel."""
    total = np.float64(0.0)
    for j in range(i, end):
        if np.int64(y[j]) * width + np.int64(x[j]) == pixel:
            total += luminance(r[j], g[j], b[j])
    return total


@kernel
def first_in(begin: int, pixel: np.int64, width: int, x: F32, y: F32) -> int:
    """The first row from ``begin`` on that lies in a pixel in which one does."""
    row = begin
    while np.int64(y[row]) * width + np.int64(x[row]) != pixel:
        row += 1
    return row


@kernel
def walk_end(walk: Walk, begin: int) -> int:
    """The row past the last of the walk whose first row is ``begin``."""
    end = begin + 1
    while end < len(walk) and walk[end] == walk[begin]:
        end += 1
    return end


@kernel
def add_values(walk: Walk, x: F32, y: F32, r: F32, g: F32, b: F32, width: int, total: F64, squares: F64, largest: F64) -> None:
    """Add the values of all walks to each pixel's sum, sum of squares and maximum."""
    begin = 0
    while begin < len(walk):
        end = walk_end(walk, begin)
        for i in range(begin, end):
            pixel = np.int64(y[i]) * width + np.int64(x[i])
            if first_in(begin, pixel, width, x, y) < i:
                continue
            value = value_from(i, end, pixel, width, x, y, r, g, b)
            total[pixel] += value
            squares[pixel] += value * value
            largest[pixel] = max(largest[pixel], value)
        begin = end


@kernel
def mark_above(walk: Walk, x: F32, y: F32, r: F32, g: F32, b: F32, width: int, slot: I32, limit: F64, marked: I32, value: F64) -> int:
    """``marked``: the slot of each row's pixel where the row's walk adds more than the slot's limit there, else -1; ``value``: what it adds.

    ``slot``: of each pixel, -1 for pixels that do not matter. Returns the number of marked rows.
    """
    count = 0
    begin = 0
    while begin < len(walk):
        end = walk_end(walk, begin)
        for i in range(begin, end):
            marked[i] = -1
            pixel = np.int64(y[i]) * width + np.int64(x[i])
            if slot[pixel] >= 0:
                value[i] = value_from(begin, end, pixel, width, x, y, r, g, b)
                if value[i] > limit[slot[pixel]]:
                    marked[i] = slot[pixel]
                    count += 1
        begin = end
    return count
