"""The footprint of a pixel in texture coordinates: how (u, v) change with the film position where the camera meets a surface (igehy1999).

A camera ray's direction, left unnormalized, is linear in the film position; a triangle's (u, v) are linear in its plane. So (u, v) are a
ratio of linear functions of the film position, whose value and derivatives at the pixel's center do not depend on the sample that found the
triangle. Exact shapes are replaced by their tangent plane at the sample.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import HALF, ONE, TWO, ZERO, Vec3, cross, dot, madd, row, sub
from renderer.sensors.base import Sensor
from renderer.sensors.dispatch import film_ray
from renderer.shapes.base import CYLINDER, SPHERE, Geometry, Hit, Index, Quadrics
from renderer.shapes.quadrics import PI_D, TWO_PI_D, to_float32, transform_vector


class Chart(NamedTuple):
    """A plane with texture coordinates: the point p + b1 e1 + b2 e2 has (u, v) + b1 (u1, v1) + b2 (u2, v2)."""

    p: Vec3
    e1: Vec3
    e2: Vec3
    u: Any  # float32
    v: Any
    u1: Any
    v1: Any
    u2: Any
    v2: Any
    exact: Any  # bool: the surface is this plane, so the point may be moved freely


class Footprint(NamedTuple):
    """Texture coordinates at a pixel's center and their derivatives by the film position, in pixels."""

    u: Any  # float32
    v: Any
    u_x: Any  # float32, du / dx
    u_y: Any
    v_x: Any
    v_y: Any
    anchored: Any  # bool: all of it is a function of pixel and triangle alone


@kernel
def triangle_chart(uvs: npt.NDArray[np.float32] | None, geometry: Geometry, q: Index) -> Chart:
    """A triangle's plane; its barycentric weights are (u, v) where the scene has no texture coordinates."""
    p, e1, e2 = row(geometry.p0, q), row(geometry.e1, q), row(geometry.e2, q)
    if uvs is None:
        return Chart(p, e1, e2, ZERO, ZERO, ONE, ZERO, ZERO, ONE, True)
    u, v = uvs[q, 0, 0], uvs[q, 0, 1]
    return Chart(p, e1, e2, u, v, uvs[q, 1, 0] - u, uvs[q, 1, 1] - v, uvs[q, 2, 0] - u, uvs[q, 2, 1] - v, True)


@kernel
def quadric_chart(quadrics: Quadrics, quadric: Index, hit: Hit) -> Chart:
    """The tangent plane of a sphere, disk or cylinder at a hit, spanned by dp/du and dp/dv; it degenerates at poles and a disk's center."""
    kind = quadrics.kind[quadric]
    u, v = float(hit.u), float(hit.v)
    if kind == SPHERE:
        phi, theta = TWO_PI_D * u, PI_D * v
        radius, height = np.sin(theta), np.cos(theta)
        p_u = (-TWO_PI_D * radius * np.sin(phi), TWO_PI_D * radius * np.cos(phi), 0.0)
        p_v = (PI_D * height * np.cos(phi), PI_D * height * np.sin(phi), -PI_D * radius)
    elif kind == CYLINDER:
        phi = TWO_PI_D * u
        p_u = (-TWO_PI_D * np.sin(phi), TWO_PI_D * np.cos(phi), 0.0)
        p_v = (0.0, 0.0, 1.0)
    else:
        phi = TWO_PI_D * v
        p_u = (np.cos(phi), np.sin(phi), 0.0)
        p_v = (-TWO_PI_D * u * np.sin(phi), TWO_PI_D * u * np.cos(phi), 0.0)
    e1 = to_float32(transform_vector(quadrics.to_world, quadric, p_u))
    e2 = to_float32(transform_vector(quadrics.to_world, quadric, p_v))
    return Chart(hit.p, e1, e2, hit.u, hit.v, ONE, ZERO, ZERO, ONE, False)


@kernel
def chart_of(quadrics: Quadrics | None, geometry: Geometry, primitive: Index, hit: Hit) -> Chart:
    """The chart of the surface at a hit."""
    if quadrics is None:
        return triangle_chart(geometry.uvs, geometry, primitive)
    if primitive < geometry.p0.shape[0]:
        return triangle_chart(geometry.uvs, geometry, primitive)
    return quadric_chart(quadrics, primitive - geometry.p0.shape[0], hit)


@kernel
def footprint(sensor: Sensor, geometry: Geometry, primitive: Index, hit: Hit, raster_x: np.float32, raster_y: np.float32, lens: Vec3) -> Footprint:
    """The footprint, at the center of its pixel, of the camera walk that met ``primitive`` through a point of the lens (camera space).

    What cannot be computed, for surfaces on edge or without an area in (u, v), is not finite.
    """
    chart = chart_of(geometry.quadrics, geometry, primitive, hit)
    x, y = np.floor(raster_x) + HALF, np.floor(raster_y) + HALF
    dx, dy = x - raster_x, y - raster_y
    o, d, d_x, d_y = film_ray(sensor, x, y, lens)

    # Where o + t d meets the plane: b1 = d·m1 / d·m0 and b2 = d·m2 / d·m0 (Cramer's rule, as moller1997)
    from_p = sub(o, chart.p)
    m0 = cross(chart.e2, chart.e1)
    m1 = cross(chart.e2, from_p)
    m2 = cross(from_p, chart.e1)

    # At the pixel's center, or where that may lie elsewhere, beyond a horizon or off a curved surface, at the sample
    at_sample = madd(d_y, -dy, madd(d_x, -dx, d))
    depths = dot(d, m0) / dot(at_sample, m0)
    anchored = bool(chart.exact and depths > HALF and depths < TWO)
    at = d if anchored else at_sample
    inverse = ONE / dot(at, m0)
    b1 = dot(at, m1) * inverse
    b2 = dot(at, m2) * inverse
    slope_x, slope_y = dot(d_x, m0), dot(d_y, m0)
    b1_x = (dot(d_x, m1) - b1 * slope_x) * inverse
    b1_y = (dot(d_y, m1) - b1 * slope_y) * inverse
    b2_x = (dot(d_x, m2) - b2 * slope_x) * inverse
    b2_y = (dot(d_y, m2) - b2 * slope_y) * inverse
    if not anchored:
        b1 += b1_x * dx + b1_y * dy
        b2 += b2_x * dx + b2_y * dy

    return Footprint(
        chart.u + b1 * chart.u1 + b2 * chart.u2,
        chart.v + b1 * chart.v1 + b2 * chart.v2,
        b1_x * chart.u1 + b2_x * chart.u2,
        b1_y * chart.u1 + b2_y * chart.u2,
        b1_x * chart.v1 + b2_x * chart.v2,
        b1_y * chart.v1 + b2_y * chart.v2,
        anchored,
    )
