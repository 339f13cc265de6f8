"""BSDFs: samplers against densities, reciprocity, energy, robustness and specialization."""

import json
import os
import subprocess
import sys

import numba
import numpy as np
import pytest
from bsdf_cases import (
    CASES,
    DELTA,
    EVENTS,
    GLASS,
    GOLD,
    PAINT,
    SMOOTH,
    Array,
    case,
    direction,
    evaluate,
    lobes,
    materials_of,
    random_directions,
    rgb,
    sample,
    sample_arrays,
    sample_many,
    total_value,
)
from chi2 import Chart, chi_square_p_value, significance

from renderer.bsdfs.base import KINDS, Families
from renderer.bsdfs.dispatch import load_bsdf
from renderer.kernel import kernel
from renderer.tables import (
    ABSORBED,
    GLOSSY_TRANSMISSION,
    SPECULAR_TRANSMISSION,
)
from renderer.textures.base import CHECKERBOARD, Textures

# --- samplers against densities ------------------------------------------------------------------------------------

CHI_SQUARE_SAMPLES = 200_000
CHI_SQUARE = [
    (name, lobe, degrees)
    for name in SMOOTH
    for lobe in range(2 if name.startswith(("roughdielectric", "roughplastic")) else 1)
    for degrees in ((10, 60, 80) if name.startswith("rough") else (30,)) + ((145, 170) if name.startswith("roughdielectric") else ())
]


@pytest.mark.parametrize(("name", "lobe", "degrees"), CHI_SQUARE)
def test_each_lobe_is_sampled_with_its_density(name: str, lobe: int, degrees: float) -> None:
    materials, _ = case(name)
    wi = direction(degrees)
    event, wo, _, _, _ = sample(materials, wi, np.random.default_rng(1).random((CHI_SQUARE_SAMPLES, 3)))
    own = event == EVENTS[CASES[name]["type"]][lobe]

    def pdf(w: Array) -> Array:
        return evaluate(materials, lobe, wi, w)[2]

    sharp = name.endswith("-0.1")
    p = chi_square_p_value(wo[own], CHI_SQUARE_SAMPLES, pdf, Chart(20, 40), order=16 if sharp else 8)
    assert p > significance(len(CHI_SQUARE))


@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
@pytest.mark.parametrize("alpha", [0.001, 0.01])
def test_sharp_lobes_are_sampled_with_their_density(distribution: str, alpha: float) -> None:
    materials = materials_of({"type": "roughconductor", "distribution": distribution, "alpha": alpha, **GOLD})
    wi = direction(50).astype(float)
    wi /= np.linalg.norm(wi)
    event, wo, _, _, _ = sample(materials, wi, np.random.default_rng(2).random((CHI_SQUARE_SAMPLES, 3)))
    chart = Chart(12, 24, axis=(-wi[0], -wi[1], wi[2]), spread=4 * alpha**2)
    p = chi_square_p_value(wo[event != ABSORBED], CHI_SQUARE_SAMPLES, lambda w: evaluate(materials, 0, wi, w)[2], chart, order=16)
    assert p > significance(4)


@pytest.mark.parametrize("adjoint", [False, True])
@pytest.mark.parametrize("name", SMOOTH)
def test_weight_is_value_over_density(name: str, adjoint: bool) -> None:
    materials, _ = case(name)
    rng = np.random.default_rng(3)
    wi = random_directions(rng, 4000)
    event, wo, weight, pdf, eta = sample(materials, wi, rng.random((4000, 3)), adjoint)
    checked = 0
    for lobe, own_event in enumerate(EVENTS[CASES[name]["type"]]):
        # Half vectors that are rebuilt from directions near the horizon lose digits
        own = (event == own_event) & (np.abs(wi[:, 2]) > 0.05) & (np.abs(wo[:, 2]) > 0.05)
        again, value, density = evaluate(materials, lobe, wi[own], wo[own], adjoint)
        checked += own.sum()
        assert np.all(again == own_event)
        np.testing.assert_allclose(density, pdf[own], rtol=2e-3)
        np.testing.assert_allclose(value, weight[own] * pdf[own, None], rtol=2e-3, atol=1e-7)
        ior = CASES[name].get("int_ior", 1.0)
        crossed = np.where(wi[own][:, 2] > 0, ior, 1 / ior) if own_event == GLOSSY_TRANSMISSION else 1.0
        np.testing.assert_allclose(eta[own], crossed, rtol=1e-6)
    assert checked > 1000


