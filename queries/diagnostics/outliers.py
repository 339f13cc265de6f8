"""Outlier pixels: those that one walk makes stand out from the pixels around them.

A pixel is an outlier where both hold:

- *one walk carries its variance*: the largest value that a walk adds has more than ``variance_share`` of the sum of squared
  deviations of all the pixel's walks;
- *it stands out*: its luminance lies more than ``deviations`` spreads above the median of the pixels around it, where the spread is the
  larger of 1.4826 times the median, and 1.2533 times the mean, of their absolute deviations from that median (iglewicz1993).

The median scale alone would vanish where most of the pixels around are black; the mean alone would be ruled by the next firefly. With the
default limits and independent pixels of 16 walks or more, whose values are uniform, exponential or chi-square, fewer than one pixel in
10,000 is called an outlier by chance; where most pixels are lit by no walk or one at all, several in a hundred are. Values are those of
samples, before the film's filter spreads them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.diagnostics.answers import F64, pixels_of
from queries.kernels.pixels import add_values
from queries.run import Run
from queries.shards import Array, Piece, map_shards

I64 = npt.NDArray[np.int64]
LEAST_WALKS = 8  # of a pixel: of fewer, one always carries much of the variance
_CHUNK = 100_000  # pixels whose surroundings are compared at a time
_LIGHT = ("raster_x", "raster_y", "contribution_r", "contribution_g", "contribution_b")


@dataclass(frozen=True)
class Outliers:
    """Outlier pixels, those that stand out by most luminance first, and what is known of each."""

    pixel: I64
    typical: F64
    spread: F64

    def first(self, count: int | None) -> "Outliers":
        """The first ``count`` of them (None: all)."""
        return Outliers(self.pixel[:count], self.typical[:count], self.spread[:count])


@dataclass(frozen=True)
class PixelSums:
    """Of each pixel (float64): sum, sum of squares and maximum of what walks add. ``walks``: how many could; ``scale``: from sums to luminance."""

    total: F64
    squares: F64
    largest: F64
    walks: float
    scale: float

    @property
    def deviation(self) -> F64:
        """Sum of squared deviations of the values of a pixel's walks."""
        return np.asarray(np.maximum(self.squares - self.total**2 / self.walks, 0.0))

    def without(self, pixel: I64, value: F64) -> F64:
        """Luminance of pixels of which one walk of this value is left out."""
        return np.asarray((self.total[pixel] - value) * self.scale * self.walks / (self.walks - 1.0))


def pixel_sums(run: Run) -> PixelSums:
    """What walks add to each pixel, by one pass over the paths. Memory: three float64 a pixel for each thread."""
    width, pixels = int(run.settings["width"]), pixels_of(run)

    def work(pieces: Iterator[Piece]) -> tuple[F64, F64, F64]:
        total, squares, largest = np.zeros(pixels), np.zeros(pixels), np.zeros(pixels)
        for piece in pieces:
            x, y, r, g, b = light_of(piece)
            add_values(piece.owner(), x, y, r, g, b, width, total, squares, largest)
        return total, squares, largest

    total, squares, largest = np.zeros(pixels), np.zeros(pixels), np.zeros(pixels)
    for part in map_shards(run.shard_files, work, run.threads):
        total += part[0]
        squares += part[1]
        np.maximum(largest, part[2], out=largest)
    walks = run.settings["passes"] * run.settings["keep"]
    # any light walk may reach any pixel, a camera walk its own
    return PixelSums(total, squares, largest, walks * (pixels if run.settings["method"] == "light" else 1), 1.0 / walks)


def outlier_pixels(sums: PixelSums, width: int, variance_share: float, deviations: float, radius: int) -> Outliers:
    """The pixels that the rule calls outliers, ordered by how much luminance they have too much."""
    luminance = (sums.total * sums.scale).reshape(-1, width)
    mean = sums.total / sums.walks
    carried = (sums.largest > mean) & ((sums.largest - mean) ** 2 > variance_share * sums.deviation)
    candidates = np.flatnonzero(carried) if luminance.size > 1 else np.arange(0)  # a pixel alone stands out of nothing
    typical, spread = np.empty(len(candidates)), np.empty(len(candidates))
    for start in range(0, len(candidates), _CHUNK):
        part = slice(start, start + _CHUNK)
        typical[part], spread[part] = _surroundings(luminance, candidates[part], radius)
    excess = luminance.reshape(-1)[candidates] - typical
    out = np.flatnonzero((excess > deviations * spread) & (excess > 0))
    order = out[np.lexsort((candidates[out], -excess[out]))]
    return Outliers(candidates[order], typical[order], spread[order])


def _surroundings(luminance: F64, pixel: I64, radius: int) -> tuple[F64, F64]:
    """Median luminance and spread of the pixels around each pixel, itself left out."""
    height, width = luminance.shape
    dy, dx = (offset.reshape(-1) for offset in np.mgrid[-radius : radius + 1, -radius : radius + 1])
    around = (dx != 0) | (dy != 0)
    y, x = pixel[:, None] // width + dy[around], pixel[:, None] % width + dx[around]
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    values = np.where(inside, luminance[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)], np.nan)
    typical = np.nanmedian(values, axis=1)
    off = np.abs(values - typical[:, None])
    return typical, np.maximum(1.4826 * np.nanmedian(off, axis=1), 1.2533 * np.nanmean(off, axis=1))


def light_of(piece: Piece) -> list[Array]:
    """Where on the film each path lies, and its contribution: five columns."""
    return [piece.column("paths", name) for name in _LIGHT]
