"""BSDFs against Mitsuba 3, pointwise, and the tables of plastics."""

from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from bsdf_cases import CASES, DELTA, EVENTS, SMOOTH, Array, case, evaluate, materials_of, random_directions, rgb, sample, total_value

from renderer.bsdfs.tables import (
    internal_diffuse_reflectance,
    rough_internal_reflectance,
    rough_plastic_table,
)
from renderer.tables import (
    ABSORBED,
    DIFFUSE_REFLECTION,
    SPECULAR_REFLECTION,
    SPECULAR_TRANSMISSION,
    STRAIGHT_TRANSMISSION,
)

mi.set_variant("scalar_rgb")

# --- equality with Mitsuba 3 ---------------------------------------------------------------------------------------


def mitsuba_context(adjoint: bool) -> Any:
    return mi.BSDFContext(mi.TransportMode.Importance if adjoint else mi.TransportMode.Radiance)


def mitsuba_point(wi: Array) -> Any:
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*map(float, wi))
    si.uv = [0.5, 0.5]
    return si


def mitsuba_eval_pdf(bsdf: Any, wi: Array, wo: Array, adjoint: bool) -> tuple[Array, Array]:
    context = mitsuba_context(adjoint)
    pairs = [bsdf.eval_pdf(context, mitsuba_point(a), mi.Vector3f(*map(float, b))) for a, b in zip(wi, wo, strict=True)]
    return np.array([[*value] for value, _ in pairs], float), np.array([pdf for _, pdf in pairs], float)


@pytest.mark.parametrize("adjoint", [False, True])
@pytest.mark.parametrize("name", SMOOTH)
def test_eval_and_pdf_equal_mitsuba(name: str, adjoint: bool) -> None:
    materials, bsdf = case(name)
    rng = np.random.default_rng(10)
    # Random pairs, and pairs that sampling prefers
    wi = random_directions(rng, 800)
    event, sampled, *_ = sample(materials, wi, rng.random((800, 3)))
    wo = np.where((np.arange(800)[:, None] % 2 == 0) & (event[:, None] != ABSORBED), sampled, random_directions(rng, 800))
    keep = (np.abs(wi[:, 2]) > 0.01) & (np.abs(wo[:, 2]) > 0.01)
    wi, wo = wi[keep], wo[keep]
    value, pdf = mitsuba_eval_pdf(bsdf, wi, wo, adjoint)
    assert np.count_nonzero(value[:, 0]) > 150

    np.testing.assert_allclose(total_value(materials, wi, wo, adjoint), value, rtol=3e-4, atol=2e-7)
    # Ours uses Beckmann's exact shadowing, Mitsuba's a fit: 0.4 %
    own_pdf = sum(evaluate(materials, lobe, wi, wo, adjoint)[2] for lobe in range(len(EVENTS[CASES[name]["type"]])))
    np.testing.assert_allclose(own_pdf, pdf, rtol=4e-3 if "beckmann" in name else 3e-4, atol=2e-7)


def mitsuba_events(component_type: int) -> int:
    flags = mi.BSDFFlags
    return {
        int(flags.DeltaReflection): SPECULAR_REFLECTION,
        int(flags.DeltaTransmission): SPECULAR_TRANSMISSION,
        int(flags.Null): STRAIGHT_TRANSMISSION,
        int(flags.DiffuseReflection): DIFFUSE_REFLECTION,
    }[component_type]


@pytest.mark.parametrize("adjoint", [False, True])
@pytest.mark.parametrize("name", [*DELTA, "plastic", "plastic-nonlinear"])
def test_delta_samples_equal_mitsuba(name: str, adjoint: bool) -> None:
    materials, bsdf = case(name)
    rng = np.random.default_rng(11)
    wi, uniforms = random_directions(rng, 400), rng.random((400, 3)).astype(np.float32)
    event, wo, weight, _, eta = sample(materials, wi, uniforms, adjoint)
    specular = 0
    for i in range(400):
        s, value = bsdf.sample(mitsuba_context(adjoint), mitsuba_point(wi[i]), float(uniforms[i, 0]), mi.Point2f(*map(float, uniforms[i, 1:])))
        if max(*value) == 0:
            assert event[i] == ABSORBED
            continue
        assert event[i] == mitsuba_events(int(s.sampled_type))
        specular += event[i] != DIFFUSE_REFLECTION
        np.testing.assert_allclose(wo[i], [*s.wo], rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(weight[i], [*value], rtol=1e-4)
        assert eta[i] == pytest.approx(s.eta, rel=1e-6)
    assert specular > 10


@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
@pytest.mark.parametrize("alpha", [0.02, 0.3, 1.0])
@pytest.mark.parametrize("ior", [1.1, 1.9])
def test_rough_plastic_tables_equal_mitsubas(distribution: str, alpha: float, ior: float) -> None:
    """Without its glossy lobe, a rough plastic seen from where the light comes shows T(theta)²."""
    description = {"type": "roughplastic", "distribution": distribution, "alpha": alpha, "int_ior": ior, "ext_ior": 1.0}
    description |= {"diffuse_reflectance": rgb(0.5, 0.5, 0.5), "specular_reflectance": rgb(0, 0, 0)}
    cos = np.linspace(0.01, 1.0, 60)
    w = np.stack((np.sqrt(1 - cos * cos), np.zeros(60), cos), axis=1).astype(np.float32)
    value, _ = mitsuba_eval_pdf(mi.load_dict(description), w, w, False)
    np.testing.assert_allclose(total_value(materials_of(description), w, w), value, rtol=2e-5)


# --- tables --------------------------------------------------------------------------------------------------------


def fresnel(cos: Array, eta: float) -> Array:
    cos_t = np.sqrt(np.maximum(0, 1 - (1 - cos * cos) / eta**2))
    return 0.5 * (((cos - eta * cos_t) / (cos + eta * cos_t)) ** 2 + ((cos_t - eta * cos) / (cos_t + eta * cos)) ** 2)


@pytest.mark.parametrize("eta", [1.1, 1.33, 1.5, 1.9])
def test_a_nearly_smooth_coat_transmits_as_fresnel_says(eta: float) -> None:
    cos = np.linspace(0, 1, 64)
    for distribution in (0, 1):
        table = rough_plastic_table(distribution, 1e-4, eta)
        assert table.shape == (64,)
        assert table.dtype == np.float32
        np.testing.assert_allclose(table[4:], 1 - fresnel(cos[4:], eta), atol=1e-3)
        assert rough_internal_reflectance(distribution, 1e-4, eta) == pytest.approx(internal_diffuse_reflectance(eta), abs=0.02)


@pytest.mark.parametrize("eta", [1.1, 1.33, 1.5, 1.9, 3.5, 5.0])
def test_internal_reflectance_is_the_cosine_weighted_mean(eta: float) -> None:
    cos = (np.arange(1_000_000) + 0.5) / 1_000_000
    assert internal_diffuse_reflectance(eta) == pytest.approx(np.mean(2 * cos * fresnel(cos, 1 / eta)), rel=0.01)


def test_a_rougher_coat_passes_less() -> None:
    tables = [rough_plastic_table(1, alpha, 1.5) for alpha in (0.05, 0.3, 0.8)]
    assert np.all(np.diff([t[-1] for t in tables]) < 0)
    assert all(np.all((t >= 0) & (t < 0.97)) for t in tables)