@pytest.mark.parametrize("name", ["diffuse", "plastic", "roughplastic-ggx-0.6", "roughdielectric-ggx-0.5", "roughconductor-beckmann-0.5"])
def test_densities_integrate_to_the_lobe_probabilities(name: str) -> None:
    materials, _ = case(name)
    n = 200_000
    for degrees in (20, 70, 150) if name.startswith("roughdielectric") else (20, 70):
        wi = direction(degrees)
        event, *_ = sample(materials, wi, np.random.default_rng(4).random((n, 3)))
        for lobe, own_event in enumerate(EVENTS[CASES[name]["type"]]):
            integral = Chart(60, 120).integrate(lambda w, k=lobe, d=wi: evaluate(materials, k, d, w)[2], 4).sum()
            part = np.mean(event == own_event)
            assert abs(part - integral) < 5 * np.sqrt(integral * (1 - integral) / n) + 2e-4


# --- reciprocity and energy ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SMOOTH)
def test_reciprocity(name: str) -> None:
    """The adjoint BSDF is the BSDF with the directions exchanged; only refraction tells them apart."""
    materials, _ = case(name)
    rng = np.random.default_rng(5)
    a, b = random_directions(rng, 3000), random_directions(rng, 3000)
    keep = (np.abs(a[:, 2]) > 0.02) & (np.abs(b[:, 2]) > 0.02)
    a, b = a[keep], b[keep]
    forth = total_value(materials, a, b, adjoint=True) / np.abs(b[:, 2:])
    back = total_value(materials, b, a, adjoint=False) / np.abs(a[:, 2:])
    assert np.count_nonzero(forth) > 600
    # Where a direction only just sees the facet, rounding decides whether it does; the value goes to zero there
    np.testing.assert_allclose(forth, back, rtol=3e-4, atol=1e-5)


@pytest.mark.parametrize("name", ["roughdielectric-ggx-0.5", "roughdielectric-beckmann-aniso", "dielectric"])
def test_radiance_is_scaled_by_squared_eta_where_it_is_refracted(name: str) -> None:
    materials, _ = case(name)
    uniforms = np.random.default_rng(6).random((500, 3))
    for degrees in (30, 150):
        event, _, radiance, _, eta = sample(materials, direction(degrees), uniforms, False)
        _, _, importance, _, _ = sample(materials, direction(degrees), uniforms, True)
        np.testing.assert_allclose(radiance, importance / eta[:, None] ** 2, rtol=1e-5)
        crossed = np.isin(event, (GLOSSY_TRANSMISSION, SPECULAR_TRANSMISSION))
        assert crossed.sum() > 100
        np.testing.assert_allclose(eta[crossed], 1.5 if degrees < 90 else 1 / 1.5, rtol=1e-6)


WHITE = {"specular_reflectance": rgb(1, 1, 1), "specular_transmittance": rgb(1, 1, 1), "diffuse_reflectance": rgb(1, 1, 1)}


@pytest.mark.parametrize("degrees", [5, 45, 85, 135])
@pytest.mark.parametrize("name", CASES)
def test_no_energy_is_made(name: str, degrees: float) -> None:
    """White furnace: with all colors white a BSDF returns at most what it gets (importance's weight: no eta² in it)."""
    white = {key: WHITE.get(key, value) for key, value in CASES[name].items()}
    if "conductor" in name:
        white |= {"eta": rgb(0, 0, 0), "k": rgb(1, 1, 1)}
    _, _, weight, _, _ = sample(materials_of(white), direction(degrees), np.random.default_rng(7).random((20_000, 3)), adjoint=True)
    mean, error = weight.mean(axis=0), weight.std(axis=0) / np.sqrt(len(weight))
    # Beckmann's fitted shadowing may be 0.4 % high; a rough plastic's lobes come from two approximations
    slack = 4e-3 if "beckmann" in name else 1e-3 if "roughplastic" in name else 1e-5
    assert np.all(mean <= 1 + slack + 4.5 * error)
    if degrees < 90 or "dielectric" in name:
        assert np.all(mean > 0.05)


