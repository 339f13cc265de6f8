"""Sampling cumulative tables: the inverse of a piecewise constant distribution."""

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import ZERO

BELOW_ONE = np.float32(np.nextafter(np.float32(1), np.float32(0)))


@kernel
def sample_cdf(cdf: npt.NDArray[np.float32], first: int, count: int, u: np.float32) -> tuple[int, np.float32, np.float32]:
    """Invert ``cdf[first : first + count + 1]``, which rises from 0 to 1.

    Returns the interval chosen, its probability, and the random number used again: uniform in [0, 1) within the interval.
    """
    low = 0
    high = count
    while high - low > 1:
        middle = (low + high) // 2
        if cdf[first + middle] <= u:
            low = middle
        else:
            high = middle
    probability = cdf[first + low + 1] - cdf[first + low]
    again = ZERO
    if probability > ZERO:
        again = min((u - cdf[first + low]) / probability, BELOW_ONE)
    return low, probability, again
