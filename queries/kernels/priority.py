"""Priorities of rows that a sample is drawn by: weights over uniform numbers, which are hashes of what names the row."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.tries import mix

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
U16 = npt.NDArray[np.uint16]
Walk = npt.NDArray[np.unsignedinteger]
GOLDEN = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: the step of SplitMix64 (steele2014)
MANTISSA, ONE = np.uint64(11), np.uint64(1)  # 64 - 53 bits
STEP = 2.0**-53


@kernel
def uniform(seed: np.uint64, owner: np.uint64, path: np.uint64) -> np.float64:
    """A number in (0, 1] for each path: number ``path`` of the SplitMix64 stream that its walk and the seed begin."""
    stream = mix(mix(seed + GOLDEN) ^ owner)
    return (np.float64(mix(stream + GOLDEN * (path + ONE)) >> MANTISSA) + 1.0) * STEP


@kernel
def high_priorities(owner: Walk, path: U16, weight: F64, seed: np.uint64, least: float, rows: I64, priority: F64) -> int:
    """The rows with a weight above 0 whose priority, weight / uniform number, is ``least`` or more; how many there are.

    Written to ``rows`` and ``priority``, which have room for all rows.
    """
    found = 0
    for i in range(len(weight)):
        if weight[i] > 0.0:
            q = weight[i] / uniform(seed, np.uint64(owner[i]), np.uint64(path[i]))
            if q >= least:
                rows[found] = i
                priority[found] = q
                found += 1
    return found
