"""Fresnel's equations against Mitsuba 3, refraction against Snell's law, and the inverse error function against scipy."""

import mitsuba as mi
import numpy as np
import pytest
import scipy.special

from renderer.kernel import kernel
from renderer.math.erf import erf, erfinv
from renderer.math.fresnel import fresnel_conductor, fresnel_dielectric, reflect_about, refract_about

mi.set_variant("scalar_rgb")


@kernel
def dielectric_many(cos, eta, out):
    for i in range(cos.shape[0]):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = fresnel_dielectric(cos[i], eta)


@kernel
def conductor_many(cos, eta, k, out):
    for i in range(cos.shape[0]):
        out[i] = fresnel_conductor(cos[i], eta, k)


@kernel
def bend_many(w, n, eta, reflected, refracted):
    for i in range(w.shape[0]):
        a, h = (w[i, 0], w[i, 1], w[i, 2]), (n[i, 0], n[i, 1], n[i, 2])
        _, cos_t, _, eta_ti = fresnel_dielectric(a[0] * h[0] + a[1] * h[1] + a[2] * h[2], eta)
        reflected[i, 0], reflected[i, 1], reflected[i, 2] = reflect_about(a, h)
        refracted[i, 0], refracted[i, 1], refracted[i, 2] = refract_about(a, h, cos_t, eta_ti)


@kernel
def erf_many(x, forth, back):
    for i in range(x.shape[0]):
        forth[i], back[i] = erf(x[i]), erfinv(x[i])


@pytest.mark.parametrize("eta", [0.5, 1 / 1.5, 0.9999, 1.0, 1.0001, 1.5, 4.0])
def test_dielectric_equals_mitsuba(eta: float) -> None:
    cos = np.concatenate((np.linspace(-1, 1, 401), [1e-7, -1e-7])).astype(np.float32)
    out = np.empty((len(cos), 4), np.float32)
    dielectric_many(cos, np.float32(eta), out)
    np.testing.assert_allclose(out, [mi.fresnel(float(c), eta) for c in cos], rtol=1e-4, atol=3e-6)
    assert np.all((out[:, 0] >= 0) & (out[:, 0] <= 1 + 1e-6))


@pytest.mark.parametrize(("eta", "k"), [(0.0, 1.0), (0.14, 3.98), (1.44, 1.6), (3.0, 0.0), (1.0, 0.0)])
def test_conductor_equals_mitsuba(eta: float, k: float) -> None:
    cos = np.linspace(0.001, 1, 300).astype(np.float32)
    out = np.empty(300, np.float32)
    conductor_many(cos, np.float32(eta), np.float32(k), out)
    np.testing.assert_allclose(out, [mi.fresnel_conductor(float(c), mi.Complex2f(eta, k)) for c in cos], rtol=1e-4, atol=1e-6)
    if k == 0 and eta > 1:
        dielectric = np.empty((300, 4), np.float32)
        dielectric_many(cos, np.float32(eta), dielectric)
        np.testing.assert_allclose(out, dielectric[:, 0], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("eta", [1 / 1.5, 1.5])
def test_reflection_and_refraction_obey_their_laws(eta: float) -> None:
    rng = np.random.default_rng(0)
    w, n = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, 500, 3)))
    reflected, refracted = np.empty((500, 3), np.float32), np.empty((500, 3), np.float32)
    bend_many(w.astype(np.float32), n.astype(np.float32), np.float32(eta), reflected, refracted)
    np.testing.assert_allclose(np.cross(w + reflected, n), 0, atol=2e-6)
    np.testing.assert_allclose((w * n).sum(1), (reflected * n).sum(1), atol=2e-6)

    ratio = np.where((w * n).sum(1) > 0, eta, 1 / eta)
    sin_t = np.linalg.norm(np.cross(w, n), axis=1) / ratio
    possible = sin_t < 0.99
    assert 100 < possible.sum() < 500
    np.testing.assert_allclose(np.linalg.norm(refracted[possible], axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(np.cross(w + refracted * ratio[:, None], n)[possible], 0, atol=1e-5)
    assert np.all(((w * n).sum(1) * (refracted * n).sum(1))[possible] < 0)


def test_erf_and_its_inverse_equal_scipy() -> None:
    x = np.concatenate((np.linspace(-0.9999, 0.9999, 2001), [1e-6, -1e-6, 1 - 1e-6])).astype(np.float32)
    forth, back = np.empty_like(x), np.empty_like(x)
    erf_many(x, forth, back)
    np.testing.assert_allclose(forth, scipy.special.erf(x.astype(float)), rtol=1e-6)
    np.testing.assert_allclose(back, scipy.special.erfinv(x.astype(float)), rtol=1e-6)
