"""Bundled curves on a stage: lit for the eye of each picture, as wide and as opaque as their light asks for."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from viz.bundles.banks import Lighting, shade
from viz.bundles.polylines import polyline_mesh, recolored

if TYPE_CHECKING:
    from viz.cameras import Pose
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]

ON_DARK = Lighting()
ON_LIGHT = Lighting(ambient=0.45, diffuse=0.5, specular=0.1)  # lines darker than their ground


class CurveLayer:
    """Curves (s, points, 3) of colors (s, 3) sRGB and opacities (s), 0 … 1, lines of ``width`` pixels."""

    def __init__(self, stage: "Stage", curves: F32, colors: F32, opacity: F32, width: float) -> None:
        self._curves, self._colors = curves, colors
        self._lighting = ON_DARK if stage.look.dark else ON_LIGHT
        opaque = bool((opacity >= 1).all())
        self._shaded: U8 = np.empty((*curves.shape[:2], 3 if opaque else 4), np.uint8)
        if not opaque:
            self._shaded[:, :, 3] = np.rint(255 * opacity)[:, None]
        self._mesh = polyline_mesh(curves, self._shaded)
        actor = stage.add(self._mesh, scalars="color", rgb=True, lighting=False, line_width=width)
        if not opaque:
            actor.ForceTranslucentOn()
        stage.before_picture.append(self.light)

    def light(self, pose: "Pose") -> None:
        """Light the curves as seen from here."""
        eye = np.asarray(pose.position, np.float64)
        shade(self._curves, self._colors, eye, self._lighting.toward(pose.axes), self._lighting, self._shaded)
        recolored(self._mesh)
