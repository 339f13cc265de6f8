"""The contract of a texture: a color for each (u, v)."""

from typing import Any, NamedTuple

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


class Pyramid(NamedTuple):
    """Bitmaps at falling sizes, each level about half as wide and high as the one before: level 0 is the bitmap, the last one a single pixel."""

    top: npt.NDArray[np.int32]  # (n,) the last level, 0 for what is no bitmap
    first: npt.NDArray[np.int64]  # (n, levels) first pixel
    size: npt.NDArray[np.int32]  # type: ignore[assignment]  # (n, levels, 2) width, height
    pixels: npt.NDArray[np.float32]  # (total, 3) the textures' own pixels, then those of the other levels


class Memory(NamedTuple):
    """The last filtered color of each pixel, for walks that meet the same triangle there; a tracer's own."""

    width: Any  # int64, of the film, pixels
    key: npt.NDArray[np.int64]  # (slots, 2) one more than the pixel, 0 for none; triangle and texture
    rgb: npt.NDArray[np.float32]  # (slots, 3)


class Ewa(NamedTuple):
    """The filter of pixels or subpixels over bitmaps; offsets are in pixels of the film, x to the right, y down.

    Tables run over distances from 0 to ``reach``, linear in between. With ``down``, ``across`` and ``down`` hold running integrals of a
    separable filter; without, ``across`` holds weights by distance.
    """

    across: npt.NDArray[np.float32]  # (filters, entries)
    down: npt.NDArray[np.float32] | None  # (filters, entries); None: the filter is round
    reach: npt.NDArray[np.float32]  # (2,) where the tables of ``across`` and ``down`` end
    box: npt.NDArray[np.float32]  # (4,) what all filters of a pixel cover: left, top, right, bottom of its center
    centers: npt.NDArray[np.float32] | None  # (rows, columns, 3, 2) right of and below the pixel's center: R, G and B of each pixel of a period
    filter: npt.NDArray[np.int32]  # (rows, columns, 3) which row of ``across``; without ``centers``, all three are row 0's
    filter_down: npt.NDArray[np.int32]  # (rows, columns, 3) which row of ``down``
    step: Any  # float32, how large a cell of the texture may be, pixels
    pyramid: Pyramid
    memory: Memory | None
