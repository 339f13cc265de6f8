"""The shell of a scene: the outer walls of a room, which stand between its inside and an eye outside."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from viz.scene.meshes import SceneMesh
from viz.scene.outlines import face_normals

F64 = npt.NDArray[np.float64]

_SLACK = 0.02  # how far things may stand out of a wall, in diagonals of the scene: walls are thick, and lean
_LAMP_SHARE = 0.1  # of the shell's area that a lamp must have to be a part of it: the lamp below a ceiling is seen from above
_SHARE = 0.25  # of an object's area that must lie in walls for it to be a part of the shell: a ball on the floor touches the hull with its top only
_BLOCK = 4096  # directions that are compared with all points at once


def walls(meshes: Sequence[SceneMesh]) -> list[F64]:
    """For each mesh the outward normals (m, 3) of its triangles, 0 where a triangle is no wall: one that has the whole scene on one of its sides."""
    if not meshes:
        return []
    points = _extremes(np.concatenate([mesh.points for mesh in meshes]))
    slack = _SLACK * float(np.linalg.norm(np.ptp(points, axis=0)))
    found = []
    for mesh in meshes:
        scaled = face_normals(mesh.points, mesh.triangles)
        area = np.linalg.norm(scaled, axis=1)
        unit = scaled / np.where(area > 0, area, 1)[:, None]
        at = (unit * mesh.points[mesh.triangles[:, 0]]).sum(axis=1)
        side = np.zeros(len(unit))
        for i in range(0, len(unit), _BLOCK):
            along = unit[i : i + _BLOCK] @ points.T - at[i : i + _BLOCK, None]
            outermost, innermost = along.max(axis=1), along.min(axis=1)
            # Of a flat scene, both sides are outer ones: none is
            side[i : i + _BLOCK] = (outermost <= slack).astype(float) - (innermost >= -slack)
        side[area == 0] = 0
        if area[side != 0].sum() < _SHARE * area.sum():
            side[:] = 0
        found.append((unit * side[:, None], area[side != 0].sum()))
    whole = sum(size for _, size in found)
    return [np.zeros_like(normals) if mesh.emits and size < _LAMP_SHARE * whole else normals for mesh, (normals, size) in zip(meshes, found)]


def _extremes(points: F64) -> F64:
    """The corners of the convex hull of points (n, 3); all of them where they have none."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull: F64 = points[np.sort(ConvexHull(points).vertices)]
    except (QhullError, ValueError):
        return points if len(points) <= _BLOCK else np.stack([points.min(axis=0), points.max(axis=0)])
    return hull
