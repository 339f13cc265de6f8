"""The run's camera: where on the film a point is seen."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from queries.errors import QueryError
from queries.kernels.regions import project
from queries.regions.base import F32, F64, Bools


@dataclass(frozen=True, eq=False)
class Camera:
    """A perspective camera. A thin lens is taken at its center: what is out of focus is seen there, without its blur.

    ``origin`` (3,) world position of the lens's center; ``to_camera`` (3, 4) float64, from the world to the space in which the camera
    looks along +z, x to the left and y up; ``film`` (8,) float64: tangents of half the angles of view, shifts of the principal point as
    shares of the film, width and height in pixels, near and far clipping distances.
    """

    origin: F64
    to_camera: F64
    film: F64

    @property
    def near(self) -> float:
        """The near clipping distance, world units."""
        return float(self.film[6])

    @property
    def optical_axis(self) -> F64:
        """The unit direction in which the camera looks."""
        return self.to_camera[2, :3]

    def project(self, points: F32) -> tuple[F64, F64, Bools]:
        """Film positions x and y (n,) in pixels, float64, of points (n, 3), and whether they lie before the camera, within its clipping distances.

        Positions of points that do not are meaningless.
        """
        raster, before = self.raster(points)
        return raster[:, 0], raster[:, 1], before

    def raster(self, points: F32) -> tuple[F64, Bools]:
        """As ``project``, with positions as one array (n, 2)."""
        raster, before = np.empty((len(points), 2)), np.empty(len(points), np.bool_)
        project(points, self.to_camera, self.film, raster, before)
        return raster, before

    def rays(self, raster: F64) -> F32:
        """Unit directions (n, 3), world, from ``origin`` through film positions (n, 2) in pixels: what ``raster`` undoes."""
        tangents, shifts, size = self.film[0:2], self.film[2:4], self.film[4:6]
        across = tangents * (1 - 2 * (raster / size + shifts))
        local = np.column_stack([across, np.ones(len(across))])
        # rows of an orthonormal matrix: its inverse is its transpose
        world: F32 = (local @ self.to_camera[:, :3] / np.linalg.norm(local, axis=1, keepdims=True)).astype(np.float32)
        return world

    def frustum(self, low: F64, high: F64) -> F64:
        """The planes (6, 4), inner side positive, around all that is before the camera and seen between film positions ``low`` and ``high`` (2,)."""
        tangents, shifts, size = self.film[0:2], self.film[2:4], self.film[4:6]
        most, least = (tangents * (1 - 2 * (corner / size + shifts)) for corner in (low, high))
        near, far = self.film[6:8]
        planes = [[-1, 0, most[0], 0], [1, 0, -least[0], 0], [0, -1, most[1], 0], [0, 1, -least[1], 0], [0, 0, 1, -near], [0, 0, -1, far]]
        world: F64 = np.array(planes) @ np.vstack([self.to_camera, [0, 0, 0, 1]])
        return world


def camera_of(description: dict[str, Any] | None) -> Camera:
    """The camera that a run's manifest describes. Raises QueryError for a run without one."""
    if not description:
        raise QueryError("this run does not say where its camera is, which regions drawn on the film need: render it again")
    try:
        names = ("tan_x", "tan_y", "shift_x", "shift_y", "width", "height", "near", "far")
        film = np.array([description[name] for name in names], np.float64)
        to_world = np.array(description["to_world"], np.float64).reshape(3, 4)
        to_camera = np.array(description["to_camera"], np.float64).reshape(3, 4)
    except (KeyError, TypeError, ValueError) as error:
        raise QueryError(f"the run's camera cannot be read ({type(error).__name__}: {error}): render the run again") from None
    return Camera(to_world[:, 3].copy(), to_camera, film)
