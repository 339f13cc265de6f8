"""Light from all around: the constant emitter, uniform over the sphere of directions, and the environment map."""

import numpy as np

from renderer.emitters.base import CONSTANT, NO_DIRECTION, DirectionSample, Emitters
from renderer.emitters.envmap import environment_pdf, environment_radiance, sample_environment
from renderer.kernel import kernel
from renderer.math.vec import BLACK, FAR, ONE, ZERO, Vec3, mul, row, scale
from renderer.math.warp import sample_sphere

UNIFORM_SPHERE = np.float32(1 / (4 * np.pi))


@kernel
def radiance_from(sky: bool | None, emitters: Emitters, d: Vec3) -> Vec3:
    """Radiance that arrives from unit direction ``d``; black where the scene has no sky."""
    if sky is None:
        return BLACK
    constant = row(emitters.rgb, emitters.infinite)
    if emitters.kind[emitters.infinite] == CONSTANT:
        return constant
    return mul(constant, environment_radiance(emitters.environment, d))


@kernel
def pdf_toward(sky: bool | None, emitters: Emitters, d: Vec3) -> np.float32:
    """Density per steradian of ``sample_sky``, the choice of the emitter not included; zero where there is no sky."""
    if sky is None:
        return ZERO
    if emitters.kind[emitters.infinite] == CONSTANT:
        return UNIFORM_SPHERE
    return environment_pdf(emitters.environment, d)


@kernel
def sample_sky(sky: bool | None, emitters: Emitters, u: np.float32, v: np.float32) -> tuple[Vec3, Vec3, np.float32]:
    """A unit direction toward the sky, the radiance from there, and its density per steradian."""
    if sky is None:
        return BLACK, BLACK, ZERO
    if emitters.kind[emitters.infinite] == CONSTANT:
        return sample_sphere(u, v), row(emitters.rgb, emitters.infinite), UNIFORM_SPHERE
    d, pdf = sample_environment(emitters.environment, u, v)
    return d, mul(row(emitters.rgb, emitters.infinite), environment_radiance(emitters.environment, d)), pdf


@kernel
def sample_sky_direction(sky: bool | None, emitters: Emitters, u: np.float32, v: np.float32, select: np.float32) -> DirectionSample:
    """Light from the sky; ``select``: probability of choosing the emitter."""
    if sky is None:
        return NO_DIRECTION
    d, radiance, density = sample_sky(sky, emitters, u, v)
    pdf = density * select
    if pdf <= ZERO:
        return NO_DIRECTION
    return DirectionSample(np.int32(emitters.infinite), d, d, FAR, scale(radiance, ONE / pdf), pdf)
