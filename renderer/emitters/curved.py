"""Area emitters on meshes, spheres, disks and cylinders, sampled by area; a sphere seen from outside by its cone.

A point of a light is chosen by the parameters of its primitive, so that ``renderer.shapes.surface`` gives its position,
normal, texture coordinates and error bound, exactly as for a point that a ray finds.
"""

import numpy as np
import numpy.typing as npt

from renderer.emitters.base import (
    AREA,
    AREA_CYLINDER,
    AREA_DISK,
    AREA_MESH,
    AREA_SPHERE,
    CDF_FIRST,
    NO_DIRECTION,
    PRIMITIVE_COUNT,
    PRIMITIVE_FIRST,
    DirectionSample,
    Emitters,
)
from renderer.emitters.cdf import sample_cdf
from renderer.emitters.rectangle import area_direction, pdf_area
from renderer.kernel import kernel
from renderer.math.vec import BLACK, ONE, TWO, TWO_PI, ZERO, Vec3, dot, row, scale, sub, tangents, to_world
from renderer.math.warp import sample_triangle
from renderer.shapes.base import SPHERE, Geometry, Index, Quadrics
from renderer.shapes.quadrics import parameters_of, transform_vector
from renderer.shapes.surface import surface_at
from renderer.textures.base import Textures
from renderer.textures.lookup import texture_rgb

F32 = npt.NDArray[np.float32]
ACOS_TO_V = np.float32(1 / np.pi)
OUTSIDE = np.float32(1.0001)  # squared distance over squared radius, above which a point is outside a sphere
SMALL_SINE = np.float32(0.00068523)  # sin² of 1.5 degrees, below which 1 - cos is sin² / 2


@kernel
def mesh_parameters(cdf: F32 | None, emitters: Emitters, emitter: Index, u: np.float32, v: np.float32) -> tuple[Index, np.float32, np.float32]:
    """A triangle of a mesh chosen by area, and barycentric weights uniform on it.

    Primary samples have 24 bits, which n triangles share: a triangle's probability is off by at most 2^-24, so by 1 % of
    itself in a light of some 170,000 equal triangles.
    """
    first = int(emitters.primitive[emitter, PRIMITIVE_FIRST])
    if cdf is None:
        return first, u, v
    count = int(emitters.primitive[emitter, PRIMITIVE_COUNT])
    triangle, _, again = sample_cdf(cdf, int(emitters.primitive[emitter, CDF_FIRST]), count, u)
    b1, b2 = sample_triangle(again, v)
    return first + triangle, b1, b2


@kernel
def area_parameters(emitters: Emitters, emitter: Index, u: np.float32, v: np.float32) -> tuple[Index, np.float32, np.float32]:
    """A primitive of an area emitter and parameters on it, uniform by area."""
    kind = emitters.kind[emitter]
    primitive = int(emitters.primitive[emitter, PRIMITIVE_FIRST])
    if kind == AREA_MESH:
        return mesh_parameters(emitters.cdf, emitters, emitter, u, v)
    if kind == AREA_DISK:
        return primitive, np.sqrt(u), v
    if kind == AREA_CYLINDER:
        return primitive, v, u
    return primitive, v, np.arccos(ONE - TWO * u) * ACOS_TO_V


@kernel
def sphere_of(quadrics: Quadrics | None, geometry: Geometry, primitive: Index) -> tuple[Vec3, np.float32]:
    """Center and radius of a sphere, world units; radius zero where the scene has no quadrics."""
    if quadrics is None:
        return BLACK, ZERO
    m = quadrics.to_world
    i = primitive - geometry.p0.shape[0]
    center = (np.float32(m[i, 0, 3]), np.float32(m[i, 1, 3]), np.float32(m[i, 2, 3]))
    return center, np.float32(np.sqrt(m[i, 0, 0] ** 2 + m[i, 1, 0] ** 2 + m[i, 2, 0] ** 2))


@kernel
def cone_of(quadrics: Quadrics | None, geometry: Geometry, primitive: Index, p: Vec3) -> tuple[np.float32, np.float32, Vec3]:
    """The cone in which ``p`` sees a sphere: sin² of its half angle, 1 - cos, and the unit axis from the center to p.

    From inside, or from the surface, there is no cone: both are 0.
    """
    center, radius = sphere_of(quadrics, geometry, primitive)
    axis = sub(p, center)
    squared_distance = dot(axis, axis)
    if squared_distance <= OUTSIDE * radius * radius:
        return ZERO, ZERO, axis
    squared_sine = radius * radius / squared_distance
    return squared_sine, squared_sine / (ONE + np.sqrt(ONE - squared_sine)), scale(axis, ONE / np.sqrt(squared_distance))


