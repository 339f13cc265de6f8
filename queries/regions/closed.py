"""What closed surfaces enclose."""

import importlib
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.kernels.regions import box_contains, in_quadric
from queries.regions.base import F32, F64, Bools
from queries.regions.rays import RayCaster

# Fixed directions that no modeled face or edge is likely to follow.
_DIRECTIONS = np.array([[0.5347, 0.6913, 0.4860], [-0.6021, 0.3679, -0.7086], [0.2279, -0.8837, 0.4088]])


class Solid:
    """Closed meshes and spheres, as what they enclose.

    A point is inside where a ray from it leaves the surface more often than it enters it, or less often (a mesh that is inside out),
    which holds for nested and for overlapping parts too (the winding number), but not where parts have faces in common. Three rays vote,
    since one may slip through an edge. Points on the surface itself, up to rounding, may come out either way.
    """

    def __init__(self, corners: F32, spheres: F64, what: str) -> None:
        """``corners`` (nt, 3, 3) of triangles, ``spheres`` (ns, 3, 4): matrices that place unit spheres; ``what``: a name for messages.

        Raises QueryError for open meshes.
        """
        corners = closed(np.asarray(corners, np.float32), what)
        self.spheres = RayCaster(np.empty((0, 3, 3), np.float32), np.zeros(len(spheres), np.uint8), spheres)
        self.mesh = RayCaster(corners, np.empty(0, np.uint8), np.empty((0, 3, 4)))
        edges = self.mesh.corners.astype(np.float64)
        self._normals = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
        self._parts = [part for part in (self.mesh, self.spheres) if len(part)]
        if not self._parts:
            raise QueryError(f"{what} encloses nothing: it has no surface")
        self.bounds = np.stack([np.min([part.bounds[0] for part in self._parts], axis=0), np.max([part.bounds[1] for part in self._parts], axis=0)])

    def inside(self, points: F32) -> Bools:
        """Whether each point (n, 3) is enclosed."""
        points = np.ascontiguousarray(points, np.float32)
        inside = np.zeros(len(points), np.bool_)
        in_quadric(self.spheres.to_object, points, inside)
        if len(self.mesh):
            near = np.empty(len(points), np.bool_)
            low, high = self.mesh.bounds
            box_contains(points, (low + high) / 2, np.eye(3), (high - low) / 2, near)
            rows = np.flatnonzero(near & ~inside)
            inside[rows] = self._in_mesh(points[rows])
        return inside

    def crosses(self, start: F32, end: F32) -> Bools:
        """Whether each closed segment (n, 3) has a point enclosed, or on the surface."""
        start, end = np.ascontiguousarray(start, np.float32), np.ascontiguousarray(end, np.float32)
        near = np.zeros(len(start), np.bool_)
        for part in self._parts:
            near |= part.near(start, end)
        rows = np.flatnonzero(near)
        crosses = np.zeros(len(start), np.bool_)
        crosses[rows] = self.inside(start[rows])
        for part in self._parts:
            rows = rows[~crosses[rows]]
            crosses[rows] = part.touches(start[rows], end[rows])
        rows = rows[~crosses[rows]]
        crosses[rows] = self.inside(end[rows])  # only where rays slipped through an edge
        return crosses

    def _in_mesh(self, points: F32) -> Bools:
        first, second = (self._winds(points, direction) for direction in _DIRECTIONS[:2])
        unsure = np.flatnonzero(first != second)
        first[unsure] = self._winds(points[unsure], _DIRECTIONS[2])
        return first

    def _winds(self, points: F32, direction: F64) -> Bools:
        """Whether the mesh winds around each point: ways out less ways in along one ray, unless they cancel."""
        winding = np.zeros(len(points), np.int64)
        d = np.broadcast_to(direction, points.shape)
        far = np.full(len(points), 2 * np.linalg.norm(self.bounds[1] - self.bounds[0]))
        outward = np.sign(self._normals @ direction).astype(np.int64)
        for rays, _, primitive in self.mesh.all_hits(points.astype(np.float64), d, np.zeros(len(points)), far):
            winding[rays] += outward[primitive]
        return np.asarray(winding != 0)


def closed(corners: F32, what: str) -> F32:
    """Triangles (n, 3, 3), without degenerate ones and wound alike. Corners at the same place are the same. Raises QueryError for open meshes."""
    if not np.isfinite(corners).all():
        raise QueryError(f"{what} has coordinates that are not finite numbers")
    corners = corners + np.float32(0)  # -0 is 0
    places, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    if _open_sides(faces):
        faces = _wound_alike(faces)
    count = _open_sides(faces)
    if count:
        raise QueryError(f"{what} encloses nothing: expected a closed mesh, whose triangles meet along every side, found {count:,} open sides")
    return np.asarray(places[faces], np.float32)


def _open_sides(faces: npt.NDArray[np.int64]) -> int:
    """How many sides are not gone along as often in one direction as in the other: none where the mesh is closed and wound alike."""
    sides = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward = np.where(sides[:, 0] < sides[:, 1], 1, -1)
    _, index = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return int(np.count_nonzero(np.bincount(index.reshape(-1), weights=forward))) if len(sides) else 0


def _wound_alike(faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The same triangles, turned over where a neighbor is wound the other way."""
    trimesh: Any = importlib.import_module("trimesh")  # slow to import, seldom needed
    mesh = trimesh.Trimesh(np.zeros((int(faces.max(initial=0)) + 1, 3)), faces, process=False, validate=False)
    trimesh.repair.fix_winding(mesh)
    return np.asarray(mesh.faces, np.int64)
