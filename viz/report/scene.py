"""A run's scene as a model: translucent surfaces with their edges, around whatever is shown in them, first seen by the job's camera."""

import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from viz.report.model import Color, Eye, Model, Shape

if TYPE_CHECKING:
    from queries.run import Run

SURFACE: Color = (0.66, 0.69, 0.75)
LAMP: Color = (1.0, 0.92, 0.68)
EDGE: Color = (0.52, 0.56, 0.64)
_WALL_OPACITY, _OPACITY, _LAMP_OPACITY, _EDGE_OPACITY = 0.07, 0.22, 0.8, 0.7


def scene_model(
    run: "Run", name: str, shapes: Sequence[Shape], caption: str, alt: str, picture: pathlib.Path | None = None, eye: Eye | None = None
) -> Model:
    """A model of some light (``shapes``) in the run's scene; ``eye``: where it is first seen from (None: the job's camera).

    Raises ``QueryError`` for a run that does not store its surfaces.
    """
    return Model(name, caption, alt, [*scene_shapes(run), *shapes], eye or job_eye(run), picture)


def job_eye(run: "Run") -> Eye:
    """The job's camera; a model is turned around the point that it looks at, so that is moved to the depth of the scene's middle."""
    from viz.cameras import job_pose
    from viz.scene.meshes import scene_meshes

    pose = job_pose(run)
    points = np.concatenate([np.empty((0, 3)), *(mesh.points for mesh in scene_meshes(run))])
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(3), np.ones(3))
    forward = pose.axes[2]
    depth = max(float(((low + high) / 2 - pose.position) @ forward), 0.1 * float(np.linalg.norm(high - low)))
    x, y, z = (np.asarray(pose.position) + depth * forward).tolist()
    return Eye(pose.position, (x, y, z), pose.up, pose.angle)


def scene_shapes(run: "Run") -> list[Shape]:
    """The scene's surfaces and the edges of its objects; walls, which hold the rest, are the most translucent."""
    import pyvista

    from viz.scene.meshes import scene_meshes
    from viz.scene.outlines import creased
    from viz.scene.shell import walls

    meshes = list(scene_meshes(run))
    shapes, edges = [], []
    for mesh, outer in zip(meshes, walls(meshes), strict=True):
        opacity = _LAMP_OPACITY if mesh.emits else _WALL_OPACITY if bool(np.any(outer)) else _OPACITY
        shapes.append(Shape(mesh.mesh, LAMP if mesh.emits else SURFACE, opacity=opacity, shines=mesh.emits))
        edges.append(creased(mesh.points, mesh.triangles).edges)
    ends = np.concatenate(edges).reshape(-1, 3) if edges else np.empty((0, 3))
    lines = np.column_stack([np.full(len(ends) // 2, 2), np.arange(len(ends)).reshape(-1, 2)])
    return [Shape(pyvista.PolyData(ends, lines=lines.ravel()), EDGE, opacity=_EDGE_OPACITY), *shapes] if len(ends) else shapes
