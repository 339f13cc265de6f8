"""Rays of light that leave an emitter: where light walks start."""

import numpy as np

from renderer.emitters.base import AREA, AREA_CYLINDER, AREA_RECTANGLE, DIRECTIONAL, POINT, SPOT, EmissionSample, Emitters
from renderer.emitters.curved import curved_point
from renderer.emitters.delta import axis, falloff, position, sample_delta_direction
from renderer.emitters.rectangle import push_off, rectangle_point
from renderer.emitters.sky import sample_sky
from renderer.kernel import kernel
from renderer.math.vec import BLACK, ONE, PI, ZERO, Vec3, dot, madd, neg, row, scale, tangents, to_world
from renderer.math.warp import sample_cosine_hemisphere, sample_disk
from renderer.shapes.base import Geometry, Index
from renderer.textures.base import Textures
from renderer.textures.lookup import texture_rgb


@kernel
def from_surface(
    emitter: Index, point: Vec3, normal: Vec3, offset: np.float32, radiance: Vec3, area: np.float32, u: np.float32, v: np.float32
) -> EmissionSample:
    """A cosine-weighted ray from a surface point that was chosen with density 1 / area."""
    s, t = tangents(normal)
    d = to_world(s, t, normal, sample_cosine_hemisphere(u, v))
    over_density = scale(radiance, area)
    return EmissionSample(np.int32(emitter), push_off(point, normal, offset), normal, d, over_density, scale(over_density, PI))


@kernel
def from_far(emitters: Emitters, emitter: Index, d: Vec3, irradiance: Vec3, u: np.float32, v: np.float32) -> EmissionSample:
    """A ray along ``d`` through the sphere around the scene, from the disk of its size that touches it."""
    x, y = sample_disk(u, v)
    s, t = tangents(d)
    radius = emitters.bounds[3]
    center = (emitters.bounds[0], emitters.bounds[1], emitters.bounds[2])
    point = madd(d, -radius, madd(s, radius * x, madd(t, radius * y, center)))
    return EmissionSample(np.int32(emitter), point, BLACK, d, BLACK, scale(irradiance, PI * radius * radius))


@kernel
def emit_rectangle(
    emitters: Emitters,
    geometry: Geometry,
    textures: Textures | None,
    emitter: Index,
    u1: np.float32,
    u2: np.float32,
    u3: np.float32,
    u4: np.float32,
    select: np.float32,
) -> EmissionSample:
    """A ray from a rectangle."""
    point, normal, offset = rectangle_point(emitters, geometry, emitter, u1, u2)
    radiance = texture_rgb(textures, emitters.texture[emitter], row(emitters.rgb, emitter), u1, u2)
    return from_surface(emitter, point, normal, offset, radiance, emitters.scalar[emitter, AREA] / select, u3, u4)


@kernel
def emit_delta(
    delta: bool | None, emitters: Emitters, emitter: Index, u1: np.float32, u2: np.float32, u3: np.float32, u4: np.float32, select: np.float32
) -> EmissionSample:
    """A ray from a point, spot or directional light."""
    if delta is None:
        return EmissionSample(np.int32(emitter), BLACK, BLACK, BLACK, BLACK, BLACK)
    if emitters.kind[emitter] == DIRECTIONAL:
        return from_far(emitters, emitter, axis(emitters, emitter), scale(row(emitters.rgb, emitter), ONE / select), u1, u2)
    d, power = sample_delta_direction(delta, emitters, emitter, u3, u4)
    intensity = scale(row(emitters.rgb, emitter), ONE / select)
    return EmissionSample(np.int32(emitter), position(emitters, emitter), BLACK, d, intensity, scale(power, ONE / select))


@kernel
def emit_sky(
    sky: bool | None, emitters: Emitters, emitter: Index, u1: np.float32, u2: np.float32, u3: np.float32, u4: np.float32, select: np.float32
) -> EmissionSample:
    """A ray from the sky."""
    if sky is None:
        return EmissionSample(np.int32(emitter), BLACK, BLACK, BLACK, BLACK, BLACK)
    toward, radiance, pdf = sample_sky(sky, emitters, u3, u4)
    over_density = scale(radiance, ONE / (pdf * select)) if pdf > ZERO else BLACK
    return from_far(emitters, emitter, neg(toward), over_density, u1, u2)


@kernel
def emit_curved(
    curved: bool | None,
    emitters: Emitters,
    geometry: Geometry,
    textures: Textures | None,
    emitter: Index,
    u1: np.float32,
    u2: np.float32,
    u3: np.float32,
    u4: np.float32,
    select: np.float32,
) -> EmissionSample:
    """A ray from a mesh, sphere, disk or cylinder."""
    if curved is None:
        return EmissionSample(np.int32(emitter), BLACK, BLACK, BLACK, BLACK, BLACK)
    point, normal, offset, radiance = curved_point(curved, emitters, geometry, textures, emitter, u1, u2)
    return from_surface(emitter, point, normal, offset, radiance, emitters.scalar[emitter, AREA] / select, u3, u4)


@kernel
def emission(
    emitters: Emitters,
    geometry: Geometry,
    textures: Textures | None,
    emitter: Index,
    u1: np.float32,
    u2: np.float32,
    u3: np.float32,
    u4: np.float32,
    select: np.float32,
) -> EmissionSample:
    """A ray from ``emitter``: (u1, u2) choose where it starts, (u3, u4) its direction, ``select`` is in the weights."""
    kind = emitters.kind[emitter]
    if kind == AREA_RECTANGLE:
        return emit_rectangle(emitters, geometry, textures, emitter, u1, u2, u3, u4, select)
    if kind <= AREA_CYLINDER:
        return emit_curved(emitters.curved, emitters, geometry, textures, emitter, u1, u2, u3, u4, select)
    if kind <= DIRECTIONAL:
        return emit_delta(emitters.delta, emitters, emitter, u1, u2, u3, u4, select)
    return emit_sky(emitters.sky, emitters, emitter, u1, u2, u3, u4, select)


@kernel
def emission_toward(emitters: Emitters, textures: Textures | None, sample: EmissionSample, d: Vec3) -> Vec3:
    """What a connection of the sampled point to the lens carries along unit ``d``.

    The radiance times the emitter's cosine, or the intensity, over the positional density and the probability of the
    choice; black for emitters that are infinite or have a single direction.
    """
    kind = emitters.kind[sample.emitter]
    if kind <= AREA_CYLINDER:
        return scale(sample.radiance, max(ZERO, dot(sample.normal, d)))
    if kind in (POINT, SPOT):
        return scale(sample.radiance, falloff(emitters, sample.emitter, d))
    return BLACK
