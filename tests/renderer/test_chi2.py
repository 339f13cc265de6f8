"""The chi-square test itself: it accepts the right density and rejects a slightly wrong one."""

import numpy as np
import pytest
from chi2 import Chart, chi_square_p_value, significance

TOTAL = 200_000
CHARTS = (Chart(), Chart(axis=(0.3, -0.5, 0.6)), Chart(axis=(0.3, -0.5, 0.6), spread=0.05))


def sample_power_cosine(exponent: float, seed: int) -> np.ndarray:
    u, v = np.random.default_rng(seed).random((2, TOTAL))
    z = u ** (1 / (exponent + 1))
    r = np.sqrt(1 - z * z)
    return np.stack((r * np.cos(2 * np.pi * v), r * np.sin(2 * np.pi * v), z), axis=1)


def pdf_power_cosine(exponent: float):
    return lambda w: np.where(w[:, 2] > 0, (exponent + 1) / (2 * np.pi) * np.maximum(w[:, 2], 0) ** exponent, 0.0)


@pytest.mark.parametrize("chart", CHARTS, ids=str)
def test_accepts_the_right_density(chart: Chart) -> None:
    p = chi_square_p_value(sample_power_cosine(3.0, 0), TOTAL, pdf_power_cosine(3.0), chart, order=16)
    assert p > significance(len(CHARTS))


@pytest.mark.parametrize("chart", CHARTS, ids=str)
def test_rejects_an_exponent_five_percent_off(chart: Chart) -> None:
    p = chi_square_p_value(sample_power_cosine(3.0, 0), TOTAL, pdf_power_cosine(3.15), chart, order=16)
    assert p < 1e-6


def test_rejects_missing_samples() -> None:
    directions = sample_power_cosine(1.0, 0)[: TOTAL - TOTAL // 100]
    with pytest.raises(AssertionError, match="without a direction"):
        chi_square_p_value(directions, TOTAL, pdf_power_cosine(1.0))
    assert chi_square_p_value(directions, TOTAL, lambda w: 0.98 * pdf_power_cosine(1.0)(w)) < 1e-6


def test_charts_integrate_the_sphere() -> None:
    for chart in CHARTS:
        assert chart.integrate(lambda w: np.ones(len(w)), 8).sum() == pytest.approx(4 * np.pi, rel=1e-6)


def test_refuses_directions_that_are_not_unit_vectors() -> None:
    with pytest.raises(AssertionError, match="unit vectors"):
        chi_square_p_value(2 * sample_power_cosine(1.0, 0), TOTAL, pdf_power_cosine(1.0))


def test_p_values_are_uniform() -> None:
    total, chart = 20_000, Chart(10, 20)
    p = np.sort([chi_square_p_value(sample_power_cosine(1.0, seed)[:total], total, pdf_power_cosine(1.0), chart) for seed in range(40)])
    assert np.abs(p - (np.arange(40) + 0.5) / 40).max() < 0.28  # Kolmogorov-Smirnov, far below 1 %
