"""The rough dielectric: a glossy lobe of reflection and one of transmission, from both sides (walter2007).

The lobe is chosen by Fresnel's reflectance at the sampled microfacet, so F(wi, h) or 1 - F is part of the density.
"""

import numpy as np

from renderer.bsdfs.base import NO_SAMPLE, Bsdf, Sample
from renderer.bsdfs.microfacet import microfacet_density, sample_visible_normal, smith_g1, visible_mass
from renderer.kernel import kernel
from renderer.math.fresnel import fresnel_dielectric, reflect_about, refract_about
from renderer.math.vec import BLACK, ONE, ZERO, Vec3, add, dot, madd, neg, scale
from renderer.tables import GLOSSY_REFLECTION, GLOSSY_TRANSMISSION

REFLECTION = np.int32(GLOSSY_REFLECTION)
TRANSMISSION = np.int32(GLOSSY_TRANSMISSION)
FOUR = np.float32(4.0)


@kernel
def sample_rough_dielectric(m: Bsdf, wi: Vec3, u_lobe: np.float32, u: np.float32, v: np.float32, adjoint: bool) -> Sample:
    """Reflect or refract at a visible microfacet."""
    if wi[2] == ZERO:
        return NO_SAMPLE
    above = wi if wi[2] > ZERO else neg(wi)
    # The distribution is symmetric: facets seen from -wi are those seen from wi, from behind
    h = sample_visible_normal(m.distribution, m.alpha_u, m.alpha_v, above, u, v)
    d = microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h)
    mass = visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi)
    cos_i = dot(wi, h)
    pdf = d * abs(cos_i) * (mass / abs(wi[2]))
    if not pdf > ZERO:
        return NO_SAMPLE

    f, cos_t, eta_it, eta_ti = fresnel_dielectric(cos_i, m.eta)
    g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) / mass
    if u_lobe < f:
        wo = reflect_about(wi, h)
        pdf *= f / (FOUR * abs(cos_i))
        weight = scale(m.a, g * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h))
        if not wo[2] * wi[2] > ZERO or not pdf > ZERO:
            return NO_SAMPLE
        return Sample(REFLECTION, wo, weight, pdf, ONE)

    wo = refract_about(wi, h, cos_t, eta_ti)
    pdf *= (ONE - f) * half_vector_jacobian(cos_i, cos_t, eta_it)
    factor = ONE if adjoint else eta_ti * eta_ti
    weight = scale(m.b, factor * g * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h))
    if not wo[2] * wi[2] < ZERO or not pdf > ZERO:
        return NO_SAMPLE
    return Sample(TRANSMISSION, wo, weight, pdf, eta_it)


@kernel
def half_vector_jacobian(cos_i: np.float32, cos_o: np.float32, eta_it: np.float32) -> np.float32:
    """Solid angle of half vectors per solid angle of transmitted directions, from the signed cosines with the microfacet."""
    s = cos_i + eta_it * cos_o
    return eta_it * eta_it * abs(cos_o) / (s * s)


@kernel
def eval_rough_dielectric(m: Bsdf, lobe: int, wi: Vec3, wo: Vec3, adjoint: bool) -> tuple[np.int32, Vec3, np.float32]:
    """Event, f |cos_o| and density of lobe 0, reflection, or lobe 1, transmission."""
    side = wi[2] * wo[2]
    if lobe == 0:
        if not side > ZERO:
            return REFLECTION, BLACK, ZERO
        value, pdf = eval_reflection(m, wi, wo)
        return REFLECTION, value, pdf
    if not side < ZERO:
        return TRANSMISSION, BLACK, ZERO
    value, pdf = eval_transmission(m, wi, wo, adjoint)
    return TRANSMISSION, value, pdf


@kernel
def upward(h: Vec3) -> Vec3:
    """Normalize h and turn it to the upper hemisphere; zero stays zero."""
    squared_length = dot(h, h)
    if not squared_length > ZERO:
        return BLACK
    s = ONE / np.sqrt(squared_length)
    return scale(h, -s if h[2] < ZERO else s)


@kernel
def eval_reflection(m: Bsdf, wi: Vec3, wo: Vec3) -> tuple[Vec3, np.float32]:
    """Value, f |cos_o|, and density of reflection; both directions are on one side."""
    h = upward(add(wi, wo))
    g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h)
    d = microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h)
    if g == ZERO or d == ZERO:
        return BLACK, ZERO
    f, _, _, _ = fresnel_dielectric(dot(wi, h), m.eta)
    mass = visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi)
    # Both fall with cos_i: divide them, not D, which would overflow
    return scale(m.a, f * d * (g / (FOUR * abs(wi[2])))), f * d * (mass / (FOUR * abs(wi[2])))


@kernel
def eval_transmission(m: Bsdf, wi: Vec3, wo: Vec3, adjoint: bool) -> tuple[Vec3, np.float32]:
    """Value, f |cos_o|, and density of transmission; the directions are on two sides."""
    eta_it = m.eta if wi[2] > ZERO else ONE / m.eta
    h = upward(madd(wo, eta_it, wi))
    g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h)
    d = microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h)
    if g == ZERO or d == ZERO:
        return BLACK, ZERO
    cos_i = dot(wi, h)
    f, _, _, _ = fresnel_dielectric(cos_i, m.eta)
    common = (ONE - f) * d * abs(cos_i) * half_vector_jacobian(cos_i, dot(wo, h), eta_it)
    factor = ONE if adjoint else ONE / (eta_it * eta_it)
    mass = visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi)
    return scale(m.b, common * factor * (g / abs(wi[2]))), common * (mass / abs(wi[2]))
