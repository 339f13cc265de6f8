"""Segments through a grid of voxels: each voxel gets what a segment carries, times the exact length of the segment within it.

The traversal is that of amanatides1987, from plane to plane; planes are met at distances that are computed afresh from their numbers, so that
rounding does not add up and the lengths in all voxels are together that of the segment within the grid.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]


@kernel
def enter(o: np.float64, d: np.float64, low: np.float64, high: np.float64, closed: bool) -> tuple[np.float64, np.float64]:
    """From where to where a segment from ``o`` to ``o + d`` is between two planes, as parts of it; (1, 0) where nowhere.

    What lies in the plane ``high`` is between them only where ``closed``.
    """
    if d == 0.0:
        if o < low or o > high or (o == high and not closed):
            return np.float64(1.0), np.float64(0.0)
        return np.float64(0.0), np.float64(1.0)
    a, b = (low - o) * (1.0 / d), (high - o) * (1.0 / d)
    return max(np.float64(0.0), min(a, b)), min(np.float64(1.0), max(a, b))


@kernel
def first_voxel(o: np.float64, d: np.float64, t: np.float64, low: int, high: int) -> np.int64:
    """The voxel along one axis, of low ... high - 1, that a segment is in from ``t`` on."""
    voxel = np.int64(np.floor(o + t * d))
    if voxel < low:
        return np.int64(low)
    return voxel if voxel < high else np.int64(high - 1)


@kernel
def next_plane(d: np.float64, voxel: np.int64) -> tuple[np.float64, np.float64]:
    """Along one axis: the plane at which a segment leaves the voxel, and the distance to the next such plane, -1, 0 or 1."""
    if d > 0.0:
        return np.float64(voxel + 1), np.float64(1.0)
    return np.float64(voxel), np.float64(-1.0) if d < 0.0 else np.float64(0.0)


@kernel
def deposit(start: F32, end: F32, values: F64, corner: F64, cell: F64, shape: I64, first: int, last: int, sums: F64) -> None:
    """Add ``values`` (n, 4) times length to the voxels with x from ``first`` to ``last`` - 1 that segments (n, 3) pass through.

    ``corner``: the grid's least coordinates (3,); ``cell``: the sides of a voxel (3,); ``shape``: voxels along the axes (3,); ``sums``: (voxels, 4),
    z runs fastest. Four channels, which are written out: a voxel is half a line of the cache, and most of the time goes to these additions.
    """
    ny, nz = int(shape[1]), int(shape[2])
    for i in range(len(start)):
        # ---- the segment, in voxels from the corner; many lie on one side of these voxels ----
        ox, dx = (start[i, 0] - corner[0]) / cell[0], (np.float64(end[i, 0]) - start[i, 0]) / cell[0]
        if (ox < first and ox + dx < first) or (ox > last and ox + dx > last):
            continue
        oy, dy = (start[i, 1] - corner[1]) / cell[1], (np.float64(end[i, 1]) - start[i, 1]) / cell[1]
        oz, dz = (start[i, 2] - corner[2]) / cell[2], (np.float64(end[i, 2]) - start[i, 2]) / cell[2]
        wx, wy, wz = dx * cell[0], dy * cell[1], dz * cell[2]
        length = np.sqrt(wx * wx + wy * wy + wz * wz)

        # ---- where it enters and leaves them, as parts of it ----
        ax, bx = enter(ox, dx, np.float64(first), np.float64(last), last == shape[0])
        ay, by = enter(oy, dy, np.float64(0.0), np.float64(ny), True)
        az, bz = enter(oz, dz, np.float64(0.0), np.float64(nz), True)
        t, out = max(ax, ay, az), min(bx, by, bz)
        if not (t < out and length < np.inf):
            continue

        # ---- the first voxel, and where the segment meets the next plane of each axis ----
        x, y, z = first_voxel(ox, dx, t, first, last), first_voxel(oy, dy, t, 0, ny), first_voxel(oz, dz, t, 0, nz)
        plane_x, step_x = next_plane(dx, x)
        plane_y, step_y = next_plane(dy, y)
        plane_z, step_z = next_plane(dz, z)
        per_x, per_y, per_z = 1.0 / dx, 1.0 / dy, 1.0 / dz
        next_x = (plane_x - ox) * per_x if dx != 0.0 else np.inf
        next_y = (plane_y - oy) * per_y if dy != 0.0 else np.inf
        next_z = (plane_z - oz) * per_z if dz != 0.0 else np.inf
        voxel = (x * ny + y) * nz + z
        on_x, on_y, on_z = np.int64(step_x) * ny * nz, np.int64(step_y) * nz, np.int64(step_z)
        a, b, c, d = values[i, 0] * length, values[i, 1] * length, values[i, 2] * length, values[i, 3] * length

        # ---- from plane to plane ----
        while True:
            meets = next_x if next_x < next_y else next_y
            meets = next_z if next_z < meets else meets
            until = meets if meets < out else out
            part = until - t if until > t else 0.0
            t += part
            there = np.uint64(voxel)
            sums[there, np.uint64(0)] += a * part
            sums[there, np.uint64(1)] += b * part
            sums[there, np.uint64(2)] += c * part
            sums[there, np.uint64(3)] += d * part
            if meets >= out:
                break
            if next_x == meets:
                plane_x += step_x
                voxel += on_x
                next_x = (plane_x - ox) * per_x
            elif next_y == meets:
                plane_y += step_y
                voxel += on_y
                next_y = (plane_y - oy) * per_y
            else:
                plane_z += step_z
                voxel += on_z
                next_z = (plane_z - oz) * per_z


@kernel
def clip_lengths(start: F32, end: F32, low: F64, high: F64, lengths: F64) -> None:
    """``lengths`` (n,): how much of each segment (n, 3) lies in the closed box from ``low`` (3,) to ``high`` (3,)."""
    for i in range(len(start)):
        near, far, squared_length = np.float64(0.0), np.float64(1.0), 0.0
        for axis in range(3):
            d = np.float64(end[i, axis]) - start[i, axis]
            a, b = enter(np.float64(start[i, axis]), d, low[axis], high[axis], True)
            near, far = max(near, a), min(far, b)
            squared_length += d * d
        lengths[i] = max(0.0, far - near) * np.sqrt(squared_length)
        if not lengths[i] < np.inf:
            lengths[i] = 0.0
