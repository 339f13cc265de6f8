"""Error bounds of points on surfaces: how far off its surface a ray must start so as not to meet it again."""

import numpy as np
import numpy.typing as npt

UNIT = 2.0**-24  # the relative error of one float32 rounding


def gamma(k: int) -> float:
    """Bound of the relative error of k roundings in a row (higham2002, lemma 3.1)."""
    return k * UNIT / (1 - k * UNIT)


def triangle_offsets(p0: npt.NDArray[np.float32], e1: npt.NDArray[np.float32], e2: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Offsets (nt,) float32, world units, of triangles given by corner and edges, each (nt, 3) float32.

    Distances are measured along the unit normal n; |x| is componentwise, and extent = |p0| + |e1| + |e2| bounds every
    coordinate of the triangle.

    1. The point p0 + b1 e1 + b2 e2 with edges rounded once: each component is off by at most gamma(4) extent, so it
       leaves the plane by at most gamma(4) n·extent; adding the offset rounds once more: gamma(5).
    2. The ray caster takes n·(p0 - o). The difference and the products round, gamma(4) n·extent.
    3. Its normal is a cross product of rounded edges: component i is off by at most gamma(5) k_i, where k is the cross
       product of absolute values over |e1 x e2| (large for slivers). It multiplies points of the triangle, whose
       distance from p0 is at most |e1| + |e2|: gamma(5) k·(|e1| + |e2|).

    At grazing angles a ray's own slope is uncertain by the same order: all is taken four times. Planes through the
    origin along the axes have no error at all; a ray must leave them too, since a hit at distance zero is a hit.
    """
    a, b, c = (np.abs(np.asarray(x, np.float64)) for x in (p0, e1, e2))
    cross = np.cross(np.asarray(e1, np.float64), np.asarray(e2, np.float64))
    length = np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    normal = np.abs(cross) / length
    spread = np.stack([b[:, i] * c[:, j] + b[:, j] * c[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1) / length
    bound = gamma(9) * np.sum(normal * (a + b + c), axis=1) + gamma(5) * np.sum(spread * (b + c), axis=1)
    least = UNIT**2 * np.max(a + b + c, axis=1)
    return np.asarray(np.clip(4 * bound, least, np.finfo(np.float32).max), np.float32)


def quadric_offsets(to_world: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """Offsets (nq,) float32, world units, of unit quadrics under ``to_world`` (nq, 3, 4) float64.

    Their points and intersections are computed in float64, so what remains is rounding a point of the bounding box to
    float32 and adding the offset, gamma(2) of each coordinate; twice that, since a ray starts from a rounded point too.
    """
    m = np.abs(np.asarray(to_world, np.float64))
    corner = m[:, :, 3] + m[:, :, 0] + m[:, :, 1] + m[:, :, 2]
    return np.asarray(4 * gamma(2) * np.linalg.norm(corner, axis=1), np.float32)
