"""The contract of a sensor: rays for camera walks, and the importance that it gives to points that a light walk reaches.

Film coordinates are in pixels, x to the right, y down, (0, 0) the upper left corner. Importance is normalized so that a
pixel's value is the mean radiance over it (box filter).
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.math.vec import Vec3


class Sensor(NamedTuple):
    """A perspective camera. In camera space it looks along +z, x to the left and y up (Mitsuba's convention)."""

    to_world: npt.NDArray[np.float32]  # (3, 4) rigid (scale removed)
    to_camera: npt.NDArray[np.float32]  # (3, 4) its inverse
    tan_x: Any  # float32, tangent of half the horizontal angle of view
    tan_y: Any  # float32
    shift_x: Any  # float32, principal point offset, as a share of the film's width
    shift_y: Any
    width: Any  # int32, pixels
    height: Any
    near: Any  # float32, clipping distances, world units
    far: Any
    lens_radius: Any | None  # float32, world units; None: a pinhole
    focus: Any | None  # float32, focus distance, world units; None: a pinhole


class LensSample(NamedTuple):
    """A point of the lens seen from a point of the scene."""

    visible: Any  # bool: inside the film and the clipping range
    point: Vec3  # on the lens
    d: Vec3  # unit, from the scene point to the lens
    distance: Any  # float32
    importance: Any  # float32: We cos / distance² over the density of the lens point. The mean over light walks of f cos beta
    # times it, summed where it lands, is a pixel's value; zero where it is not visible
    raster_x: Any  # float32, strictly inside the film
    raster_y: Any
    free: Any  # float32, the distance that must be free: to the near clipping plane, where camera rays start
