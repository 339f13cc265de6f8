"""Bundled paths for the report: a picture of each top class of a ranking, and a model of all light that a person can turn."""

import pathlib

import numpy as np

from queries.run import Run
from viz.cameras import job_pose
from viz.description import View
from viz.pictures import finished, write_png
from viz.report.model import Eye, Model, Shape
from viz.report.picture import Picture
from viz.report.sections import DrawClass
from viz.scene_meshes import scene_meshes
from viz.stage import Stage
from viz.tools.bundles import Bundles
from viz.view import draw_view

CLASS_PATHS, CLASS_SIZE = 600, (640, 480)
_POINTS = 12  # of a curve of the model: a page is to open at once
_SURFACE, _LAMP = (0.62, 0.64, 0.68), (1.0, 0.86, 0.4)


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
    with Stage(run, size=(960, 720)) as stage:
        drawn = tool.draw(run, stage)
        pose = job_pose(run)
        picture = folder / "model.png"
        write_png(picture, finished(stage.picture(pose), drawn))
        background = stage.look.background_color
        # The curves keep the light that they have in the picture
        lines = [Shape(mesh, colors="color", line_width=1.5) for mesh in drawn.meshes.values()]
    surfaces = [Shape(thing.mesh, _LAMP if thing.emits else _SURFACE, opacity=0.9 if thing.emits else 0.12) for thing in scene_meshes(run)]
    angle = 2 * float(np.degrees(np.arctan(pose.tangents((960, 720))[1])))
    eye = Eye(pose.position, pose.target, pose.up, angle)
    return Model("light paths", drawn.caption, f"A model that can be turned: {drawn.caption}", [*lines, *surfaces], eye, picture, background)
