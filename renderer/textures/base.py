"""The contract of a texture: a color for each (u, v)."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

BITMAP, CHECKERBOARD = range(2)
NEAREST, BILINEAR = range(2)
REPEAT, MIRROR, CLAMP = range(3)


class Textures(NamedTuple):
    """One row for each texture; bitmaps share one array of linear RGB pixels, rows top to bottom."""

    kind: npt.NDArray[np.int32]  # (n,)
    to_uv: npt.NDArray[np.float32]  # (n, 2, 3) affine map of (u, v)
    rgb: npt.NDArray[np.float32]  # (n, 2, 3) the checkerboard's two colors
    first: npt.NDArray[np.int64]  # (n,) first pixel
    size: npt.NDArray[np.int32]  # (n, 2) width, height
    mode: npt.NDArray[np.int32]  # (n, 2) filter, wrap
    pixels: npt.NDArray[np.float32]  # (total, 3)
