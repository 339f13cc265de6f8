"""A flat list of triangles, no hierarchy: what a scene of a few dozen triangles needs.

Each triangle keeps the affine map to its own frame (baldwin2016), with the rays' origins taken relative to its first
corner so that nothing cancels far from the world's origin. Rays go through in blocks of 64 that stay in the first-level
cache, and the loop over a block is vectorized by the compiler. Up to ``FLAT_LIMIT`` triangles this beats a tree.
"""

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import ONE, ZERO

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]

FLAT_LIMIT = 96  # triangles; past some 150 embree's tree is faster
BLOCK = 64  # rays
ROWS = 8  # origin, direction, far end, what was met
SLACK = np.float32(1e-6)  # of barycentric weights: neighbors overlap rather than leave a crack


def flat_triangles(p0: F32, e1: F32, e2: F32) -> F32:
    """One row for each triangle, float32 (nt, 12): first corner, and the rows of the map from offsets to (b1, b2, height)."""
    a, b = e1.astype(np.float64), e2.astype(np.float64)
    to_local = np.linalg.inv(np.stack([a, b, np.cross(a, b)], axis=-1))
    return np.concatenate([p0, to_local.reshape(-1, 9)], axis=1).astype(np.float32)


@kernel
def load_block(o: F32, d: F32, far: F32, first: int, m: int, block: F32) -> None:
    """Copy m rays from row ``first`` on into the block, component by component; the block's rest meets nothing."""
    for j in range(m):
        i = first + j
        block[j] = o[i, 0]
        block[BLOCK + j] = o[i, 1]
        block[2 * BLOCK + j] = o[i, 2]
        block[3 * BLOCK + j] = d[i, 0]
        block[4 * BLOCK + j] = d[i, 1]
        block[5 * BLOCK + j] = d[i, 2]
        block[6 * BLOCK + j] = far[i]
    for j in range(m, BLOCK):
        block[6 * BLOCK + j] = ZERO
    for j in range(BLOCK):
        block[7 * BLOCK + j] = -ONE


@kernel
def meet_block(flat: F32, block: F32) -> None:
    """The nearest triangle of each ray of the block: its distance to row 6, its index to row 7 (exact in float32)."""
    for q in range(flat.shape[0]):
        px, py, pz = flat[q, 0], flat[q, 1], flat[q, 2]
        ux, uy, uz = flat[q, 3], flat[q, 4], flat[q, 5]
        vx, vy, vz = flat[q, 6], flat[q, 7], flat[q, 8]
        nx, ny, nz = flat[q, 9], flat[q, 10], flat[q, 11]
        index = np.float32(q)
        for j in range(BLOCK):
            x = block[j] - px
            y = block[BLOCK + j] - py
            z = block[2 * BLOCK + j] - pz
            dx = block[3 * BLOCK + j]
            dy = block[4 * BLOCK + j]
            dz = block[5 * BLOCK + j]
            t = -(nx * x + ny * y + nz * z) / (nx * dx + ny * dy + nz * dz)
            b1 = ux * x + uy * y + uz * z + t * (ux * dx + uy * dy + uz * dz)
            b2 = vx * x + vy * y + vz * z + t * (vx * dx + vy * dy + vz * dz)
            met = (t > ZERO) & (t < block[6 * BLOCK + j]) & (b1 >= -SLACK) & (b2 >= -SLACK) & (b1 + b2 <= ONE + SLACK)
            block[6 * BLOCK + j] = t if met else block[6 * BLOCK + j]
            block[7 * BLOCK + j] = index if met else block[7 * BLOCK + j]


@kernel
def closest_flat(flat: F32, o: F32, d: F32, t: F32, primitive: I32, n: int, block: F32) -> None:
    """For n rays (n, 3): the triangle met first (-1: none), and its distance in ``t``, which holds the far ends."""
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        load_block(o, d, t, first, m, block)
        meet_block(flat, block)
        for j in range(m):
            t[first + j] = block[6 * BLOCK + j]
            primitive[first + j] = np.int32(block[7 * BLOCK + j])


@kernel
def occluded_flat(flat: F32, o: F32, d: F32, far: F32, blocked: I32, n: int, block: F32) -> None:
    """For n rays: 0 where a triangle lies before ``far``, -1 where the way is free."""
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        load_block(o, d, far, first, m, block)
        meet_block(flat, block)
        for j in range(m):
            blocked[first + j] = np.int32(0) if block[7 * BLOCK + j] >= ZERO else np.int32(-1)
