"""Luminance of arrays of colors; ``queries.kernels.luminance`` has its weights, and its twin for kernels."""

from typing import Any

import numpy as np
import numpy.typing as npt

from queries.kernels.luminance import LUMINANCE


def luminance_of(rgb: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.float64]:
    """The luminance (…) of linear RGB (…, 3): float64."""
    found: npt.NDArray[np.float64] = np.asarray(rgb, np.float64) @ np.array(LUMINANCE)
    return found
