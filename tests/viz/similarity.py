"""Structural similarity of two pictures. Source: wang2004."""

import numpy as np
from scipy.ndimage import gaussian_filter

_SIGMA = 1.5  # pixels
_C1, _C2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2


def structural_similarity(a: np.ndarray, b: np.ndarray) -> float:
    """The mean over pixels and channels of two pictures, uint8 (h, w, 3): 1 for equal ones."""
    x, y = a.astype(np.float64), b.astype(np.float64)

    def blurred(values: np.ndarray) -> np.ndarray:
        return gaussian_filter(values, (_SIGMA, _SIGMA, 0), truncate=3.5)

    mean_x, mean_y = blurred(x), blurred(y)
    var_x, var_y = blurred(x * x) - mean_x**2, blurred(y * y) - mean_y**2
    both = blurred(x * y) - mean_x * mean_y
    return float((((2 * mean_x * mean_y + _C1) * (2 * both + _C2)) / ((mean_x**2 + mean_y**2 + _C1) * (var_x + var_y + _C2))).mean())
