"""Numbers for each direction on a grid of bands and sectors of equal solid angle: a low pass that keeps their integral."""

from typing import Any

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
Floats = npt.NDArray[np.floating[Any]]
_MOST_STEPS = 10_000
_BALANCED = 1e-13


def low_pass(values: Floats, directions: Floats, weights: F64, degrees: float) -> F64:
    """Values (bands, sectors, channels) spread over neighboring directions (bands, sectors, 3), unit vectors.

    The kernel is a Gaussian of the angle, of this standard deviation. It is scaled from both sides by one factor for each band (sinkhorn1967), so
    that the sum of values times weights (bands,) stays what it was, and so does a constant, at poles and borders too. 0 degrees: the values as given.
    """
    given = np.asarray(values, np.float64)
    if degrees <= 0:
        return given.copy()
    ways = np.asarray(directions, np.float64)
    bands, sectors, _ = ways.shape
    # Turning the grid by a sector changes nothing: the kernel depends on two bands and the difference of sectors
    cosine = np.einsum("ik,jsk->ijs", ways[:, 0], ways)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    angle[np.arange(bands), np.arange(bands), 0] = 0.0
    kernel = np.exp(-0.5 * (angle / degrees) ** 2)
    # Directions are rounded: what is symmetric but for that is made so, or the integral would be kept only to their precision
    kernel = (kernel + np.roll(kernel.transpose(1, 0, 2)[..., ::-1], 1, axis=2)) / 2
    factor = _balance(kernel.sum(axis=2), weights)
    kernel *= (factor[:, None] * factor[None, :])[..., None]
    # The convolution over sectors is a product of transforms
    spread = np.einsum("ijf,jfc->ifc", np.conj(np.fft.rfft(kernel, axis=2)), np.fft.rfft(given * weights[:, None, None], axis=1))
    found: F64 = np.fft.irfft(spread, n=sectors, axis=1)
    return np.maximum(found, 0.0) if given.min(initial=0.0) >= 0 else found


def _balance(kernel: F64, weights: F64) -> F64:
    """Factors d (n,) such that d_i sum_j kernel_ij d_j weights_j = 1 for every i, for a symmetric kernel (n, n) of positive diagonal."""
    factor = np.ones(len(kernel))
    for _ in range(_MOST_STEPS):
        rows = factor * (kernel @ (factor * weights))
        factor /= np.sqrt(rows)
        if np.abs(rows - 1).max() < _BALANCED:
            break
    return factor
