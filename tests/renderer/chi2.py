"""Chi-square test of a sampler of directions against its density.

Samples are binned over a chart of the sphere: azimuth phi about an axis, and q, which grows with c = 1 - cos(angle to the axis).
With ``spread`` infinite q is c / 2, so equal areas are equal solid angles; a small spread gives a sharp lobe about the axis many cells.
The default grid has an even number of rows, so that the horizon, where densities jump to zero, is the edge of a row.

A test that asks ``count`` questions should reject at ``significance(count)``: then one of them fails by chance in 1 % of all seeds.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.stats

Array = npt.NDArray[np.float64]
MIN_EXPECTED = 5.0  # pool cells until a pool expects this many samples


def significance(count: int, level: float = 0.01) -> float:
    """Level of each of ``count`` independent tests such that all together fail by chance with probability ``level`` (Šidák)."""
    return float(-np.expm1(np.log1p(-level) / count))


@dataclass(frozen=True)
class Chart:
    """A grid over the sphere of directions: ``columns`` of phi, ``rows`` of q."""

    columns: int = 20
    rows: int = 40
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    spread: float = np.inf

    def frame(self) -> tuple[Array, Array, Array]:
        n = np.array(self.axis, float) / np.linalg.norm(self.axis)
        s = np.cross(n, (0.0, 1.0, 0.0) if abs(n[1]) < 0.9 else (1.0, 0.0, 0.0))
        s /= np.linalg.norm(s)
        return s, np.cross(n, s), n

    def cells(self, directions: Array) -> npt.NDArray[np.int64]:
        """The cell of each direction (n, 3)."""
        s, t, n = self.frame()
        phi = np.arctan2(directions @ t, directions @ s) / (2 * np.pi) % 1.0
        c = np.clip(0.5 * ((directions - n) ** 2).sum(axis=1), 0.0, 2.0)  # 1 - cos, without cancellation
        q = c / 2 if np.isinf(self.spread) else c / (c + self.spread) * (2 + self.spread) / 2
        column = np.minimum((phi * self.columns).astype(np.int64), self.columns - 1)
        row = np.minimum((q * self.rows).astype(np.int64), self.rows - 1)
        return row * self.columns + column

    def integrate(self, pdf: Callable[[Array], Array], order: int) -> Array:
        """Integral of ``pdf`` over each cell by Gauss-Legendre quadrature with order² nodes."""
        nodes, weights = np.polynomial.legendre.leggauss(order)
        nodes, weights = 0.5 * nodes + 0.5, 0.5 * weights
        phi = 2 * np.pi * (np.arange(self.columns)[:, None] + nodes) / self.columns
        q = (np.arange(self.rows)[:, None] + nodes) / self.rows
        if np.isinf(self.spread):
            c, jacobian = 2 * q, np.full_like(q, 2.0)
        else:
            x = 2 * q / (2 + self.spread)
            c, jacobian = self.spread * x / (1 - x), self.spread / (1 - x) ** 2 * 2 / (2 + self.spread)
        s, t, n = self.frame()
        cos, sin = 1 - c, np.sqrt(c * (2 - c))
        shape = (self.rows, self.columns, order, order)  # row, column, node of q, node of phi
        around = np.cos(phi)[..., None] * s + np.sin(phi)[..., None] * t
        directions = sin[:, None, :, None, None] * around[None, :, None] + cos[:, None, :, None, None] * n
        density = pdf(directions.reshape(-1, 3)).reshape(shape)
        weight = (weights * jacobian)[:, None, :, None] * weights / self.rows / self.columns * 2 * np.pi
        return (density * weight).sum(axis=(2, 3)).ravel()


def chi_square_p_value(directions: Array, total: int, pdf: Callable[[Array], Array], chart: Chart = Chart(), order: int = 6) -> float:
    """P-value of "these directions are what ``total`` draws from ``pdf`` give", where draws without a direction are left out.

    Raises AssertionError where directions are not unit vectors, where a density is negative or not finite, where the densities add up
    to more than 1, where a sample lies in a cell that expects none, and where draws without a direction are not expected.
    """
    directions = np.asarray(directions, float)
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    assert np.allclose(length, 1.0, atol=1e-4), "directions are not unit vectors"
    directions = directions / length

    def checked(w: Array) -> Array:
        density = np.asarray(pdf(w), float)
        assert np.all(np.isfinite(density)), "a density is not finite"
        assert np.all(density >= 0), "a density is negative"
        return density

    expected = chart.integrate(checked, order) * total
    observed = np.bincount(chart.cells(directions), minlength=expected.size).astype(float)
    assert expected.sum() < 1.005 * total, f"the density integrates to {expected.sum() / total}"
    # Rounding may carry a few samples over the edge of the density's domain
    assert observed[expected == 0].sum() <= 1e-5 * total, "samples where the density is zero"
    # Draws without a direction are one more cell
    missing, expected_missing = total - observed.sum(), max(0.0, total - expected.sum())
    if expected_missing < MIN_EXPECTED:
        assert missing <= MIN_EXPECTED + 10 * np.sqrt(MIN_EXPECTED), f"{missing} draws without a direction, {expected_missing} expected"
    return pooled_p_value(np.append(observed, missing), np.append(expected, expected_missing))


def pooled_p_value(observed: Array, expected: Array) -> float:
    """P-value of cell counts; cells with small expectations are pooled."""
    order = np.argsort(expected, kind="stable")
    observed, expected = observed[order], expected[order]

    # Pools of the smallest cells, each of at least MIN_EXPECTED; the last pool takes the rest
    small = int(np.searchsorted(expected, MIN_EXPECTED))
    pool = (np.cumsum(expected[:small]) // MIN_EXPECTED).astype(int)
    pool = np.append(pool, np.arange(expected.size - small) + (pool[-1] + 1 if small else 0))
    o, e = np.bincount(pool, observed), np.bincount(pool, expected)
    o, e = o[e > 0], e[e > 0]
    keep = np.argsort(e, kind="stable")
    o, e = o[keep], e[keep]
    while e.size > 1 and e[0] < MIN_EXPECTED:
        o, e = np.append(o[0] + o[1], o[2:]), np.append(e[0] + e[1], e[2:])
    assert e.size > 1, "too few cells expect samples: use more samples or a chart with a smaller spread"
    statistic = float(((o - e) ** 2 / e).sum())
    return float(scipy.stats.chi2.sf(statistic, e.size - 1))
