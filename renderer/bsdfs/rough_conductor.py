"""The rough conductor: one glossy lobe, f = F D G / (4 cos_i cos_o), one-sided (walter2007)."""

import numpy as np

from renderer.bsdfs.base import NO_SAMPLE, Bsdf, Sample
from renderer.bsdfs.microfacet import microfacet_density, sample_visible_normal, smith_g1, visible_mass
from renderer.kernel import kernel
from renderer.math.fresnel import fresnel_conductor_rgb, reflect_about
from renderer.math.vec import BLACK, ONE, ZERO, Vec3, add, dot, mul, normalize, scale
from renderer.tables import GLOSSY_REFLECTION

EVENT = np.int32(GLOSSY_REFLECTION)
FOUR = np.float32(4.0)


@kernel
def sample_rough_conductor(m: Bsdf, wi: Vec3, u: np.float32, v: np.float32) -> Sample:
    """Reflect about a visible microfacet."""
    if wi[2] <= ZERO:
        return NO_SAMPLE
    h = sample_visible_normal(m.distribution, m.alpha_u, m.alpha_v, wi, u, v)
    wo = reflect_about(wi, h)
    d = microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h)
    mass = visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi)
    pdf = d * mass / (FOUR * wi[2])
    if not wo[2] > ZERO or not pdf > ZERO:
        return NO_SAMPLE

    g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h)
    weight = scale(mul(m.a, fresnel_conductor_rgb(dot(wi, h), m.b, m.c)), g / mass)
    return Sample(EVENT, wo, weight, pdf, ONE)


@kernel
def eval_rough_conductor(m: Bsdf, wi: Vec3, wo: Vec3) -> tuple[np.int32, Vec3, np.float32]:
    """Event, f cos_o and density of the glossy lobe."""
    if wi[2] <= ZERO or wo[2] <= ZERO:
        return EVENT, BLACK, ZERO
    h = normalize(add(wi, wo))
    d = microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h)
    if d == ZERO:
        return EVENT, BLACK, ZERO
    g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h)
    # Both fall with cos_i: divide them, not D, which would overflow
    value = scale(mul(m.a, fresnel_conductor_rgb(dot(wi, h), m.b, m.c)), d * (g / (FOUR * wi[2])))
    return EVENT, value, d * (visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi) / (FOUR * wi[2]))
