"""Text, of sizes and styles as on pages and in menus."""

import itertools

import numpy as np

from queries.subpixel.targets.base import F32, Raster, average

_FACES = ("DejaVuSans", "DejaVuSerif", "DejaVuSans-Oblique", "DejaVuSerif-Italic", "DejaVuSans-Bold")
_SIZES = (11, 9, 13, 10, 12, 14)  # pixels; one more than faces, so that every face comes in every size
_LEADING = 1.2
_MARGIN = 1.5  # pixels
_MEASURE = 64  # points across a pixel at which words are measured, whatever the raster is

_TEXT = (
    "Light will fall on every leaf, five wild foxes jump quickly by a dozen lazy zebras; William (age 47) kept 1,386 slim violins & "
    "filled 250 mild jugs with ink. Which letters fit? Kilo, milli, Vienna, AVAWATA, illicit fjord, minimum 0.98%, waltz & sphinx: "
    "hyphens fade, serifs stay; a thin line is seen where light is missing."
)


def text(raster: Raster) -> F32:
    """Black text on white, by the fonts that matplotlib ships."""
    ink = _ink(raster)
    return np.repeat((np.float32(1.0) - ink)[..., None], 3, axis=2)


def text_inverted(raster: Raster) -> F32:
    """White text on black: 1 - ``text``."""
    return np.float32(1.0) - text(raster)


def _ink(raster: Raster) -> F32:
    """How much of each sample is covered by letters, (rows, columns)."""
    import matplotlib
    from PIL import Image, ImageDraw, ImageFont

    def font(face: str, size: int) -> "ImageFont.FreeTypeFont":
        file = f"{matplotlib.get_data_path()}/fonts/ttf/{face}.ttf"
        return ImageFont.truetype(file, size, layout_engine=ImageFont.Layout.BASIC)

    k = raster.oversampling()
    density = raster.fine * k
    sheet = Image.new("L", (raster.width * density, raster.height * density))
    pen = ImageDraw.Draw(sheet)
    words, faces, sizes = itertools.cycle(_TEXT.split()), itertools.cycle(_FACES), itertools.cycle(_SIZES)
    top = _MARGIN
    word = next(words)
    while top < raster.height - _MARGIN:
        face, size = next(faces), next(sizes)
        drawn, measured = font(face, size * density), font(face, size * _MEASURE)
        baseline = top + 0.95 * size
        x = _MARGIN
        while x < raster.width - _MARGIN:
            pen.text((x * density, baseline * density), word, fill=255, font=drawn, anchor="ls")
            x += measured.getlength(word + " ") / _MEASURE
            word = next(words)
        top += _LEADING * size
    return average(np.asarray(sheet), k) / np.float32(255.0)
