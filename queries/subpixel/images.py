"""Image files and arrays, filtered for the subpixels of a display (thesis 4.4.1).

A pixel of the display is ``scale`` x ``scale`` pixels of the image, ``scale`` 1 or more and not always a whole number; what is left over at the
right and below makes no pixel, but counts where filters reach it. Filters that end in a jump, boxes, take the light on their area exactly, where an
image pixel is a square of even light; all others take image pixels as samples at their centers.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.shards import cores
from queries.srgb import to_linear
from queries.subpixel.accumulate import LEAST_SHARE, accumulate_samples
from queries.subpixel.full import apply_kernels
from renderer.filters.reconstruction import ReconstructionFilter
from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import subpixel_filter
from renderer.filters.subpixel.windowed_sinc import Fit, box

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Window = tuple[int, int, int, int]  # left, top, right, bottom: whole pixels of a display

MOST_PIXELS = 100_000_000  # of an image
_BAND = 1 << 20  # image pixels that are filtered at once


def read_image(path: str | os.PathLike[str]) -> F32:
    """An image file as linear RGB, float32 (height, width, 3), top row first.

    Integer formats are sRGB-coded and get decoded, floating-point formats are linear already, as textures have it. Gray becomes RGB, alpha is
    dropped; of images with more channels R, G and B are taken, or else the first three. Values below 0 and above 1 stay as they are: what a
    display cannot show is cut off when it is shown.

    Raises QueryError for files that cannot be read, are no images, damaged or empty, hold more than 100 megapixels or numbers that are not finite.
    """
    import OpenImageIO as oiio

    name = os.fspath(path)
    try:
        with open(path, "rb"):
            pass
    except OSError as error:
        raise QueryError(f"the image `{name}` cannot be read: {error.strerror}") from None
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(name, config)
    if file is None:
        raise QueryError(f"expected an image file, but `{name}` cannot be read as one: {_line(oiio.geterror())}")
    try:
        spec = file.spec()
        if spec.deep or spec.depth > 1 or not spec.width * spec.height * spec.nchannels:
            raise QueryError(f"expected an image of two dimensions with at least one pixel, but `{name}` is deep, a volume or empty")
        if spec.width * spec.height > MOST_PIXELS:
            raise QueryError(f"`{name}` has {spec.width} x {spec.height} pixels, more than {MOST_PIXELS:,}: scale it down, or cut out a part")
        coded = spec.format.basetype not in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
        channels = list(spec.channelnames)
        values = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        if values is None or file.has_error:
            raise QueryError(f"the image `{name}` is damaged: {_line(file.geterror())}")
    finally:
        file.close()

    pixels = np.asarray(values, np.float32).reshape(spec.height, spec.width, spec.nchannels)
    first_three = [0, 1, 2] if len(channels) > 2 else [0, 0, 0]
    pixels = pixels[:, :, [channels.index(c) for c in "RGB"] if {"R", "G", "B"} <= set(channels) else first_three]
    _require_finite(pixels, f"the image `{name}`")
    return np.ascontiguousarray(to_linear(pixels) if coded else pixels)


def display_size(image: F32, scale: float) -> tuple[int, int]:
    """Width and height of the display that shows an image, in its pixels: the whole ones that the image fills.

    Raises QueryError where there is none, and for a scale that is not 1 or more.
    """
    if image.ndim != 3 or image.shape[2] != 3:
        raise QueryError(f"expected an image of (height, width, 3), found the shape {image.shape}")
    if not 1 <= scale < float("inf"):
        raise QueryError(f"expected a scale of 1 or more image pixels for each pixel of the display, found {scale:g}: enlarge the image first")
    height, width, _ = image.shape
    across, down = (int(size / scale + 1e-9) for size in (width, height))
    if not across or not down:
        raise QueryError(f"an image of {width} x {height} pixels fills no pixel of {scale:g} x {scale:g}: choose a smaller scale")
    return across, down


def apply(
    image: F32,
    method: str,
    layout: Layout,
    kernels: Kernels | None = None,
    fits: tuple[Fit, ...] | None = None,
    zeros: int = 2,
    scale: float = 1.0,
    threads: int | None = None,
) -> F32:
    """The lattice of an image by a method of ``renderer.filters.subpixel.methods``; ``kernels`` and ``fits`` are for ``kernels`` and ``optimal``."""
    if method != "kernels":
        return resolve_image(image, subpixel_filter(method, layout, fits, zeros), scale, threads)
    if kernels is None:
        raise QueryError(f"{layout.name}: the method `kernels` needs the kernels of the layout: give those of `derive`")
    return np.asarray(apply_kernels(signal_of_image(image, layout, scale, threads), kernels, threads=threads), np.float32)


def resolve_image(image: F32, filter: SubpixelFilter, scale: float = 1.0, threads: int | None = None) -> F32:
    """The lattice of an image: float32 (rows, columns), not clipped; a subpixel is the weighted mean of the image around it.

    ``image``: float32 (height, width, 3), linear. Where weights cancel or reach no image pixel, that at the subpixel's center counts alone.
    Raises QueryError as ``display_size`` does, and for numbers that are not finite.
    """
    width, height = display_size(image, scale)
    _require_finite(image, "the image")
    if filter.down is None:
        return _resolve_radial(image, filter, scale, width, height, threads)
    return _resolve_separable(image, filter, filter.down, scale, width, height, threads)


def signal_of_image(image: F32, layout: Layout, scale: float = 1.0, threads: int | None = None) -> F32:
    """γ at every position: the mean light of the image on the position's cell, float32 (rows, columns, 3), linear RGB.

    Image pixels are squares of even light, and cells may hold parts of them. Raises QueryError as ``resolve_image`` does.
    """
    return _areas(image, scale, layout.cells, layout.origin, threads)


def resample(image: F32, scale: float, fine: int, window: Window | None = None, threads: int | None = None) -> F32:
    """The image on the fine grid of the display: float32 (height * fine, width * fine, 3), the mean light on each of ``fine`` x ``fine`` squares.

    Image pixels are squares of even light. ``window``: only that part is made. Raises QueryError as ``resolve_image`` does.
    """
    return _areas(image, scale, (fine, fine), (0.5, 0.5), threads, window)


def _areas(image: F32, scale: float, cells: tuple[int, int], origin: tuple[float, float], threads: int | None, window: Window | None = None) -> F32:
    """The mean light on cells, so many across and down a pixel, the first around ``origin``, in cells: float32 (rows, columns, 3)."""
    width, height = display_size(image, scale)
    _require_finite(image, "the image")
    left, top, right, bottom = window or (0, 0, width, height)
    if not (0 <= left < right <= width and 0 <= top < bottom <= height):
        raise QueryError(f"expected a window in a display of {width} x {height} pixels, found ({left}, {top}) to ({right}, {bottom})")
    (cells_x, cells_y), (origin_x, origin_y) = cells, origin
    across = _weights((np.arange(left * cells_x, right * cells_x) + origin_x) / cells_x, box("cell", 0.5 / cells_x), scale, image.shape[1])
    center_y = (np.arange(top * cells_y, bottom * cells_y) + origin_y) / cells_y
    light = np.empty((len(center_y), (right - left) * cells_x, 3), np.float32)

    def fill(first: int, last: int) -> None:
        tall = _reduced(image, _weights(center_y[first:last], box("cell", 0.5 / cells_y), scale, len(image)))
        for channel in range(3):
            light[first:last, :, channel] = _across(across, tall[:, :, channel])

    _in_bands(fill, len(light), max(1, int(_BAND * cells_y / (scale * image.shape[1]))), threads)
    return light


# --- separable filters --------------------------------------------------------------------------------------------


def _resolve_separable(
    image: F32, filter: SubpixelFilter, down: tuple[ReconstructionFilter, ...], scale: float, width: int, height: int, threads: int | None
) -> F32:
    """Rows of the image become rows of subpixels, then columns."""
    layout, (cells_x, cells_y) = filter.layout, filter.layout.cells
    pattern_rows, pattern_columns = layout.pattern.shape
    centers = filter.centers()
    lattice = np.zeros((height * cells_y, width * cells_x), np.float32)
    across = []
    for (_, column), (x, _), one in zip(layout.active, centers, filter.across):
        periods = np.arange(len(range(column, lattice.shape[1], pattern_columns)))
        across.append(_weights(x + periods * (pattern_columns / cells_x), one, scale, image.shape[1]))

    def fill(first: int, last: int) -> None:
        tall: dict[tuple[float, ReconstructionFilter], F64] = {}  # subpixels beside each other have it in common
        for p, (row, column) in enumerate(layout.active):
            into = lattice[first + row : last : pattern_rows, column::pattern_columns]
            key = float(centers[p, 1]), down[p]
            if key not in tall:
                y = key[0] + (np.arange(len(into)) + first // pattern_rows) * (pattern_rows / cells_y)
                tall[key] = _reduced(image, _weights(y, down[p], scale, len(image)))
            into[:] = _of_primary(layout, p, lambda c, rows=tall[key], which=across[p]: _across(which, rows[:, :, c]))  # type: ignore[misc]

    # Bands of whole periods
    band = pattern_rows * max(1, int(_BAND * cells_y / (scale * image.shape[1] * pattern_rows)))
    _in_bands(fill, len(lattice), band, threads)
    return lattice


def _of_primary(layout: Layout, subpixel: int, channel: Callable[[int], F64]) -> F64:
    """What a subpixel's primary shows of colors, of which ``channel`` gives R, G and B."""
    primary = int(layout.active_primaries[subpixel])
    if len(layout.primaries) == 3:
        return channel(primary)
    return np.asarray(layout.signal(np.stack([channel(c) for c in range(3)], axis=-1))[..., primary])


