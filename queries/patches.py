"""Surfaces cut into patches: what irradiance is estimated on and drawn with.

Flat facets are cut into equal parts: parallelograms each way, triangles into congruent ones. Spheres are blown-up cubes cut at equal angles, disks
images of a square (shirley1997), cylinders cut along and around. Areas are exact; what is drawn of a round patch are triangles with corners on it.
A triangle of a mesh that is no longer than the wanted size is a patch itself.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.facets import Surfaces, to_local
from queries.kernels.surfaces import CYLINDER, DISK, PARALLELOGRAM, SPHERE, TRIANGLE, FacetGrid, Facets, find_patches
from queries.regions.scene import SceneGeometry

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
MOST_PATCHES = 4_000_000
_ROUND = np.radians(6.0)  # largest angle between neighboring corners of what is drawn of round surfaces


@dataclass(frozen=True, eq=False)
class Patches:
    """``p`` patches, in the order of the scene's primitives.

    ``object``: int32 (p), keys; ``area``: float64 (p), world units²; ``center``, ``normal``: float32 (p, 3), the normal toward the surface's
    front (as it is without ``flip_normals``, which tables do not keep). To draw: ``corners``, float32 (t, 3, 3), triangles, and ``patch``,
    int32 (t), which patch each is of. ``facets``, ``grid``: what finds the patches of points.
    """

    corners: F32
    patch: I32
    object: I32
    area: F64
    center: F32
    normal: F32
    facets: Facets
    grid: FacetGrid

    def __len__(self) -> int:
        """The number of patches."""
        return len(self.object)

    def find(self, points: F32, objects: npt.NDArray[np.integer]) -> I64:
        """The patch of each point (n, 3) on an object (n,): int64, -1 for objects that have none."""
        return self.locate(points, objects, False)[0]

    def locate(self, points: F32, objects: npt.NDArray[np.integer], normals: bool = True) -> tuple[I64, F64]:
        """The same with the surface's unit normals at the points, float64 (n, 3); (0, 3) where not asked for."""
        found, there = np.empty(len(points), np.int64), np.zeros((len(points) if normals else 0, 3))
        find_patches(self.facets, self.grid, np.ascontiguousarray(points, np.float32), objects.astype(np.int32), found, there)
        return found, there


def patches(scene: SceneGeometry, size: float, objects: Sequence[str] | None = None) -> Patches:
    """The surfaces of a scene, or of some objects by name, in patches whose sides are not longer than ``size`` world units.

    Raises ``QueryError`` for unknown objects, sizes that are not above 0 or make more than 4 million patches, and runs without their surfaces.
    """
    if not 0 < size < np.inf:
        raise QueryError(f"expected a size of patches above 0, in world units, found {size!r}")
    surfaces = Surfaces.of(scene, objects)
    counts = _counts(surfaces, size)
    total = _in_facets(surfaces.kind, counts).sum()
    if total > MOST_PATCHES:
        enough = size * float(np.sqrt(total / MOST_PATCHES))
        raise QueryError(f"patches of size {size:g} would be {total:,.0f}: expected {MOST_PATCHES:,} at most, so ask for {enough:.3g} or more")
    number = _in_facets(surfaces.kind, counts).astype(np.int64)
    first = np.cumsum(number) - number
    facets = Facets(surfaces.kind, np.ascontiguousarray(surfaces.to_world), to_local(surfaces.to_world), first.astype(np.int64), counts)
    n = int(number.sum())
    area, center, normal = np.empty(n), np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
    corners, owners = [np.empty((0, 3, 3), np.float32)], [np.empty(0, np.int64)]
    for kind, nu, nv, mine in _alike(surfaces.kind, counts):
        made = _Cells.of(kind, nu, nv)
        rows = first[mine][:, None] + np.arange(made.cells)
        area[rows] = _areas(made, surfaces.to_world[mine])
        center[rows] = _placed(made.centers, surfaces.to_world[mine])
        normal[rows] = _normals(made.gradients, facets.to_local[mine])
        corners.append(_placed(made.corners.reshape(-1, 3), surfaces.to_world[mine]).astype(np.float32).reshape(-1, 3, 3))
        owners.append((first[mine][:, None] + made.cell).ravel())
    patch = np.concatenate(owners)
    order = np.argsort(patch, kind="stable")
    things = np.repeat(surfaces.object, number).astype(np.int32)
    return Patches(np.concatenate(corners)[order], patch[order].astype(np.int32), things, area, center, normal, facets, surfaces.grid())


