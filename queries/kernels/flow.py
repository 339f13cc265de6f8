"""Particles that follow a field of directions on a grid."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]


@kernel
def sample_field(field: F32, x: float, y: float, z: float) -> tuple[float, float, float, float, float]:
    """A field (nx, ny, nz, 5) between the centers of its voxels, trilinear, and as at the last centers beyond them; positions are in voxels."""
    nx, ny, nz = field.shape[0], field.shape[1], field.shape[2]
    u, v, w = min(max(x - 0.5, 0.0), nx - 1.0), min(max(y - 0.5, 0.0), ny - 1.0), min(max(z - 0.5, 0.0), nz - 1.0)
    i, j, k = int(u), int(v), int(w)
    u, v, w = u - i, v - j, w - k
    a, b, c, d, e = 0.0, 0.0, 0.0, 0.0, 0.0
    for corner in range(8):
        right, up, deep = corner & 1, (corner >> 1) & 1, corner >> 2
        share = (u if right else 1.0 - u) * (v if up else 1.0 - v) * (w if deep else 1.0 - w)
        if share > 0.0:
            here = field[min(i + right, nx - 1), min(j + up, ny - 1), min(k + deep, nz - 1)]
            a += share * here[0]
            b += share * here[1]
            c += share * here[2]
            d += share * here[3]
            e += share * here[4]
    return a, b, c, d, e


@kernel
def direction_at(field: F32, low: F64, cell: F64, x: float, y: float, z: float, least: float) -> tuple[float, float, float]:
    """The unit direction of the light at a world position; zero outside, where there is no light, and where it has no dominant direction.

    ``field``: the light vector (3), the fluence, and the anisotropy that may be an accident; a direction needs more, and ``least``.
    """
    u, v, w = (x - low[0]) / cell[0], (y - low[1]) / cell[1], (z - low[2]) / cell[2]
    if not (0.0 <= u <= field.shape[0] and 0.0 <= v <= field.shape[1] and 0.0 <= w <= field.shape[2]):
        return 0.0, 0.0, 0.0
    i, j, k = min(int(u), field.shape[0] - 1), min(int(v), field.shape[1] - 1), min(int(w), field.shape[2] - 1)
    if field[i, j, k, 3] <= 0.0:  # dark voxels next to lit ones are dark
        return 0.0, 0.0, 0.0
    a, b, c, fluence, chance = sample_field(field, u, v, w)
    length = np.sqrt(a * a + b * b + c * c)
    if fluence <= 0.0 or length <= 0.0 or length < max(least, chance) * fluence:
        return 0.0, 0.0, 0.0
    return a / length, b / length, c / length


@kernel
def advance(field: F32, low: F64, cell: F64, step: float, least: float, tracks: F64, count: I32) -> None:
    """Follow the light from ``tracks[:, 0]``, by steps of equal length (fourth-order Runge-Kutta), until a particle has nowhere to go.

    ``tracks``: float64 (particles, steps + 1, 3), world; ``count``: int32 (particles), how many of its positions each particle has, 1 or more.
    The last positions of a track repeat the last one that there is.
    """
    for i in range(len(tracks)):
        x, y, z = tracks[i, 0, 0], tracks[i, 0, 1], tracks[i, 0, 2]
        count[i] = 1
        going = True
        for n in range(1, tracks.shape[1]):
            if going:
                dx, dy, dz = _runge_kutta(field, low, cell, x, y, z, step, least)
                going = dx != 0.0 or dy != 0.0 or dz != 0.0
                if going:
                    x, y, z = x + dx, y + dy, z + dz
                    count[i] += 1
            tracks[i, n, 0], tracks[i, n, 1], tracks[i, n, 2] = x, y, z


@kernel
def _runge_kutta(field: F32, low: F64, cell: F64, x: float, y: float, z: float, step: float, least: float) -> tuple[float, float, float]:
    """One step, of length ``step`` along the curve; zero where any of its four directions is missing."""
    half = 0.5 * step
    ax, ay, az = direction_at(field, low, cell, x, y, z, least)
    bx, by, bz = direction_at(field, low, cell, x + half * ax, y + half * ay, z + half * az, least)
    cx, cy, cz = direction_at(field, low, cell, x + half * bx, y + half * by, z + half * bz, least)
    dx, dy, dz = direction_at(field, low, cell, x + step * cx, y + step * cy, z + step * cz, least)
    none = 0.0
    for gx, gy, gz in ((ax, ay, az), (bx, by, bz), (cx, cy, cz), (dx, dy, dz)):
        none += 1.0 if gx == 0.0 and gy == 0.0 and gz == 0.0 else 0.0
    sx, sy, sz = ax + 2.0 * (bx + cx) + dx, ay + 2.0 * (by + cy) + dy, az + 2.0 * (bz + cz) + dz
    if none > 0.0 or sx * sx + sy * sy + sz * sz < 1.0:  # of at most 36: the light turns back within one step
        return 0.0, 0.0, 0.0
    return step * sx / 6.0, step * sy / 6.0, step * sz / 6.0
