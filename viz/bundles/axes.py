"""The axis of each bundle: the line through the mean ends of its segments (thesis 8.3)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

_EXACT_BITS = 52  # sums of integers below 2^52 are exact in float64
_PARALLEL = 2.0**-20  # mean ends closer than this share of the coordinates are one point: their difference would be rounding


@dataclass(frozen=True)
class Axes:
    """``begin``, ``end``: float64 (bundles, 3), the mean ends c0 and c1; ``way``: the unit vectors between, 0 where the two are one point."""

    begin: F64
    end: F64
    way: F64

    def project(self, points: F32, bundle: I32) -> F32:
        """The orthogonal projection of each point (s, 3) onto the infinite line of its bundle (s): float32 (s, 3).

        A bundle without direction, as that of segments which lead both ways between the same two places, is drawn to its center: the projection
        onto a line of no length.
        """
        way, base = self.way[bundle], self.begin[bundle]
        along = np.einsum("ij,ij->i", points - base, way)
        way *= along[:, None]
        way += base
        return way.astype(np.float32)


def axes_of(begin: F32, end: F32, bundle: I32, bundles: int) -> Axes:
    """The axes of bundles, from the ends (s, 3) of their segments."""
    c0, c1 = exact_means(begin, bundle, bundles), exact_means(end, bundle, bundles)
    way = c1 - c0
    length = np.linalg.norm(way, axis=1)
    scale = np.maximum(np.abs(c0).max(axis=1, initial=0), np.abs(c1).max(axis=1, initial=0))
    some = length > _PARALLEL * scale
    way = np.divide(way, length[:, None], out=np.zeros_like(way), where=some[:, None])
    # Of no direction: the center of both ends
    middle = 0.5 * (c0 + c1)
    return Axes(np.where(some[:, None], c0, middle), np.where(some[:, None], c1, middle), way)


def exact_means(points: F32, group: I32, groups: int) -> F64:
    """The mean of the points (s, 3) of each group, float64 (groups, 3), the same bits in any order of rows and whatever other groups there are.

    Coordinates are rounded to multiples of a power of two, fine enough for a group's own size and extent (2^-30 of it for four million points),
    so that their sums are exact.
    """
    count = np.bincount(group, minlength=groups)
    largest = np.zeros(groups, np.float32)
    np.maximum.at(largest, group, np.abs(points).max(axis=1, initial=0))
    _, bits = np.frexp(largest.astype(np.float64))
    room = _EXACT_BITS - np.ceil(np.log2(np.maximum(count, 1))).astype(np.int64) - bits
    unit = np.ldexp(1.0, room)
    of_row, means = unit[group], np.empty((groups, 3))
    for k in range(3):
        weights = points[:, k] * of_row
        np.rint(weights, out=weights)
        means[:, k] = np.bincount(group, weights, groups)
    means /= (unit * np.maximum(count, 1))[:, None]
    return means
