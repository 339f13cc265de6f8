"""A zone plate: every frequency in every direction, so that aliases show where they come from."""

import numpy as np

from queries.subpixel.targets.base import F32, F64, LEAST_DENSITY, Raster, average

NYQUIST = 0.5  # cycles per pixel


def chirp(x: F64, y: F64, width: float, height: float) -> F64:
    """The wave, in [-1, 1], at positions in pixels.

    Its local frequency at a distance r from the center is f(r) = ``NYQUIST`` * r / R, where R is from the center to the nearest edge; its phase is
    the integral of 2 pi f: pi ``NYQUIST`` r² / R.
    """
    squared = (x - 0.5 * width) ** 2 + (y - 0.5 * height) ** 2
    return np.asarray(np.cos(np.pi * NYQUIST / (0.5 * min(width, height)) * squared))


def zone_plate(raster: Raster) -> F32:
    """Gray on the left; on the right red against green above, blue against yellow below."""
    k = raster.oversampling(LEAST_DENSITY)
    x, y = raster.centers(k)
    wave = 0.5 * average(chirp(x[None, :], y[:, None], raster.width, raster.height), k)
    x, y = raster.centers()
    right, lower = x[None, :] > 0.5 * raster.width, y[:, None] > 0.5 * raster.height
    red = wave
    green = np.where(right & ~lower, -wave, wave)
    blue = np.where(right, np.where(lower, -wave, 0.0), wave)
    return np.clip(np.stack([red, green, blue], axis=2) + 0.5, 0.0, 1.0).astype(np.float32)
