"""What test images are made with: a raster of samples, seeds, and convex polygons painted over one another."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

LEAST_DENSITY = 12  # points across a pixel, at least, by which smooth images are averaged
_DENSITY = 24  # points across a pixel, at least, by which areas of shapes are measured: the same for all divisors of 24 up to 12
_BAND = 1 << 22  # points that are painted at once


@dataclass(frozen=True)
class Raster:
    """A display of ``width`` x ``height`` pixels with ``fine`` x ``fine`` samples in each."""

    width: int
    height: int
    fine: int

    def oversampling(self, density: int = _DENSITY) -> int:
        """How many points across a sample give at least ``density`` across a pixel, and at least 2 across a sample."""
        return max(2, -(-density // self.fine))

    @property
    def area(self) -> int:
        """Pixels."""
        return self.width * self.height

    def centers(self, oversampling: int = 1) -> tuple[F64, F64]:
        """Where the centers of points lie, in pixels: x (columns,) and y (rows,)."""
        density = self.fine * oversampling
        return (np.arange(self.width * density) + 0.5) / density, (np.arange(self.height * density) + 0.5) / density


def generator(seed: int, raster: Raster) -> np.random.Generator:
    """Random numbers that depend on a target and on the display's size, and on nothing else."""
    return np.random.default_rng([seed, raster.width, raster.height])


def average(points: npt.NDArray[np.floating | np.integer | np.bool_], oversampling: int) -> F32:
    """Averages of squares of ``oversampling`` x ``oversampling`` points, (rows, columns) or (rows, columns, channels)."""
    sides = (points[i::oversampling, j::oversampling] for i in range(oversampling) for j in range(oversampling))
    total = np.array(next(sides), np.float32)
    for side in sides:
        total += side
    total /= oversampling**2
    return total


def ribbons(path: F64, width: F64) -> F64:
    """Quadrilaterals along curves: ``path`` (curves, points, 2) and ``width`` (curves, points) in pixels -> (curves * (points - 1), 4, 2).

    They lie across the mean direction at every point, so that neighbors share an edge. The pieces of a curve follow one another.
    """
    along = np.gradient(path, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-12)
    across = np.stack([-along[..., 1], along[..., 0]], axis=2) * (0.5 * width[..., None])
    left, right = path - across, path + across
    return np.stack([left[:, :-1], left[:, 1:], right[:, 1:], right[:, :-1]], axis=2).reshape(-1, 4, 2)


def paint(raster: Raster, polygons: F64, colors: F64, background: Callable[[F64, F64], F64]) -> F32:
    """Convex polygons over a background, later ones over earlier ones, area averaged: float32 (rows, columns, 3).

    ``polygons``: (polygons, vertices, 2), x and y in pixels, a vertex may be repeated; ``colors``: (polygons, 3), linear;
    ``background(x, y)``: smooth, linear colors (…, 3) at positions in pixels.
    """
    k = raster.oversampling()
    columns = raster.width * raster.fine * k
    palette = np.vstack([np.zeros(3), colors]).astype(np.float32)
    vertices = polygons * float(raster.fine * k)
    low, high = vertices[..., 1].min(axis=1), vertices[..., 1].max(axis=1)
    x, y = raster.centers()
    image = np.empty((len(y), len(x), 3), np.float32)
    band = max(1, _BAND // (columns * k))
    for first in range(0, len(y), band):
        last = min(first + band, len(y))
        seen = np.flatnonzero((high > first * k) & (low < last * k))
        front = _fill(vertices[seen], first * k, last * k, columns)
        shown = np.concatenate([[0], seen + 1])[front]
        share = average(shown == 0, k)[..., None]
        image[first:last] = share * background(x[None, :], y[first:last, None])
        image[first:last] += _shade(palette, shown, k)
    return np.clip(image, 0.0, 1.0, out=image)


def _shade(palette: F32, shown: I64, oversampling: int) -> F32:
    """The average color of what is shown."""
    total = np.zeros((len(shown) // oversampling, shown.shape[1] // oversampling, 3), np.float32)
    for i in range(oversampling):
        for j in range(oversampling):
            total += palette.take(shown[i::oversampling, j::oversampling], axis=0)
    total /= oversampling**2
    return total


def _fill(vertices: F64, first: int, last: int, columns: int) -> I64:
    """Which polygon is in front at the center of each point of some rows: its index + 1, or 0; (last - first, columns)."""
    # Every row of points of every polygon
    low = np.clip(np.ceil(vertices[..., 1].min(axis=1) - 0.5), first, last).astype(np.int64)
    high = np.clip(np.ceil(vertices[..., 1].max(axis=1) - 0.5), first, last).astype(np.int64)
    polygon, row = _runs(low, high)

    # Between which columns the row crosses it
    y = row + 0.5
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    start = vertices
    end = np.roll(vertices, -1, axis=1)
    rise = end[..., 1] - start[..., 1]
    slope = (end[..., 0] - start[..., 0]) / np.where(rise != 0.0, rise, 1.0)
    foot = start[..., 0] - slope * start[..., 1]
    bottom, top = np.minimum(start[..., 1], end[..., 1]), np.maximum(start[..., 1], end[..., 1])
    for edge in range(vertices.shape[1]):
        crosses = (bottom[:, edge].take(polygon) <= y) & (y < top[:, edge].take(polygon))
        x = foot[:, edge].take(polygon) + y * slope[:, edge].take(polygon)
        np.minimum(left, x, out=left, where=crosses)
        np.maximum(right, x, out=right, where=crosses)
    begin = np.ceil(np.clip(left, 0, columns) - 0.5).astype(np.int64)
    finish = np.ceil(np.clip(right, 0, columns) - 0.5).astype(np.int64)

    # Paint: where an index repeats, the last assignment stays
    base = (row - first) * columns
    run, at = _runs(base + begin, base + finish)
    front = np.zeros((last - first) * columns, np.int64)
    front[at] = polygon[run] + 1
    return front.reshape(-1, columns)


def _runs(begin: I64, end: I64) -> tuple[I64, I64]:
    """All integers of half-open ranges, and which range each is of."""
    counts = np.maximum(end - begin, 0)
    which = np.repeat(np.arange(len(begin)), counts)
    return which, np.arange(len(which)) + np.repeat(begin - (np.cumsum(counts) - counts), counts)
