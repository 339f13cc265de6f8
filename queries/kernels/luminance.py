"""Luminance of linear sRGB: one place for its weights."""

import numpy as np

from queries.kernel import kernel

RED, GREEN, BLUE = LUMINANCE = (0.2126, 0.7152, 0.0722)


@kernel
def luminance(r: np.float32, g: np.float32, b: np.float32) -> np.float64:
    """Luminance of a color."""
    return np.float64(r) * RED + np.float64(g) * GREEN + np.float64(b) * BLUE