def _weights(centers: F64, filter: ReconstructionFilter, scale: float, count: int) -> Any:
    """Weights of ``count`` image pixels along an axis, a sparse matrix (centers, count), float64; each row sums to 1. Centers are in pixels."""
    from scipy.sparse import csr_array

    radius = filter.radius
    taps = int(np.ceil(2 * radius * scale)) + 2
    at = np.floor((centers - radius) * scale).astype(np.int64)[:, None] + np.arange(taps)
    from_center = at / scale - centers[:, None]
    if _jumps(filter):
        low, high = np.maximum(from_center, -radius), np.minimum(from_center + 1 / scale, radius)
        weights = np.where(high > low, (high - low) * filter.weight(0.5 * (low + high)), 0.0)
    else:
        offset = from_center + 0.5 / scale
        weights = np.where(np.abs(offset) <= radius, filter.weight(offset), 0.0)
    weights[(at < 0) | (at >= count)] = 0.0

    # Where there is no weight, or hardly any is left of what cancels, the pixel at the center
    total, magnitude = weights.sum(axis=1), np.abs(weights).sum(axis=1)
    weak = total <= LEAST_SHARE * magnitude
    weights = weights / np.where(weak, 1.0, total)[:, None]
    at = np.clip(at, 0, count - 1)
    weights[weak] = 0.0
    weights[weak, 0], at[weak, 0] = 1.0, np.clip((centers[weak] * scale).astype(np.int64), 0, count - 1)
    return csr_array((weights.ravel(), at.ravel(), np.arange(len(centers) + 1) * taps), shape=(len(centers), count))


