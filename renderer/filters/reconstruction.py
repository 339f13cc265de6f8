"""Separable reconstruction filters, with the names and default parameters of Mitsuba 3 (thesis 3.3)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ReconstructionFilter:
    """A separable filter: ``weight(x) * weight(y)`` for offsets in pixels from a pixel's center, zero beyond ``radius``.

    ``integral`` is the integral of ``weight`` over the line, in pixels.
    """

    name: str
    radius: float
    weight: Callable[[F64], F64]

    @property
    def integral(self) -> float:
        """The integral of ``weight``, by Simpson's rule on a grid that has the knots of all filters on it."""
        n = 4096
        x = np.linspace(-self.radius, self.radius, n + 1)
        w = np.ones(n + 1)
        w[1:-1:2], w[2:-1:2] = 4.0, 2.0
        return float((self.weight(x) * w).sum() * (2 * self.radius / n) / 3.0)

    def table(self, entries: int = 1024) -> npt.NDArray[np.float32]:
        """``weight`` at ``entries`` + 1 offsets from 0 to ``radius``, for kernels (linear in between)."""
        return self.weight(np.linspace(0.0, self.radius, entries + 1)).astype(np.float32)


def _box(x: F64) -> F64:
    return np.where(np.abs(x) <= 0.5, 1.0, 0.0)


def _tent(x: F64) -> F64:
    return np.maximum(0.0, 1.0 - np.abs(x))


def _gaussian(x: F64) -> F64:
    # standard deviation of half a pixel, lowered so that it ends at zero at four deviations
    value: F64 = np.maximum(0.0, np.exp(-2.0 * x * x) - np.exp(-2.0 * 2.0 * 2.0))
    return value


def _cubic(b: float, c: float) -> Callable[[F64], F64]:
    def weight(x: F64) -> F64:
        x = np.abs(x)
        near = (12 - 9 * b - 6 * c) * x**3 + (-18 + 12 * b + 6 * c) * x**2 + (6 - 2 * b)
        far = (-b - 6 * c) * x**3 + (6 * b + 30 * c) * x**2 + (-12 * b - 48 * c) * x + (8 * b + 24 * c)
        inside: F64 = np.where(x < 1.0, near, np.where(x < 2.0, far, 0.0)) / 6.0
        return inside

    return weight


def _lanczos(x: F64) -> F64:
    return np.where(np.abs(x) < 3.0, np.sinc(x) * np.sinc(x / 3.0), 0.0)


FILTERS: dict[str, ReconstructionFilter] = {
    f.name: f
    for f in (
        ReconstructionFilter("box", 0.5, _box),
        ReconstructionFilter("tent", 1.0, _tent),
        ReconstructionFilter("gaussian", 2.0, _gaussian),
        ReconstructionFilter("mitchell", 2.0, _cubic(1 / 3, 1 / 3)),
        ReconstructionFilter("catmullrom", 2.0, _cubic(0.0, 0.5)),
        ReconstructionFilter("lanczos", 3.0, _lanczos),
    )
}
"""All filters by name."""


def reconstruction_filter(name: str) -> ReconstructionFilter:
    """The filter of that name. Raises ValueError with the known names."""
    if name not in FILTERS:
        raise ValueError(f"unknown reconstruction filter {name!r}; known: {', '.join(FILTERS)}")
    return FILTERS[name]
