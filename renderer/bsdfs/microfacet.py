"""Microfacet distributions: Beckmann and GGX, anisotropic, with Smith's shadowing and visible-normal sampling.

All functions take the distribution (``BECKMANN`` or ``GGX``) and the roughness along the two tangents. Formulas are those of
walter2007, the sampling of visible normals is by heitz2014, jakob2014 (Beckmann) and heitz2018 (GGX).
"""

import numpy as np

from renderer.bsdfs.base import BECKMANN
from renderer.kernel import kernel
from renderer.math.erf import erf, erfinv
from renderer.math.vec import HALF, ONE, PI, TWO, ZERO, Vec3, dot, normalize
from renderer.math.warp import sample_disk

INV_SQRT_PI = np.float32(1 / np.sqrt(np.pi))
TINY = np.float32(1e-20)
CLAMP = np.float32(1e-6)
INSIDE_ERF = np.float32(1 - 1e-6)
FIRST_ROUGHNESS = np.float32(1.6)  # above it Beckmann's shadowing is taken as 1
R1, R2, R3, R4 = (np.float32(c) for c in (3.535, 2.181, 2.276, 2.577))


@kernel
def microfacet_density(distribution: np.int32, alpha_u: np.float32, alpha_v: np.float32, m: Vec3) -> np.float32:
    """D(m): area of microfacets with normal m, per unit of macrosurface area and steradian."""
    if not m[2] > ZERO:
        return ZERO
    x = m[0] / alpha_u
    y = m[1] / alpha_v
    squared_cos = m[2] * m[2]
    if distribution == BECKMANN:
        d = np.exp(-(x * x + y * y) / squared_cos) / (PI * alpha_u * alpha_v * squared_cos * squared_cos)
    else:
        t = x * x + y * y + squared_cos
        d = ONE / (PI * alpha_u * alpha_v * t * t)
    # Also false for NaN, which grazing normals give
    return d if d * m[2] > TINY else ZERO


@kernel
def squared_alpha_tan(alpha_u: np.float32, alpha_v: np.float32, v: Vec3) -> np.float32:
    """(alpha tan theta)² of direction v, alpha being the roughness along v's azimuth."""
    x = alpha_u * v[0]
    y = alpha_v * v[1]
    return (x * x + y * y) / (v[2] * v[2])


@kernel
def ggx_g1(squared_alpha_tan: np.float32) -> np.float32:
    """Smith's shadowing of GGX, which is exact."""
    root: np.float32 = np.sqrt(ONE + squared_alpha_tan)
    return TWO / (ONE + root)


@kernel
def smith_g1(distribution: np.int32, alpha_u: np.float32, alpha_v: np.float32, v: Vec3, m: Vec3) -> np.float32:
    """Smith's shadowing of direction v: the visible fraction of the microfacets with normal m.

    Zero where v sees m from the wrong side. Beckmann's is walter2007's rational fit, up to 0.4 % from ``visible_mass``.
    """
    if not dot(v, m) * v[2] > ZERO:
        return ZERO
    t = squared_alpha_tan(alpha_u, alpha_v, v)
    if t == ZERO:
        return ONE
    if distribution != BECKMANN:
        return ggx_g1(t)
    a: np.float32 = ONE / np.sqrt(t)
    if a >= FIRST_ROUGHNESS:
        return ONE
    return (R1 * a + R2 * a * a) / (ONE + R3 * a + R4 * a * a)


@kernel
def visible_mass(distribution: np.int32, alpha_u: np.float32, alpha_v: np.float32, v: Vec3) -> np.float32:
    """Exactly cos(v) over the projected area of all microfacets that face v, so that ``pdf_visible_normal`` integrates to 1."""
    t = squared_alpha_tan(alpha_u, alpha_v, v)
    if t == ZERO:
        return ONE
    if distribution != BECKMANN:
        return ggx_g1(t)
    a: np.float32 = ONE / np.sqrt(t)
    gauss: np.float32 = np.exp(-a * a)
    return TWO / (ONE + erf(a) + INV_SQRT_PI * gauss / a)


@kernel
def pdf_visible_normal(distribution: np.int32, alpha_u: np.float32, alpha_v: np.float32, wi: Vec3, m: Vec3) -> np.float32:
    """Density per steradian of ``sample_visible_normal``; wi is above the surface."""
    d = dot(wi, m)
    if not d > ZERO or not wi[2] > ZERO:
        return ZERO
    return microfacet_density(distribution, alpha_u, alpha_v, m) * visible_mass(distribution, alpha_u, alpha_v, wi) * d / wi[2]


@kernel
def sample_visible_normal(distribution: np.int32, alpha_u: np.float32, alpha_v: np.float32, wi: Vec3, u: np.float32, v: np.float32) -> Vec3:
    """A microfacet normal as seen from wi, which is above the surface."""
    # Stretch wi, so that the roughness is 1
    w = normalize((alpha_u * wi[0], alpha_v * wi[1], wi[2]))
    sin_theta = np.sqrt(w[0] * w[0] + w[1] * w[1])
    if sin_theta > ZERO:
        cos_phi, sin_phi = w[0] / sin_theta, w[1] / sin_theta
    else:
        cos_phi, sin_phi = ONE, ZERO

    # Slopes along wi's azimuth and across it
    if distribution == BECKMANN:
        along, across = sample_beckmann_slopes(w[2], sin_theta, u, v)
    else:
        along, across = sample_ggx_slopes(w[2], sin_theta, u, v)

    # Turn and unstretch
    x = (cos_phi * along - sin_phi * across) * alpha_u
    y = (sin_phi * along + cos_phi * across) * alpha_v
    return normalize((-x, -y, ONE))


@kernel
def sample_beckmann_slopes(cos_theta: np.float32, sin_theta: np.float32, u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """Visible slopes of a Beckmann surface of roughness 1: three Newton steps in the domain of erf (jakob2014)."""
    tan_theta = sin_theta / cos_theta
    cot_theta = cos_theta / sin_theta
    u = min(max(u, CLAMP), ONE - CLAMP)

    # First guess: the solution for a grazing direction
    largest = erf(cot_theta)
    x = largest - (largest + ONE) * erf(np.sqrt(-np.log(u)))
    target = u * (ONE + largest + INV_SQRT_PI * tan_theta * np.exp(-cot_theta * cot_theta))

    for _ in range(3):
        x = min(max(x, -INSIDE_ERF), INSIDE_ERF)
        slope = erfinv(x)
        value = ONE + x + INV_SQRT_PI * tan_theta * np.exp(-slope * slope) - target
        x -= value / (ONE - slope * tan_theta)
    x = min(max(x, -INSIDE_ERF), INSIDE_ERF)
    y = min(max(TWO * v - ONE, -INSIDE_ERF), INSIDE_ERF)
    return erfinv(x), erfinv(y)


@kernel
def sample_ggx_slopes(cos_theta: np.float32, sin_theta: np.float32, u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """Visible slopes of a GGX surface of roughness 1: a point of the projected hemisphere (heitz2018)."""
    x, y = sample_disk(u, v)
    s = HALF * (ONE + cos_theta)
    y = (ONE - s) * np.sqrt(max(ZERO, ONE - x * x)) + s * y
    z = np.sqrt(max(ZERO, ONE - x * x - y * y))
    norm = ONE / (sin_theta * y + cos_theta * z)
    return (cos_theta * y - sin_theta * z) * norm, x * norm
