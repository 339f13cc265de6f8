"""A display's pattern, drawn: its subpixels at their places and of their sizes, over the pixels that they belong to."""

from typing import Any

import markupsafe

from renderer.filters.subpixel.layout import Layout
from viz.subpixel.look import PRIMARY_WORDS, listed

_FILL = {"R": "#d7263d", "G": "#1b9e4b", "B": "#2f6fe0", "W": "#f4f4f0"}
_INK = {"R": "#ffffff", "G": "#ffffff", "B": "#ffffff", "W": "#222222"}
_PIXEL = 72.0  # units of the drawing for each pixel
_GAP = 2.0  # units of dark between subpixels
_MARGIN = 4.0  # units of dark around the whole
_LEAST = 2  # pixels that are drawn along each axis, at least


def pattern_drawing(layout: Layout, title: str) -> Any:
    """The pattern as an SVG, of whole periods, two pixels or more along each axis; pixels are framed. Safe markup, for templates."""
    across, down = (count * -(-_LEAST // count) for count in _pixels(layout))
    width, height = across * _PIXEL, down * _PIXEL
    shapes = [_subpixel(layout, row, column, x, y) for row, column, x, y in _places(layout, across, down)]
    lines = [_line(i * _PIXEL, 0.0, i * _PIXEL, height) for i in range(across + 1)] + [
        _line(0.0, i * _PIXEL, width, i * _PIXEL) for i in range(down + 1)
    ]
    return markupsafe.Markup(
        '<svg class="pattern" role="img" viewBox="{corner} {corner} {whole}" {size} aria-label="{label}">'
        '<rect x="{corner}" y="{corner}" width="100%" height="100%" fill="#17181b"/>'
        '<svg width="{width}" height="{height}">{shapes}</svg>{lines}</svg>'
    ).format(
        corner=_text(-_MARGIN),
        whole=f"{_text(width + 2 * _MARGIN)} {_text(height + 2 * _MARGIN)}",
        size=markupsafe.Markup('width="{}" height="{}"').format(_text(width + 2 * _MARGIN), _text(height + 2 * _MARGIN)),
        label=f"{title}: {pattern_in_words(layout)}",
        width=_text(width),
        height=_text(height),
        shapes=markupsafe.Markup("").join(shapes),
        lines=markupsafe.Markup("").join(lines),
    )


def pattern_in_words(layout: Layout) -> str:
    """How a period is made up, row by row.

    >>> from renderer.filters.subpixel.layout import stripe
    >>> pattern_in_words(stripe("x", "RGB"))
    'a period of 1 pixel: red, green and blue'
    """
    across, down = _pixels(layout)
    rows = [[PRIMARY_WORDS[layout.primaries[q]] for q in row if q >= 0] for row in layout.pattern.tolist()]
    pixels = f"{across} × {down} pixels" if down > 1 else f"{across} pixel{'s' if across > 1 else ''}"
    return f"a period of {pixels}: " + "; below: ".join(listed(row) for row in rows if row)


def _pixels(layout: Layout) -> tuple[int, int]:
    """How many pixels a period is wide and high."""
    rows, columns = layout.pattern.shape
    return columns // layout.cells[0], rows // layout.cells[1]


def _places(layout: Layout, across: int, down: int) -> list[tuple[int, int, float, float]]:
    """Row and column in the pattern of every subpixel that is drawn, and where its center lies, pixels: one period beyond the edges too."""
    rows, columns = layout.pattern.shape
    places = []
    for i in range(-rows, down * layout.cells[1] + rows):
        for j in range(-columns, across * layout.cells[0] + columns):
            if layout.pattern[i % rows, j % columns] >= 0:
                places.append((i % rows, j % columns, (j + layout.origin[0]) / layout.cells[0], (i + layout.origin[1]) / layout.cells[1]))
    return [place for place in places if _seen(layout, place, across, down)]


def _seen(layout: Layout, place: tuple[int, int, float, float], across: int, down: int) -> bool:
    row, column, x, y = place
    half_width, half_height = _halves(layout, row, column)
    return -half_width < x < across + half_width and -half_height < y < down + half_height


def _halves(layout: Layout, row: int, column: int) -> tuple[float, float]:
    """Half the width and height of a subpixel, pixels."""
    width, height = layout.extent[layout.pattern[row, column]]
    return 0.5 * width / layout.cells[0], 0.5 * height / layout.cells[1]


def _subpixel(layout: Layout, row: int, column: int, x: float, y: float) -> Any:
    letter = layout.primaries[layout.pattern[row, column]]
    half_width, half_height = (_PIXEL * half for half in _halves(layout, row, column))
    x, y = _PIXEL * x, _PIXEL * y
    gap = min(_GAP, 0.5 * half_width, 0.5 * half_height)
    return markupsafe.Markup(
        '<rect x="{}" y="{}" width="{}" height="{}" rx="2" fill="{}"/><text x="{}" y="{}" fill="{}" font-size="{}">{}</text>'
    ).format(
        *map(_text, (x - half_width + 0.5 * gap, y - half_height + 0.5 * gap, 2 * half_width - gap, 2 * half_height - gap)),
        _FILL[letter],
        *(_text(x), _text(y), _INK[letter], _text(min(15.0, 1.1 * half_width, 1.1 * half_height)), letter),
    )


def _line(*ends: float) -> Any:
    return markupsafe.Markup('<line class="pixel" x1="{}" y1="{}" x2="{}" y2="{}"/>').format(*map(_text, ends))


def _text(value: float) -> str:
    return f"{value:.6g}"
