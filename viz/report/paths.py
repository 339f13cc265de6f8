"""Bundled paths for the report: a picture of each top class of a ranking, and a model of all light that a person can turn."""

import pathlib
from typing import TYPE_CHECKING

import numpy as np

from queries.run import Run
from viz.bundles.banks import shade
from viz.bundles.layers import ON_DARK
from viz.cameras import Pose, job_pose
from viz.description import View
from viz.pictures import finished, write_png
from viz.report.model import Model, Shape
from viz.report.picture import Picture
from viz.report.scene import scene_model
from viz.report.sections import DrawClass
from viz.stage import Stage
from viz.tools.bundles import Bundles
from viz.view import draw_view

if TYPE_CHECKING:
    import pyvista

CLASS_PATHS, CLASS_SIZE = 600, (640, 480)
_POINTS = 12  # of a curve of the model: a page is to open at once


def draw_classes(run: Run, folder: pathlib.Path) -> DrawClass:
    """A function that draws the paths of a class into ``folder``, given a name and the expression that selects them."""

    def draw(name: str, expression: str) -> Picture | None:
        view = View(bundles=Bundles(expression=expression, dialect="std", most=CLASS_PATHS), size=CLASS_SIZE)
        drawn = draw_view(run, view, folder, name)
        return Picture(name, drawn.caption, f"Bundled light paths: {drawn.caption}", drawn.files["png"], drawn.figures)

    return draw


def model_of_paths(run: Run, paths: int, folder: pathlib.Path) -> Model:
    """So many paths of the run as bundled curves inside its scene, to be turned; its picture is written into ``folder``."""
    tool = Bundles(most=paths, points=_POINTS)
    picture = folder / "model.png"
    pose = job_pose(run)
    with Stage(run) as stage:
        drawn = tool.draw(run, stage)
        write_png(picture, finished(stage.picture(pose), drawn))
    for mesh in drawn.meshes.values():
        _light(mesh, pose)
    lines = [Shape(mesh, colors="color") for mesh in drawn.meshes.values()]
    return scene_model(run, "light paths", lines, drawn.caption, f"Light paths in the scene. {drawn.caption}", picture)


def _light(mesh: "pyvista.PolyData", pose: Pose) -> None:
    """Light the curves of a mesh as they are seen from a pose: the viewer draws lines of plain colors."""
    curves = np.asarray(mesh.points, np.float32).reshape(-1, _POINTS, 3)
    colors = np.asarray(mesh.point_data["color"], np.float32).reshape(curves.shape)[:, 0] / np.float32(255)
    lit = np.empty(curves.shape, np.uint8)
    shade(curves, colors, np.asarray(pose.position), ON_DARK.toward(pose.axes), ON_DARK, lit)
    mesh.point_data["color"] = lit.reshape(-1, 3)