def _jumps(filter: ReconstructionFilter) -> bool:
    """Whether a filter is a box, and ends at half its height or more."""
    middle, end = filter.weight(np.array([0.0, 0.999999 * filter.radius]))
    return bool(abs(end) >= 0.5 * abs(middle))


def _reduced(image: F32, weights: Any) -> F64:
    """Sums of the image's rows: float64 (rows of ``weights``, width, 3)."""
    first, last = int(weights.indices.min(initial=len(image) - 1)), int(weights.indices.max(initial=0)) + 1  # the rest is not looked at
    last = max(first + 1, last)
    found = weights[:, first:last] @ image[first:last].reshape(last - first, -1)
    return np.asarray(found, np.float64).reshape(-1, *image.shape[1:])


def _across(weights: Any, channel: F64) -> F64:
    """Sums along rows: (rows, width) to (rows, columns)."""
    return np.asarray((weights @ np.ascontiguousarray(channel.T)).T, np.float64)


# --- radial filters -----------------------------------------------------------------------------------------------


def _resolve_radial(image: F32, filter: SubpixelFilter, scale: float, width: int, height: int, threads: int | None) -> F32:
    """Image pixels as samples, band after band, each with the samples around it that its subpixels reach."""
    layout, cells_y = filter.layout, filter.layout.cells[1]
    period = len(layout.pattern) // cells_y  # pixels
    more = period * (-(-int(np.ceil(filter.radius[1])) // period) + 1)
    band = period * max(1, int(_BAND / (scale * image.shape[1] * period)))
    lattice = np.empty((height * cells_y, width * layout.cells[0]), np.float32)
    beyond_right, beyond_below = (int(np.ceil(size / scale)) for size in (image.shape[1], image.shape[0]))
    x = (np.arange(image.shape[1]) + 0.5) / scale

    def fill(first: int, last: int) -> None:
        start, end = max(first - more, 0), min(last + more, beyond_below)
        rows = np.arange(max(int(start * scale) - 1, 0), min(int(np.ceil(end * scale)) + 1, len(image)))
        y = np.repeat((rows + 0.5) / scale - start, len(x))
        found = accumulate_samples(np.tile(x, len(rows)), y, image[rows].reshape(-1, 3), filter, beyond_right, end - start)
        from_row = (first - start) * cells_y
        lattice[first * cells_y : last * cells_y] = found[from_row : from_row + (last - first) * cells_y, : lattice.shape[1]]

    _in_bands(fill, height, band, threads)
    return lattice


# --- bands and checks ---------------------------------------------------------------------------------------------


def _in_bands(fill: Callable[[int, int], None], rows: int, band: int, threads: int | None) -> None:
    with ThreadPoolExecutor(threads or cores()) as pool:
        list(pool.map(lambda first: fill(first, min(first + band, rows)), range(0, rows, band)))


def _line(text: str) -> str:
    return " ".join(text.split())


def _require_finite(image: F32, what: str) -> None:
    bad = ~np.isfinite(image).all(axis=2)
    if bad.any():
        row, column = np.argwhere(bad)[0]
        raise QueryError(f"{what} has {np.count_nonzero(bad)} pixels that are not finite numbers, the first in column {column}, row {row} (from 0)")
