"""Closest hits and occlusion over a list of accelerators: embree for triangles, exact quadrics beside it."""

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from renderer.scene.arrays import Scene
from renderer.shapes.quadrics import intersect_quadrics, occluded_quadrics

FAR = np.float32(1e30)  # beyond any scene; embree wants a finite distance


class Accelerators:
    """Answers of rays against one scene. Safe to share between threads; queries release the GIL."""

    def __init__(self, scene: Scene) -> None:
        self.triangles = len(scene.triangles)
        self.quadrics = scene.arrays.geometry.quadrics
        self.embree = EmbreeScene()
        if self.triangles:
            TriangleMesh(self.embree, np.ascontiguousarray(scene.vertices, np.float32), np.ascontiguousarray(scene.triangles, np.int32))

    def closest(self, o: npt.NDArray[np.float32], d: npt.NDArray[np.float32], t: npt.NDArray[np.float32]) -> npt.NDArray[np.int32]:
        """The primitive that each ray meets first, -1 where none; ``t`` holds the far ends and receives the distances.

        ``o`` and ``d`` are (n, 3), ``t`` is (n,); distances are in units of |d|.
        """
        if self.triangles:
            primitive = self.embree.run(o, d, dists=t, query="INTERSECT")
        else:
            primitive = np.full(len(o), -1, np.int32)
        if self.quadrics is not None:
            intersect_quadrics(self.quadrics, self.triangles, o, d, t, primitive, len(o))
        return primitive  # type: ignore[no-any-return]

    def occluded(self, o: npt.NDArray[np.float32], d: npt.NDArray[np.float32], far: npt.NDArray[np.float32]) -> npt.NDArray[np.int32]:
        """0 where something lies between o and o + far d, -1 where the way is free."""
        if self.triangles:
            blocked = self.embree.run(o, d, dists=far.copy(), query="OCCLUDED")
        else:
            blocked = np.full(len(o), -1, np.int32)
        if self.quadrics is not None:
            occluded_quadrics(self.quadrics, self.triangles, o, d, far, blocked, len(o))
        return blocked  # type: ignore[no-any-return]