def surface_area(scene: SceneGeometry, objects: Sequence[str] | None = None) -> float:
    """The area of a scene's surfaces, world units²."""
    surfaces = Surfaces.of(scene, objects)
    found = 0.0
    for kind, nu, nv, mine in _alike(surfaces.kind, np.ones((len(surfaces.kind), 2), np.int64)):
        found += float(_areas(_Cells.of(kind, nu, nv), surfaces.to_world[mine]).sum())
    return found


# --- how many -----------------------------------------------------------------------------------------------------


def _counts(surfaces: Surfaces, size: float) -> I64:
    """How many patches each way, (f, 2), make none longer than ``size``."""
    a, b, c = (np.linalg.norm(surfaces.to_world[:, :, i], axis=1) for i in range(3))
    third = np.linalg.norm(surfaces.to_world[:, :, 1] - surfaces.to_world[:, :, 0], axis=1)
    longest = np.maximum(np.maximum(a, b), third)
    quarter = np.pi / 2 * np.maximum(a, b)
    kind = surfaces.kind
    across = 2 * np.hypot(1, np.pi / 4) * np.maximum(a, b)  # sides are longest where the concentric map is most askew
    u = np.select([kind == TRIANGLE, kind == PARALLELOGRAM, kind == CYLINDER, kind == DISK], [longest, a, 4 * quarter, across], quarter)
    v = np.select([kind == TRIANGLE, kind == PARALLELOGRAM, kind == CYLINDER, kind == DISK], [longest, b, c, across], quarter)
    wanted = np.ceil(np.stack([u, v], axis=1) / size * (1 - 1e-6))
    wanted[kind == CYLINDER, 0] = np.maximum(wanted[kind == CYLINDER, 0], 3)
    counts: I64 = np.clip(wanted, 1, 1e8).astype(np.int64)
    return counts


def _in_facets(kind: npt.NDArray[np.uint8], counts: I64) -> F64:
    """The number of patches of each facet."""
    found: F64 = counts[:, 0].astype(np.float64) * counts[:, 1] * np.where(kind == SPHERE, 6, 1)
    return found


def _alike(kind: npt.NDArray[np.uint8], counts: I64) -> Iterator[tuple[int, int, int, I64]]:
    """Kinds and numbers of patches each way, and the facets that have them."""
    keys, group = np.unique(np.column_stack([kind, counts]), axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    for (k, u, v), mine in zip(keys.tolist(), np.split(order, np.cumsum(np.bincount(group.ravel()))[:-1])):
        yield k, u, v, mine


# --- the patches of one facet -------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Cells:
    """The patches of one facet in local coordinates.

    ``shares`` (cells) of its area; ``centers`` (cells, 3) and ``gradients`` (cells, 3) there; ``corners`` (t, 3, 3) of triangles that draw it
    and the ``cell`` (t) of each.
    """

    kind: int
    shares: F64
    centers: F64
    gradients: F64
    corners: F64
    cell: I64

    @property
    def cells(self) -> int:
        return len(self.shares)

    @classmethod
    def of(cls, kind: int, nu: int, nv: int) -> "_Cells":
        if kind == TRIANGLE:
            return cls._triangle(nu)
        parts = {PARALLELOGRAM: (1, 1), CYLINDER: (_steps(2 * np.pi / nu), 1)}.get(kind, (_steps(np.pi / 2 / nu),) * 2)
        cell, corners = _quads(nu, nv, *parts)
        middle = np.stack(np.meshgrid((np.arange(nu) + 0.5) / nu, (np.arange(nv) + 0.5) / nv, indexing="ij"), axis=-1).reshape(-1, 2)
        shares = np.full(nu * nv, 1.0 / (nu * nv))
        if kind != SPHERE:
            centers = _local(kind, middle)
            return cls(kind, shares, centers, _gradients(kind, centers), _local(kind, corners), cell)
        tangents = [np.tan(np.pi / 4 * (2 * np.arange(n + 1) / n - 1)) for n in (nu, nv)]
        solid = np.diff(np.diff(_solid_angle(tangents[0][:, None], tangents[1]), axis=0), axis=1).ravel()
        faces = [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]
        centers = np.concatenate([_on_face(middle, *face) for face in faces])
        drawn = np.concatenate([_on_face(corners, *face)[:, :: 1 if face[1] > 0 else -1] for face in faces])
        cell = np.concatenate([cell + i * nu * nv for i in range(6)])
        return cls(kind, np.tile(solid / (4 * np.pi), 6), centers, centers, drawn, cell)

    @classmethod
    def _triangle(cls, n: int) -> "_Cells":
        i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        upright, turned = i + j < n, i + j < n - 1
        at = i * (2 * n - i) + 2 * j
        cell = np.concatenate([at[upright], at[turned] + 1])
        steps = [np.array([[0, 0], [1, 0], [0, 1]]), np.array([[1, 1], [0, 1], [1, 0]])]
        parts = [np.stack([i[kept], j[kept]], axis=1)[:, None] + step for kept, step in zip((upright, turned), steps)]
        flat = np.concatenate(parts)[np.argsort(cell)] / n
        corners = np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=2)
        centers = corners.mean(axis=1)
        return cls(TRIANGLE, np.full(n * n, 1.0 / (n * n)), centers, _gradients(TRIANGLE, centers), corners, np.arange(n * n))


