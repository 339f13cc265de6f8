"""Regions drawn on the film: brush strokes and polygons, projected on the surfaces that the camera sees there (thesis, section 9.4.2)."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from queries.kernels.regions import clip_segments, in_polygon, near_polyline, within
from queries.regions.base import F32, F64, Bools, Objects, Region, growth
from queries.regions.scene import SceneGeometry
from renderer.tables import NO_OBJECT

Pixel = tuple[float, float]
CONTACT = 1e-4  # what lies so little before a vertex, as a share of its distance from the camera, does not hide it


class Sketch(Region):
    """The parts of surfaces that are seen within a shape on the film.

    A vertex is inside where it lies on a surface, is seen within the shape and within the clipping distances, and nothing lies between it and
    the camera (glass hides what is behind it). A thin lens sees from its center.
    """

    @abstractmethod
    def bounds(self) -> tuple[F64, F64]:
        """The least and the largest film position (2,) of the shape, pixels."""

    @abstractmethod
    def draw(self, raster: F64, inside: Bools) -> None:
        """Set ``inside`` (n,) where film positions (n, 2) lie within the shape."""

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        drawn = self._drawn(scene, points)
        drawn &= np.asarray(objects != NO_OBJECT)
        rows = np.flatnonzero(drawn)
        drawn[rows] = visible(scene, points[rows])
        return drawn

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        crosses = np.zeros(len(start), np.bool_)
        parts = np.empty((len(start), 2))
        clip_segments(start, end, scene.camera.frustum(*self.bounds()), parts)
        rows = np.flatnonzero(parts[:, 0] <= parts[:, 1])

        # Ends on a surface
        for ends in (start, end):
            rows = rows[~crosses[rows]]
            drawn = rows[self._drawn(scene, ends[rows])]
            drawn = drawn[scene.caster.on_surface(ends[drawn])]
            crosses[drawn] = visible(scene, ends[drawn])

        # Surfaces on the way
        rows = rows[~crosses[rows]]
        o = start[rows].astype(np.float64)
        d = end[rows] - o
        moving = np.any(d != 0, axis=1)
        rows, o, d = rows[moving], o[moving], d[moving]
        for found, t, _ in scene.caster.all_hits(o, d, parts[rows, 0], parts[rows, 1]):
            points = (o[found] + t[:, None] * d[found]).astype(np.float32)
            drawn = np.flatnonzero(self._drawn(scene, points))
            crosses[rows[found[drawn]]] |= visible(scene, points[drawn])
        return crosses

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``."""
        if scene is not None:
            _ = scene.camera, scene.caster

    def _drawn(self, scene: SceneGeometry, points: F32) -> Bools:
        """Whether points before the camera are seen within the shape, or would be if nothing hid them."""
        raster, drawn = scene.camera.raster(points)
        low, high = self.bounds()
        within(raster, low[0], low[1], high[0], high[1], drawn)
        rows = np.flatnonzero(drawn)
        inside = np.zeros(len(rows), np.bool_)
        self.draw(raster[rows], inside)
        drawn[rows] = inside
        return drawn


def visible(scene: SceneGeometry, points: F32) -> Bools:
    """Whether nothing lies between the camera's near clipping plane and each point (n, 3) beyond it.

    Distances are compared up to ``CONTACT``: the surface of a point does not hide it, where it was rounded.
    """
    camera = scene.camera
    d = points - camera.origin
    near = camera.near / (d @ camera.optical_axis)
    start = camera.origin + near[:, None] * d
    return ~scene.occluded(start.astype(np.float32), d.astype(np.float32), ((1 - CONTACT) - near).astype(np.float32))


@dataclass(frozen=True)
class Polygon(Sketch):
    """All that is seen within polygons on the film, pixels: what lies in one of them, each taken by the even-odd rule."""

    loops: tuple[tuple[Pixel, ...], ...]

    def bounds(self) -> tuple[F64, F64]:
        """See ``Sketch``."""
        corners = np.concatenate(self.loops)
        return corners.min(axis=0), corners.max(axis=0)

    def draw(self, raster: F64, inside: Bools) -> None:
        """See ``Sketch``."""
        for loop in self.loops:
            in_polygon(raster, np.array(loop, np.float64), inside)

    def enlarged(self, factor: float = 1.5) -> "Polygon":
        """The polygons and the same ones scaled about the center of their bounds."""
        center = np.mean(self.bounds(), axis=0)
        growth(factor)
        scaled = (tuple((float(x), float(y)) for x, y in center + factor * (np.array(loop) - center)) for loop in self.loops)
        return Polygon(tuple(dict.fromkeys((*self.loops, *scaled))))

    def describe(self) -> str:
        """See ``Region``."""
        low, high = self.bounds()
        return f"what is seen within a polygon between pixels ({low[0]:.6g}, {low[1]:.6g}) and ({high[0]:.6g}, {high[1]:.6g})"


@dataclass(frozen=True)
class Stroke(Sketch):
    """All that is seen within ``radius`` of a polyline on the film, pixels."""

    points: tuple[Pixel, ...]
    radius: float

    def bounds(self) -> tuple[F64, F64]:
        """See ``Sketch``."""
        corners = np.array(self.points, np.float64)
        return corners.min(axis=0) - self.radius, corners.max(axis=0) + self.radius

    def draw(self, raster: F64, inside: Bools) -> None:
        """See ``Sketch``."""
        near_polyline(raster, np.array(self.points, np.float64), float(self.radius), inside)

    def enlarged(self, factor: float = 1.5) -> "Stroke":
        """The same stroke of a wider brush."""
        return Stroke(self.points, self.radius * growth(factor))

    def describe(self) -> str:
        """See ``Region``."""
        (x, y), others = self.points[0], len(self.points) - 1
        way = f" and on through {others} more point{'s' * (others > 1)}" if others else ""
        return f"what is seen under a stroke of radius {self.radius:.6g} pixels at ({x:.6g}, {y:.6g}){way}"
