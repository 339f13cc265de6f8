"""The low-pass kernels of displays that give primaries different resolutions, as Fig. 4.6 of the thesis shows those of RGBG, and their spectra."""

import pathlib
from typing import Any

import numpy as np

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from viz.charts import FAINT
from viz.report.subpixel import layout_title
from viz.subpixel.figure import Agreement, Figure
from viz.subpixel.fits import family
from viz.subpixel.look import (
    PRIMARY_COLORS,
    choice,
    letters,
    listed,
    new_panels,
    note,
    panel_title,
    pixel_nyquist,
    save_panels,
    shown_subpixels,
    subpixel_names,
    subpixel_words,
)
from viz.subpixel.spectra import own_spectra

WIDER = 1.1  # a kernel "reaches farther" than another if it is so many times as wide
ALIKE = 0.05  # largest difference of spectra that are "very similar"
ZEROS = 3  # of the widest sinc, on each side, that the axis shows
_DASHES: tuple[Any, ...] = (
    "-",
    (0, (4.0, 3.0)),
    (0, (1.5, 3.0)),
    (0, (5.0, 3.0, 1.0, 3.0)),
)  # of kernels of one spacing, which lie nearly on one another


def low_pass_figure(display: Display, description: SubpixelDescription, folder: pathlib.Path) -> Figure | None:
    """The kernels from subpixels' own channels in one panel, their spectra in another; None where all are equally far apart, or in 2-D."""
    layout, shown = display.layout, shown_subpixels(display.layout)
    if not layout.one_dimensional or np.ptp(layout.spacing) == 0:
        return None
    title, nyquist, names, primaries = layout_title(layout.name), pixel_nyquist(description), subpixel_names(layout), letters(layout)
    figure, panels = new_panels(1, 2, 3.4, f"{title}: low-pass kernels")
    note(figure, f"gray: pixel Nyquist frequency, {nyquist:.3g} cpd")
    (kernel, response), offsets = panels[0], display.kernels.columns_at
    reach = int(ZEROS * layout.spacing.max())
    near = np.abs(offsets) <= reach
    kernel.axhline(0.0, color=FAINT, linewidth=0.8)
    response.axvline(nyquist, color=FAINT, linewidth=1.2)
    for i in shown:
        color, like = PRIMARY_COLORS[primaries[i]], [k for k in shown if k < i and layout.spacing[k] == layout.spacing[i]]
        dash = _DASHES[len(like) % len(_DASHES)]
        frequency, magnitude = own_spectra(display.kernels, i)
        kernel.plot(offsets[near], display.kernels.own(i)[0, near], color=color, linestyle=dash, linewidth=1.9, label=names[i])
        response.plot(frequency, magnitude[layout.active_primaries[i]], color=color, linestyle=dash, linewidth=1.9, label=names[i])
    panel_title(kernel, "Kernels")
    panel_title(response, "Spectra")
    kernel.set_xlabel(f"offset (positions; a pixel is {layout.cells[0]})", fontsize=9)
    kernel.set_ylabel("weight", fontsize=9)
    response.set_xlabel("frequency (cycles per degree)", fontsize=9)
    response.set_ylabel("magnitude", fontsize=9)
    response.set_xlim(0.0, 2.0 * nyquist)
    response.set_ylim(0.0, 1.1)
    for axes in (kernel, response):
        axes.legend(frameon=False, fontsize=8.5, labelcolor="linecolor", handlelength=3.2, borderaxespad=0.2, loc="upper right")
    file = save_panels(figure, folder / f"low_pass_{layout.name}.png")

    agreement, comparison = compared(display)
    words = [subpixel_words(layout)[i] for i in shown]
    return Figure(
        name=f"low_pass_{layout.name}",
        title=f"Low-pass kernels of {title}",
        file=file,
        alt=f"Two charts: the kernels from their own channels of {len(shown)} subpixels ({listed(words)}) over the offset, and their spectra.",
        caption=f"What each subpixel of {title} takes from its own channel of the image, kernels from other channels left out, and how strongly it "
        "follows waves of each frequency. Kernels that lie nearly on one another are told apart by their "
        f"dashes.{choice(layout)}",
        thesis="Fig. 4.6: the kernels of red and blue adapt to their lower resolution and have a larger support than those of the two greens; the "
        "spectra of red and blue are very similar."
        if family(layout) == "RGBG"
        else "",
        agreement=agreement,
        comparison=comparison,
    )


def compared(display: Display) -> tuple[Agreement, str]:
    """How wide the kernels are, and how alike the spectra of red and blue."""
    primaries, names = letters(display.layout), subpixel_names(display.layout)
    wide = [width(display, i) for i in range(len(primaries))]
    spectra = {letter: own_spectra(display.kernels, primaries.index(letter))[1][display.layout.primaries.index(letter)] for letter in "RB"}
    difference = float(np.abs(spectra["R"] - spectra["B"]).max())
    text = (
        f"Widths at half height, in pixels: {', '.join(f'{name} {value:.3g}' for name, value in zip(names, wide, strict=True))}. "
        f"The spectra of red and blue differ by at most {difference:.2g}."
    )
    if family(display.layout) != "RGBG":
        return "not comparable", text
    greens = max(value for letter, value in zip(primaries, wide, strict=True) if letter == "G")
    least = min(value for letter, value in zip(primaries, wide, strict=True) if letter != "G") / greens
    text += f" Red and blue are at least {least:.3g} times as wide as green (larger: at least {WIDER:g} times; very similar: at most {ALIKE:g})."
    return ("agrees" if least >= WIDER and difference <= ALIKE else "differs"), text


def width(display: Display, subpixel: int) -> float:
    """The width at half height of a subpixel's own kernel, in pixels, where its values are joined by straight lines."""
    at, h = display.kernels.columns_at.astype(np.float64), display.kernels.own(subpixel)[0]
    middle, half = int(np.argmax(h)), 0.5 * float(h.max())
    ends = []
    for step in (-1, 1):
        i = middle
        while 0 < i < len(h) - 1 and h[i] > half:
            i += step
        share = (h[i - step] - half) / (h[i - step] - h[i]) if h[i - step] != h[i] else 0.0
        ends.append(at[i - step] + step * share)
    return float((ends[1] - ends[0]) / display.layout.cells[0])