@kernel
def cone_parameters(
    quadrics: Quadrics | None, primitive: Index, squared_sine: np.float32, spread: np.float32, axis: Vec3, u: np.float32, v: np.float32, nt: int
) -> tuple[np.float32, np.float32]:
    """Parameters of the sphere's point that a direction, uniform in its cone, meets first (pbrt4e, section 6.2.4)."""
    if quadrics is None:
        return u, v
    one_minus_cos = u * spread
    squared_sine_theta = one_minus_cos * (TWO - one_minus_cos)
    if squared_sine < SMALL_SINE:
        squared_sine_theta = u * squared_sine
    cos_theta = np.sqrt(max(ZERO, ONE - squared_sine_theta))

    # The angle alpha at the center, between the axis and the point
    inverse_sine = ONE / np.sqrt(squared_sine)
    cos_alpha = squared_sine_theta * inverse_sine + cos_theta * np.sqrt(max(ZERO, ONE - squared_sine_theta * inverse_sine * inverse_sine))
    sin_alpha = np.sqrt(max(ZERO, ONE - cos_alpha * cos_alpha))
    phi = TWO_PI * v
    s, t = tangents(axis)
    normal = to_world(s, t, axis, (np.cos(phi) * sin_alpha, np.sin(phi) * sin_alpha, cos_alpha))
    return parameters_of(SPHERE, transform_vector(quadrics.to_object, primitive - nt, normal))


@kernel
def sample_curved(
    curved: bool | None,
    emitters: Emitters,
    geometry: Geometry,
    textures: Textures | None,
    emitter: Index,
    p: Vec3,
    u: np.float32,
    v: np.float32,
    select: np.float32,
) -> DirectionSample:
    """Light from a point of a mesh, sphere, disk or cylinder toward ``p``; ``select``: probability of choosing the emitter."""
    if curved is None:
        return NO_DIRECTION
    primitive, b1, b2 = area_parameters(emitters, emitter, u, v)

    # A sphere from outside: by solid angle
    spread = ZERO
    if emitters.kind[emitter] == AREA_SPHERE:
        squared_sine, spread, axis = cone_of(geometry.quadrics, geometry, primitive, p)
        if spread > ZERO:
            b1, b2 = cone_parameters(geometry.quadrics, primitive, squared_sine, spread, axis, u, v, geometry.p0.shape[0])

    # The point, as if sampled by area, then with the cone's density
    hit = surface_at(geometry, primitive, b1, b2)
    radiance = texture_rgb(textures, emitters.texture[emitter], row(emitters.rgb, emitter), hit.u, hit.v)
    s = area_direction(emitter, p, hit.p, hit.ng, hit.offset, radiance, select / emitters.scalar[emitter, AREA])
    if spread > ZERO and s.pdf > ZERO:
        pdf = select / (TWO_PI * spread)
        return DirectionSample(s.emitter, s.d, s.endpoint, s.distance, scale(radiance, ONE / pdf), pdf)
    return s


@kernel
def pdf_curved(
    curved: bool | None,
    emitters: Emitters,
    geometry: Geometry,
    emitter: Index,
    p: Vec3,
    distance: np.float32,
    cos_light: np.float32,
    primitive: Index,
    select: np.float32,
) -> np.float32:
    """Density per steradian of ``sample_curved`` at a point of the emitter, seen from ``p``."""
    if curved is None:
        return ZERO
    if emitters.kind[emitter] == AREA_SPHERE:
        _, spread, _ = cone_of(geometry.quadrics, geometry, primitive, p)
        if spread > ZERO:
            return select / (TWO_PI * spread) if cos_light > ZERO else ZERO
    return pdf_area(distance, cos_light, select / emitters.scalar[emitter, AREA])


@kernel
def curved_point(
    curved: bool | None, emitters: Emitters, geometry: Geometry, textures: Textures | None, emitter: Index, u: np.float32, v: np.float32
) -> tuple[Vec3, Vec3, np.float32, Vec3]:
    """A point of the emitter uniform by area: position, unit normal, offset, radiance."""
    if curved is None:
        return BLACK, BLACK, ZERO, BLACK
    primitive, b1, b2 = area_parameters(emitters, emitter, u, v)
    hit = surface_at(geometry, primitive, b1, b2)
    return hit.p, hit.ng, hit.offset, texture_rgb(textures, emitters.texture[emitter], row(emitters.rgb, emitter), hit.u, hit.v)
