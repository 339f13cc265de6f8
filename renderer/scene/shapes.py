"""Shapes of a description as triangles or exact quadrics in world space."""

from collections.abc import Callable

import numpy as np

from renderer.scene import transforms
from renderer.scene.geometry import Mesh, Quadric, Surface
from renderer.scene.meshes import read_mesh
from renderer.scene.paths import Paths
from renderer.scene.reader import Reader
from renderer.scene.transforms import F64
from renderer.shapes.base import CYLINDER, DISK, SPHERE

# The cube's faces: outward normal, direction of u, direction of v
CUBE_FACES = (
    ((0, -1, 0), (0, 0, 1), (1, 0, 0)),
    ((0, 1, 0), (-1, 0, 0), (0, 0, -1)),
    ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
    ((0, 0, 1), (0, 1, 0), (1, 0, 0)),
    ((-1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 0, -1), (0, -1, 0), (1, 0, 0)),
)


def flat_mesh(to_world: F64, positions: F64, faces: F64, uvs: F64, flip: bool, parallelogram: bool = False) -> Mesh:
    """A mesh of flat faces. A mirrored transform would turn its triangles inside out; they are turned back."""
    order = [0, 2, 1] if np.linalg.det(to_world[:3, :3]) < 0 else [0, 1, 2]
    return Mesh(transforms.points(to_world, positions), faces.astype(np.int64)[:, order], None, uvs, flip, parallelogram)


def rectangle(reader: Reader, paths: Paths) -> Mesh:
    """[-1, 1]² in the plane z = 0, its normal along +z; (u, v) runs over [0, 1]² along x and y."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float64)
    faces = np.array([(0, 1, 2), (2, 3, 0)])
    return flat_mesh(reader.transform("to_world"), corners, faces, (corners[:, :2] + 1) / 2, reader.flag("flip_normals", False), parallelogram=True)


def cube(reader: Reader, paths: Paths) -> Mesh:
    """[-1, 1]³, its normals outward; (u, v) runs over [0, 1]² on each face."""
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float64)
    corners = [np.asarray(n) + (2 * u - 1) * np.asarray(du) + (2 * v - 1) * np.asarray(dv) for n, du, dv in CUBE_FACES for u, v in uv]
    faces = np.array([(4 * f + a, 4 * f + b, 4 * f + c) for f in range(6) for a, b, c in ((0, 1, 2), (3, 0, 2))])
    return flat_mesh(reader.transform("to_world"), np.array(corners), faces, np.tile(uv, (6, 1)), reader.flag("flip_normals", False))


def sphere(reader: Reader, paths: Paths) -> Quadric:
    """A sphere by center and radius, by ``to_world``, or both; scales must be uniform."""
    local = transforms.translate(reader.vector("center", [0.0, 0.0, 0.0])) @ transforms.scale([reader.number("radius", 1.0, above=0)] * 3)
    to_world = reader.transform("to_world") @ local
    uniform_axes(reader, to_world, 3)
    mirrored = bool(np.linalg.det(to_world[:3, :3]) < 0)
    return Quadric(SPHERE, to_world, reader.flag("flip_normals", False) != mirrored)


def disk(reader: Reader, paths: Paths) -> Quadric:
    """The unit disk in the plane z = 0, its normal along +z."""
    return Quadric(DISK, reader.transform("to_world"), reader.flag("flip_normals", False))


def cylinder(reader: Reader, paths: Paths) -> Quadric:
    """A cylinder without caps from p0 to p1; unit shape: radius 1 around z from 0 to 1."""
    p0, p1 = np.array(reader.vector("p0", [0.0, 0.0, 0.0])), np.array(reader.vector("p1", [0.0, 0.0, 1.0]))
    radius = reader.number("radius", 1.0, above=0)
    length = float(np.linalg.norm(p1 - p0))
    if not length > 0:
        raise reader.error("'p0' and 'p1' must differ: the cylinder has no length", "p1")
    local = np.eye(4)
    local[:3, :3] = np.stack([*frame((p1 - p0) / length), (p1 - p0) / length], axis=1) * (radius, radius, length)
    local[:3, 3] = p0
    to_world = reader.transform("to_world") @ local
    uniform_axes(reader, to_world, 2)
    return Quadric(CYLINDER, to_world, reader.flag("flip_normals", False))


def frame(n: F64) -> tuple[F64, F64]:
    """Two unit tangents of a unit vector, right-handed with it (duff2017; Mitsuba's choice, so that u starts where it does there)."""
    sign = 1.0 if n[2] >= 0 else -1.0
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return np.array([1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]]), np.array([b, sign + n[1] * n[1] * a, -n[1]])


def uniform_axes(reader: Reader, to_world: F64, axes: int) -> None:
    """Refuse transforms that would make an ellipsoid of a sphere or lean a cylinder."""
    gram = to_world[:3, :3].T @ to_world[:3, :3]
    lengths = np.sqrt(np.diag(gram))
    cosines = gram / np.outer(lengths, lengths) - np.eye(3)
    if np.ptp(lengths[:axes]) > 1e-4 * lengths[0] or np.abs(cosines).max() > 1e-4:
        across = "" if axes == 3 else " across its axis"
        raise reader.error(f"'to_world' must scale uniformly{across} and not shear; use a mesh for other shapes", "to_world")


SHAPES: dict[str, Callable[[Reader, Paths], Surface]] = {
    "rectangle": rectangle,
    "cube": cube,
    "sphere": sphere,
    "disk": disk,
    "cylinder": cylinder,
    "obj": read_mesh,
    "ply": read_mesh,
    "mesh": read_mesh,
}
