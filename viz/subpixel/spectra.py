"""Spectra of the kernels, as Fig. 4.4 of the thesis shows them, with those of the analytic filters that end after a few zeros."""

import pathlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.spectra import Axis, fitted_spectrum, spectrum
from viz.charts import FAINT, INK
from viz.report.subpixel import layout_title
from viz.subpixel.figure import Agreement, Figure
from viz.subpixel.fits import STATED_PEAK, family, same_viewer
from viz.subpixel.look import (
    PRIMARY_COLORS,
    PRIMARY_WORDS,
    choice,
    colored_lines,
    label_panels,
    listed,
    new_panels,
    note,
    panel_grid,
    panel_title,
    pixel_nyquist,
    room,
    save_panels,
    shown_subpixels,
    subpixel_names,
    subpixel_words,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

F64 = npt.NDArray[np.float64]

SHOWN = 3.0  # pixel Nyquist frequencies that the axis shows
CLOSE_PEAK = 0.10  # relative deviation of a peak's frequency from what the thesis states
LOW_PASS = 0.01  # by how much a low-pass kernel may deviate from 1 at frequency 0
BAND_PASS = 0.05  # the share of its peak that a band-pass kernel may have at frequency 0
NARROW = 0.5  # of the pixel Nyquist frequency: how wide a "narrow frequency band" may be where a spectrum is at least half as high as at its peak
LOW_AMPLITUDE = 0.5  # of a low-pass kernel at frequency 0: what the thesis, which gives no number, calls a "low amplitude" is surely not above this
NEGLIGIBLE = 0.005  # peaks below are not looked at

# What is known of differences from the thesis beyond one analysis
STRONG_PEAKS = (
    "With one sensitivity for all three channels these amplitudes follow from the opponent matrix (Eq. 4.2) alone, whatever that sensitivity is: "
    "green has 73% of the luminance, and red subpixels counter what green ones alias. A narrower sensitivity to color raises them."
)
PRINTED_DISTANCE = "Section 4.3.2 prints a distance of 25 cm for these 16 cpd, which would put the pixel Nyquist frequency at 8.6 cpd; 46 cm fits."
_WHY = {
    "RGBG": " Red and blue subpixels stand two pixels apart; the greens counter what they alias, so that their bands are wide.",
    "RGBW": " White looks like red, green and blue together, so the solution trades them: kernels need not pass 1 and 0 of a constant.",
}


@dataclass(frozen=True)
class Peak:
    """Where the spectrum of a kernel is largest: the subpixel's and the primary's letters, the frequency (cpd), the magnitude there and at 0."""

    subpixel: str
    primary: str
    own: bool
    frequency: float
    magnitude: float
    at_zero: float


def spectra_figure(display: Display, description: SubpixelDescription, folder: pathlib.Path) -> Figure:
    """One panel for each subpixel: magnitudes of its kernels over cycles per degree, and of its clamped analytic filter, dashed."""
    layout, shown = display.layout, shown_subpixels(display.layout)
    words = [subpixel_words(layout)[i] for i in shown]
    title, nyquist = layout_title(layout.name), pixel_nyquist(description)
    rows, columns = panel_grid(len(words))
    along = "" if layout.one_dimensional else ", down columns" if stands(layout) else ", along rows"
    figure, panels = new_panels(
        rows, columns, 3.5 if rows == 1 else 0.5 + 2.6 * rows, f"{title}: spectra of the kernels{along}", sharex=True, sharey=True
    )
    found = peaks(display)
    for subpixel, axes in zip(shown, panels.ravel(), strict=False):
        _draw_panel(axes, display, description, subpixel, [peak for peak in found if peak.subpixel == subpixel_names(layout)[subpixel]])
    label_panels(panels, len(words), "frequency (cycles per degree)", "magnitude")
    panels[0, 0].set_xlim(0.0, min(SHOWN * nyquist, float(own_spectra(display.kernels, 0)[0][-1])))
    analytic = [clamped_spectrum(display, description, i, np.linspace(0.0, nyquist, 101)).max() for i in shown]
    panels[0, 0].set_ylim(0.0, 1.06 * max(1.0, *(peak.magnitude for peak in found), *analytic))
    if len(layout.primaries) > 3:
        room(panels[0, 0], 2, 2.1)
    note(figure, f"dashed: analytic filter; gray: pixel Nyquist frequency, {nyquist:.3g} cpd")
    file = save_panels(figure, folder / f"spectra_{layout.name}.png")

    agreement, comparison = compared(display, description, found)
    cut = "" if layout.one_dimensional else f" Shown is the section of the two-dimensional spectra{along[1:]}."
    return Figure(
        name=f"spectra_{layout.name}",
        title=f"Spectra of the kernels of {title}",
        file=file,
        alt=f"{len(words)} charts of magnitude over frequency, one for each subpixel ({listed(words)}): a low-pass curve from the subpixel's own "
        "channel, and the curves of the other channels, each with a dot at its peak.",
        caption=f"How strongly each subpixel of {title} follows a wave of each frequency in the red, green and blue of the image; solid: the solved "
        f"kernels, with a dot at the peak of those from other channels; dashed: the analytic filter, ended at zero number {description.zeros} of "
        f"its sinc and normalized.{cut}{choice(layout)} Gray line: the pixel Nyquist frequency.",
        thesis="Fig. 4.4 and section 4.3.3, for the RGB stripe: each subpixel has a low-pass kernel, from its own channel, and two band-pass ones "
        "that peak at about 16 cycles per degree, in a narrow band and with a low amplitude, so that they hardly contribute and may be left out."
        if family(layout) == "RGB"
        else "The thesis shows spectra of all kernels only for the RGB stripe (Fig. 4.4).",
        agreement=agreement,
        comparison=comparison,
    )


def stands(layout: Layout) -> bool:
    """Whether subpixels stand one above the other and nowhere side by side."""
    return layout.pattern.shape[1] == 1 and layout.cells[0] == 1


def own_spectra(kernels: Kernels, subpixel: int) -> tuple[F64, F64]:
    """Frequencies, cycles per degree (n,), and there the magnitudes of a subpixel's kernels, float64 (primaries, n), along its display's axis."""
    found = [spectrum(kernels, subpixel, primary, axis(kernels.layout)) for primary in range(len(kernels.layout.primaries))]
    return found[0][0], np.stack([magnitude for _, magnitude in found])


def axis(layout: Layout) -> Axis:
    """Along which axis spectra are shown: rows, or columns where subpixels stand one above the other."""
    return "down" if stands(layout) else "across"


def clamped_spectrum(display: Display, description: SubpixelDescription, subpixel: int, frequency: F64) -> F64:
    """The magnitude of a subpixel's clamped and normalized analytic filter at frequencies in cycles per degree, along the same axis."""
    layout = display.layout
    return fitted_spectrum(display.fits[subpixel], layout, description.viewing, frequency, description.zeros, axis(layout))


def peaks(display: Display) -> list[Peak]:
    """The peak of each kernel, subpixel by subpixel."""
    layout, found = display.layout, []
    for subpixel, name in enumerate(subpixel_names(layout)):
        frequency, magnitude = own_spectra(display.kernels, subpixel)
        for primary, letter in enumerate(layout.primaries):
            at = int(magnitude[primary].argmax())
            own = primary == layout.active_primaries[subpixel]
            found.append(Peak(name, letter, own, float(frequency[at]), float(magnitude[primary, at]), float(magnitude[primary, 0])))
    return found


def compared(display: Display, description: SubpixelDescription, found: list[Peak]) -> tuple[Agreement, str]:
    """Shape, place and height of the peaks beside what the thesis states of the stripe's."""
    own, cross = [peak for peak in found if peak.own], [peak for peak in found if not peak.own and peak.magnitude > NEGLIGIBLE]
    if not cross:
        return "not comparable", "No kernel leads from another channel to a subpixel."
    low = all(abs(peak.at_zero - 1) <= LOW_PASS for peak in own)
    band = all(peak.at_zero <= BAND_PASS * peak.magnitude for peak in cross)
    frequencies = [peak.frequency for peak in cross]
    highest, lowest = max(cross, key=lambda peak: peak.magnitude), min(cross, key=lambda peak: peak.magnitude)
    text = (
        f"The kernels from a subpixel's own channel pass {_range([p.at_zero for p in own], '.3f')} of a constant image; those from other channels "
        f"pass at most {max(p.at_zero for p in cross):.2g}, and peak at {_range(frequencies, '.1f')} cpd (pixel Nyquist frequency "
        f"{pixel_nyquist(description):.3g} cpd). The highest of these peaks is {highest.magnitude:.2f}, from {PRIMARY_WORDS[highest.primary]} on "
        f"{highest.subpixel}, half as high over a band of {_band(display, highest):.2g} cpd; the lowest is {lowest.magnitude:.2g}, from "
        f"{PRIMARY_WORDS[lowest.primary]} on {lowest.subpixel}."
    )
    if family(display.layout) != "RGB":
        return "not comparable", text + _WHY.get(family(display.layout), "")
    if not same_viewer(description):
        return "not comparable", f"{text} The thesis's viewer has a pixel Nyquist frequency of about {STATED_PEAK:g} cpd."
    near = all(abs(f / STATED_PEAK - 1) <= CLOSE_PEAK for f in frequencies)
    narrow = max(_band(display, peak) for peak in cross) <= NARROW * pixel_nyquist(description)
    weak = highest.magnitude <= LOW_AMPLITUDE
    parts = {
        f"low-pass kernels pass 1 within {LOW_PASS:.0%}": low,
        f"others pass at 0 no more than {BAND_PASS:.0%} of their peaks": band,
        f"peaks within {CLOSE_PEAK:.0%} of {STATED_PEAK:g} cpd": near,
        f"half as high over at most {NARROW:.0%} of the pixel Nyquist frequency": narrow,
        f"amplitudes of at most {LOW_AMPLITUDE:g}": weak,
    }
    kept, missed = ([part for part, holds in parts.items() if holds is wanted] for wanted in (True, False))
    text += (f" Agrees in: {'; '.join(kept)}." if kept else "") + (f" Differs in: {'; '.join(missed)}." if missed else "")
    text += f" {STRONG_PEAKS}" if not weak else ""
    return ("differs" if missed else "agrees"), f"{text} {PRINTED_DISTANCE}".replace("%", " %")


def _range(values: list[float], form: str) -> str:
    """The smallest and the largest of values, or the one that both are, as far as the digits tell."""
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"


def _band(display: Display, peak: Peak) -> float:
    """Over how wide a band, cycles per degree, a spectrum is at least half as high as at its peak."""
    frequency, magnitude = own_spectra(display.kernels, subpixel_names(display.layout).index(peak.subpixel))
    along = magnitude[display.layout.primaries.index(peak.primary)]
    return float(np.count_nonzero(along >= 0.5 * along.max()) * (frequency[1] - frequency[0]))


def _draw_panel(axes: "Axes", display: Display, description: SubpixelDescription, subpixel: int, found: list[Peak]) -> None:
    """One subpixel's spectra."""
    layout, nyquist = display.layout, pixel_nyquist(description)
    frequency, magnitude = own_spectra(display.kernels, subpixel)
    axes.axvline(nyquist, color=FAINT, linewidth=1.2, zorder=1)
    for primary, peak in enumerate(found):
        color = PRIMARY_COLORS[peak.primary]
        axes.plot(frequency, magnitude[primary], "-", color=color, linewidth=1.7 if peak.own else 1.2, zorder=4 if peak.own else 3)
        if not peak.own and peak.magnitude > NEGLIGIBLE:
            axes.plot([peak.frequency], [peak.magnitude], "o", color=color, markersize=5, markeredgecolor="white", markeredgewidth=0.8, zorder=5)
    fine = np.linspace(0.0, min(SHOWN * nyquist, frequency[-1]), 301)
    axes.plot(fine, clamped_spectrum(display, description, subpixel, fine), "--", color=INK, linewidth=1.0, dashes=(4, 2), zorder=6)
    panel_title(
        axes,
        f"{subpixel_names(layout)[subpixel]}: {subpixel_words(layout)[subpixel]} subpixel",
        PRIMARY_COLORS[next(p.primary for p in found if p.own)],
    )
    lines = [(f"{PRIMARY_WORDS[p.primary]} {p.magnitude:.2f} at {p.frequency:.3g} cpd", PRIMARY_COLORS[p.primary]) for p in found]
    colored_lines(axes, lines, right=True, columns=2 if len(lines) > 3 else 1)
