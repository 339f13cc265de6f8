"""Numbers as colors: which range a color map covers, and where on it each number lies."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from viz.colors import color_map, mapped
from viz.tools.base import ColorBar

F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.floating[Any]]

HIGH_SHARE, LOW_SHARE = 0.99, 0.01  # of the area lie below the ends of a range that nobody chose
LARGEST_RATIO = 1e4  # between the ends of such a range, on a logarithmic scale
SMALLEST_RATIO = 10.0
_DIGITS = 2


@dataclass(frozen=True)
class FalseColor:
    """A color map by name from ``low`` to ``high``, on a logarithmic scale or a linear one."""

    map: str
    low: float
    high: float
    logarithmic: bool

    @classmethod
    def of(cls, map: str, values: Floats, weights: Floats, logarithmic: bool, given: tuple[float, float] | None = None) -> "FalseColor":
        """The range that was given, or one that fits the values (n,), of which each counts by its weight (n,), not by a few outliers."""
        return cls(map, *(given or fitting_range(values, weights, logarithmic)), logarithmic)

    def shares(self, values: Floats) -> F64:
        """Where values lie between low (0) and high (1); what lies beyond is cut off."""
        x = np.asarray(values, np.float64)
        if self.logarithmic:
            x = np.log(np.maximum(x, self.low) / self.low) / np.log(self.high / self.low)
        else:
            x = (x - self.low) / (self.high - self.low)
        return np.clip(x, 0.0, 1.0)

    def colors(self, values: Floats) -> U8:
        """The colors of values, as sRGB uint8 (…, 3)."""
        shares = self.shares(values)
        return mapped(self.map, shares.ravel()).reshape(*shares.shape, 3)

    def bar(self, label: str) -> ColorBar:
        """The legend."""
        return ColorBar(label, color_map(self.map), self.low, self.high, self.logarithmic)


def fitting_range(values: Floats, weights: Floats, logarithmic: bool) -> tuple[float, float]:
    """From 0 to the 99th percentile of the values that are above 0; on a logarithmic scale from their 1st, at most four decades below.

    Ends are rounded outward to two digits. Without any such value: 0 to 1, or 0.1 to 1.
    """
    x, w = np.asarray(values, np.float64).ravel(), np.asarray(weights, np.float64).ravel()
    kept = (x > 0) & (w > 0) & np.isfinite(x)
    if not kept.any():
        return (0.1, 1.0) if logarithmic else (0.0, 1.0)
    low, high = quantiles(x[kept], w[kept], (LOW_SHARE, HIGH_SHARE))
    high = _rounded(high, up=True)
    if not logarithmic:
        return 0.0, high
    return min(_rounded(max(low, high / LARGEST_RATIO), up=False), high / SMALLEST_RATIO), high


def quantiles(values: F64, weights: F64, shares: tuple[float, ...]) -> list[float]:
    """The least values at or below which at least these shares of the weight lie."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    rows = np.searchsorted(total, np.array(shares) * total[-1])
    return [float(value) for value in values[order][np.minimum(rows, len(order) - 1)]]


def _rounded(value: float, up: bool) -> float:
    """To two digits, upward or downward."""
    step = 10.0 ** (np.floor(np.log10(value)) - _DIGITS + 1)
    # What two digits hold already stays, whatever its last bit
    steps = np.ceil(value / step * (1 - 1e-9)) if up else np.floor(value / step * (1 + 1e-9))
    return float(f"{steps * step:.{_DIGITS}g}")
