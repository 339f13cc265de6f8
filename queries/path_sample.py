"""Some paths of a selection, with all their vertices: what pictures of paths are drawn from."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class PathSample:
    """``n`` paths in the order of (owner, path), each with its vertices from the emitter to the camera, as light travels.

    ``start``: int64 (n + 1), where each path's vertices begin; ``points``: float32 (m, 3), world; ``event``: uint8 (m), EMITTER first, LENS last;
    ``object``: int32 (m), NO_OBJECT where there is none; ``owner``: int64 (n), the walk; ``path``: int32 (n), the ordinal in it; ``infinite``: bool (n),
    whether the emitter is at infinity: its vertex then stands where the ray leaves the scene's bounds; ``contribution``: float32 (n, 3);
    ``raster``: float32 (n, 2), pixels; ``scale``: float64 (n), such that sums of scale x value over the sample estimate sums over all paths of the selection.
    ``found``: how many paths the selection has.
    """

    start: I64
    points: F32
    event: U8
    object: I32
    owner: I64
    path: I32
    infinite: npt.NDArray[np.bool_]
    contribution: F32
    raster: F32
    scale: F64
    found: int

    def __len__(self) -> int:
        """How many paths were drawn."""
        return len(self.owner)
