"""Geometry as kernels see it, and what a ray finds."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.math.vec import Vec3

SPHERE, DISK, CYLINDER = range(3)

Index = Any  # a row of an array: an int in Python, any integer type inside kernels


class Quadrics(NamedTuple):
    """Exact spheres, disks and cylinders in their local frames (unit shapes, Mitsuba's parametrization); ``nq`` rows."""

    kind: npt.NDArray[np.int32]  # (nq,)
    to_world: npt.NDArray[np.float64]  # (nq, 3, 4)
    to_object: npt.NDArray[np.float64]  # (nq, 3, 4)
    flip: npt.NDArray[np.uint8]  # (nq,) 1: the normal points the other way


class Geometry(NamedTuple):
    """Triangles by corner and edges; then quadrics. Primitive ids run through both."""

    p0: npt.NDArray[np.float32]  # (nt, 3) first corner
    e1: npt.NDArray[np.float32]  # (nt, 3) second corner - first
    e2: npt.NDArray[np.float32]  # (nt, 3) third corner - first
    ng: npt.NDArray[np.float32]  # (nt, 3) unit geometric normal, flipped where the description says so
    offset: npt.NDArray[np.float32]  # (nt + nq,) how far off the surface a ray must start, world units
    object: npt.NDArray[np.int32]  # (nt + nq,)
    normals: npt.NDArray[np.float32] | None  # (nt, 3, 3) at the corners, flipped likewise; ng where a mesh has none
    uvs: npt.NDArray[np.float32] | None  # (nt, 3, 2) at the corners; barycentric where a mesh has none; None: untextured
    quadrics: Quadrics | None


class Hit(NamedTuple):
    """A point of a surface and its frame."""

    p: Vec3
    ng: Vec3  # unit geometric normal
    n: Vec3  # unit shading normal
    s: Vec3  # unit tangents, right-handed with n: s along dp/du where the scene has texture coordinates
    t: Vec3
    u: Any  # float32, texture coordinates
    v: Any
    b1: Any  # float32, the recorded parameters: barycentric weights of corners 2 and 3, or a quadric's own (u, v)
    b2: Any
    offset: Any  # float32, how far off the surface a ray must start
    object: Any  # int32
