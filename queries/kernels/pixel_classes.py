"""Shares of classes of paths in each cell of the film."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.luminance import luminance

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
U16 = npt.NDArray[np.uint16]
NO_CLASS = 255  # in a slot that no class fills


@kernel
def cells_and_values(x: F32, y: F32, r: F32, g: F32, b: F32, block: int, columns: int, cell: I32, value: F64) -> None:
    """The cell that each row lies in, ``block`` pixels to a side, and its luminance."""
    for i in range(len(x)):
        cell[i] = (np.int64(y[i]) // block) * columns + np.int64(x[i]) // block
        value[i] = luminance(r[i], g[i], b[i])


@kernel
def deposit(cell: I32, layer: U8, value: F64, sums: F64) -> None:
    """Add each row to its cell and layer of ``sums`` (cells, layers)."""
    for i in range(len(cell)):
        sums[cell[i], layer[i]] += value[i]


@kernel
def largest_shares(sums: F64, whole: int, classes: U8, parts: U16) -> None:
    """The largest named layers of each cell, as parts of ``whole``; all else is the last part, so that parts add up to ``whole``.

    ``sums``: (cells, layers), the last layer holds all classes without names; it is changed. ``classes``: (cells, slots), ``NO_CLASS`` in slots that
    nothing fills; ``parts``: (cells, slots + 1), all 0 in cells without light. Of equal layers the first comes first. Fractions are rounded
    down, and what is left to ``whole`` goes to the parts that lost most.
    """
    cells, layers = sums.shape
    slots = classes.shape[1]
    for i in range(cells):
        total = 0.0
        for k in range(layers):
            total += sums[i, k]
        for slot in range(slots):
            classes[i, slot] = NO_CLASS
        for slot in range(slots + 1):
            parts[i, slot] = 0
        if not total > 0.0:
            continue
        left, given = total, np.int64(0)
        for slot in range(slots):
            best, most = -1, 0.0
            for k in range(layers - 1):
                if sums[i, k] > most:
                    best, most = k, sums[i, k]
            if best < 0:
                break
            classes[i, slot] = best
            left -= most
            share = most / total * whole
            parts[i, slot] = np.uint16(min(share, np.float64(whole)))
            given += np.int64(parts[i, slot])
            sums[i, best] = parts[i, slot] - share  # what rounding took, negative: the layer is done with
        rest = max(left, 0.0) / total * whole
        parts[i, slots] = np.uint16(min(rest, np.float64(whole)))
        given += np.int64(parts[i, slots])
        lost = rest - parts[i, slots]
        for _ in range(min(whole - given, slots + 1)):
            # One more to whichever part lost most by rounding
            at, most = slots, lost
            for slot in range(slots):
                if classes[i, slot] != NO_CLASS and -sums[i, classes[i, slot]] > most:
                    at, most = slot, -sums[i, classes[i, slot]]
            parts[i, at] += 1
            if at == slots:
                lost -= 1.0
            else:
                sums[i, classes[i, at]] += 1.0
