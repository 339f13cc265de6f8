"""Noise with the statistics of natural images: amplitude 1/f, and channels that vary mostly together."""

import numpy as np

from queries.subpixel.targets.base import F32, F64, LEAST_DENSITY, Raster, average, generator

SEED = 7
BAND = LEAST_DENSITY // 2  # cycles per pixel: no detail is finer
_MEAN, _SPREAD = -0.9, 1.1  # of the logit of light: darker than the middle, as scenes are in linear light

# Axes along which natural colors vary independently of one another (light, blue against yellow, red against green), and how much they do
_AXES: F64 = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, -2.0], [1.0, -1.0, 0.0]]) / np.sqrt([[3.0], [6.0], [2.0]])
_DEVIATIONS: F64 = np.array([1.0, 0.30, 0.15])


def noise(raster: Raster) -> F32:
    """A sum of waves of all frequencies up to ``BAND`` with random phases, as light between 0 and 1 by the logistic function."""
    k = raster.oversampling(LEAST_DENSITY)
    density = raster.fine * k
    mix = (_AXES.T * _DEVIATIONS * (_SPREAD / np.sqrt((_DEVIATIONS**2).sum() / 3))).astype(np.float32)
    waves = _waves(raster, density)
    channels = [average(1.0 / (1.0 + np.exp(-_MEAN - np.tensordot(row, waves, 1))), k) for row in mix]
    return np.stack(channels, axis=2)


def _waves(raster: Raster, density: int) -> F32:
    """Three independent fields of variance 1 at ``density`` points across a pixel, (3, rows, columns); they continue at opposite edges."""
    rows, columns = 2 * BAND * raster.height, BAND * raster.width
    down = np.fft.fftfreq(rows, 1.0 / (2 * BAND))  # cycles per pixel
    across = np.arange(columns) / raster.width
    frequency = np.hypot(down[:, None], across)
    amplitude = np.where((frequency > 0) & (frequency < BAND), 1.0 / np.maximum(frequency, 1e-9), 0.0)
    amplitude[:, 0] *= np.sqrt(0.5)  # this column holds both a wave and its mirror image, of which the transform takes the mean
    amplitude /= np.sqrt(4.0 * (amplitude**2).sum())

    # The same waves at any density: the frequencies beyond are zero
    rng, half = generator(SEED, raster), rows // 2
    shape = raster.height * density, raster.width * density
    waves = np.empty((3, *shape), np.float32)
    for wave in waves:
        spectrum = rng.standard_normal((rows, columns, 2), np.float32).view(np.complex64)[..., 0] * amplitude.astype(np.float32)
        padded = np.zeros((shape[0], shape[1] // 2 + 1), np.complex64)
        padded[:half, :columns], padded[-half:, :columns] = spectrum[:half], spectrum[half:]
        wave[:] = np.fft.irfft2(padded, s=shape, norm="forward")
    return waves
