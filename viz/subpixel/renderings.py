"""The input as each display shows it, beside standard filtering for each pixel, as Fig. 4.9 of the thesis does."""

import math
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from queries.subpixel.display import fine_grid, subpixel_picture
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import TITLES
from viz.numbers import number, percent
from viz.report.subpixel import layout_title, method_title
from viz.subpixel.figure import Agreement, Figure
from viz.subpixel.fits import family
from viz.subpixel.look import PRIMARY_WORDS
from viz.subpixel.mosaic import COLUMN, as_picture, enlarged, mosaic, pixel_light, reduced

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]

TIMES = 8  # by how much the thesis scales the difference
CROP = (24, 18)  # pixels of the display, across and down, that are enlarged
PURPLE = 1.25  # red and blue differ at least so many times as much as green: "mostly purple"
EVEN = 1.5  # the most affected primary differs at most so many times as much as the least: "roughly equally affected"
_FRAME = ((0, 0, 0), (255, 221, 51))  # of the part that is enlarged, outside and inside

_STATED = {
    "RGB": "Fig. 4.9: the difference to standard anti-aliasing is mostly purple for the RGB stripe, as green subpixels stand on the pixels' centers "
    "while red and blue ones are offset and thus most affected.",
    "RGBG": "Fig. 4.9: for RGBG the green subpixels are shifted. We read: off the pixels' centers, so that they are affected too.",
    "RGBW": "Fig. 4.9: all subpixels are roughly equally affected with the 2-D RGBW layout.",
}


@dataclass(frozen=True)
class Crop:
    """The part of a display that is enlarged, in whole pixels."""

    left: int
    top: int
    width: int
    height: int


