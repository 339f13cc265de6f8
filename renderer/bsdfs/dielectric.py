"""Smooth dielectrics: one interface, or a thin pane of two; a delta lobe of reflection and one of transmission each."""

import numpy as np

from renderer.bsdfs.base import NO_SAMPLE, Bsdf, Sample
from renderer.kernel import kernel
from renderer.math.fresnel import fresnel_dielectric, reflect, refract
from renderer.math.vec import ONE, TWO, ZERO, Vec3, neg, scale
from renderer.tables import SPECULAR_REFLECTION, SPECULAR_TRANSMISSION, STRAIGHT_TRANSMISSION

REFLECTION = np.int32(SPECULAR_REFLECTION)
TRANSMISSION = np.int32(SPECULAR_TRANSMISSION)
STRAIGHT = np.int32(STRAIGHT_TRANSMISSION)


@kernel
def sample_dielectric(m: Bsdf, wi: Vec3, u_lobe: np.float32, adjoint: bool) -> Sample:
    """Reflect with Fresnel's probability, else refract; radiance changes by (eta_i / eta_t)² where it crosses."""
    if wi[2] == ZERO:
        return NO_SAMPLE
    f, cos_t, eta_it, eta_ti = fresnel_dielectric(wi[2], m.eta)
    if u_lobe < f:
        return Sample(REFLECTION, reflect(wi), m.a, ZERO, ONE)
    factor = ONE if adjoint else eta_ti * eta_ti
    return Sample(TRANSMISSION, refract(wi, cos_t, eta_ti), scale(m.b, factor), ZERO, eta_it)


@kernel
def sample_thin_dielectric(m: Bsdf, wi: Vec3, u_lobe: np.float32) -> Sample:
    """Reflect or go straight on, with all reflections between the two interfaces summed: R' = 2R / (1 + R)."""
    if wi[2] == ZERO:
        return NO_SAMPLE
    f, _, _, _ = fresnel_dielectric(abs(wi[2]), m.eta)
    f = TWO * f / (ONE + f)
    if u_lobe < f:
        return Sample(REFLECTION, reflect(wi), m.a, ZERO, ONE)
    return Sample(STRAIGHT, neg(wi), m.b, ZERO, ONE)
