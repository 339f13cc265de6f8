"""Vertices of walks, written one path after another."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.vertices import Prefixes

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
U16 = npt.NDArray[np.uint16]


@kernel
def gather_walks(event: U8, thing: U16, points: F32, prefixes: Prefixes, at: I64, step: int, to_event: U8, to_thing: I32, to_points: F32) -> None:
    """Write what each path uses of its walk, given by ``event``, ``thing`` and ``points`` (vertices, 3), to places ``at``, ``at + step``, …

    The last vertex has the lobe that the path has there.
    """
    for i in range(len(at)):
        place = at[i]
        row = prefixes.start[i]
        for _ in range(prefixes.length[i]):
            to_event[place] = event[row]
            to_thing[place] = thing[row]
            for axis in range(3):
                to_points[place, axis] = points[row, axis]
            place += step
            row += 1
        if prefixes.length[i] > 0 and prefixes.last[i] != 0:
            to_event[place - step] = prefixes.last[i]
