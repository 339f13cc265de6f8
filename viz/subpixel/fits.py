"""The analytic filters' parameters beside those of the thesis's Table 4.1."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from queries.subpixel.analysis import Analysis, Display
from queries.subpixel.description import SubpixelDescription
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.windowed_sinc import Fit, Model, fit
from viz.numbers import percent
from viz.subpixel.figure import Agreement
from viz.subpixel.look import letters, listed, pixel_nyquist, subpixel_names

STATED_RMS = 0.02  # thesis 4.3.3: "a root mean squared error of less than 0.02 for each color channel"
STATED_PEAK = 16.0  # cycles per degree: where the thesis's cross kernels peak (4.3.3), the pixel Nyquist frequency of its viewer
CLOSE_A, CLOSE_B = 0.02, 0.05  # relative deviations up to which a parameter agrees with the table
SAME_VIEWER = 0.05  # relative deviation of the Nyquist frequency up to which the viewer is the thesis's

_STATED_MODELS = ("across", "radial")  # what x is in Eqs. 4.7 and 4.13
# Table 4.1 by the primaries of a period, the spacing of each, and the rows of the pattern: a and b, in units of positions
_STRIPE = {"R": (math.pi / 3, 92.65), "G": (math.pi / 3, 76.58), "B": (math.pi / 3, 46.62)}
_TABLE: dict[tuple[str, tuple[float, ...], int], tuple[tuple[float, float], ...]] = {
    ("RGB", (3, 3, 3), 1): (_STRIPE["R"], _STRIPE["G"], _STRIPE["B"]),
    ("BGR", (3, 3, 3), 1): (_STRIPE["B"], _STRIPE["G"], _STRIPE["R"]),
    ("RGBG", (12, 6, 12, 6), 1): ((math.pi / 12, 457.37), (math.pi / 6, 476.62), (math.pi / 12, 457.37), (math.pi / 6, 479.06)),
    ("RGBW", (4, 4, 4, 4), 2): ((2.06, 7.12), (1.75, 1.40), (1.89, 2.66), (3.04, 16.36)),
}


# What is known of differences from the table beyond one analysis, by the primaries of a period in alphabetical order
WHY = {
    "BGR": " An exponential of 2.0 cpd gives R 91, G 72 and B 98; no smooth sensitivity that was tried puts B's below R's, as the table has it.",
    "BGRW": " No sensitivity that was tried gives the table's row: a sinc of the distance cannot vanish at all positions of a square grid, as exact "
    "reproduction asks, so products of two sincs are fitted and applied instead.",
}


@dataclass(frozen=True)
class FitRow:
    """One subpixel's analytic filter, ``sin(a x) / (a x) exp(-x² / b)`` with x in positions, and the thesis's, None where it has none.

    ``model``: what x is (``renderer.filters.subpixel.windowed_sinc.Fit``); ``a_down`` and ``b_down`` are there for products of two such filters.
    ``applied``: whether the subpixel is filtered with it; others are fitted as the thesis fits, for comparison with its table.
    ``rms``, ``largest``: how far the kernel's values lie from the curve; ``relative``: the first in units of the kernel's root mean square.
    ``agreement``: of a and b with the table, within 2 and 5 percent; not comparable where the table has no such layout, or the viewer is another.
    """

    layout: str
    subpixel: str
    primary: str
    a: float
    b: float
    rms: float
    largest: float
    relative: float
    thesis_a: float | None
    thesis_b: float | None
    agreement: Agreement
    model: Model
    a_down: float | None
    b_down: float | None
    applied: bool


def family(layout: Layout) -> str:
    """Which layout of Table 4.1 a display is: ``RGB``, the stripe in either direction, ``RGBG``, ``RGBW``; empty where it is none of them."""
    primaries = "".join(letters(layout))
    return {"BGR": "RGB"}.get(primaries, primaries) if stated(layout) else ""


def stated(layout: Layout) -> tuple[tuple[float, float], ...] | None:
    """Table 4.1: a and b of each subpixel (a stripe in reverse order has the stripe's), or None for displays it does not list."""
    return _TABLE.get(("".join(letters(layout)), tuple(float(s) for s in layout.spacing), len(layout.pattern)))


def same_viewer(description: SubpixelDescription) -> bool:
    """Whether the display is seen at the thesis's frequencies."""
    return abs(pixel_nyquist(description) / STATED_PEAK - 1.0) <= SAME_VIEWER


def display_rows(display: Display, description: SubpixelDescription) -> list[FitRow]:
    """The rows of one display, one for each subpixel of a period; then radial fits, where Table 4.1 has those and others are applied."""
    table = stated(display.layout)
    if table is None or display.fits[0].model in _STATED_MODELS:
        return _rows(display.layout, display.fits, table, description, applied=True)
    applied = _rows(display.layout, display.fits, None, description, applied=True)
    return applied + _rows(display.layout, fit(display.kernels, "radial"), table, description, applied=False)


def _rows(
    layout: Layout, fits: Sequence[Fit], table: tuple[tuple[float, float], ...] | None, description: SubpixelDescription, applied: bool
) -> list[FitRow]:
    rows = []
    for i, (name, letter, one) in enumerate(zip(subpixel_names(layout), letters(layout), fits, strict=True)):
        a, b = table[i] if table else (None, None)
        agreement: Agreement = "not comparable"
        if a is not None and b is not None and same_viewer(description):
            agreement = "agrees" if abs(one.a / a - 1) <= CLOSE_A and abs(one.b / b - 1) <= CLOSE_B else "differs"
        measured = (one.a, one.b, one.rms, one.largest, one.relative, a, b, agreement)
        rows.append(FitRow(layout.name, name, letter, *measured, one.model, one.a_down, one.b_down, applied))
    return rows


def fit_rows(analysis: Analysis) -> list[FitRow]:
    """All analytic filters beside Table 4.1, in the order of the displays."""
    return [row for display in analysis.displays for row in display_rows(display, analysis.description)]


def fits_in_words(rows: list[FitRow]) -> str:
    """Each subpixel's a and b beside the table's; empty where the table has none."""
    return "; ".join(
        f"{row.subpixel}: a = {row.a:.4g} against {row.thesis_a:.4g}, b = {row.b:.4g} against {row.thesis_b:.4g} ({_change(row.b / row.thesis_b)})"
        for row in rows
        if row.thesis_a is not None and row.thesis_b is not None
    )


def compared_fits(rows: list[FitRow], description: SubpixelDescription) -> tuple[Agreement, str]:
    """Whether windowed sincs model the kernels of a display as well as the thesis states, with its parameters where it lists them, in words."""
    rows = [row for row in rows if row.thesis_a is not None] or rows
    worst = max(rows, key=lambda row: row.rms)
    good = worst.rms < STATED_RMS
    kind = "" if rows[0].applied else f" {rows[0].model}"
    text = f"The{kind} fits' root mean square errors are {'all ' if good else 'not all '}below {STATED_RMS:g}; the largest is {worst.rms:.2g} "
    text += f"({worst.subpixel}), {percent(worst.relative)} of its kernel's own root mean square."
    table = fits_in_words(rows)
    if not table:
        return "not comparable", f"{text} Table 4.1 does not list this display."
    text += f" Ours beside Table 4.1: {table}."
    if not same_viewer(description):
        text += (
            f" The parameters depend on the viewer, and this one's pixel Nyquist frequency is {pixel_nyquist(description):.3g} cpd, the thesis's "
            f"about {STATED_PEAK:g}: only the errors are judged."
        )
        return ("agrees" if good else "differs"), text
    off = [row.subpixel for row in rows if row.agreement == "differs"]
    limits = f"a within {CLOSE_A:.0%} and b within {CLOSE_B:.0%}".replace("%", " %")
    if not off:
        return ("agrees" if good else "differs"), f"{text} All agree ({limits})."
    which = "no subpixel" if len(off) == len(rows) else f"only {listed([row.subpixel for row in rows if row.subpixel not in off])}"
    why = WHY.get("".join(sorted(row.primary for row in rows)), "")
    return "differs", (
        f"{text} Agreement ({limits}) holds for {which}. b depends on the contrast sensitivity, of which the thesis draws the curves (Fig. 4.2) but "
        f"gives no numbers; it is refitted here to the kernels at hand.{why}"
    )


def _change(ratio: float) -> str:
    return f"{100 * (ratio - 1):+.1f} %".replace("-", "−")
