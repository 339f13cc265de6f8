"""Pictures side by side, pixel by pixel as they are, with headings and a title."""

import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.srgb import to_srgb
from queries.subpixel.display import F32, Floating
from renderer.filters.subpixel.layout import Layout
from viz.charts import DPI, INK
from viz.subpixel.look import QUIET, save_panels

U8 = npt.NDArray[np.uint8]

GAP, MARGIN, TITLE, HEADING = 12, 14, 44, 30  # pixels
COLUMN = 432  # pixels: a third of a chart's width, which many whole numbers divide
POINT = DPI / 72  # pixels


def mosaic(file: pathlib.Path, rows: Sequence[Sequence[U8]], headings: Sequence[Sequence[str]], title: str, remark: str = "") -> pathlib.Path:
    """Write rows of pictures, uint8 (h, w, 3), each with its heading above, as a PNG. Columns are ``COLUMN`` wide, or as their widest picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    widths = [max(COLUMN, *(row[column].shape[1] for row in rows)) for column in range(len(rows[0]))]
    heights = [max(picture.shape[0] for picture in row) for row in rows]
    across = 2 * MARGIN + sum(widths) + GAP * (len(widths) - 1)
    down = TITLE + sum(heights) + HEADING * len(rows) + GAP * (len(rows) - 1) + MARGIN
    figure = Figure(figsize=(across / DPI, down / DPI), dpi=DPI)
    FigureCanvasAgg(figure)
    _text(figure, MARGIN, 10, title, 11, INK)
    if remark:
        _text(figure, across - MARGIN, 14, remark, 8.5, QUIET, right=True)
    top = TITLE
    for row, names, height in zip(rows, headings, heights, strict=True):
        left = MARGIN
        for picture, name, width in zip(row, names, widths, strict=True):
            _text(figure, left, top, name, 9.5, INK)
            figure.figimage(picture, left, down - top - HEADING - picture.shape[0], origin="upper")
            left += width + GAP
        top += HEADING + height + GAP
    return save_panels(figure, file)


def enlarged(picture: U8, times: int) -> U8:
    """Each pixel as a square of ``times`` x ``times``."""
    return np.repeat(np.repeat(picture, times, axis=0), times, axis=1)


def reduced(light: F32, width: int) -> F32:
    """A picture, float32 (h, w, 3), reduced to a width in the same proportions: the mean of the area of each new pixel."""
    height = max(1, round(len(light) * width / light.shape[1]))
    for axis, size in ((0, height), (1, width)):
        old = light.shape[axis]
        sums = np.concatenate([np.zeros_like(light.take([0], axis)), light], axis).cumsum(axis, dtype=np.float64)
        edge = np.arange(size + 1) * (old / size)
        low = np.minimum(edge.astype(np.int64), old - 1)
        part = (edge - low).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        at_edges = sums.take(low, axis) * (1 - part) + sums.take(low + 1, axis) * part
        light = np.asarray(np.diff(at_edges, axis=axis) * (size / old), np.float32)
    return light


def as_picture(light: Floating) -> U8:
    """Linear RGB, cut to [0, 1], as sRGB uint8."""
    return np.asarray(np.round(255 * to_srgb(np.asarray(light, np.float32))), np.uint8)


def pixel_light(lattice: Floating, layout: Layout) -> F32:
    """The light of a display as it is seen where subpixels melt into one another, linear RGB, float32 (height, width, 3); drives are cut to [0, 1].

    At each pixel: the mean drive of each primary in the period around the pixel's center, times the primary's light; where a period has several
    pixels, with weights that fall linearly, so that a primary that they share is interpolated.
    """
    # A period more on all sides, so that periods around pixels at the edges are whole
    rows, columns = (_extended(size, period) for size, period in zip(lattice.shape, layout.pattern.shape, strict=True))
    of = layout.pattern.astype(np.int8)[rows[:, None] % layout.pattern.shape[0], columns % layout.pattern.shape[1]]
    drive = np.clip(lattice[rows[:, None], columns], 0, 1).astype(np.float32)

    axes = zip(layout.pattern.shape, layout.cells[::-1], lattice.shape, strict=True)
    centers = np.ix_(*(np.arange(period + cells // 2, period + size, cells) for period, cells, size in axes))
    light = np.zeros((*drive[centers].shape, 3), np.float32)
    for primary, color in enumerate(layout.light()):
        here = of == primary
        sums = _weighed(np.where(here, drive, np.float32(0)), layout)[centers]
        share = _weighed(here.astype(np.float32), layout)[centers]
        mean = np.divide(sums, share, out=np.zeros_like(sums), where=share > 1e-6)
        light += mean[..., None] * color.astype(np.float32)
    return light


def _weighed(values: F32, layout: Layout) -> F32:
    """Means over the period around each position, float32 (rows, columns); along axes where that is several pixels, their means once more: a tent."""
    from scipy.ndimage import uniform_filter

    sizes = [period if period > cells else 1 for period, cells in zip(layout.pattern.shape, layout.cells[::-1], strict=True)]
    boxes = uniform_filter(values, layout.pattern.shape, mode="constant")
    return np.asarray(uniform_filter(boxes, sizes, mode="constant", origin=[-1 if size % 2 == 0 else 0 for size in sizes]), np.float32)


def _extended(size: int, period: int) -> npt.NDArray[np.int64]:
    """Positions 0 … ``size``, and before and after them those of the first and of the last period again."""
    at = np.arange(-period, size + period)
    return np.clip(np.where(at < 0, at + period, np.where(at >= size, at - period, at)), 0, size - 1)


def _text(figure: Any, left: int, top: int, text: str, size: float, color: str, right: bool = False) -> None:
    """Text whose upper corner is so many pixels from the figure's."""
    width, height = figure.get_size_inches() * DPI
    figure.text(left / width, 1 - top / height, text, fontsize=size, color=color, ha="right" if right else "left", va="top")
