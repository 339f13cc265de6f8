"""What a display shows: the light of its subpixels, how much of it was cut off, and pictures of it (thesis 4.5)."""

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.srgb import to_srgb
from renderer.filters.subpixel.layout import Layout

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
Floating = npt.NDArray[np.floating]

FINEST = 24  # samples across a pixel at most: subpixels whose edges fall between samples light a part of them
TOLERANCE = 1e-6  # by how much a drive may lie outside [0, 1] that does not count as clipped
_BAND = 1 << 21  # samples of a picture that are drawn at once


def fine_grid(layouts: Iterable[Layout]) -> int:
    """The fewest samples across and down a pixel on which the edges of all subpixels of all layouts lie, ``FINEST`` at most."""
    found = 1
    for layout in layouts:
        for axis in (0, 1):
            # In positions, edges lie half an extent from the centers: on whole ones, or halfway, or wherever the origin puts them
            edges = [layout.origin[axis] + 0.5 * extent[axis] for extent in layout.extent]
            between = any(abs(edge - round(edge)) > TOLERANCE for edge in edges)
            found = math.lcm(found, layout.cells[axis] * (2 if between else 1))
    return min(found, FINEST)


def shown(lattice: Floating, layout: Layout, fine: int, clip: bool = False) -> F32:
    """The light of a display, linear RGB, on ``fine`` x ``fine`` samples for each pixel: float32 (height * fine, width * fine, 3).

    Each subpixel lights its extent around its center, evenly, so brightly that all of R, G and B at 1 average to white, (1, 1, 1), over a period;
    W adds ``layout.white_share`` to that, so a display that has it is brighter than white with everything on. Samples that a subpixel lights in
    part get that part. Light beside the display is left out. ``clip``: drives are cut to [0, 1] first, as a display does; without, light may be
    negative.

    Raises QueryError for a lattice that is not one of whole pixels.
    """
    height, width = _pixels(lattice, layout)
    if fine < 1:
        raise QueryError(f"expected at least one sample across a pixel, found {fine}")
    extent = np.array(layout.extent, np.float64)[layout.active_primaries]
    colors = layout.light()[layout.active_primaries] * (layout.spacing / extent.prod(axis=1))[:, None]
    return _draw(_drive(lattice, clip), layout, fine, colors, height, width)


def clipped_share(lattice: Floating, layout: Layout) -> float:
    """The share of subpixels whose drive is outside [0, 1] by more than 1e-6."""
    outside = total = 0
    for row, column in layout.active:
        drive = _of(lattice, layout, row, column)
        total += drive.size
        outside += int(np.count_nonzero((drive < -TOLERANCE) | (drive > 1 + TOLERANCE)))
    return outside / max(total, 1)


