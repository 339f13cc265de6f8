"""What light meters add up: flux that arrives on patches, and flux that passes through a ball or a disk.

Rows come as segments, float32 (n, 3) starts and ends. All arithmetic is float64.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.luminance import luminance

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
Index = int | np.integer[Any]
TINY = 1e-300


@kernel
def add_to_patches(
    walks: npt.NDArray[np.unsignedinteger], rows: I64, patches: I64, r: F32, g: F32, b: F32, sums: F64, squares: F64, hits: I64
) -> None:
    """Add ``rows`` (n) of a table to the patches (n) that they arrive on, -1 for none: ``sums`` (p, 3), ``hits`` (p), ``squares`` (p).

    ``walks``, ``r``, ``g``, ``b`` are whole columns, rows of one walk one after another; ``squares``: of the luminance that each walk brings.
    """
    begin, n = 0, len(rows)
    while begin < n:
        end = begin + 1
        while end < n and walks[rows[end]] == walks[rows[begin]]:
            end += 1
        for i in range(begin, end):
            patch, row = patches[i], rows[i]
            if patch < 0:
                continue
            sums[patch, 0] += np.float64(r[row])
            sums[patch, 1] += np.float64(g[row])
            sums[patch, 2] += np.float64(b[row])
            hits[patch] += 1
            # All that a walk brings to a patch is one sample, added at the first of its rows
            x, earlier = 0.0, False
            for j in range(begin, end):
                if patches[j] == patch:
                    earlier |= j < i
                    x += luminance(r[rows[j]], g[rows[j]], b[rows[j]])
            if not earlier:
                squares[patch] += x * x
        begin = end


@kernel
def chords_of_ball(start: F32, end: F32, center: F64, radius: float, chord: F64, middle: F64) -> None:
    """``chord`` (n): the length of each segment within the ball; ``middle`` (n, 3): the middle of that part, where it has a length."""
    for i in range(len(start)):
        ox, oy, oz = start[i, 0] - center[0], start[i, 1] - center[1], start[i, 2] - center[2]
        dx = np.float64(end[i, 0]) - np.float64(start[i, 0])
        dy = np.float64(end[i, 1]) - np.float64(start[i, 1])
        dz = np.float64(end[i, 2]) - np.float64(start[i, 2])
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        chord[i] = 0.0
        if not length > 0.0:
            continue
        dx, dy, dz = dx / length, dy / length, dz / length
        # The line's point nearest to the center comes first, which avoids cancellation (haines2019)
        along = -(ox * dx + oy * dy + oz * dz)
        x, y, z = ox + along * dx, oy + along * dy, oz + along * dz
        square = radius * radius - (x * x + y * y + z * z)
        if not square > 0.0:
            continue
        half = np.sqrt(square)
        near, far = max(along - half, 0.0), min(along + half, length)
        if far > near:
            chord[i] = far - near
            m = 0.5 * (near + far)
            middle[i, 0] = start[i, 0] + m * dx
            middle[i, 1] = start[i, 1] + m * dy
            middle[i, 2] = start[i, 2] + m * dz


@kernel
def through_disk(start: F32, end: F32, center: F64, normal: F64, radius: float, touch: float, crosses: npt.NDArray[np.bool_], at: F64) -> None:
    """Segments that go through a disk from its front: ``crosses`` (n), and the points ``at`` (n, 3).

    Ends within ``touch`` of the disk's plane lie on it: those that end there have come through, those that start there have not.
    """
    for i in range(len(start)):
        crosses[i] = False
        ox, oy, oz = start[i, 0] - center[0], start[i, 1] - center[1], start[i, 2] - center[2]
        ex, ey, ez = end[i, 0] - center[0], end[i, 1] - center[1], end[i, 2] - center[2]
        before = ox * normal[0] + oy * normal[1] + oz * normal[2]
        after = ex * normal[0] + ey * normal[1] + ez * normal[2]
        if not (before > touch and after <= touch):
            continue
        t = min(before / (before - after), 1.0)
        x, y, z = ox + t * (ex - ox), oy + t * (ey - oy), oz + t * (ez - oz)
        if x * x + y * y + z * z <= radius * radius:
            crosses[i] = True
            at[i, 0], at[i, 1], at[i, 2] = center[0] + x, center[1] + y, center[2] + z


# --- smoothing over patches ---------------------------------------------------------------------------------------


X, NORMAL, AREA, FLUX, DEVIATION, HITS, OWNER, COLUMNS = 0, 3, 6, 7, 10, 11, 12, 13  # columns of patches, as ``smooth`` reads them
EMPTY = np.int64(-1)
_BITS = np.int64(21)  # of each coordinate of a cell in its key
_HALF = np.int64(1) << (_BITS - np.int64(1))


@kernel
def key_of(x: Index, y: Index, z: Index) -> np.int64:
    """A cell's coordinates as one number of 63 bits."""
    return np.int64((((np.int64(x) + _HALF) << _BITS | (np.int64(y) + _HALF)) << _BITS) | (np.int64(z) + _HALF))


