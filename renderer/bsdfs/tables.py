"""What the scene compiler works out once for each plastic: reflectances of its coat, and the tables of the rough one.

A rough coat's reflectance and transmittance for light from direction wi are means over the facets that wi sees (density D_wi),

    R(wi) = integral of F(wi . h) G1(wo, h) D_wi(h) dh,          wo = wi reflected about h, 0 where it points inside,
    T(wi) = integral of (1 - F(wi . h)) G1(wo, h) D_wi(h) dh,    wo = wi refracted at h, 0 where it points outside,

computed by Gauss-Legendre quadrature over the unit square that ``sample_visible_normal`` maps to D_wi. Node counts and the
sums over cos theta are those of Mitsuba 3, whose plastics these constants define.
"""

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.microfacet import sample_visible_normal, smith_g1
from renderer.kernel import kernel
from renderer.math.fresnel import fresnel_dielectric, reflect_about, refract_about
from renderer.math.vec import ONE, ZERO, Vec3, dot

RESOLUTION = 64  # samples of cos theta in [0, 1], both ends included
NODES_OUTSIDE, NODES_INSIDE = 32, 128  # quadrature nodes on a side; inside, total reflection makes a kink
SMALLEST_COS = 1e-6
LARGEST_FITTED_ETA = 3.0

F32 = npt.NDArray[np.float32]


def specular_sampling_weight(diffuse_mean: float, specular_mean: float) -> float:
    """How much the specular lobe of a plastic is preferred: its mean color in both lobes' (0.5 where both are black)."""
    total = diffuse_mean + specular_mean
    return specular_mean / total if total > 0 else 0.5


def internal_diffuse_reflectance(eta: float) -> float:
    """Part of diffuse light inside a smooth coat of relative index ``eta`` (interior over exterior) that is reflected back inside.

    Mitsuba's fit, up to an index of 3; it exceeds 1 soon after, so there the exterior's reflectance gives it: F_in = 1 - (1 - F_out) / eta².
    """
    if eta > LARGEST_FITTED_ETA:
        return 1.0 - (1.0 - diffuse_fresnel_reflectance(eta)) / eta**2
    return diffuse_fresnel_reflectance(1.0 / eta)


def diffuse_fresnel_reflectance(eta: float) -> float:
    """Fresnel's reflectance averaged over cosine-weighted directions on the exterior side.

    Polynomial fits: below 1 egan1973 (within 0.6 % for 1 / eta < 2), above deon2011 (within 0.2 %).
    """
    if eta < 1.0:
        return -1.4399 * eta**2 + 0.7099 * eta + 0.6681 + 0.0636 / eta
    x = 1.0 / eta
    return 0.919317 - 3.4793 * x + 6.75335 * x**2 - 7.80989 * x**3 + 4.98554 * x**4 - 1.36881 * x**5


def rough_plastic_table(distribution: int, alpha: float, eta: float) -> F32:
    """Transmittance T(wi) of a rough coat from outside, float32[64] over cos theta = 0 … 1 (``BECKMANN`` or ``GGX``)."""
    return rough_interface(distribution, alpha, eta, transmitted=True)


def rough_internal_reflectance(distribution: int, alpha: float, eta: float) -> float:
    """Part of diffuse light inside a rough coat that is reflected back inside: 2 mean of R(mu) mu over the 64 samples mu."""
    return float(2.0 * np.mean(rough_interface(distribution, alpha, 1.0 / eta, transmitted=False) * cosines(), dtype=np.float64))


def cosines() -> F32:
    """The 64 values of cos theta; the first is not quite 0."""
    return np.maximum(SMALLEST_COS, np.linspace(0.0, 1.0, RESOLUTION)).astype(np.float32)


def rough_interface(distribution: int, alpha: float, eta: float, transmitted: bool) -> F32:
    """T or R of a rough interface at the 64 values of cos theta; ``eta`` is the index behind it over the index on wi's side."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES_OUTSIDE if eta > 1.0 else NODES_INSIDE)
    alpha32 = np.float32(max(alpha, 1e-4))
    result = np.empty(RESOLUTION, np.float32)
    nodes32 = (0.5 * nodes + 0.5).astype(np.float32)
    integrate_interface(np.int32(distribution), alpha32, np.float32(eta), transmitted, cosines(), nodes32, 0.5 * weights, result)
    return np.clip(result, 0.0, 1.0)


@kernel
def integrate_interface(
    distribution: np.int32,
    alpha: np.float32,
    eta: np.float32,
    transmitted: bool,
    mu: F32,
    nodes: F32,
    weights: npt.NDArray[np.float64],
    result: F32,
) -> None:
    """Fill result[i] with T or R at cos theta mu[i] by the product rule of ``nodes`` in [0, 1] and ``weights`` that sum to 1."""
    for i in range(mu.shape[0]):
        wi = (np.sqrt(np.float32(1.0) - mu[i] * mu[i]), ZERO, mu[i])
        total = 0.0
        for j in range(nodes.shape[0]):
            for k in range(nodes.shape[0]):
                h = sample_visible_normal(distribution, alpha, alpha, wi, nodes[j], nodes[k])
                total += weights[j] * weights[k] * scattered(distribution, alpha, eta, transmitted, wi, h)
        result[i] = total


@kernel
def scattered(distribution: np.int32, alpha: np.float32, eta: np.float32, transmitted: bool, wi: Vec3, h: Vec3) -> np.float32:
    """(1 - F) G1 or F G1 at facet h, zero where the scattered direction is on the wrong side of the surface."""
    f, cos_t, _, eta_ti = fresnel_dielectric(dot(wi, h), eta)
    if transmitted:
        wo = refract_about(wi, h, cos_t, eta_ti)
        return (ONE - f) * smith_g1(distribution, alpha, alpha, wo, h) if wo[2] < ZERO else ZERO
    wo = reflect_about(wi, h)
    return f * smith_g1(distribution, alpha, alpha, wo, h) if wo[2] > ZERO else ZERO
