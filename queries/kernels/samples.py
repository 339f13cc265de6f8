"""Paths to samples of the film: one for each camera walk, of all that its chosen paths carry."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
Walks = npt.NDArray[np.unsignedinteger]


@kernel
def gather_samples(
    walk: Walks, chosen: npt.NDArray[np.bool_], x: F32, y: F32, r: F32, g: F32, b: F32, sample_x: F32, sample_y: F32, color: F32
) -> np.int64:
    """Sum the chosen rows of each walk, which lie together, into ``color`` (samples, 3); a walk without one is black. Returns how many walks."""
    n, i, rows = 0, 0, len(walk)
    while i < rows:
        sample_x[n], sample_y[n] = x[i], y[i]
        red, green, blue, this = np.float64(0.0), np.float64(0.0), np.float64(0.0), walk[i]
        while i < rows and walk[i] == this:
            if chosen[i]:
                red += np.float64(r[i])
                green += np.float64(g[i])
                blue += np.float64(b[i])
            i += 1
        color[n, 0], color[n, 1], color[n, 2] = red, green, blue
        n += 1
    return np.int64(n)