@kernel
def slot_of(key: Index, mask: Index) -> np.int64:
    """Where to look first for a key in a table of mask + 1 slots: the high half of its product with the golden ratio (knuth1973)."""
    return np.int64((np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(32)) & np.int64(mask)


@kernel
def fill_keys(centers: F32, cell: float, keys: I64) -> None:
    """The key (n) of the cell of each point."""
    for i in range(len(centers)):
        x, y, z = np.float64(centers[i, 0]) / cell, np.float64(centers[i, 1]) / cell, np.float64(centers[i, 2]) / cell
        keys[i] = key_of(np.int64(np.floor(x)), np.int64(np.floor(y)), np.int64(np.floor(z)))


@kernel
def fill_slots(keys: I64, slots: I64) -> None:
    """``slots``: the row of each of some distinct keys, in a table that is EMPTY elsewhere, the next free slot after ``slot_of``."""
    mask = np.int64(len(slots) - 1)
    for row in range(len(keys)):
        slot = slot_of(keys[row], mask)
        while slots[slot] != EMPTY:
            slot = (slot + 1) & mask
        slots[slot] = row


@kernel
def smooth(
    points: F32,
    normals: F64,
    things: I32,
    patches: F32,
    keys: I64,
    starts: I64,
    slots: I64,
    cell: float,
    least: float,
    most: float,
    wanted: int,
    aligned: float,
    values: F64,
    errors: F64,
) -> None:
    """``values`` (n, 3): flux over area of the patches around each point, weighted by Epanechnikov's kernel; ``errors`` (n).

    Patches count that are of the point's object and whose normals agree with the point's to a cosine of ``aligned``. The radius grows from
    ``least`` until the patches hold ``wanted`` hits, at most to ``most``. ``patches`` (p, COLUMNS) are sorted by cells of this size, whose
    ``keys`` (c) have the rows ``starts`` (c + 1) and are found by ``slots``.
    """
    mask = np.int64(len(slots) - 1)
    for i in range(len(points)):
        px, py, pz = np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2])
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        thing, radius, last = np.float32(things[i]), least, False
        fewer, smaller, covered = 0.0, 0.0, 0.0  # of the disc before: hits, the square of its radius, area
        while True:
            square = radius * radius
            area, r, g, b, noise, count = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for cx in range(np.int64(np.floor((px - radius) / cell)), np.int64(np.floor((px + radius) / cell)) + 1):
                for cy in range(np.int64(np.floor((py - radius) / cell)), np.int64(np.floor((py + radius) / cell)) + 1):
                    for cz in range(np.int64(np.floor((pz - radius) / cell)), np.int64(np.floor((pz + radius) / cell)) + 1):
                        key = key_of(cx, cy, cz)
                        slot = slot_of(key, mask)
                        while slots[slot] != EMPTY and keys[slots[slot]] != key:
                            slot = (slot + 1) & mask
                        if slots[slot] == EMPTY:
                            continue
                        for p in range(starts[slots[slot]], starts[slots[slot] + 1]):
                            dx, dy, dz = patches[p, X] - px, patches[p, X + 1] - py, patches[p, X + 2] - pz
                            distance = dx * dx + dy * dy + dz * dz
                            if distance >= square or patches[p, OWNER] != thing:
                                continue
                            if patches[p, NORMAL] * nx + patches[p, NORMAL + 1] * ny + patches[p, NORMAL + 2] * nz < aligned:
                                continue
                            weight = 1.0 - distance / square
                            area += weight * patches[p, AREA]
                            r += weight * patches[p, FLUX]
                            g += weight * patches[p, FLUX + 1]
                            b += weight * patches[p, FLUX + 2]
                            deviation = weight * patches[p, DEVIATION]
                            noise += deviation * deviation
                            count += patches[p, HITS]
            enough = count >= wanted and area > 0.0
            if last or (enough and covered == 0.0) or (not enough and radius >= most):
                break
            if enough:
                # A disc between the last two, for as many hits as wanted: radii then change smoothly from point to point
                radius, last = np.sqrt(smaller + (square - smaller) * (wanted - fewer) / max(count - fewer, 1.0)), True
            else:
                fewer, smaller, covered = count, square, area
                radius = min(radius * 1.4142135623730951, most)
        values[i, 0], values[i, 1], values[i, 2] = r / max(area, TINY), g / max(area, TINY), b / max(area, TINY)
        errors[i] = np.sqrt(noise) / max(area, TINY)
