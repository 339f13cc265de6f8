"""A scene's surfaces as facets, and which facet a point of an object lies on.

A facet is a triangle, two triangles that make a parallelogram, or an exact sphere, disk or cylinder. Flat facets are kept by two edges and
their normal, round ones by the matrix that places the unit shape (``queries.kernels.surfaces``).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.kernels.surfaces import PARALLELOGRAM, SPHERE, TRIANGLE, FacetGrid, fill_cells
from queries.regions.rays import TOUCH, inverse
from queries.regions.scene import SceneGeometry

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
CELLS_PER_FACET = 2.0


@dataclass(frozen=True)
class Surfaces:
    """``kind`` uint8 (f), ``object`` int32 (f), ``to_world`` float64 (f, 3, 4), in the order of the scene's primitives."""

    kind: U8
    object: I32
    to_world: F64

    @classmethod
    def of(cls, scene: SceneGeometry, objects: Sequence[str] | None = None) -> "Surfaces":
        """The surfaces of a scene, or of some objects. Raises ``QueryError`` for unknown objects and for runs that do not store their surfaces."""
        keys = None if objects is None else [scene.object_id(name) for name in objects]
        caster, owner = scene.caster, scene.primitive_objects
        count = len(caster.corners)
        kind, place, thing = _flat(caster.corners.astype(np.float64), owner[:count])
        kinds = np.concatenate([kind, caster.kinds.astype(np.uint8) + np.uint8(SPHERE)])
        made = cls(kinds, np.concatenate([thing, owner[count:]]).astype(np.int32), np.concatenate([place, caster.to_world]))
        if keys is None:
            return made
        mine = np.isin(made.object, keys)
        return cls(made.kind[mine], made.object[mine], made.to_world[mine])

    def grid(self) -> FacetGrid:
        """The facets by the cells of a grid over each object."""
        low, high = self._bounds()
        things = int(self.object.max(initial=-1)) + 1
        least, most = np.full((things, 3), np.inf), np.full((things, 3), -np.inf)
        np.minimum.at(least, self.object, low)
        np.maximum.at(most, self.object, high)
        count = np.bincount(self.object, minlength=things)
        shape = _grid_shape(np.where(count[:, None] > 0, most - least, 0.0), count)
        first = np.concatenate([[0], np.cumsum(shape.prod(axis=1))]).astype(np.int64)
        with np.errstate(invalid="ignore", divide="ignore"):
            per_unit = np.where(shape > 1, shape / (most - least), 0.0)
        least = np.where(np.isfinite(least), least, 0.0)
        corner, steps, last = least[self.object], per_unit[self.object], shape[self.object] - 1
        cells = [np.clip(np.floor((at - corner) * steps), 0, last).astype(np.int64) for at in (low, high)]
        starts = np.zeros(int(first[-1]) + 1, np.int64)
        cells[1][_degenerate(self.to_world)] = -1  # they touch no cell: no point is found on them
        (low_cell, high_cell), shapes, firsts = cells, shape[self.object], first[self.object]
        fill_cells(low_cell, high_cell, shapes, firsts, starts, np.empty(0, np.int32))
        starts = np.concatenate([[0], np.cumsum(starts[:-1])]).astype(np.int64)
        facets = np.empty(int(starts[-1]), np.int32)
        fill_cells(low_cell, high_cell, shapes, firsts, starts.copy(), facets)
        return FacetGrid(least, per_unit, shape, first[:-1], starts, facets)

    def _bounds(self) -> tuple[F64, F64]:
        """The least and the largest coordinates of each facet, (f, 3) each, widened by what rounding may have moved a point."""
        a, b, n, o = (self.to_world[:, :, i] for i in range(4))
        flat, ball = (self.kind <= PARALLELOGRAM)[:, None], (self.kind == SPHERE)[:, None]
        fourth = np.where((self.kind == PARALLELOGRAM)[:, None], a + b, 0.0)
        low = np.minimum(np.minimum(a, b), np.minimum(fourth, 0.0))
        high = np.maximum(np.maximum(a, b), np.maximum(fourth, 0.0))
        reach = np.where(ball, np.linalg.norm(self.to_world[:, :, :3], axis=2), np.abs(a) + np.abs(b) + np.abs(n))
        touch = 4 * TOUCH * np.abs(o).max(axis=1, initial=0.0)[:, None] + 4 * TOUCH * np.abs(self.to_world[:, :, :3]).sum(axis=2).max(axis=1)[:, None]
        return o + np.where(flat, low, -reach) - touch, o + np.where(flat, high, reach) + touch


