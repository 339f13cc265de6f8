"""The step that both tracers share: strike out the connections that are blocked, and add the others to their walks."""

import numpy as np
import numpy.typing as npt

from renderer.integrators.buffers import NO_LANE, Lanes, PathRows
from renderer.integrators.rows import copy_path
from renderer.kernel import kernel
from renderer.math.vec import ZERO

I32 = npt.NDArray[np.int32]


@kernel
def connect(lanes: Lanes, paths: PathRows, first: int, last: int, blocked: I32) -> None:
    """Add the rows first … last whose connection is free (``blocked`` is -1) to their walks' radiance, in order.

    The others stay where they are, without a walk and black: moving rows together would cost more than skipping some later.
    """
    for i in range(first, last):
        ray = paths.ray[i]
        if ray >= 0 and blocked[ray] >= 0:
            paths.lane[i] = NO_LANE
            for c in range(3):
                paths.contribution[i, c] = ZERO
            continue
        lane = paths.lane[i]
        for c in range(3):
            lanes.radiance[lane, c] += paths.contribution[i, c]


@kernel
def keep_blocked(paths: PathRows, first: int, last: int, blocked: I32, blocker: I32, out: PathRows, k: int) -> int:
    """Copy the rows first … last whose connection is blocked to ``out`` from row k on; ``blocker`` is the first object met."""
    for i in range(first, last):
        ray = paths.ray[i]
        if ray >= 0 and blocked[ray] >= 0:
            copy_path(paths, i, out, k)
            out.blocker[k] = blocker[ray]
            k += 1
    return k
