"""The point of a surface that a ray met, and its frame, rebuilt from (primitive, two parameters) alone.

A triangle's point comes from its barycentric weights, not from the ray: its rounding error is then a property of the
triangle (``renderer.shapes.bounds``), whatever the length of the ray. The parameters are what the tables record, so
``surface_at`` gives the same point again.
"""

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import ONE, ZERO, Vec3, cross, dot, madd, row, scale, sub, tangents
from renderer.shapes.base import Geometry, Hit, Index, Quadrics
from renderer.shapes.quadrics import quadric_hit, quadric_parameters


@kernel
def plane_distances(
    p0: npt.NDArray[np.float32], ng: npt.NDArray[np.float32], primitive: npt.NDArray[np.int32], o: npt.NDArray[np.float32],
    d: npt.NDArray[np.float32], t: npt.NDArray[np.float32], n: int,
) -> None:  # fmt: skip
    """Write to ``t`` where each of n rays (n, 3) crosses the plane of the triangle it met, within its far end there.

    Rays that met none (-1) keep their far ends.
    """
    for i in range(n):
        q = primitive[i]
        if q >= 0:
            normal = row(ng, q)
            t[i] = min(max(dot(sub(row(p0, q), row(o, i)), normal) / dot(row(d, i), normal), ZERO), t[i])


@kernel
def clamp_barycentrics(b1: np.float32, b2: np.float32) -> tuple[np.float32, np.float32]:
    """The nearest weights of a point inside the triangle; NaN (a degenerate triangle) gives the first corner."""
    b1 = min(max(b1, ZERO), ONE) if b1 == b1 else ZERO
    b2 = min(max(b2, ZERO), ONE - b1) if b2 == b2 else ZERO
    return b1, b2


@kernel
def barycentrics(geometry: Geometry, primitive: Index, o: Vec3, d: Vec3) -> tuple[np.float32, np.float32]:
    """Barycentric weights of corners 2 and 3 where the ray's line crosses a triangle's plane, clamped (moller1997)."""
    e1 = row(geometry.e1, primitive)
    e2 = row(geometry.e2, primitive)
    h = cross(d, e2)
    to_origin = sub(o, row(geometry.p0, primitive))
    inverse = ONE / dot(e1, h)
    return clamp_barycentrics(dot(to_origin, h) * inverse, dot(d, cross(to_origin, e1)) * inverse)


@kernel
def shading_normal(normals: npt.NDArray[np.float32] | None, primitive: Index, b1: np.float32, b2: np.float32, ng: Vec3) -> Vec3:
    """The interpolated unit normal of a triangle; ``ng`` where the scene has no vertex normals."""
    if normals is None:
        return ng
    b0 = ONE - b1 - b2
    n = (
        b0 * normals[primitive, 0, 0] + b1 * normals[primitive, 1, 0] + b2 * normals[primitive, 2, 0],
        b0 * normals[primitive, 0, 1] + b1 * normals[primitive, 1, 1] + b2 * normals[primitive, 2, 1],
        b0 * normals[primitive, 0, 2] + b1 * normals[primitive, 1, 2] + b2 * normals[primitive, 2, 2],
    )
    squared_length = dot(n, n)
    if squared_length <= ZERO:
        return ng
    return scale(n, ONE / np.sqrt(squared_length))


@kernel
def texture_coordinates(uvs: npt.NDArray[np.float32] | None, primitive: Index, b1: np.float32, b2: np.float32) -> tuple[np.float32, np.float32]:
    """(u, v) at a triangle's barycentric weights; the weights themselves where the scene has no texture coordinates."""
    if uvs is None:
        return b1, b2
    b0 = ONE - b1 - b2
    return (
        b0 * uvs[primitive, 0, 0] + b1 * uvs[primitive, 1, 0] + b2 * uvs[primitive, 2, 0],
        b0 * uvs[primitive, 0, 1] + b1 * uvs[primitive, 1, 1] + b2 * uvs[primitive, 2, 1],
    )