def to_local(to_world: F64) -> F64:
    """The inverses (f, 3, 4) of placements; zeros for facets without an area, on which nothing lies."""
    flat = _degenerate(to_world)
    safe = np.where(flat[:, None, None], np.eye(3, 4), to_world)
    return np.where(flat[:, None, None], 0.0, inverse(safe))


def _degenerate(to_world: F64) -> npt.NDArray[np.bool_]:
    """Facets that have no area."""
    found: npt.NDArray[np.bool_] = np.abs(np.linalg.det(to_world[:, :, :3])) <= 1e-300
    return found


def _flat(corners: F64, owner: I32) -> tuple[U8, F64, I32]:
    """Triangles (n, 3, 3) as facets: kinds, placements and objects. Neighbors in the table that make a parallelogram become one."""
    n = len(corners)
    pairs, turned = _parallelograms(corners, owner)
    second = np.zeros(n, np.bool_)
    second[pairs + 1] = True
    origin, a, b = corners[:, 0].copy(), corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # A parallelogram's origin is the corner of its first triangle that the second one lacks
    turn = (turned[:, None] + np.arange(3)) % 3
    o, p, q = (corners[pairs, turn[:, i]] for i in range(3))
    origin[pairs], a[pairs], b[pairs] = o, p - o, q - o
    kind = np.full(n, TRIANGLE, np.uint8)
    kind[pairs] = PARALLELOGRAM
    normal = np.cross(a, b)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0)
    return kind[~second], np.stack([a, b, normal, origin], axis=2)[~second], owner[~second]


def _parallelograms(corners: F64, owner: I32) -> tuple[I64, I64]:
    """The first of each two triangles, one after the other, that make a parallelogram, and the corner (0 … 2) that the second does not share."""
    if len(corners) < 2:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    one, two = corners[:-1], corners[1:]
    same = (one[:, :, None] == two[:, None, :]).all(axis=3)  # (n, 3 corners, 3 corners)
    alone = ~same.any(axis=2)
    corner = alone.argmax(axis=1)
    other = (~same.any(axis=1)).argmax(axis=1)
    at = np.arange(len(one))
    lone, shared = one[at, corner], one.sum(axis=1) - one[at, corner]
    size = np.abs(corners[:-1] - corners[:-1, :1]).max(axis=(1, 2))
    gap = np.abs(lone + two[at, other] - shared).max(axis=1)
    # The second must be turned the same way: normals that agree
    turned = np.einsum("ni,ni->n", *(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (one, two))) > 0
    fits = (alone.sum(axis=1) == 1) & (same.sum(axis=(1, 2)) == 2) & (gap <= 1e-6 * size) & turned & (owner[:-1] == owner[1:])
    first = np.flatnonzero(fits)
    # Of a row of such neighbors every other one begins a pair
    run = np.flatnonzero(np.diff(first, prepend=-2) > 1)
    begins = (np.arange(len(first)) - np.repeat(run, np.diff(np.append(run, len(first))))) % 2 == 0
    return first[begins], corner[first[begins]]


def _grid_shape(size: F64, count: I64) -> I64:
    """Cells along each axis (objects, 3): some for each facet, cubes as near as can be; zeros for objects without facets."""
    longest = size.max(axis=1, keepdims=True)
    thick = np.maximum(size, 1e-3 * longest)
    wanted = CELLS_PER_FACET * np.maximum(count, 1)
    few = count <= 4
    edge = np.cbrt(thick.prod(axis=1) / wanted)
    with np.errstate(invalid="ignore", divide="ignore"):
        cells = np.where((edge > 0)[:, None] & ~few[:, None], np.ceil(size / edge[:, None]), 1.0)
    shape: I64 = np.clip(np.nan_to_num(cells, nan=1.0), 1, 512).astype(np.int64)
    shape[count == 0] = 0
    return shape
