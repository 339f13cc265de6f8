"""Finished pictures: what was drawn, with its caption, legend and color bar below; written as PNG and as animated GIF."""

import functools
import math
import pathlib
import tempfile
import zlib
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from viz.numbers import number
from viz.ticks import ticks

if TYPE_CHECKING:
    from PIL import Image, ImageDraw

    from viz.tools.base import ColorBar, Drawn

U8 = npt.NDArray[np.uint8]

_PAPER, _INK, _FRAME = (255, 255, 255), (32, 32, 32), (150, 150, 150)
_LETTERS = 1 / 56  # height of letters, as a share of the picture's width: 17 pixels in a picture of 960
_SMALLEST, _LARGEST = 11, 34  # pixels
_BAR_SHARE = 0.6  # of the strip's width, and of no more than this many letters:
_BAR_LETTERS = 34
_BITS = 5  # of each channel, that tell colors of an animation apart when its palette is chosen
_PALETTE = 256
_SAMPLES = 1 << 16


def finished(image: U8, drawn: "Drawn", note: str = "") -> U8:
    """A picture, uint8 (h, w, 3), with a white strip below that holds the caption, the legend and the color bar of what was drawn.

    ``note``: a line of this frame's own, above the caption. All frames get strips of one height, whatever their notes.
    """
    width = image.shape[1]
    size = letter_height(width)
    margin = size
    font = _font(size)
    parts = []
    notes = (note, *drawn.frame_notes)
    if any(notes):
        rows = max(len(wrapped(text, width - 2 * margin, font)) for text in notes)
        parts.append(_text(wrapped(note, width - 2 * margin, font), rows, width - 2 * margin, font))
    if drawn.caption:
        lines = wrapped(drawn.caption, width - 2 * margin, font)
        parts.append(_text(lines, len(lines), width - 2 * margin, font))
    if drawn.legend:
        parts.append(_legend(drawn.legend, width - 2 * margin, font))
    if drawn.color_bar is not None:
        parts.append(_color_bar(drawn.color_bar, width - 2 * margin, font))
    if not parts:
        return image.copy()
    gap = size * 2 // 3
    strip = np.full((2 * (margin * 3 // 4) + sum(len(part) for part in parts) + gap * (len(parts) - 1), width, 3), _PAPER, np.uint8)
    y = margin * 3 // 4
    for part in parts:
        strip[y : y + len(part), margin : margin + part.shape[1]] = part
        y += len(part) + gap
    return np.concatenate([image, strip])


def message_picture(size: tuple[int, int], text: str) -> U8:
    """A picture, uint8 (height, width, 3), that says something instead of showing it."""
    width, height = size
    letters = min(_LARGEST, letter_height(width) * 3 // 2)
    font = _font(letters)
    lines = wrapped(text, width - 2 * letters, font)
    line = _line_height(font)
    image, draw = _sheet(width, height, (240, 240, 242))
    for i, words in enumerate(lines):
        draw.text(((width - _width(words, font)) // 2, (height - line * len(lines)) // 2 + i * line), words, fill=_INK, font=font)
    return np.asarray(image)


def write_png(path: str | pathlib.Path, image: U8) -> None:
    """Write a picture, uint8 (h, w, 3)."""
    from PIL import Image

    Image.fromarray(np.ascontiguousarray(image)).save(path, format="PNG")


def write_animation(path: str | pathlib.Path, frames: Iterable[U8], seconds: float) -> None:
    """Write pictures, uint8 (h, w, 3) of one size, as an animated GIF that repeats; ``seconds``: how long each is shown.

    All frames share one palette, chosen from the colors of all of them, so that nothing flickers; meanwhile they wait in a temporary file.
    """
    from PIL import Image

    with tempfile.TemporaryFile() as waiting:
        lengths, shape, palette = _kept_frames(frames, waiting)
        waiting.seek(0)

        def indexed() -> Iterable["Image.Image"]:
            for length in lengths:
                frame = np.frombuffer(zlib.decompress(waiting.read(length)), np.uint8).reshape(shape)
                yield Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)

        images = iter(indexed())
        next(images).save(
            path, format="GIF", save_all=True, append_images=images, duration=max(20, round(seconds * 100) * 10), loop=0, optimize=False
        )  # durations are multiples of 10 ms; browsers slow down below 20 ms


def letter_height(width: int) -> int:
    """The height of letters in a picture of this width, pixels."""
    return min(max(round(width * _LETTERS), _SMALLEST), _LARGEST)


def wrapped(text: str, width: int, font: Any) -> list[str]:
    """Text as lines that are no wider than ``width`` pixels; words that are wider are cut. A percent sign stays with its number."""
    lines: list[str] = []
    for paragraph in text.splitlines():
        line = ""
        for word in filter(None, paragraph.replace(" %", "\N{NO-BREAK SPACE}%").split(" ")):
            longer = f"{line} {word}" if line else word
            if _width(longer, font) <= width:
                line = longer
                continue
            if line:
                lines.append(line)
            while _width(word, font) > width and len(word) > 1:
                fits = next(n for n in range(len(word) - 1, 0, -1) if n == 1 or _width(word[:n], font) <= width)
                lines.append(word[:fits])
                word = word[fits:]
            line = word
        lines.append(line)
    return lines


# --- the parts of the strip ---------------------------------------------------------------------------------------------


def _text(lines: Sequence[str], rows: int, width: int, font: Any) -> U8:
    """Lines of text on a sheet with room for so many rows."""
    height = _line_height(font)
    image, draw = _sheet(width, height * rows)
    for i, line in enumerate(lines):
        draw.text((0, i * height), line, fill=_INK, font=font)
    return np.asarray(image)


def _legend(entries: Sequence[tuple[str, tuple[float, float, float]]], width: int, font: Any) -> U8:
    """Squares of color, each with its name, in as many rows as they need."""
    height = _line_height(font)
    square, space = height * 2 // 3, height * 3 // 4
    places: list[tuple[int, int, str, tuple[int, ...]]] = []
    x = row = 0
    for name, color in entries:
        first, *more = wrapped(name, width - square - space // 2, font) or [""]
        name = first + ("…" if more else "")
        needed = square + space // 2 + _width(name, font)
        if x and x + needed > width:
            x, row = 0, row + 1
        places.append((x, row, name, tuple(round(255 * min(max(value, 0.0), 1.0)) for value in color)))
        x += needed + space
    image, draw = _sheet(width, height * (row + 1))
    for x, row, name, shade in places:
        top = row * height + (height - square) // 2
        draw.rectangle((x, top, x + square - 1, top + square - 1), fill=shade, outline=_FRAME)
        draw.text((x + square + space // 2, row * height), name, fill=_INK, font=font)
    return np.asarray(image)


def _color_bar(bar: "ColorBar", width: int, font: Any) -> U8:
    """The colors from low to high, with ticks and numbers below and the label above."""
    height = _line_height(font)
    size = font.size
    label = wrapped(bar.label, width, font)
    edge = size * 2  # beside the bar, for numbers that are centered on its ends
    long = max(2, min(int(width * _BAR_SHARE), _BAR_LETTERS * size) if width > 20 * size else width - 2 * edge)
    top = height * len(label) + size // 4
    thick, tick = size, max(3, size // 3)
    image, draw = _sheet(width, top + thick + tick + height)
    for i, line in enumerate(label):
        draw.text((0, i * height), line, fill=_INK, font=font)
    steps = np.clip((np.arange(long) + 0.5) / long * len(bar.colors), 0, len(bar.colors) - 1).astype(np.int64)
    pixels = np.array(image)
    pixels[top : top + thick, edge : edge + long] = bar.colors[steps]
    from PIL import Image, ImageDraw

    image = Image.fromarray(pixels)
    draw = ImageDraw.Draw(image)
    draw.fontmode = "L"
    draw.rectangle((edge - 1, top - 1, edge + long, top + thick), outline=_FRAME)
    free = -edge
    for share, value in ticks(bar.low, bar.high, bar.logarithmic, most=max(2, long // (size * 5))):
        x = edge + round(share * (long - 1))
        text = number(value)
        wide = _width(text, font)
        left = min(max(x - wide // 2, 0), width - wide)
        draw.line((x, top + thick, x, top + thick + tick - 1), fill=_INK)
        if left >= free:
            draw.text((left, top + thick + tick), text, fill=_INK, font=font)
            free = left + wide + size // 2
    return np.asarray(image)


# --- letters --------------------------------------------------------------------------------------------------------------


@functools.lru_cache(maxsize=8)
def _font(size: int) -> Any:
    """DejaVu Sans, which matplotlib brings along: the same letters on every machine."""
    import matplotlib
    from PIL import ImageFont

    file = pathlib.Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(file, size, layout_engine=ImageFont.Layout.BASIC)


def _sheet(width: int, height: int, color: tuple[int, int, int] = _PAPER) -> tuple["Image.Image", "ImageDraw.ImageDraw"]:
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (width, max(1, height)), color)
    return image, ImageDraw.Draw(image)


def _width(text: str, font: Any) -> int:
    length: float = font.getlength(text)
    return math.ceil(length)


def _line_height(font: Any) -> int:
    ascent, descent = font.getmetrics()
    return int((ascent + descent) * 1.12)


# --- colors of an animation -----------------------------------------------------------------------------------------------


def _kept_frames(frames: Iterable[U8], waiting: Any) -> tuple[list[int], tuple[int, ...], "Image.Image"]:
    """Write frames to a file, compressed: their lengths there, their shape, and a palette for all of them. Raises ValueError where there is none."""
    bins = 1 << (3 * _BITS)
    count, total = np.zeros(bins), np.zeros((bins, 3))
    lengths: list[int] = []
    shape: tuple[int, ...] = ()
    for frame in frames:
        if shape and frame.shape != shape:
            raise ValueError(f"expected frames of one size, {shape}, found {frame.shape}")
        shape = frame.shape
        flat = np.ascontiguousarray(frame).reshape(-1, 3)
        key = (flat >> (8 - _BITS)).astype(np.int32) @ np.array([1 << (2 * _BITS), 1 << _BITS, 1], np.int32)
        count += np.bincount(key, minlength=bins)
        for channel in range(3):
            total[:, channel] += np.bincount(key, weights=flat[:, channel], minlength=bins)
        lengths.append(waiting.write(zlib.compress(flat.tobytes(), 1)))
    if not lengths:
        raise ValueError("expected at least one frame")
    return lengths, shape, _palette(count, total)


def _palette(count: npt.NDArray[np.float64], total: npt.NDArray[np.float64]) -> "Image.Image":
    """The colors that stand for all: rare ones count more than their share, or thin lines would lose theirs to the background."""
    from PIL import Image

    used = np.flatnonzero(count)
    colors = np.round(total[used] / count[used, None]).astype(np.uint8)
    weight = np.sqrt(count[used])
    copies = np.maximum(1, np.round(weight / weight.sum() * _SAMPLES)).astype(np.int64)
    if len(used) <= _PALETTE:
        palette = Image.new("P", (1, 1))
        palette.putpalette(colors.ravel().tolist())
        return palette
    sample = np.repeat(colors, copies, axis=0)
    return Image.fromarray(sample[None]).quantize(_PALETTE, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