def subpixel_picture(lattice: Floating, layout: Layout) -> U8:
    """The display under a magnifying glass, sRGB uint8, on ``fine_grid`` samples for each pixel: subpixels in their color at their drive.

    No gain makes up for the light that the other primaries do not give, so it is darker than the image; W is white.
    """
    height, width = _pixels(lattice, layout)
    fine, pattern_rows = fine_grid([layout]), len(layout.pattern)
    colors = np.vstack([np.eye(3), np.ones((1, 3))])[layout.active_primaries]
    picture = np.empty((height * fine, width * fine, 3), np.uint8)

    # Bands of whole periods, with as many more around them as their subpixels may reach
    cells_y = layout.cells[1]
    period = math.lcm(pattern_rows, cells_y) // cells_y  # pixels
    more = period * -(-max(extent[1] for extent in layout.extent) // pattern_rows)
    band = period * max(1, _BAND // (fine * fine * width * period))
    for first in range(0, height, band):
        last, start, end = min(first + band, height), max(first - more, 0), min(first + band + more, height)
        light = _draw(_drive(lattice[start * cells_y : end * cells_y], True), layout, fine, colors, end - start, width)
        picture[first * fine : last * fine] = _encoded(light[(first - start) * fine : (last - start) * fine])
    return picture


def drive_picture(lattice: Floating, layout: Layout) -> U8 | None:
    """What to send to the display, sRGB uint8 (height, width, 3), if each of its pixels has one R, one G and one B; else None."""
    height, width = _pixels(lattice, layout)
    pattern_rows, pattern_columns = layout.pattern.shape
    (across, down), picture = layout.cells, np.empty((height, width, 3), np.uint8)
    period_rows, period_columns = pattern_rows // down, pattern_columns // across  # pixels
    filled = np.zeros((period_rows, period_columns, 3), np.int64)
    for (row, column), primary in zip(layout.active, layout.active_primaries):
        if primary > 2:
            return None
        y, x = row // down, column // across
        filled[y, x, primary] += 1
        picture[y::period_rows, x::period_columns, primary] = _encoded(_drive(_of(lattice, layout, row, column), True))
    return picture if (filled == 1).all() else None


# --- drawing ------------------------------------------------------------------------------------------------------


def _draw(drive: F32, layout: Layout, fine: int, colors: F64, height: int, width: int) -> F32:
    """Rectangles of light: each subpixel of ``layout.active`` in its row of ``colors`` times its drive, float32 (height fine, width fine, 3)."""
    light = np.zeros((height * fine, width * fine, 3), np.float32)
    pattern_rows, pattern_columns = layout.pattern.shape
    period_x, period_y = (size * fine // of for size, of in zip((pattern_columns, pattern_rows), layout.cells))
    groups: dict[tuple[int, int], list[int]] = {}  # subpixels of one row and height have their rows of light in common
    for k, (row, _) in enumerate(layout.active):
        groups.setdefault((int(row), layout.extent[layout.active_primaries[k]][1]), []).append(k)
    for (row, _), subpixels in groups.items():
        strips = np.zeros((len(drive[row::pattern_rows]), light.shape[1], 3), np.float32)
        for k in subpixels:
            values = drive[row::pattern_rows, layout.active[k, 1] :: pattern_columns]
            for at, share in _coverage(layout, fine, k, 0):
                into, of = _placed(at, period_x, values.shape[1], strips.shape[1])
                for channel in np.flatnonzero(colors[k]):
                    strips[:, into, channel] += values[:, of] * np.float32(share * colors[k, channel])
        for at, share in _coverage(layout, fine, subpixels[0], 1):
            into, of = _placed(at, period_y, len(strips), len(light))
            light[into] += strips[of] * np.float32(share)
    return light


def _coverage(layout: Layout, fine: int, subpixel: int, axis: int) -> list[tuple[int, float]]:
    """Which samples of the fine grid a subpixel of the first period lights along an axis (0: across), and what share of each."""
    center = layout.active[subpixel, 1 - axis] + layout.origin[axis]
    half = 0.5 * layout.extent[layout.active_primaries[subpixel]][axis]
    low, high = ((center + side) * fine / layout.cells[axis] for side in (-half, half))
    shares = [(at, min(high, at + 1) - max(low, at)) for at in range(math.floor(low), math.ceil(high))]
    return [(at, share) for at, share in shares if share > TOLERANCE]


def _placed(at: int, period: int, periods: int, samples: int) -> tuple[slice, slice]:
    """Where a sample comes again in each period: those of ``samples`` that it falls on, and the periods that do."""
    first, last = max(0, -(at // period)), min(periods, -(-(samples - at) // period))
    last = max(first, last)
    start = at + first * period
    return slice(start, start + max(0, (last - first - 1) * period + 1) if last > first else start, period), slice(first, last)


def _drive(lattice: Floating, clip: bool) -> F32:
    drive = np.asarray(lattice, np.float32)
    return np.clip(drive, 0, 1) if clip else drive


def _of(lattice: Floating, layout: Layout, row: int, column: int) -> Floating:
    """The drives of one subpixel of the pattern, in all periods."""
    return lattice[row :: layout.pattern.shape[0], column :: layout.pattern.shape[1]]


def _pixels(lattice: Floating, layout: Layout) -> tuple[int, int]:
    """Height and width of a lattice in pixels."""
    across, down = layout.cells
    if lattice.ndim != 2 or lattice.shape[0] % down or lattice.shape[1] % across or not lattice.size:
        raise QueryError(f"{layout.name}: expected a lattice of whole pixels of {across} x {down} positions, found the shape {lattice.shape}")
    return lattice.shape[0] // down, lattice.shape[1] // across


def _encoded(light: F32) -> U8:
    return np.asarray(np.round(to_srgb(light) * np.float32(255)), np.uint8)
