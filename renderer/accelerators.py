"""Closest hits and occlusion over a list of accelerators: triangles by embree or in a flat list, exact quadrics beside them."""

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from renderer.scene.arrays import Scene
from renderer.shapes.flat import BLOCK, FLAT_LIMIT, ROWS, closest_flat, flat_triangles, occluded_flat
from renderer.shapes.quadrics import intersect_quadrics, occluded_quadrics
from renderer.shapes.surface import plane_distances

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]


class Accelerators:
    """Answers of rays against one scene. Safe to share between threads; queries release the GIL.

    ``flat_limit``: up to how many triangles are kept in a flat list rather than in embree's tree.
    """

    def __init__(self, scene: Scene, flat_limit: int = FLAT_LIMIT) -> None:
        self.geometry = geometry = scene.arrays.geometry
        self.triangles = len(geometry.p0)
        self.quadrics = geometry.quadrics
        self.flat: F32 | None = None
        if self.triangles <= flat_limit:
            self.flat = flat_triangles(geometry.p0, geometry.e1, geometry.e2)
        else:
            self.embree = EmbreeScene()
            TriangleMesh(self.embree, np.ascontiguousarray(scene.vertices, np.float32), np.ascontiguousarray(scene.triangles, np.int32))

    def closest(self, o: F32, d: F32, t: F32) -> I32:
        """The primitive that each ray meets first, -1 where none; ``t`` holds the far ends and receives the distances.

        ``o`` and ``d`` are (n, 3), ``t`` is (n,); distances are in units of |d|.
        """
        if self.flat is not None:
            primitive = np.empty(len(o), np.int32)
            closest_flat(self.flat, o, d, t, primitive, len(o), np.empty(ROWS * BLOCK, np.float32))
        else:
            # embreex fills in distances only with four more arrays that nobody needs: compute them from the planes
            primitive = self.embree.run(o, d, dists=t, query="INTERSECT")
            plane_distances(self.geometry.p0, self.geometry.ng, primitive, o, d, t, len(o))
        if self.quadrics is not None:
            intersect_quadrics(self.quadrics, self.triangles, o, d, t, primitive, len(o))
        return primitive

    def occluded(self, o: F32, d: F32, far: F32) -> I32:
        """0 where something lies between o and o + far d, -1 where the way is free."""
        if self.flat is not None:
            blocked = np.empty(len(o), np.int32)
            occluded_flat(self.flat, o, d, far, blocked, len(o), np.empty(ROWS * BLOCK, np.float32))
        else:
            blocked = self.embree.run(o, d, dists=far.copy(), query="OCCLUDED")
        if self.quadrics is not None:
            occluded_quadrics(self.quadrics, self.triangles, o, d, far, blocked, len(o))
        return blocked