def rendering_figure(display: Display, description: SubpixelDescription, folder: pathlib.Path) -> Figure:
    """The whole display by the chosen method, by a box for each pixel, and their difference; below, where that is largest."""
    layout, title, method = display.layout, layout_title(display.layout.name), TITLES[description.method]
    lights = [pixel_light(lattice, layout) for lattice in (display.lattice, display.standard)]
    change = np.abs(lights[0] - lights[1])
    crop = strongest(change, layout)
    wholes = [_framed(*_fitted(light), crop) for light in (*lights, TIMES * change)]

    # Subpixels, enlarged by a whole number
    drives = [np.clip(lattice, 0, 1).astype(np.float32) for lattice in (display.lattice, display.standard)]
    difference = np.abs(drives[0] - drives[1])
    times = max(1, COLUMN // (crop.width * fine_grid([layout])))
    parts = [enlarged(_cut_picture(lattice, layout, crop), times) for lattice in (*drives, TIMES * difference)]
    headings = [method_title(description.method), "Box per pixel", f"Absolute difference × {TIMES}"]
    file = folder / f"rendering_{layout.name}.png"
    remark = f"{change.shape[1]} x {len(change)} pixels; the frame holds {crop.width} x {crop.height} of them"
    below = ["Subpixels in the frame", "Subpixels in the frame", f"Their absolute difference × {TIMES}"]
    mosaic(file, [wholes, parts], [headings, below], f"{title}: rendering", remark)

    agreement, comparison = compared(means(difference, layout), means(drives[1], layout), layout)
    return Figure(
        name=f"rendering_{layout.name}",
        title=f"Rendering for {title}",
        file=file,
        alt=f"The input on {title} by {method}, by a box for each pixel, and {TIMES} times their difference, whole and as {crop.width} x "
        f"{crop.height} enlarged pixels at column {crop.left}, row {crop.top}.",
        caption=f"Above: the light of {title} where subpixels melt into one another, by “{method}” and by the standard box for each pixel, and the "
        f"absolute difference of linear light × {TIMES}. Below: the subpixels themselves, at their drive, in the framed {crop.width} x "
        f"{crop.height} pixels, where the difference is largest. All sRGB; {number(100 * display.clipped)} % of the subpixels were clipped.",
        thesis=_STATED.get(family(layout), ""),
        agreement=agreement,
        comparison=comparison,
    )


def strongest(change: F32, layout: Layout) -> Crop:
    """The part of ``CROP`` pixels, whole periods of the layout from the upper left, with the largest sum of differences, float32 (h, w, 3)."""
    from scipy.ndimage import uniform_filter

    height, width, _ = change.shape
    across, down = min(CROP[0], width), min(CROP[1], height)
    sums = uniform_filter(change.sum(axis=2), (down, across), mode="constant")
    step_y, step_x = (math.lcm(size, cells) // cells for size, cells in zip(layout.pattern.shape, layout.cells[::-1], strict=True))
    inside = sums[down // 2 : height - down + down // 2 + 1 : step_y, across // 2 : width - across + across // 2 + 1 : step_x]
    top, left = np.unravel_index(int(inside.argmax()), inside.shape)
    return Crop(int(left) * step_x, int(top) * step_y, across, down)


def means(drive: F32, layout: Layout) -> dict[str, float]:
    """The mean of drives or of their differences, float32 (rows, columns), over the subpixels of each primary, by its letter."""
    pattern_rows, pattern_columns = layout.pattern.shape
    sums, counts = dict.fromkeys(layout.primaries, 0.0), dict.fromkeys(layout.primaries, 0)
    for (row, column), primary in zip(layout.active, layout.active_primaries, strict=True):
        values = drive[row::pattern_rows, column::pattern_columns]
        sums[layout.primaries[primary]] += float(values.sum(dtype=np.float64))
        counts[layout.primaries[primary]] += values.size
    return {letter: sums[letter] / max(1, counts[letter]) for letter in sums}


def compared(differences: Mapping[str, float], drives: Mapping[str, float], layout: Layout) -> tuple[Agreement, str]:
    """Which primaries the difference is in, beside what the thesis states, in words. Of each primary: mean difference, and mean drive.

    Differences are judged in units of the primary's own mean drive, or a reddish picture would have reddish differences by any filter.
    """
    named = ", ".join(f"{PRIMARY_WORDS[letter]} {number(value)}" for letter, value in differences.items())
    text = f"Mean absolute differences, in units of full drive: {named}"
    kind = family(layout)
    if min(drives.values()) <= 0 or max(differences.values()) <= 0:
        return "not comparable", f"{text}. {'Both filters give the same picture.' if max(differences.values()) <= 0 else 'A primary is not lit.'}"
    relative = {letter: differences[letter] / drives[letter] for letter in differences}
    text += f"; in units of the primary's own mean drive: {', '.join(f'{PRIMARY_WORDS[k]} {percent(v)}' for k, v in relative.items())}."
    if not kind:
        return "not comparable", f"{text} The thesis shows no such display."
    red, green, blue = (relative[letter] for letter in "RGB")
    if kind == "RGB":
        least = min(red, blue) / green if green > 0 else math.inf
        tint = f" Relative to that, red and blue differ at least {number(least)} times as much as green (mostly purple: at least {PURPLE:g} times)."
        return ("agrees" if least >= PURPLE else "differs"), text + tint
    if kind == "RGBG":
        share = green / max(red, blue) if max(red, blue) > 0 else math.inf
        return ("agrees" if share >= 1 / EVEN else "differs"), (
            f"{text} Relative to that, green differs {number(share)} times as much as the more affected of red and blue (affected too: at least "
            f"{1 / EVEN:.2g} times)."
        )
    spread = max(relative.values()) / min(relative.values()) if min(relative.values()) > 0 else math.inf
    return ("agrees" if spread <= EVEN else "differs"), (
        f"{text} Relative to that, the most affected primary differs {number(spread)} times as much as the least (roughly equally: at most {EVEN:g} "
        "times)."
    )


def _fitted(light: F32) -> tuple[U8, float]:
    """A display's light as a picture, enlarged by a whole number or reduced to the width of a column, and by how much."""
    width = light.shape[1]
    if width <= COLUMN:
        times = COLUMN // width
        return enlarged(as_picture(light), times), float(times)
    return as_picture(reduced(light, COLUMN)), COLUMN / width


def _framed(picture: U8, scale: float, crop: Crop) -> U8:
    """The picture with a frame around the part that is enlarged, where that is not the whole."""
    framed = picture.copy()
    left, top, right, bottom = (round(v * scale) for v in (crop.left, crop.top, crop.left + crop.width, crop.top + crop.height))
    if right - left >= picture.shape[1] and bottom - top >= picture.shape[0]:
        return framed
    for grow, color in ((2, _FRAME[0]), (1, _FRAME[1])):
        x0, y0 = max(left - grow, 0), max(top - grow, 0)
        x1, y1 = min(right + grow, picture.shape[1]) - 1, min(bottom + grow, picture.shape[0]) - 1
        framed[[y0, y1], x0 : x1 + 1] = color
        framed[y0 : y1 + 1, [x0, x1]] = color
    return framed


def _cut_picture(lattice: F32, layout: Layout, crop: Crop) -> U8:
    """The subpixels of a part, drawn with a period around it, since they reach beyond their pixels."""
    (across, down), (pattern_rows, pattern_columns) = layout.cells, layout.pattern.shape
    fine = fine_grid([layout])
    columns, rows = crop.left * across, crop.top * down
    before_x, before_y = min(pattern_columns, columns), min(pattern_rows, rows)
    right = min((crop.left + crop.width) * across + pattern_columns, lattice.shape[1])
    bottom = min((crop.top + crop.height) * down + pattern_rows, lattice.shape[0])
    picture = subpixel_picture(lattice[rows - before_y : bottom, columns - before_x : right], layout)
    y, x = before_y // down * fine, before_x // across * fine
    return picture[y : y + crop.height * fine, x : x + crop.width * fine]
