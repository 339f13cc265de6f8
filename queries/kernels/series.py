"""Sums by pass: what running estimates are made of."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


@kernel
def add_by_pass(walk: npt.NDArray[np.generic], chosen: npt.NDArray[np.bool_], r: F32, g: F32, b: F32, walks_per_pass: int, sums: F64) -> None:
    """Add the luminance of each chosen row to the sum of its walk's pass."""
    for i in range(len(walk)):
        if chosen[i]:
            number = np.int64(walk[i]) // walks_per_pass
            sums[number] += np.float64(r[i]) * 0.2126 + np.float64(g[i]) * 0.7152 + np.float64(b[i]) * 0.0722
