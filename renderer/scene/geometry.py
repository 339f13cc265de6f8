"""The parts of compiled shapes, and their assembly into the arrays that rays and kernels read."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from renderer.errors import SceneError
from renderer.scene.transforms import F64
from renderer.shapes import bounds
from renderer.shapes.base import DISK, SPHERE, Geometry, Quadrics

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
Bounds = tuple[tuple[float, float, float], tuple[float, float, float]]


@dataclass
class Mesh:
    """Triangles in world space. ``flip`` turns their normals around; ``parallelogram`` marks a rectangle's two triangles."""

    positions: F64  # (n, 3)
    faces: npt.NDArray[np.int64]  # (m, 3)
    normals: F64 | None = None  # (n, 3) unit, already flipped
    uvs: F64 | None = None  # (n, 2)
    flip: bool = False
    parallelogram: bool = False

    def corners(self) -> F32:
        """Corner positions, (m, 3, 3)."""
        return np.asarray(self.positions[self.faces], np.float32)

    def areas(self) -> F64:
        """Triangle areas, (m,)."""
        p = self.positions[self.faces]
        return np.asarray(np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2)

    def bounds(self) -> Bounds:
        """The box around the triangles."""
        p = self.positions[self.faces].reshape(-1, 3)
        return box(p.min(axis=0), p.max(axis=0))


@dataclass
class Quadric:
    """An exact sphere, disk or cylinder: a unit shape in its frame."""

    kind: int
    to_world: F64  # (4, 4)
    flip: bool = False

    def area(self) -> float:
        """Surface area (of a cylinder: its lateral surface)."""
        a, c = (float(np.linalg.norm(self.to_world[:3, i])) for i in (0, 2))
        if self.kind == SPHERE:
            return 4 * np.pi * a * a
        if self.kind == DISK:
            return float(np.pi * np.linalg.norm(np.cross(self.to_world[:3, 0], self.to_world[:3, 1])))
        return 2 * np.pi * a * c

    def bounds(self) -> Bounds:
        """The tight box around the shape."""
        m = self.to_world[:3, :3]
        if self.kind == SPHERE:
            reach, center = np.linalg.norm(m, axis=1), self.to_world[:3, 3]
        elif self.kind == DISK:
            reach, center = np.linalg.norm(m[:, :2], axis=1), self.to_world[:3, 3]
        else:
            reach, center = np.linalg.norm(m[:, :2], axis=1) + np.abs(m[:, 2]) / 2, self.to_world[:3, 3] + m[:, 2] / 2
        return box(center - reach, center + reach)


Surface = Mesh | Quadric


def box(low: F64, high: F64) -> Bounds:
    """Bounds as plain floats."""
    return (float(low[0]), float(low[1]), float(low[2])), (float(high[0]), float(high[1]), float(high[2]))


@dataclass
class Assembly:
    """All geometry of a scene, and where each object's primitives stand."""

    geometry: Geometry
    vertices: F32  # (nv, 3)
    triangles: I32  # (nt, 3)
    first: list[int]  # for each object, its first primitive
    count: list[int]


def assemble(surfaces: Sequence[Surface], textured: bool) -> Assembly:
    """Triangles of all meshes in object order, then quadrics in object order.

    ``textured`` keeps texture coordinates (barycentric ones where a mesh has none).
    """
    meshes = [(i, s) for i, s in enumerate(surfaces) if isinstance(s, Mesh)]
    quadrics = [(i, s) for i, s in enumerate(surfaces) if isinstance(s, Quadric)]
    counts = [len(m.faces) for _, m in meshes]
    nt = sum(counts)
    if nt + len(quadrics) > 2**31 - 1:
        raise SceneError(f"the scene has {nt} triangles; at most {2**31 - 1} can be indexed")
    first, count = [0] * len(surfaces), [1] * len(surfaces)
    for (i, _), n, start in zip(meshes, counts, np.cumsum([0, *counts]), strict=False):
        first[i], count[i] = int(start), n
    for k, (i, _) in enumerate(quadrics):
        first[i] = nt + k

    # Triangles: corners and edges in float32, as rays will see them; normals from those edges
    corners = np.concatenate([np.zeros((0, 3, 3), np.float32), *(m.corners() for _, m in meshes)])
    p0 = np.ascontiguousarray(corners[:, 0])
    e1, e2 = corners[:, 1] - p0, corners[:, 2] - p0
    ng = np.cross(e1.astype(np.float64), e2.astype(np.float64))
    ng /= np.linalg.norm(ng, axis=1, keepdims=True)
    ng *= np.repeat(np.array([-1.0 if m.flip else 1.0 for _, m in meshes]), counts)[:, None]
    normals = corner_normals([m for _, m in meshes], ng)
    uvs = np.concatenate([np.zeros((0, 3, 2), np.float32), *(corner_uvs(m) for _, m in meshes)]) if textured else None

    owner = np.concatenate([np.repeat(np.array([i for i, _ in meshes], np.int32), counts), np.array([i for i, _ in quadrics], np.int32)])
    offset = np.concatenate([bounds.triangle_offsets(p0, e1, e2), quadric_offsets(quadrics)]).astype(np.float32)
    starts = np.cumsum([0] + [len(m.positions) for _, m in meshes])
    vertices = np.concatenate([np.zeros((0, 3)), *(m.positions for _, m in meshes)]).astype(np.float32)
    rows = [m.faces + start for (_, m), start in zip(meshes, starts, strict=False)]
    triangles = np.concatenate([np.zeros((0, 3), np.int64), *rows]).astype(np.int32)
    geometry = Geometry(p0, e1, e2, ng.astype(np.float32), offset, owner, normals, uvs, pack_quadrics([q for _, q in quadrics]))
    return Assembly(geometry, vertices, triangles, first, count)


def corner_normals(meshes: Sequence[Mesh], ng: F64) -> F32 | None:
    """Normals at the corners, (nt, 3, 3): a mesh's own, else the geometric normal; None where no mesh has any."""
    if all(m.normals is None for m in meshes):
        return None
    out = np.repeat(ng[:, None, :], 3, axis=1).astype(np.float32)
    start = 0
    for mesh in meshes:
        if mesh.normals is not None:
            out[start : start + len(mesh.faces)] = mesh.normals[mesh.faces]
        start += len(mesh.faces)
    return out


def corner_uvs(mesh: Mesh) -> F32:
    """Texture coordinates at the corners, (m, 3, 2)."""
    if mesh.uvs is not None:
        return mesh.uvs[mesh.faces].astype(np.float32)
    return np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (len(mesh.faces), 1, 1))


def pack_quadrics(quadrics: Sequence[Quadric]) -> Quadrics | None:
    """The arrays of exact shapes."""
    if not quadrics:
        return None
    to_world = np.stack([q.to_world for q in quadrics])
    return Quadrics(
        np.array([q.kind for q in quadrics], np.int32),
        np.ascontiguousarray(to_world[:, :3]),
        np.ascontiguousarray(np.linalg.inv(to_world)[:, :3]),
        np.array([q.flip for q in quadrics], np.uint8),
    )


def quadric_offsets(quadrics: Sequence[tuple[int, Quadric]]) -> npt.NDArray[np.floating]:
    """Ray offsets of exact shapes, (nq,)."""
    if not quadrics:
        return np.zeros(0)
    return np.asarray(bounds.quadric_offsets(np.stack([q.to_world[:3] for _, q in quadrics])))
