"""Transforms of a description: 4 x 4 matrices, and the operations that build them, as Mitsuba defines them."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


def translate(offset: Sequence[float]) -> F64:
    """Move by (x, y, z)."""
    m = np.eye(4)
    m[:3, 3] = offset
    return m


def scale(factors: Sequence[float]) -> F64:
    """Scale along the axes by (x, y, z)."""
    return np.diag([*factors, 1.0])


def rotate(axis: Sequence[float], angle: float) -> F64:
    """Turn around an axis through the origin by an angle in degrees, counter-clockwise seen against the axis."""
    x, y, z = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    quarter = round(angle / 90)
    if angle == quarter * 90:  # exact, so that what lies in a plane stays in it
        sine, cosine = ((0, 1), (1, 0), (0, -1), (-1, 0))[quarter % 4]
    else:
        sine, cosine = np.sin(np.deg2rad(angle)), np.cos(np.deg2rad(angle))
    m = np.eye(4)
    m[:3, :3] += sine * cross + (1 - cosine) * cross @ cross
    return m


def look_at(origin: Sequence[float], target: Sequence[float], up: Sequence[float]) -> F64:
    """A frame at ``origin`` with +z toward ``target``, +x to the left and +y near ``up``; zero vectors give NaN."""
    o = np.asarray(origin, np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        z = np.asarray(target, np.float64) - o
        z /= np.linalg.norm(z)
        x = np.cross(np.asarray(up, np.float64), z)
        x /= np.linalg.norm(x)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = x, np.cross(z, x), z, o
    return m


def points(m: F64, p: npt.ArrayLike) -> F64:
    """Transform points of shape (n, 3)."""
    return np.asarray(p, np.float64) @ m[:3, :3].T + m[:3, 3]


def normals(m: F64, n: npt.ArrayLike) -> F64:
    """Transform normals of shape (n, 3) by the inverse transpose, and make them unit; zero normals stay zero."""
    moved = np.asarray(n, np.float64) @ np.linalg.inv(m[:3, :3])
    length = np.linalg.norm(moved, axis=1, keepdims=True)
    return np.asarray(moved / np.where(length == 0, 1, length))


def without_scale(m: F64) -> F64:
    """The rigid part of a transform: its linear part's rotation, with the same translation."""
    u, _, vt = np.linalg.svd(m[:3, :3])
    rigid = m.copy()
    rigid[:3, :3] = u @ vt
    return rigid
