"""Exact spheres, disks and cylinders: where rays meet them, and the frame there.

Each is intersected in its own frame, where it is a unit shape, in float64: a sphere far away or a ray that grazes it
then keeps the accuracy of its float32 end points. A point is recorded as (u, v), Mitsuba's texture coordinates:

- sphere: u = phi / 2 pi, v = theta / pi
- disk: u = radius, v = phi / 2 pi
- cylinder: u = phi / 2 pi, v = z, along the axis
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import ONE, Vec3, cross, dot, madd, scale
from renderer.shapes.base import CYLINDER, DISK, SPHERE, Geometry, Hit, Index, Quadrics

Vec3d = tuple[Any, Any, Any]  # three float64
F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
TWO_PI_D = 2 * np.pi
PI_D = np.pi


@kernel
def transform_point(m: npt.NDArray[np.float64], i: Index, p: Vec3d) -> Vec3d:
    """Matrix i of (n, 3, 4) float64 times the point p."""
    return (
        m[i, 0, 0] * p[0] + m[i, 0, 1] * p[1] + m[i, 0, 2] * p[2] + m[i, 0, 3],
        m[i, 1, 0] * p[0] + m[i, 1, 1] * p[1] + m[i, 1, 2] * p[2] + m[i, 1, 3],
        m[i, 2, 0] * p[0] + m[i, 2, 1] * p[1] + m[i, 2, 2] * p[2] + m[i, 2, 3],
    )


@kernel
def transform_vector(m: npt.NDArray[np.float64], i: Index, a: Vec3d) -> Vec3d:
    """The linear part of matrix i of (n, 3, 4) float64 times the vector a."""
    return (
        m[i, 0, 0] * a[0] + m[i, 0, 1] * a[1] + m[i, 0, 2] * a[2],
        m[i, 1, 0] * a[0] + m[i, 1, 1] * a[1] + m[i, 1, 2] * a[2],
        m[i, 2, 0] * a[0] + m[i, 2, 1] * a[1] + m[i, 2, 2] * a[2],
    )


@kernel
def transform_normal(inverse: npt.NDArray[np.float64], i: Index, n: Vec3d) -> Vec3d:
    """The transposed linear part of matrix i of (n, 3, 4) times n: a normal under the inverse of that matrix."""
    return (
        inverse[i, 0, 0] * n[0] + inverse[i, 1, 0] * n[1] + inverse[i, 2, 0] * n[2],
        inverse[i, 0, 1] * n[0] + inverse[i, 1, 1] * n[1] + inverse[i, 2, 1] * n[2],
        inverse[i, 0, 2] * n[0] + inverse[i, 1, 2] * n[1] + inverse[i, 2, 2] * n[2],
    )


@kernel
def to_float32(a: Vec3d) -> Vec3:
    """A float64 vector rounded to float32."""
    return (np.float32(a[0]), np.float32(a[1]), np.float32(a[2]))


@kernel
def unit_float32(a: Vec3d) -> Vec3:
    """A float64 vector made a unit vector, then rounded."""
    length = np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    return (np.float32(a[0] / length), np.float32(a[1] / length), np.float32(a[2] / length))


@kernel
def chord(a: float, b: float, c: float) -> tuple[float, float]:
    """Both parameters t where |o + t d|² = 1, with a = d·d, b = o·d, c = |the point of the line nearest to 0|².

    Taking the nearest point first avoids the cancellation of the textbook discriminant (haines2019). No hit: (inf, -inf).
    """
    if not (c <= 1.0 and a > 0.0):
        return np.inf, -np.inf
    middle = -b / a
    half = np.sqrt((1.0 - c) / a)
    return middle - half, middle + half


@kernel
def intersect_sphere(o: Vec3d, d: Vec3d) -> float:
    """The first t > 0 where a local ray meets the unit sphere; inf if none."""
    a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    b = o[0] * d[0] + o[1] * d[1] + o[2] * d[2]
    middle = -b / a
    x = o[0] + middle * d[0]
    y = o[1] + middle * d[1]
    z = o[2] + middle * d[2]
    near, far = chord(a, b, x * x + y * y + z * z)
    if near > 0.0:
        return near
    return far if far > 0.0 else np.inf


@kernel
def intersect_cylinder(o: Vec3d, d: Vec3d) -> float:
    """The first t > 0 where a local ray meets the open cylinder of radius 1 over z in [0, 1]; inf if none."""
    a = d[0] * d[0] + d[1] * d[1]
    b = o[0] * d[0] + o[1] * d[1]
    middle = -b / a
    x = o[0] + middle * d[0]
    y = o[1] + middle * d[1]
    near, far = chord(a, b, x * x + y * y)
    if near > 0.0:
        z = o[2] + near * d[2]
        if z >= 0.0 and z <= 1.0:
            return near
    if far > 0.0:
        z = o[2] + far * d[2]
        if z >= 0.0 and z <= 1.0:
            return far
    return np.inf


@kernel
def intersect_disk(o: Vec3d, d: Vec3d) -> float:
    """The t > 0 where a local ray meets the unit disk in the plane z = 0; inf if none."""
    t = -o[2] / d[2]
    x = o[0] + t * d[0]
    y = o[1] + t * d[1]
    if t > 0.0 and x * x + y * y <= 1.0:
        return float(t)
    return np.inf


@kernel
def intersect_quadric(quadrics: Quadrics, row: Index, o: Vec3, d: Vec3) -> float:
    """The first t > 0, in units of d, where a world ray meets quadric ``row``; inf if none."""
    local_o = transform_point(quadrics.to_object, row, o)
    local_d = transform_vector(quadrics.to_object, row, d)
    kind = quadrics.kind[row]
    if kind == SPHERE:
        return intersect_sphere(local_o, local_d)
    if kind == DISK:
        return intersect_disk(local_o, local_d)
    return intersect_cylinder(local_o, local_d)


@kernel
def intersect_quadrics(quadrics: Quadrics, nt: Index, o: F32, d: F32, t: F32, primitive: I32, n: int) -> None:
    """Closest hits of the first n rays, o and d (n, 3) float32: lower ``t`` (n,) and set ``primitive`` (n,) to nt + row."""
    rows = quadrics.kind.shape[0]
    for i in range(n):
        origin = (o[i, 0], o[i, 1], o[i, 2])
        direction = (d[i, 0], d[i, 1], d[i, 2])
        for row in range(rows):
            distance = np.float32(intersect_quadric(quadrics, row, origin, direction))
            if distance < t[i]:
                t[i] = distance
                primitive[i] = nt + row


@kernel
def occluded_quadrics(quadrics: Quadrics, nt: Index, o: F32, d: F32, tfar: F32, blocked: I32, n: int) -> None:
    """Shadow rays: ``blocked`` (n,) int32, as embree leaves it (0 blocked, -1 free), becomes 0 where t < tfar meets a quadric."""
    rows = quadrics.kind.shape[0]
    for i in range(n):
        origin = (o[i, 0], o[i, 1], o[i, 2])
        direction = (d[i, 0], d[i, 1], d[i, 2])
        row = 0
        while row < rows and blocked[i] != 0:
            if np.float32(intersect_quadric(quadrics, row, origin, direction)) < tfar[i]:
                blocked[i] = 0
            row += 1


@kernel
def turn(y: float, x: float) -> np.float32:
    """The angle of (x, y) as a share of a full turn, in [0, 1]."""
    share = np.arctan2(y, x) / TWO_PI_D
    return np.float32(share if share >= 0.0 else share + 1.0)


@kernel
def parameters_of(kind: Index, local: Vec3d) -> tuple[np.float32, np.float32]:
    """(u, v) of a point on, or near, a unit shape."""
    x, y, z = local
    radius = np.sqrt(x * x + y * y)
    if kind == SPHERE:
        return turn(y, x), np.float32(np.arctan2(radius, z) / PI_D)
    if kind == DISK:
        return np.float32(min(radius, 1.0)), turn(y, x)
    return turn(y, x), np.float32(min(max(z, 0.0), 1.0))


@kernel
def quadric_parameters(quadrics: Quadrics, row: Index, o: Vec3, d: Vec3, t: np.float32) -> tuple[np.float32, np.float32]:
    """(u, v) of quadric ``row`` where the world ray meets it at t."""
    local_o = transform_point(quadrics.to_object, row, o)
    local_d = transform_vector(quadrics.to_object, row, d)
    x = local_o[0] + t * local_d[0]
    y = local_o[1] + t * local_d[1]
    z = local_o[2] + t * local_d[2]
    return parameters_of(quadrics.kind[row], (x, y, z))


@kernel
def local_frame(kind: Index, u: np.float32, v: np.float32) -> tuple[Vec3d, Vec3d, Vec3d]:
    """Point, outward normal (disk: +z) and dp/du up to scale of a unit shape at (u, v)."""
    phi = TWO_PI_D * (v if kind == DISK else u)
    c = np.cos(phi)
    s = np.sin(phi)
    if kind == SPHERE:
        sin_theta = np.sin(PI_D * v)
        cos_theta = np.cos(PI_D * v)
        point = (c * sin_theta, s * sin_theta, cos_theta)
        return point, point, (-s, c, 0.0)
    if kind == CYLINDER:
        return (c, s, float(v)), (c, s, 0.0), (-s, c, 0.0)
    return (u * c, u * s, 0.0), (0.0, 0.0, 1.0), (c, s, 0.0)


@kernel
def quadric_hit(quadrics: Quadrics, geometry: Geometry, primitive: Index, u: np.float32, v: np.float32) -> Hit:
    """The point (u, v) of the quadric with id ``primitive``, and its frame; the tangent s is along dp/du."""
    row = primitive - geometry.p0.shape[0]
    point, normal, dp_du = local_frame(quadrics.kind[row], u, v)
    p = to_float32(transform_point(quadrics.to_world, row, point))
    n = unit_float32(transform_normal(quadrics.to_object, row, normal))
    if quadrics.flip[row]:
        n = (-n[0], -n[1], -n[2])

    # The tangent, made orthogonal to the rounded normal
    s = unit_float32(transform_vector(quadrics.to_world, row, dp_du))
    s = madd(n, -dot(n, s), s)
    s = scale(s, ONE / np.sqrt(dot(s, s)))
    return Hit(p, n, n, s, cross(n, s), u, v, u, v, geometry.offset[primitive], geometry.object[primitive])