def test_perfect_mirrors_and_smooth_glass_keep_all_energy() -> None:
    uniforms = np.random.default_rng(8).random((1000, 3))
    for description in (
        {"type": "conductor", "eta": rgb(0, 0, 0), "k": rgb(1, 1, 1)},
        {"type": "dielectric", "int_ior": 1.5},
        {"type": "thindielectric", "int_ior": 1.5},
    ):
        for degrees in (0, 30, 89.9):
            _, _, weight, _, _ = sample(materials_of(description), direction(degrees), uniforms, adjoint=True)
            np.testing.assert_allclose(weight, 1.0, rtol=1e-6)


def test_a_rough_mirror_at_normal_incidence_loses_what_its_masking_says() -> None:
    """Albedo of GGX at normal incidence: the mean of G1(wo) over tan² theta_h = alpha² u / (1 - u), in closed form."""
    alpha = 0.5
    materials = materials_of({"type": "roughconductor", "distribution": "ggx", "alpha": alpha, "eta": rgb(0, 0, 0), "k": rgb(1, 1, 1)})
    u = (np.arange(100_000) + 0.5) / 100_000
    theta_o = 2 * np.arctan(alpha * np.sqrt(u / (1 - u)))
    g1 = np.where(theta_o < np.pi / 2, 2 / (1 + np.sqrt(1 + (alpha * np.tan(theta_o)) ** 2)), 0.0)
    _, _, weight, _, _ = sample(materials, direction(0), np.random.default_rng(9).random((200_000, 3)))
    assert abs(weight[:, 0].mean() - g1.mean()) < 4.5 * weight[:, 0].std() / np.sqrt(200_000)


# --- robustness ----------------------------------------------------------------------------------------------------


def is_table_heavy(kind: str, alpha: float, ior: float) -> bool:
    """Whether a case integrates tables between those of the extremes."""
    return kind == "roughplastic" and (alpha == 1e-2 or ior == 1.5)


@pytest.mark.parametrize(
    ("kind", "alpha", "ior"),
    [
        pytest.param(kind, alpha, ior, marks=pytest.mark.slow) if is_table_heavy(kind, alpha, ior) else (kind, alpha, ior)
        for kind in KINDS
        for alpha in ((1.0,) if kind in ("diffuse", "conductor") else (1e-4, 1e-2, 1.0))
        for ior in ((1.5,) if kind in ("diffuse", "conductor") else (1.00001, 1.5, 1 / 1.5, 4.0))
    ],
)
def test_extremes_give_no_nan(kind: str, alpha: float, ior: float) -> None:
    rng = np.random.default_rng(12)
    z = np.repeat(np.array([0.0, 1e-30, 1e-20, 1e-10, 1e-7, 1e-4, 0.01, 0.5, 1.0], np.float32), 64)
    z = np.concatenate((z, -z))
    phi = rng.uniform(0, 2 * np.pi, len(z))
    r = np.sqrt(1 - z.astype(float) ** 2)
    wi = np.stack((r * np.cos(phi), r * np.sin(phi), z), axis=1).astype(np.float32)
    uniforms = rng.random((len(z), 3)).astype(np.float32)
    uniforms[::5, 1] = 0.0
    uniforms[::7, 2] = np.float32(1 - 2**-24)
    opposite = np.concatenate((wi, -wi, wi * (-1, -1, 1), rng.permutation(wi))).astype(np.float32)

    for distribution in ("beckmann", "ggx"):
        description = {**GOLD, **GLASS, **PAINT} | {"type": kind, "alpha": alpha, "int_ior": ior, "distribution": distribution}
        materials = materials_of(description)
        for adjoint in (False, True):
            event, wo, weight, pdf, _ = sample(materials, wi, uniforms, adjoint)
            for array in (wo, weight, pdf):
                assert np.all(np.isfinite(array))
            alive = event != ABSORBED
            np.testing.assert_allclose(np.linalg.norm(wo[alive], axis=1), 1.0, atol=2e-3)
            assert np.all(weight >= 0)
            assert np.all(weight[~alive] == 0)
            assert np.all(pdf >= 0)
            for lobe in range(2):
                _, value, density = evaluate(materials, lobe, np.tile(wi, (4, 1)), opposite, adjoint)
                assert np.all(np.isfinite(value))
                assert np.all(np.isfinite(density))
                assert np.all(value >= 0)
                assert np.all(density >= 0)


@kernel
def load_one(materials, textures, u, v, out):
    m = load_bsdf(materials, textures, Families(True, True, True), 0, u, v)
    out[:] = (m.a[0], m.a[1], m.a[2], m.b[0], m.b[1], m.b[2], m.alpha_u, m.alpha_v)


