"""Meshes that stand for directed quantities: arrows, rings, and surfaces whose distance from a center is a number for each direction."""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
Floats = npt.NDArray[np.floating[Any]]

HEAD_RADIUS = 2.4  # of an arrow, in radii of its shaft
HEAD_LENGTH = 5.0  # likewise
LONGEST_HEAD = 0.4  # of the whole arrow
_PARALLEL = 0.9  # cosine beyond which an axis is too near to a direction to be crossed with it


@dataclass(frozen=True)
class Mesh:
    """Triangles with smooth normals: ``points`` and ``normals`` float32 (n, 3), ``triangles`` int64 (m, 3), counterclockwise seen from outside."""

    points: F32
    normals: F32
    triangles: I64

    def surface(self) -> Any:
        """The mesh as ``pyvista.PolyData``, with its normals."""
        import pyvista

        found: Any = pyvista.PolyData(self.points, np.column_stack([np.full(len(self.triangles), 3, np.int64), self.triangles]).reshape(-1))
        found.point_data["Normals"] = self.normals
        found.point_data.active_normals_name = "Normals"
        return found


def joined(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one, in this order."""
    first = np.cumsum([0] + [len(mesh.points) for mesh in meshes])
    return Mesh(
        np.concatenate([np.empty((0, 3), np.float32), *(mesh.points for mesh in meshes)]),
        np.concatenate([np.empty((0, 3), np.float32), *(mesh.normals for mesh in meshes)]),
        np.concatenate([np.empty((0, 3), np.int64), *(mesh.triangles + start for mesh, start in zip(meshes, first))]),
    )


def frame(axis: Floats) -> F64:
    """Two unit vectors across a direction, and its own: rows (3, 3), right-handed."""
    w = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    beside = np.array([0.0, 1.0, 0.0]) if abs(w[0]) > _PARALLEL else np.array([1.0, 0.0, 0.0])
    u = np.cross(beside, w)
    u /= np.linalg.norm(u)
    return np.stack([u, np.cross(w, u), w])


def arrow(tail: Floats, tip: Floats, radius: float, sides: int = 32) -> Mesh:
    """An arrow between two points (3,), with a shaft of this radius. Short arrows have small heads."""
    start: F64 = np.asarray(tail, np.float64)
    along: F64 = np.asarray(tip, np.float64) - start
    length = float(np.linalg.norm(along))
    if not length > 0:
        return joined([])
    head = min(HEAD_LENGTH * radius, LONGEST_HEAD * length)
    wide = radius + (HEAD_RADIUS - 1) * head / HEAD_LENGTH
    slope = float(np.hypot(head, wide))
    # Each part of the outline has normals of its own, so that edges are sharp: (distance along, radius, normal along, normal outward)
    outline = np.array(
        [
            [[0, 0, -1, 0], [0, radius, -1, 0]],
            [[0, radius, 0, 1], [length - head, radius, 0, 1]],
            [[length - head, radius, -1, 0], [length - head, wide, -1, 0]],
            [[length - head, wide, wide / slope, head / slope], [length, 0, wide / slope, head / slope]],
        ]
    )
    return joined([_revolved(part, start, frame(along), sides) for part in outline])


def ring(center: Floats, axis: Floats, radius: float, thickness: float, sides: int = 64, around: int = 10) -> Mesh:
    """A ring: a torus around an axis, ``thickness`` the radius of its tube."""
    u, v, w = frame(axis)
    a, b = (2 * np.pi * np.arange(count) / count for count in (sides, around))
    outward = np.cos(a)[:, None] * u + np.sin(a)[:, None] * v
    normals = np.cos(b)[None, :, None] * outward[:, None] + np.sin(b)[None, :, None] * w
    points = np.asarray(center, np.float64) + radius * outward[:, None] + thickness * normals
    i, j = np.indices((sides, around))
    corners = [i * around + j, (i + 1) % sides * around + j, (i + 1) % sides * around + (j + 1) % around, i * around + (j + 1) % around]
    return Mesh(_flat(points), _flat(normals), _split(np.stack(corners, axis=-1).reshape(-1, 4)))


def radial_surface(center: Floats, directions: Floats, distances: Floats, closed: bool) -> Mesh:
    """The surface that lies ``distances`` (bands, sectors) from a center (3,) along unit ``directions`` (bands, sectors, 3).

    Bands run from one pole to the other (``closed``), or to the equator. The points of the directions come first, in their order; one for
    each pole follows, at the mean of the nearest band, and without a second pole a rim: the last band's distances on the equator.
    """
    bands, sectors, _ = directions.shape
    r = np.asarray(distances, np.float64)
    ways = np.asarray(directions, np.float64)
    axis = _unit(ways[0].sum(axis=0))
    points = [(ways * r[..., None]).reshape(-1, 3), axis[None] * r[0].mean()]
    grid, along = np.arange(bands * sectors).reshape(bands, sectors), np.arange(sectors)
    after = (along + 1) % sectors
    top = bands * sectors
    triangles = [np.stack([np.full(sectors, top), grid[0], grid[0, after]], axis=1)]
    rings = list(grid)
    if closed:
        points.append(-axis[None] * r[-1].mean())
        triangles.append(np.stack([np.full(sectors, top + 1), grid[-1, after], grid[-1]], axis=1))
    else:
        level = ways[-1] - (ways[-1] @ axis)[:, None] * axis
        points.append(level / np.linalg.norm(level, axis=1, keepdims=True) * r[-1][:, None])
        rings.append(top + 1 + along)
    for upper, lower in itertools.pairwise(rings):
        triangles.append(_split(np.stack([upper, lower, lower[after], upper[after]], axis=1)))
    offsets = np.concatenate(points)
    found = np.concatenate(triangles).astype(np.int64)
    # Sectors may run either way around the axis: faces look outward in any case
    if np.dot(np.cross(ways[bands // 2, 0], ways[bands // 2, 1 % sectors]), axis) < 0:
        found = found[:, ::-1].copy()
    return Mesh((offsets + np.asarray(center, np.float64)).astype(np.float32), _normals(offsets, found), found)


def _revolved(part: F64, start: F64, axes: F64, sides: int) -> Mesh:
    """One part of an outline, two rows of (distance along, radius, normal along, normal outward), turned about an axis (the last of ``axes``)."""
    angle = 2 * np.pi * np.arange(sides) / sides
    outward = np.cos(angle)[:, None] * axes[0] + np.sin(angle)[:, None] * axes[1]
    points = start + part[:, None, :1] * axes[2] + part[:, None, 1:2] * outward
    normals = part[:, None, 2:3] * axes[2] + part[:, None, 3:] * outward
    i, after = np.arange(sides), (np.arange(sides) + 1) % sides
    return Mesh(_flat(points), _flat(normals), _split(np.stack([i, after, sides + after, sides + i], axis=1)))


def _split(quads: npt.NDArray[Any]) -> I64:
    """Two triangles for each quadrilateral (n, 4)."""
    found: I64 = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3).astype(np.int64)
    return found


def _normals(points: F64, triangles: I64) -> F32:
    """A unit normal for each point: of the faces around it, weighted by their areas."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    of_faces = np.cross(b - a, c - a)
    found = np.zeros_like(points)
    for k in range(3):
        np.add.at(found, triangles[:, k], of_faces)
    lengths = np.linalg.norm(found, axis=1, keepdims=True)
    unit: F32 = np.divide(found, lengths, out=np.tile(np.array([[0.0, 0.0, 1.0]]), (len(points), 1)), where=lengths > 0).astype(np.float32)
    return unit


def _flat(vectors: F64) -> F32:
    return vectors.reshape(-1, 3).astype(np.float32)


def _unit(vector: F64) -> F64:
    found: F64 = vector / np.linalg.norm(vector)
    return found