def _quads(nu: int, nv: int, mu: int, mv: int) -> tuple[I64, F64]:
    """The cells of a grid over the unit square, each drawn as ``mu`` x ``mv`` pairs of triangles: cells (t), corners (t, 3, 2)."""
    i, j = (index.ravel() for index in np.meshgrid(np.arange(nu * mu), np.arange(nv * mv), indexing="ij"))
    low = np.stack([i, j], axis=1)[:, None, None]
    steps = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    corners = ((low + steps) / np.array([nu * mu, nv * mv])).reshape(-1, 3, 2)
    return np.repeat((i // mu) * nv + j // mv, 2).astype(np.int64), corners


def _local(kind: int, square: F64) -> F64:
    """Points of the unit square (…, 2) on a facet other than a sphere."""
    u, v = square[..., 0], square[..., 1]
    if kind == PARALLELOGRAM:
        return np.stack([u, v, np.zeros_like(u)], axis=-1)
    if kind == CYLINDER:
        return np.stack([np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), v], axis=-1)
    a, b = 2 * u - 1, 2 * v - 1
    first = np.abs(a) >= np.abs(b)
    r = np.where(first, a, b)
    with np.errstate(invalid="ignore", divide="ignore"):
        angle = np.where(first, np.pi / 4 * np.nan_to_num(b / a), np.pi / 2 - np.pi / 4 * np.nan_to_num(a / b))
    return np.stack([r * np.cos(angle), r * np.sin(angle), np.zeros_like(r)], axis=-1)


def _on_face(square: F64, axis: int, sign: float) -> F64:
    """Points of the unit square (…, 2) on one face of the cube, cut at equal angles, and from there on the unit sphere."""
    tangent = np.tan(np.pi / 4 * (2 * square - 1))
    point = np.empty((*square.shape[:-1], 3))
    point[..., axis], point[..., (axis + 1) % 3], point[..., (axis + 2) % 3] = sign, tangent[..., 0], tangent[..., 1]
    unit: F64 = point / np.linalg.norm(point, axis=-1, keepdims=True)
    return unit


def _solid_angle(x: F64, y: F64) -> F64:
    """Of the rectangle from (0, 0) to (x, y) at a distance of 1."""
    angle: F64 = np.arctan2(x * y, np.sqrt(x * x + y * y + 1))
    return angle


def _gradients(kind: int, points: F64) -> F64:
    return points * (1, 1, 0) if kind == CYLINDER else np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)


def _steps(angle: float) -> int:
    return max(1, int(np.ceil(angle / _ROUND)))


# --- in the world -------------------------------------------------------------------------------------------------


def _placed(local: F64, to_world: F64) -> F64:
    """Local points (n, 3) on each facet: (f, n, 3)."""
    placed: F64 = np.einsum("fij,nj->fni", to_world[:, :, :3], local) + to_world[:, None, :, 3]
    return placed


def _normals(gradients: F64, inverse: F64) -> F64:
    """Unit normals (f, n, 3)."""
    found = np.einsum("fji,nj->fni", inverse[:, :, :3], gradients)
    length = np.linalg.norm(found, axis=2, keepdims=True)
    unit: F64 = found / np.where(length > 0, length, 1.0)
    return unit


def _areas(made: _Cells, to_world: F64) -> F64:
    """Areas (f, cells)."""
    a, b, c = (to_world[:, :, i] for i in range(3))
    across = np.linalg.norm(np.cross(a, b), axis=1)
    if made.kind == CYLINDER:
        whole = 2 * np.pi * np.linalg.norm(a, axis=1) * np.linalg.norm(c, axis=1)
    else:
        whole = across * {TRIANGLE: 0.5, PARALLELOGRAM: 1.0, DISK: np.pi, SPHERE: 4 * np.pi}[made.kind]
    found: F64 = whole[:, None] * made.shares
    return found
