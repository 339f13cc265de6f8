"""Regions of space: balls, boxes, and closed meshes from files."""

import pathlib
from dataclasses import dataclass

import numpy as np

from queries.errors import QueryError
from queries.kernels.regions import ball_contains, ball_crosses, box_contains, box_crosses
from queries.regions.base import F32, F64, Bools, Objects, Point, Region, growth, triple
from queries.regions.closed import Solid
from queries.regions.grown import Centered
from queries.regions.scene import SceneGeometry

_MESH_FILES = (".ply", ".obj", ".stl", ".off")


@dataclass(frozen=True)
class Sphere(Region):
    """A ball: ``center`` and ``radius``, world units."""

    center: Point
    radius: float

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        inside = np.empty(len(points), np.bool_)
        ball_contains(points, np.array(self.center, np.float64), float(self.radius), inside)
        return inside

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        crosses = np.empty(len(start), np.bool_)
        ball_crosses(start, end, np.array(self.center, np.float64), float(self.radius), crosses)
        return crosses

    def enlarged(self, factor: float = 1.5) -> "Sphere":
        """The ball of a larger radius."""
        return Sphere(self.center, self.radius * growth(factor))

    def describe(self) -> str:
        """See ``Region``."""
        return f"the ball of radius {self.radius:.6g} around {triple(self.center)}"


@dataclass(frozen=True)
class Box(Region):
    """A box: ``center`` and ``size`` (lengths of its sides), world units, turned about its center.

    ``axis`` (any length but 0) and ``angle`` (degrees, counterclockwise as seen from the axis's tip) say how.
    """

    center: Point
    size: Point
    axis: Point = (0.0, 0.0, 1.0)
    angle: float = 0.0

    def axes(self) -> F64:
        """The box's unit axes (3, 3), one in each row (Rodrigues' formula)."""
        axis = np.array(self.axis, np.float64) / np.max(np.abs(self.axis))
        x, y, z = axis / np.linalg.norm(axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = np.deg2rad(self.angle)
        rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
        return np.ascontiguousarray(rotation.T)

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        inside = np.empty(len(points), np.bool_)
        box_contains(points, np.array(self.center, np.float64), self.axes(), np.array(self.size, np.float64) / 2, inside)
        return inside

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        crosses = np.empty(len(start), np.bool_)
        box_crosses(start, end, np.array(self.center, np.float64), self.axes(), np.array(self.size, np.float64) / 2, crosses)
        return crosses

    def enlarged(self, factor: float = 1.5) -> "Box":
        """The box of longer sides."""
        x, y, z = self.size
        growth(factor)
        return Box(self.center, (x * factor, y * factor, z * factor), self.axis, self.angle)

    def describe(self) -> str:
        """See ``Region``."""
        turned = f", turned by {self.angle:.6g}° about {triple(self.axis)}" if self.angle else ""
        return f"the box of size {triple(self.size)} around {triple(self.center)}{turned}"


@dataclass(frozen=True)
class Mesh(Centered):
    """What a closed mesh encloses: a file, its ``scale`` to world units, and what is added after that.

    The file is read when the region is first used, and once for each scene. Points on the mesh, up to rounding, may come out either way.
    """

    file: pathlib.Path
    scale: float = 1.0
    translate: Point = (0.0, 0.0, 0.0)

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        return self._solid(scene).inside(points)

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        return self._solid(scene).crosses(start, end)

    def center(self, scene: SceneGeometry) -> F64:
        """The center of the mesh's bounds."""
        return np.asarray(self._solid(scene).bounds.mean(axis=0))

    def describe(self) -> str:
        """See ``Region``."""
        return f"the inside of {self.file.name}"

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``: reads the file."""
        if scene is None:
            self._read()
        else:
            self._solid(scene)

    def _solid(self, scene: SceneGeometry) -> Solid:
        return scene.once(self, self._read)

    def _read(self) -> Solid:
        corners = read_mesh(self.file).astype(np.float64) * self.scale + np.array(self.translate)
        return Solid(corners.astype(np.float32), np.empty((0, 3, 4)), f"mesh `{self.file}`")


def read_mesh(file: pathlib.Path) -> F32:
    """The triangles (n, 3, 3) of a mesh file. Raises QueryError."""
    import trimesh

    if file.suffix.lower() not in _MESH_FILES:
        raise QueryError(f"expected a mesh file that ends in {', '.join(_MESH_FILES)}, found `{file}`")
    if not file.is_file():
        raise QueryError(f"there is no mesh file `{file}`: names are relative to the job's file")
    try:
        mesh = trimesh.load_mesh(str(file), process=False)
        return np.asarray(mesh.triangles, np.float32).reshape(-1, 3, 3)
    except Exception as error:  # each of trimesh's readers raises its own kinds
        raise QueryError(f"mesh `{file}` cannot be read ({type(error).__name__}: {str(error)[:200]})") from None
