"""Rays against a list of triangles and exact quadrics: what they meet first, whether anything blocks them, all that they meet."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from queries.kernels.regions import blocked_by_quadric, box_crosses, closest_quadric
from queries.regions.base import F32, F64, I32, Bools

Floats = npt.NDArray[np.floating[Any]]

TOUCH = 2.0**-18  # how far off a surface a point of it may be stored, in units of the largest coordinate: 64 roundings
_AXES = np.eye(3)


class RayCaster:
    """Answers of rays, for several threads at once.

    ``corners`` (nt, 3, 3) float32 of triangles; ``kinds`` (nq,) and ``to_world`` (nq, 3, 4) float64 of quadrics, which place unit shapes.
    Primitives are numbered through both, triangles first. Rays are (n, 3) float32 origins and directions; distances are in units of
    the direction's length.
    """

    def __init__(self, corners: F32, kinds: npt.NDArray[np.uint8], to_world: F64) -> None:
        self.corners = np.ascontiguousarray(corners, np.float32)
        self.kinds = kinds
        self.to_world = np.ascontiguousarray(to_world, np.float64).reshape(-1, 3, 4)
        self.to_object = inverse(self.to_world)
        self.bounds = np.stack(_bounds(self.corners, self.kinds, self.to_world))
        self.touch = float(TOUCH * np.abs(self.bounds).max(initial=0.0)) if len(self) else 0.0
        self._embree: EmbreeScene | None = None
        if len(self.corners):
            self._embree = EmbreeScene()
            TriangleMesh(self._embree, self.corners.reshape(-1, 3), np.arange(3 * len(self.corners), dtype=np.int32).reshape(-1, 3))
            # The first ray builds the tree, which only one thread may do.
            self._embree.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), query="OCCLUDED")

    def __len__(self) -> int:
        """The number of primitives."""
        return len(self.corners) + len(self.kinds)

    def closest(self, o: Floats, d: Floats, far: Floats) -> tuple[I32, F32]:
        """The primitive that each ray meets first before ``far`` (n,), -1 where none, and its distance (``far`` where none)."""
        o, d, t = np.ascontiguousarray(o, np.float32), np.ascontiguousarray(d, np.float32), np.array(far, np.float32)
        primitive = np.full(len(o), -1, np.int32)
        if self._embree is not None and len(o):
            met = self._embree.run(o, d, dists=t.copy(), query="INTERSECT", output=True)
            primitive = np.asarray(met["primID"], np.int32)
            t = np.where(primitive >= 0, met["tfar"], t)
        if len(self.kinds):
            closest_quadric(self.kinds, self.to_object, len(self.corners), o, d, t, primitive)
        return primitive, t

    def occluded(self, o: Floats, d: Floats, far: Floats) -> Bools:
        """Whether anything lies on each ray before ``far`` (n,)."""
        o, d, far = np.ascontiguousarray(o, np.float32), np.ascontiguousarray(d, np.float32), np.array(far, np.float32)
        blocked = np.zeros(len(o), np.bool_)
        if self._embree is not None and len(o):
            blocked = self._embree.run(o, d, dists=far.copy(), query="OCCLUDED") == 0
        if len(self.kinds):
            blocked_by_quadric(self.kinds, self.to_object, o, d, far, blocked)
        return blocked

    def all_hits(self, o: F64, d: F64, near: F64, far: F64) -> Iterator[tuple[npt.NDArray[np.int64], F64, I32]]:
        """Everything that lies on rays (n, 3) from distances ``near`` to ``far`` (n,), a layer at a time.

        A layer: the rays that met something, the distances, the primitives. Surfaces nearer to each other than ``touch`` may be met as one.
        """
        rays = np.arange(len(o))
        length = np.maximum(np.linalg.norm(d, axis=1), np.finfo(np.float64).tiny)
        step = np.full(len(o), max(self.touch / 4, np.finfo(np.float32).tiny)) / length
        at, last = near.astype(np.float64), np.full(len(o), -1, np.int32)
        while len(rays):
            origin = o[rays] + at[rays, None] * d[rays]
            primitive, t = self.closest(origin.astype(np.float32), d[rays].astype(np.float32), (far - at)[rays].astype(np.float32))
            met = primitive >= 0
            rays, primitive, t = rays[met], primitive[met], t[met]
            distance = at[rays] + t
            # A line meets a flat triangle once: a second time is the same point again, and the ray has to step farther.
            again = (primitive == last[rays]) & (primitive < len(self.corners))
            step[rays[again]] *= 2
            last[rays] = primitive
            at[rays] = distance + step[rays]
            if not again.all():
                yield rays[~again], distance[~again], primitive[~again]
            rays = rays[at[rays] < far[rays]]

    def touches(self, start: F32, end: F32) -> Bools:
        """Whether each closed segment (n, 3) meets a surface; one that ends on a surface does, however its end was rounded."""
        touches = np.zeros(len(start), np.bool_)
        rows = np.flatnonzero(self.near(start, end))
        a, b = start[rows].astype(np.float64), end[rows].astype(np.float64)
        d = b - a
        length = np.linalg.norm(d, axis=1)
        unit = np.divide(d, length[:, None], out=np.zeros_like(d), where=length[:, None] > 0)
        long = length > 0
        touches[rows[long]] = self.occluded(a[long] - self.touch * unit[long], unit[long], length[long] + 2 * self.touch)

        # Segments that graze the surface at their ends
        for ends in (a, b):
            missed = ~touches[rows]
            touches[rows[missed]] = self.on_surface(ends[missed].astype(np.float32))
        return touches

    def on_surface(self, points: F32) -> Bools:
        """Whether each point (n, 3) lies on a surface, but for rounding: three short rays along the axes, of which one meets any plane."""
        found = np.zeros(len(points), np.bool_)
        rows = np.flatnonzero(self.near(points, points))
        for axis in _AXES:
            rows = rows[~found[rows]]
            o = points[rows] - self.touch * axis
            found[rows] = self.occluded(o, np.broadcast_to(axis, o.shape), np.full(len(o), 2 * self.touch))
        return found

    def near(self, start: F32, end: F32) -> Bools:
        """Whether each closed segment passes through the bounds of all primitives, widened by ``touch``."""
        crosses = np.zeros(len(start), np.bool_)
        if len(self):
            low, high = self.bounds[0] - 2 * self.touch, self.bounds[1] + 2 * self.touch
            box_crosses(start, end, (low + high) / 2, _AXES, (high - low) / 2, crosses)
        return crosses


def inverse(to_world: F64) -> F64:
    """The inverses (n, 3, 4) of affine maps (n, 3, 4)."""
    linear = np.linalg.inv(to_world[:, :, :3]) if len(to_world) else to_world[:, :, :3]
    return np.concatenate([linear, -(linear @ to_world[:, :, 3:])], axis=2)


def _bounds(corners: F32, kinds: npt.NDArray[np.uint8], to_world: F64) -> tuple[F64, F64]:
    """The least and the largest coordinates, (3,) each, of all primitives; zeros where there is none."""
    points = [corners.reshape(-1, 3).astype(np.float64)]
    if len(kinds):
        # Spheres reach exactly as far as the rows of their matrices are long, the others no farther than the cube from -1 to 1.
        reach = np.where((kinds == 0)[:, None], np.linalg.norm(to_world[:, :, :3], axis=2), np.abs(to_world[:, :, :3]).sum(axis=2))
        points += [to_world[:, :, 3] - reach, to_world[:, :, 3] + reach]
    everything = np.concatenate(points)
    if not len(everything):
        return np.zeros(3), np.zeros(3)
    return everything.min(axis=0), everything.max(axis=0)
