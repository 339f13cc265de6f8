"""The scene on a stage: its surfaces as the look asks for, sorted for the eye, with their edges and outlines."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from viz.cameras import Pose
from viz.look import Look
from viz.scene.meshes import scene_meshes
from viz.scene.outlines import creased, outlines
from viz.scene.shell import walls

if TYPE_CHECKING:
    from queries.run import Run

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

_GLASS = {True: (0.62, 0.65, 0.70), False: (0.50, 0.53, 0.58)}  # translucent surfaces, on dark backgrounds and on light ones
_SOLID = {True: (0.47, 0.49, 0.53), False: (0.80, 0.82, 0.85)}  # opaque ones: lines drawn on them stand out as on the background
_LAMP = (1.0, 0.92, 0.68)
_LINE = {True: (0.62, 0.66, 0.74), False: (0.30, 0.33, 0.38)}
_LINE_OPACITY = {"translucent": 0.55, "solid": 0.5, "cut": 0.5, "silhouette": 0.9}
_SHADING = {True: {"ambient": 0.3, "diffuse": 0.75}, False: {"ambient": 0.55, "diffuse": 0.5}}  # paper has no dark rooms
_FRONT = 0.25  # how opaque walls before the scene are, as a share of the rest
_LAMP_OPACITY = 0.75  # at least, of translucent lamps


class SceneActors:
    """Surfaces, lamps and lines of a scene, on a plotter. ``prepare`` makes them ready for a pose."""

    def __init__(self, run: "Run", look: Look, plotter: Any) -> None:
        meshes = [mesh for mesh in scene_meshes(run) if mesh.name not in look.hide]
        outer = walls(meshes)
        surfaces = [creased(mesh.points, mesh.triangles) for mesh in meshes]
        self.look = look
        self.surfaces = surfaces
        self.edges = np.concatenate([surface.edges for surface in surfaces]) if surfaces else np.empty((0, 2, 3))
        self.solids = [_Surface(plotter, look, emits) for emits in (False, True)] if look.scene != "silhouette" else []
        for solid in self.solids:
            mine = [i for i, mesh in enumerate(meshes) if mesh.emits == solid.emits]
            solid.fill([surfaces[i] for i in mine], [outer[i] for i in mine])
        self.lines = _Lines(plotter, look)

    def show_surfaces(self, shown: bool) -> None:
        """Whether surfaces are drawn, lamps too, beside edges and outlines."""
        for solid in self.solids:
            solid.wanted = shown

    def prepare(self, pose: Pose) -> None:
        """Choose, sort and color triangles, and find outlines, for this eye."""
        eye = np.array(pose.position)
        for solid in self.solids:
            solid.prepare(eye, pose.axes[2])
        self.lines.show([self.edges, *(outlines(surface, eye) for surface in self.surfaces)])


class _Surface:
    """Triangles of one actor."""

    def __init__(self, plotter: Any, look: Look, emits: bool) -> None:
        import pyvista

        self.look, self.emits = look, emits
        self.wanted = True
        self.mesh = pyvista.PolyData()
        self.plotter = plotter
        self.translucent = look.scene == "translucent"
        self.color = _LAMP if emits else (_GLASS if self.translucent else _SOLID)[look.dark]
        self.opacity = max(look.opacity, _LAMP_OPACITY) if emits else look.opacity

    def fill(self, surfaces: list[Any], outer: list[F64]) -> None:
        """Take the triangles of some surfaces, and the outward normals of those that are walls."""
        offsets = np.cumsum([0] + [len(surface.points) for surface in surfaces])
        self.points = np.concatenate([np.empty((0, 3)), *(surface.points for surface in surfaces)])
        self.triangles = np.concatenate([np.empty((0, 3), np.int64), *(s.triangles + offset for s, offset in zip(surfaces, offsets))])
        self.outer = np.concatenate([np.empty((0, 3)), *outer])
        normals = np.concatenate([np.empty((0, 3)), *(surface.normals for surface in surfaces)])
        if not len(self.triangles):
            return
        self.middle = self.points[self.triangles].mean(axis=1)
        self.mesh.points = self.points
        self.mesh.point_data["Normals"] = normals
        self.mesh.point_data.active_normals_name = "Normals"
        self.mesh.faces = np.column_stack([np.full(len(self.triangles), 3), self.triangles]).ravel()
        self.mesh.cell_data["color"] = self._colors(np.ones(len(self.triangles)))
        shading = {"lighting": False} if self.emits else _SHADING[self.look.dark] | {"specular": 0.0, "smooth_shading": True}
        self.actor = actor = self.plotter.add_mesh(
            self.mesh, scalars="color", rgb=True, copy_mesh=False, show_scalar_bar=False, reset_camera=False, render=False, **shading
        )
        actor.SetForceTranslucent(self.translucent)
        actor.SetForceOpaque(not self.translucent)
        if self.look.cut is not None:
            actor.mapper.AddClippingPlane(clipping_plane(self.look))

    def prepare(self, eye: F64, forward: F64) -> None:
        """The triangles that this eye is shown, far ones first: translucent ones are blended in this order."""
        if not len(self.triangles):
            return
        before = ((eye - self.middle) * self.outer).sum(axis=1) > 0
        shown = np.arange(len(self.triangles))
        opacity = np.where(before, _FRONT, 1.0) * self.opacity
        if self.look.scene == "cut" and self.look.cut is None:
            shown = shown[~before]
        if self.translucent:
            shown = shown[np.argsort(-((self.middle[shown] - eye) @ forward), kind="stable")]
        self.actor.visibility = self.wanted and len(shown) > 0
        if not self.actor.visibility:
            return
        self.mesh.cell_data.clear()
        self.mesh.faces = np.column_stack([np.full(len(shown), 3), self.triangles[shown]]).ravel()
        self.mesh.cell_data["color"] = self._colors(opacity[shown])
        self.mesh.cell_data.active_scalars_name = "color"

    def _colors(self, opacity: F64) -> npt.NDArray[np.uint8]:
        """Colors (k, 3) of triangles, (k, 4) of translucent ones."""
        colors = np.tile(np.array([*self.color, 1.0]), (len(opacity), 1))
        colors[:, 3] = opacity
        return np.round(colors[:, : 4 if self.translucent else 3] * 255).astype(np.uint8)


class _Lines:
    """Edges and outlines."""

    def __init__(self, plotter: Any, look: Look) -> None:
        import pyvista

        self.mesh = pyvista.PolyData()
        self.actor: Any = None
        self.plotter, self.look = plotter, look

    def show(self, parts: list[F64]) -> None:
        """Draw these segments, (k, 2, 3) each."""
        segments = np.concatenate(parts)
        count = len(segments)
        self.mesh.points = segments.reshape(-1, 3)
        self.mesh.lines = np.column_stack([np.full(count, 2), np.arange(2 * count).reshape(-1, 2)]).ravel()
        if self.actor is None and count:
            self.actor = self.plotter.add_mesh(
                self.mesh, color=_LINE[self.look.dark], opacity=_LINE_OPACITY[self.look.scene], line_width=1.2, lighting=False,
                copy_mesh=False, show_scalar_bar=False, reset_camera=False, render=False,
            )  # fmt: skip
            if self.look.cut is not None:
                self.actor.mapper.AddClippingPlane(clipping_plane(self.look))


def clipping_plane(look: Look) -> Any:
    """The look's cut, for a mapper: VTK keeps what is on the side of a plane to which its normal points."""
    from vtkmodules.vtkCommonDataModel import vtkPlane

    assert look.cut is not None
    plane = vtkPlane()
    plane.SetOrigin(look.cut.point)
    plane.SetNormal([-value for value in look.cut.normal])
    return plane
