"""Point, spot and directional lights: a single position or direction, so no ray can meet them."""

import numpy as np

from renderer.emitters.base import BEAM, CUTOFF, DIRECTIONAL, NO_DIRECTION, SPOT, DirectionSample, Emitters
from renderer.kernel import kernel
from renderer.math.vec import BLACK, FAR, HALF, ONE, TWO, TWO_PI, ZERO, Vec3, dot, neg, row, scale, sub, tangents, to_world
from renderer.math.warp import sample_sphere
from renderer.shapes.base import Index

FOUR_PI = np.float32(4 * np.pi)


@kernel
def position(emitters: Emitters, emitter: Index) -> Vec3:
    """Where a point or spot light stands: the last column of its matrix."""
    return (emitters.frame[emitter, 3], emitters.frame[emitter, 7], emitters.frame[emitter, 11])


@kernel
def axis(emitters: Emitters, emitter: Index) -> Vec3:
    """The unit direction of travel of a directional light, or along a spot light's axis: the third column of its matrix."""
    return (emitters.frame[emitter, 2], emitters.frame[emitter, 6], emitters.frame[emitter, 10])


@kernel
def angle_of(versine: np.float32) -> np.float32:
    """The angle whose 1 - cos is ``versine``, accurate where that is tiny."""
    return np.float32(TWO * np.arcsin(min(ONE, np.sqrt(HALF * versine))))


@kernel
def falloff(emitters: Emitters, emitter: Index, d: Vec3) -> np.float32:
    """The share of a point or spot light's intensity that leaves along unit ``d``.

    A spot's is linear in the angle from its beam's edge to its cutoff, as Mitsuba's.
    """
    if emitters.kind[emitter] != SPOT:
        return ONE
    off_axis = sub(d, axis(emitters, emitter))
    versine = HALF * dot(off_axis, off_axis)
    cutoff = emitters.scalar[emitter, CUTOFF]
    beam = emitters.scalar[emitter, BEAM]
    if versine >= cutoff:
        return ZERO
    if versine <= beam:
        return ONE
    edge = angle_of(cutoff)
    return np.float32((edge - angle_of(versine)) / (edge - angle_of(beam)))


@kernel
def sample_delta(delta: bool | None, emitters: Emitters, emitter: Index, p: Vec3, select: np.float32) -> DirectionSample:
    """Light from a point, spot or directional emitter toward ``p``; ``select``: probability of choosing the emitter."""
    if delta is None:
        return NO_DIRECTION
    if emitters.kind[emitter] == DIRECTIONAL:
        d = neg(axis(emitters, emitter))
        return DirectionSample(np.int32(emitter), d, d, FAR, scale(row(emitters.rgb, emitter), ONE / select), ZERO)
    endpoint = position(emitters, emitter)
    to_light = sub(endpoint, p)
    squared_distance = dot(to_light, to_light)
    if squared_distance <= ZERO:
        return NO_DIRECTION
    distance = np.sqrt(squared_distance)
    d = scale(to_light, ONE / distance)
    weight = scale(row(emitters.rgb, emitter), falloff(emitters, emitter, neg(d)) / (squared_distance * select))
    return DirectionSample(np.int32(emitter), d, endpoint, distance, weight, ZERO)


@kernel
def sample_delta_direction(delta: bool | None, emitters: Emitters, emitter: Index, u: np.float32, v: np.float32) -> tuple[Vec3, Vec3]:
    """A direction that leaves a point or spot light, uniform over all directions or its cone, and intensity over density."""
    if delta is None:
        return BLACK, BLACK
    if emitters.kind[emitter] != SPOT:
        return sample_sphere(u, v), scale(row(emitters.rgb, emitter), FOUR_PI)
    spread = emitters.scalar[emitter, CUTOFF]
    one_minus_cos = u * spread
    sin_theta = np.sqrt(max(ZERO, one_minus_cos * (ONE + ONE - one_minus_cos)))
    phi = TWO_PI * v
    n = axis(emitters, emitter)
    s, t = tangents(n)
    d = to_world(s, t, n, (np.cos(phi) * sin_theta, np.sin(phi) * sin_theta, ONE - one_minus_cos))
    return d, scale(row(emitters.rgb, emitter), falloff(emitters, emitter, d) * TWO_PI * spread)
