"""Plastics: a dielectric coat over a diffuse base, with all light that the coat reflects back inside summed.

``plastic`` has a delta lobe of reflection and a diffuse lobe; ``roughplastic`` a glossy lobe and a diffuse lobe, whose
transmittance through the rough coat is a table over cos theta (``renderer.bsdfs.tables``). One-sided.
"""

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.base import NO_SAMPLE, Bsdf, Sample
from renderer.bsdfs.microfacet import microfacet_density, sample_visible_normal, smith_g1, visible_mass
from renderer.kernel import kernel
from renderer.math.fresnel import fresnel_dielectric, reflect, reflect_about
from renderer.math.vec import BLACK, ONE, ZERO, Vec3, add, dot, normalize, scale
from renderer.math.warp import pdf_cosine_hemisphere, sample_cosine_hemisphere
from renderer.tables import DIFFUSE_REFLECTION, GLOSSY_REFLECTION, SPECULAR_REFLECTION

DIFFUSE_EVENT = np.int32(DIFFUSE_REFLECTION)
GLOSSY_EVENT = np.int32(GLOSSY_REFLECTION)
SPECULAR_EVENT = np.int32(SPECULAR_REFLECTION)
FOUR = np.float32(4.0)


@kernel
def specular_probability(m: Bsdf, transmittance: np.float32) -> np.float32:
    """p_l of the specular lobe: the coat's reflectance against its transmittance, each times its lobe's color."""
    specular = (ONE - transmittance) * m.p_specular
    diffuse = transmittance * (ONE - m.p_specular)
    total = specular + diffuse
    return specular / total if total > ZERO else ZERO


@kernel
def base_color(m: Bsdf) -> Vec3:
    """The base's reflectance after any number of internal reflections, over eta²: radiance that leaves, per unit that entered."""
    s = ONE / (m.eta * m.eta)
    if m.nonlinear:
        return (
            s * m.a[0] / (ONE - m.a[0] * m.internal),
            s * m.a[1] / (ONE - m.a[1] * m.internal),
            s * m.a[2] / (ONE - m.a[2] * m.internal),
        )
    return scale(m.a, s / (ONE - m.internal))


@kernel
def smooth_transmittance(m: Bsdf, cos_theta: np.float32) -> np.float32:
    """What the smooth coat lets through."""
    f, _, _, _ = fresnel_dielectric(cos_theta, m.eta)
    return ONE - f


@kernel
def sample_plastic(m: Bsdf, wi: Vec3, u_lobe: np.float32, u: np.float32, v: np.float32) -> Sample:
    """The mirror direction, or a cosine-distributed one."""
    if wi[2] <= ZERO:
        return NO_SAMPLE
    t_i = smooth_transmittance(m, wi[2])
    p = specular_probability(m, t_i)
    if u_lobe < p:
        return Sample(SPECULAR_EVENT, reflect(wi), scale(m.b, (ONE - t_i) / p), ZERO, ONE)
    wo = sample_cosine_hemisphere(u, v)
    pdf = (ONE - p) * pdf_cosine_hemisphere(wo[2])
    if not pdf > ZERO:
        return NO_SAMPLE
    return Sample(DIFFUSE_EVENT, wo, scale(base_color(m), t_i * smooth_transmittance(m, wo[2]) / (ONE - p)), pdf, ONE)


@kernel
def eval_plastic(m: Bsdf, wi: Vec3, wo: Vec3) -> tuple[np.int32, Vec3, np.float32]:
    """Event, f cos_o and density of the diffuse lobe."""
    if wi[2] <= ZERO or wo[2] <= ZERO:
        return DIFFUSE_EVENT, BLACK, ZERO
    t_i = smooth_transmittance(m, wi[2])
    pdf = pdf_cosine_hemisphere(wo[2])
    value = scale(base_color(m), pdf * t_i * smooth_transmittance(m, wo[2]))
    return DIFFUSE_EVENT, value, pdf * (ONE - specular_probability(m, t_i))


@kernel
def rough_transmittance(tables: npt.NDArray[np.float32] | None, row: int, cos_theta: np.float32) -> np.float32:
    """What the rough coat lets through: one row of the tables, linear in cos theta."""
    if tables is None:
        return ZERO
    last = tables.shape[1] - 1
    x = cos_theta * np.float32(last)
    i = min(int(x), last - 1)
    w = x - np.float32(i)
    transmittance: np.float32 = (ONE - w) * tables[row, i] + w * tables[row, i + 1]
    return transmittance


@kernel
def sample_rough_plastic(m: Bsdf, tables: npt.NDArray[np.float32] | None, wi: Vec3, u_lobe: np.float32, u: np.float32, v: np.float32) -> Sample:
    """Reflect about a visible microfacet, or a cosine-distributed direction."""
    if wi[2] <= ZERO:
        return NO_SAMPLE
    t_i = rough_transmittance(tables, m.table, wi[2])
    p = specular_probability(m, t_i)

    if u_lobe < p:
        h = sample_visible_normal(m.distribution, m.alpha_u, m.alpha_v, wi, u, v)
        wo = reflect_about(wi, h)
        mass = visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi)
        pdf = p * microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h) * mass / (FOUR * wi[2])
        if not wo[2] > ZERO or not pdf > ZERO:
            return NO_SAMPLE
        g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h)
        f, _, _, _ = fresnel_dielectric(dot(wi, h), m.eta)
        return Sample(GLOSSY_EVENT, wo, scale(m.b, f * g / (mass * p)), pdf, ONE)

    wo = sample_cosine_hemisphere(u, v)
    pdf = (ONE - p) * pdf_cosine_hemisphere(wo[2])
    if not pdf > ZERO:
        return NO_SAMPLE
    t_o = rough_transmittance(tables, m.table, wo[2])
    return Sample(DIFFUSE_EVENT, wo, scale(base_color(m), t_i * t_o / (ONE - p)), pdf, ONE)


@kernel
def eval_rough_plastic(m: Bsdf, tables: npt.NDArray[np.float32] | None, lobe: int, wi: Vec3, wo: Vec3) -> tuple[np.int32, Vec3, np.float32]:
    """Event, f cos_o and density of lobe 0, glossy, or lobe 1, diffuse."""
    event = GLOSSY_EVENT if lobe == 0 else DIFFUSE_EVENT
    if wi[2] <= ZERO or wo[2] <= ZERO:
        return event, BLACK, ZERO
    t_i = rough_transmittance(tables, m.table, wi[2])
    p = specular_probability(m, t_i)

    if lobe == 0:
        h = normalize(add(wi, wo))
        d = microfacet_density(m.distribution, m.alpha_u, m.alpha_v, h)
        if d == ZERO:
            return event, BLACK, ZERO
        g = smith_g1(m.distribution, m.alpha_u, m.alpha_v, wi, h) * smith_g1(m.distribution, m.alpha_u, m.alpha_v, wo, h)
        f, _, _, _ = fresnel_dielectric(dot(wi, h), m.eta)
        mass = visible_mass(m.distribution, m.alpha_u, m.alpha_v, wi)
        return event, scale(m.b, f * d * (g / (FOUR * wi[2]))), p * d * (mass / (FOUR * wi[2]))

    pdf = pdf_cosine_hemisphere(wo[2])
    t_o = rough_transmittance(tables, m.table, wo[2])
    return event, scale(base_color(m), pdf * t_i * t_o), (ONE - p) * pdf
