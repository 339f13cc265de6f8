"""The curve of sRGB (IEC 61966-2-1), between linear light and the numbers that screens and files have."""

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]


def to_srgb(linear: npt.NDArray[np.floating]) -> F32:
    """Linear RGB, cut to 0 … 1, encoded for screens: float32 of the same shape."""
    x = np.clip(np.asarray(linear, np.float32), 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1 / 2.4, dtype=np.float32) - 0.055).astype(np.float32)


def to_linear(srgb: npt.NDArray[np.floating]) -> F32:
    """The inverse of ``to_srgb``."""
    x = np.clip(np.asarray(srgb, np.float32), 0, 1)
    return np.where(x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4, dtype=np.float32)).astype(np.float32)