def test_textures_replace_constants() -> None:
    """Column a, column b and the roughness each from a checkerboard; a roughness is the luminance of its color."""
    colors = np.array([[[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]], [[0.7, 0.7, 0.7], [0.0, 0.0, 0.0]]], np.float32)
    textures = Textures(
        np.full(2, CHECKERBOARD, np.int32),
        np.tile(np.array([[[1, 0, 0], [0, 1, 0]]], np.float32), (2, 1, 1)),
        colors,
        np.zeros(2, np.int64),
        np.ones((2, 2), np.int32),
        np.zeros((2, 2), np.int32),
        np.zeros((1, 3), np.float32),
    )
    materials = materials_of(CASES["roughdielectric-ggx-0.5"])
    materials.index[0, :4] = 0, -1, 1, -1
    out = np.empty(8, np.float32)
    load_one(materials, textures, np.float32(0.25), np.float32(0.25), out)
    np.testing.assert_allclose(out, [0.1, 0.2, 0.3, 0.6, 0.7, 0.8, 0.7, 0.5], rtol=1e-6)
    load_one(materials, textures, np.float32(0.75), np.float32(0.25), out)
    np.testing.assert_allclose(out, [0.4, 0.5, 0.6, 0.6, 0.7, 0.8, 1e-4, 0.5], rtol=1e-6)


def test_roughness_is_at_least_a_ten_thousandth() -> None:
    smooth, least = (materials_of({"type": "roughconductor", "alpha": alpha, **GOLD}) for alpha in (0.0, 1e-4))
    uniforms = np.random.default_rng(13).random((100, 3))
    for a, b in zip(sample(smooth, direction(30), uniforms), sample(least, direction(30), uniforms), strict=True):
        np.testing.assert_array_equal(a, b)


# --- specialization ------------------------------------------------------------------------------------------------


def test_a_scene_of_diffuse_surfaces_compiles_nothing_else() -> None:
    """The kernel for families that are all None has no callee of theirs, and gives the same numbers."""
    materials = materials_of(SMOOTH["diffuse"])._replace(tables=None)
    rng = np.random.default_rng(14)
    wi, uniforms = random_directions(rng, 50), rng.random((50, 3)).astype(np.float32)
    out = sample_arrays(50)
    sample_many(Families(None, None, None), materials, wi, uniforms, False, *out)
    for ours, general in zip(out, sample(case("diffuse")[0], wi, uniforms), strict=True):
        np.testing.assert_array_equal(ours, general)

    # compiled anew: a kernel from the disk cache cannot be inspected
    fresh = numba.njit(_nrt=False)(sample_many.py_func)
    for families, foreign in ((Families(None, None, None), False), (Families(True, True, True), True)):
        fresh(families, materials, wi, uniforms, False, *out)
        text = fresh.inspect_llvm(fresh.signatures[-1])
        assert ("fresnel" in text or "rough_conductor" in text) == foreign


def one_of_each_kind() -> list[list[float]]:
    """Events, weights and values of a few samples of one material of each kind."""
    rng = np.random.default_rng(0)
    rows = []
    for name in (*DELTA, "diffuse", "plastic", "roughconductor-beckmann-0.5", "roughdielectric-ggx-0.5"):
        materials, wi = materials_of(CASES[name]), np.abs(random_directions(rng, 4))
        event, wo, weight, _, _ = sample(materials, wi, rng.random((4, 3)))
        value = np.zeros((4, 3)) + sum(evaluate(materials, lobe, wi, wo)[1] for lobe in range(lobes(name)))
        rows.append([*map(float, (*event, *weight.ravel(), *value.ravel()))])
    return rows


def test_kernels_run_as_plain_python() -> None:
    """Without the compiler, wrong indices and names raise; the numbers stay."""
    code = "import sys, json, numpy; sys.path.insert(0, sys.argv[1]); numpy.seterr(all='ignore'); import test_bsdfs as t; "
    code += "print(json.dumps(t.one_of_each_kind()))"
    command = [sys.executable, "-c", code, os.path.dirname(__file__)]
    done = subprocess.run(command, env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for plain, compiled in zip(json.loads(done.stdout), one_of_each_kind(), strict=True):
        np.testing.assert_allclose(plain, compiled, rtol=1e-4, atol=1e-6)
