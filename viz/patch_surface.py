"""Patches of surfaces on a stage, colored by a number for each: smooth within smooth parts of an object, or one color for each patch."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from viz.scene.meshes import SceneMesh
from viz.scene.outlines import creased, face_normals
from viz.scene.shell import walls

if TYPE_CHECKING:
    import pyvista

    from queries.patches import Patches
    from viz.cameras import Pose
    from viz.stage import Stage

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.floating[Any]]
_GRID_BITS = 20  # corners that fall into the same of so many steps along the scene are one point


class PatchSurface:
    """Triangles that draw patches, with a number at each corner of each: (t, 3) from ``interpolated`` or ``flat``.

    ``add`` puts them on a stage. Walls that stand between an eye outside and the inside are left out, unless the look is solid, and so is what its
    ``cut`` takes away.
    """

    def __init__(self, patches: "Patches") -> None:
        self.patches = patches
        self.corners = patches.corners.astype(np.float64)
        self.object = patches.object[patches.patch]

    def flat(self, values: Floats) -> F64:
        """Each patch's value at all of its corners."""
        return np.repeat(np.asarray(values, np.float64)[self.patches.patch][:, None], 3, axis=1)

    def interpolated(self, values: Floats) -> F64:
        """At each point the mean of the patches that meet there, by area, of the same smooth part of an object."""
        found = self.flat(values)
        for _, rows, points, triangles in self._parts():
            corner = creased(points, triangles).triangles
            size = np.linalg.norm(face_normals(points, triangles), axis=1)
            weight, total = (np.zeros(int(corner.max(initial=-1)) + 1) for _ in range(2))
            np.add.at(weight, corner, size[:, None])
            np.add.at(total, corner, size[:, None] * found[rows])
            found[rows] = np.divide(total, weight, out=np.zeros_like(total), where=weight > 0)[corner]
        return found

    def add(self, stage: "Stage", shares: F64, colors: U8) -> None:
        """Draw, with places (t, 3) on a map of 256 colors (256, 3), 0 … 1, at the corners: without shading, since colors are numbers."""
        import pyvista
        from matplotlib.colors import ListedColormap

        mesh: Any = pyvista.PolyData(self.corners.reshape(-1, 3), self._faces(np.arange(len(self.corners))))
        mesh.point_data["share"] = shares.reshape(-1)
        actor = stage.add(
            mesh, scalars="share", cmap=ListedColormap(colors / 255.0), clim=(0.0, 1.0), n_colors=256, interpolate_before_map=True, lighting=False
        )
        # Lines of the scene lie on these surfaces, and are to be seen
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(1.0, 1.0)
        if stage.look.cut is not None:
            from viz.scene.actors import clipping_plane

            actor.mapper.AddClippingPlane(clipping_plane(stage.look))
        elif stage.look.scene != "solid":
            outward, middle = self._outward(), self.corners.mean(axis=1)

            def open_toward(pose: "Pose") -> None:
                before = ((np.array(pose.position) - middle) * outward).sum(axis=1) > 0
                mesh.faces = self._faces(np.flatnonzero(~before))

            stage.before_picture.append(open_toward)

    def mesh(self, attributes: dict[str, npt.NDArray[Any]]) -> "pyvista.PolyData":
        """What to export: the triangles with these attributes of their patches, beside the ``patch`` itself, its ``object`` and ``area``."""
        import pyvista

        found = pyvista.PolyData(self.patches.corners.reshape(-1, 3), self._faces(np.arange(len(self.corners))))
        mine: dict[str, npt.NDArray[Any]] = {"patch": np.arange(len(self.patches)), "object": self.patches.object, "area": self.patches.area}
        for name, values in (mine | attributes).items():
            found.cell_data[name] = values[self.patches.patch]
        return found

    def _parts(self) -> list[tuple[int, I64, F64, I64]]:
        """For each object its key, the rows of its triangles, and these as points and indices."""
        low = self.corners.reshape(-1, 3).min(axis=0, initial=np.inf)
        step = np.ptp(self.corners.reshape(-1, 3), axis=0).max(initial=0.0) / ((1 << _GRID_BITS) - 1) if len(self.corners) else 1.0
        found = []
        for key in np.unique(self.object):
            rows = np.flatnonzero(self.object == key)
            flat = self.corners[rows].reshape(-1, 3)
            x, y, z = np.rint((flat - low) / (step or 1.0)).astype(np.int64).T
            _, first, index = np.unique((x << 2 * _GRID_BITS) | (y << _GRID_BITS) | z, return_index=True, return_inverse=True)
            found.append((int(key), rows, flat[first], index.reshape(-1, 3)))
        return found

    def _outward(self) -> F64:
        """Outward normals (t, 3) of triangles that are walls of the whole scene, 0 for the rest."""
        parts = self._parts()
        found = np.zeros((len(self.corners), 3))
        for (_, rows, _, _), outward in zip(parts, walls([SceneMesh(key, "", "", False, points, triangles) for key, _, points, triangles in parts])):
            found[rows] = outward
        return found

    def _faces(self, rows: I64) -> I64:
        return np.column_stack([np.full(len(rows), 3), 3 * rows[:, None] + np.arange(3)]).ravel()
