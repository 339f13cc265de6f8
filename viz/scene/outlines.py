"""Line drawings of surfaces: their sharp edges and borders, and their outlines as an eye sees them."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
SHARP = 30.0  # degrees between faces from which on their edge is one that is seen


@dataclass(frozen=True)
class Creased:
    """A surface that is smooth but for its creases.

    ``points`` (n, 3): those of the surface, once for each smooth part that meets there; ``normals`` (n, 3), unit; ``triangles`` (m, 3); ``edges``
    (k, 2, 3): creases and borders as segments.
    """

    points: F64
    normals: F64
    triangles: I64
    edges: F64


def creased(points: F64, triangles: I64) -> Creased:
    """Part a surface, points (n, 3) and triangles (m, 3), along edges where neighbors meet at more than ``SHARP`` degrees, or at less than two."""
    scaled = face_normals(points, triangles)
    area = np.linalg.norm(scaled, axis=1)
    unit = scaled / np.where(area > 0, area, 1)[:, None]
    # The two sides of every edge; a side knows its triangle and its corner there
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T[::-1])
    sorted_ends = ends[order]
    first = np.ones(len(order), np.bool_)
    first[1:] = (sorted_ends[1:] != sorted_ends[:-1]).any(axis=1)
    begin = np.flatnonzero(first)
    sides = np.diff(np.append(begin, len(order)))
    pair = begin[sides == 2]
    one, other = order[pair], order[pair + 1]
    # Neighbors that wind alike run along their edge in opposite directions; else one of them is turned over
    alike = triangles.ravel()[one] != triangles.ravel()[other]
    cosine = (unit[one // 3] * unit[other // 3]).sum(axis=1) * np.where(alike, 1, -1)
    flat = (cosine >= math.cos(math.radians(SHARP))) | (area[one // 3] == 0) | (area[other // 3] == 0)
    corner, count = _smooth_corners(triangles, one[flat], other[flat], alike[flat])
    sign = _common_sides(len(triangles), one[flat] // 3, other[flat] // 3, alike[flat])
    normals = np.zeros((count, 3))
    np.add.at(normals, corner, np.repeat(scaled * sign[:, None], 3, axis=0))
    length = np.linalg.norm(normals, axis=1)
    normals /= np.where(length > 0, length, 1)[:, None]
    placed = np.empty((count, 3))
    placed[corner] = points[triangles.ravel()]
    lines = np.concatenate([sorted_ends[begin[sides != 2]], ends[one[~flat]]])
    return Creased(placed, normals, corner.reshape(-1, 3), points[lines])


def outlines(surface: Creased, eye: npt.NDArray[Any]) -> F64:
    """Where smooth parts turn away from the eye, (3,): segments (k, 2, 3), along which the interpolated normal is across the view.

    Source: hertzmann2000.
    """
    facing = (surface.normals * (eye - surface.points)).sum(axis=1)
    corner = facing[surface.triangles]
    towards = corner > 0
    mixed = towards.any(axis=1) & ~towards.all(axis=1)
    triangles, corner, towards = surface.triangles[mixed], corner[mixed], towards[mixed]
    # The corner that is alone on its side: two edges lead away from it
    alone = np.where(towards.sum(axis=1) == 1, towards.argmax(axis=1), (~towards).argmax(axis=1))
    rows = np.arange(len(triangles))
    segments = np.empty((len(triangles), 2, 3))
    for side in (1, 2):
        far = (alone + side) % 3
        here, there = corner[rows, alone], corner[rows, far]
        t = (here / (here - there))[:, None]
        segments[:, side - 1] = (1 - t) * surface.points[triangles[rows, alone]] + t * surface.points[triangles[rows, far]]
    return segments


def face_normals(points: F64, triangles: I64) -> F64:
    """Normals (m, 3) of triangles (m, 3), as long as twice their areas."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    found: F64 = np.cross(b - a, c - a)
    return found


def _smooth_corners(triangles: I64, one: I64, other: I64, alike: npt.NDArray[np.bool_]) -> tuple[I64, int]:
    """A number for each corner of each triangle (3 m,), the same for corners that smooth edges join; and how many there are."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # An edge begins at its own corner and ends at the next one of its triangle
    def following(side: I64) -> I64:
        return side // 3 * 3 + (side + 1) % 3

    joined_a = np.concatenate([one, following(one)])
    joined_b = np.concatenate([np.where(alike, following(other), other), np.where(alike, other, following(other))])
    links = coo_array((np.ones(len(joined_a), np.bool_), (joined_a, joined_b)), shape=(triangles.size, triangles.size))
    count, corner = connected_components(links, directed=False)
    return corner.astype(np.int64), int(count)


def _common_sides(count: int, one: I64, other: I64, alike: npt.NDArray[np.bool_]) -> F64:
    """For each of so many triangles 1 or -1, such that normals times it lie on one side of each smooth part, however its triangles wind."""
    if alike.all():
        return np.ones(count)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    # Two nodes for each triangle, one for each side: what lies on one side of a smooth part is connected
    turned = np.where(alike, 0, count)
    sides = np.concatenate([one, one + count]), np.concatenate([other + turned, other + count - turned])
    _, part = connected_components(coo_array((np.ones(2 * len(one), np.bool_), sides), shape=(2 * count, 2 * count)), directed=False)
    return np.where(part[:count] <= part[count:], 1.0, -1.0)