@kernel
def frame_along(n: Vec3, dp_du: Vec3) -> tuple[Vec3, Vec3]:
    """Unit tangents with n: the first is dp/du made orthogonal to n; any frame where that vanishes."""
    s = madd(n, -dot(n, dp_du), dp_du)
    squared_length = dot(s, s)
    if not squared_length > ZERO:
        return tangents(n)
    s = scale(s, ONE / np.sqrt(squared_length))
    return s, cross(n, s)


@kernel
def triangle_frame(uvs: npt.NDArray[np.float32] | None, primitive: Index, e1: Vec3, e2: Vec3, n: Vec3) -> tuple[Vec3, Vec3]:
    """Unit tangents of a triangle's shading frame, along dp/du where the scene has texture coordinates."""
    if uvs is None:
        return tangents(n)
    du1 = uvs[primitive, 1, 0] - uvs[primitive, 0, 0]
    dv1 = uvs[primitive, 1, 1] - uvs[primitive, 0, 1]
    du2 = uvs[primitive, 2, 0] - uvs[primitive, 0, 0]
    dv2 = uvs[primitive, 2, 1] - uvs[primitive, 0, 1]
    determinant = du1 * dv2 - dv1 * du2
    if determinant == ZERO:
        return tangents(n)
    return frame_along(n, scale(sub(scale(e1, dv2), scale(e2, dv1)), ONE / determinant))


@kernel
def triangle_at(geometry: Geometry, primitive: Index, b1: np.float32, b2: np.float32) -> Hit:
    """The point of a triangle with these barycentric weights of corners 2 and 3, and its frame."""
    e1 = row(geometry.e1, primitive)
    e2 = row(geometry.e2, primitive)
    p = madd(e2, b2, madd(e1, b1, row(geometry.p0, primitive)))
    ng = row(geometry.ng, primitive)
    n = shading_normal(geometry.normals, primitive, b1, b2, ng)
    s, t = triangle_frame(geometry.uvs, primitive, e1, e2, n)
    u, v = texture_coordinates(geometry.uvs, primitive, b1, b2)
    return Hit(p, ng, n, s, t, u, v, b1, b2, geometry.offset[primitive], geometry.object[primitive])


@kernel
def parameters(quadrics: Quadrics | None, geometry: Geometry, primitive: Index, o: Vec3, d: Vec3, t: np.float32) -> tuple[np.float32, np.float32]:
    """The recorded parameters of the point where a ray met ``primitive``."""
    if quadrics is None:
        return barycentrics(geometry, primitive, o, d)
    if primitive < geometry.p0.shape[0]:
        return barycentrics(geometry, primitive, o, d)
    return quadric_parameters(quadrics, primitive - geometry.p0.shape[0], o, d, t)


@kernel
def point_at(quadrics: Quadrics | None, geometry: Geometry, primitive: Index, b1: np.float32, b2: np.float32) -> Hit:
    """The point of a primitive, triangle or quadric, with these parameters."""
    if quadrics is None:
        return triangle_at(geometry, primitive, b1, b2)
    if primitive < geometry.p0.shape[0]:
        return triangle_at(geometry, primitive, b1, b2)
    return quadric_hit(quadrics, geometry, primitive, b1, b2)


@kernel
def surface(geometry: Geometry, primitive: Index, o: Vec3, d: Vec3, t: np.float32) -> Hit:
    """What the ray (o, d) met on ``primitive`` at parameter ``t``."""
    b1, b2 = parameters(geometry.quadrics, geometry, primitive, o, d, t)
    return point_at(geometry.quadrics, geometry, primitive, b1, b2)


@kernel
def surface_at(geometry: Geometry, primitive: Index, b1: np.float32, b2: np.float32) -> Hit:
    """The point with the recorded parameters of a primitive: the same, to rounding, as ``surface`` gave."""
    return point_at(geometry.quadrics, geometry, primitive, b1, b2)


@kernel
def offset_point(p: Vec3, ng: Vec3, offset: np.float32, d: Vec3) -> Vec3:
    """``p`` moved off its surface by the error bound, to the side that ``d`` points to (pbrt4e, section 6.8.6)."""
    return madd(ng, np.float32(np.copysign(offset, dot(ng, d))), p)
