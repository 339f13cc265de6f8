"""The film: one more sink of what walks carry. Sums are float64, in id order, so images are bit-identical in every run."""

import numpy as np
import numpy.typing as npt

from renderer.filters import reconstruction_filter
from renderer.kernel import kernel
from renderer.math.vec import ZERO

F64 = npt.NDArray[np.float64]
F32 = npt.NDArray[np.float32]


@kernel
def add_box(sums: F64, raster: F32, value: F32, n: int) -> None:
    """Add n samples to the pixels that they lie in."""
    for i in range(n):
        x = np.int64(raster[i, 0])
        y = np.int64(raster[i, 1])
        for c in range(3):
            sums[y, x, c] += value[i, c]
        sums[y, x, 3] += 1.0


@kernel
def add_filtered(sums: F64, raster: F32, value: F32, n: int, radius: np.float32, table: F32) -> None:
    """Add n samples to all pixels whose centers lie within ``radius``, weighted by the separable filter of ``table``."""
    height, width = sums.shape[0], sums.shape[1]
    half = np.float32(0.5)
    steps = np.float32(table.shape[0] - 1) / radius
    for i in range(n):
        x = raster[i, 0] - half
        y = raster[i, 1] - half
        first_y, last_y = covered(y, radius, height)
        first_x, last_x = covered(x, radius, width)
        for py in range(first_y, last_y):
            wy = lookup(table, abs(np.float32(py) - y) * steps)
            for px in range(first_x, last_x):
                w = wy * lookup(table, abs(np.float32(px) - x) * steps)
                for c in range(3):
                    sums[py, px, c] += np.float64(w) * np.float64(value[i, c])
                sums[py, px, 3] += np.float64(w)


@kernel
def covered(center: np.float32, radius: np.float32, size: int) -> tuple[int, int]:
    """The range of pixels within ``radius`` of ``center``, both counted from the first pixel's center."""
    return int(max(0, np.ceil(center - radius))), int(min(size - 1, np.floor(center + radius))) + 1


@kernel
def lookup(table: F32, x: np.float32) -> np.float32:
    """The table at x, in entries, linear in between; zero past its end."""
    i = np.int64(x)
    if i >= table.shape[0] - 1:
        return ZERO
    f = x - np.float32(i)
    value: np.float32 = table[i] + f * (table[i + 1] - table[i])
    return value


class Film:
    """Sums of filtered samples. ``sums`` is float64 (height, width, 4): weighted r, g, b and the weights themselves."""

    def __init__(self, width: int, height: int, filter: str = "box") -> None:
        self.filter = reconstruction_filter(filter)
        self.sums: F64 = np.zeros((height, width, 4))
        self._radius = np.float32(self.filter.radius)
        self._table = self.filter.table()

    def clear(self) -> None:
        """Back to black."""
        self.sums[:] = 0.0

    def add(self, raster: F32, value: F32, n: int) -> None:
        """Add the first n samples: ``raster`` (n, 2) in pixels, strictly inside the film, ``value`` (n, 3)."""
        if self.filter.name == "box":
            add_box(self.sums, raster, value, n)
        else:
            add_filtered(self.sums, raster, value, n, self._radius, self._table)

    def merge(self, sums: F64) -> None:
        """Add another film's sums."""
        self.sums += sums

    def image(self, method: str, passes: int) -> F32:
        """The image, float32 (height, width, 3), after ``passes`` passes.

        Camera walks are normalized by the weights that reached a pixel, light walks by the filter's integral.
        """
        if method == "path":
            weight = np.where(self.sums[..., 3:] != 0.0, self.sums[..., 3:], 1.0)
        else:
            weight = np.full((1, 1, 1), passes * self.filter.integral**2)
        return (self.sums[..., :3] / weight).astype(np.float32)
