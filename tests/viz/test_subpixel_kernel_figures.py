"""Figures of subpixel filters themselves: their parameters, kernels, spectra and widths, with verdicts that follow them."""

import dataclasses
import math
import pathlib
from typing import Any

import numpy as np
import pytest
from subpixel_displays import DESCRIPTION, NEAR, display, has_color, pixels

from queries.subpixel.analysis import Display
from queries.subpixel.description import LayoutDescription
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.sensitivity import exponential, gaussian
from renderer.filters.subpixel.windowed_sinc import fit
from viz.subpixel.fits import WHY, compared_fits, display_rows
from viz.subpixel.kernels import kernels_figure
from viz.subpixel.look import PRIMARY_COLORS, label_panels, new_panels, pixel_nyquist, shown_subpixels, subpixel_names
from viz.subpixel.low_pass import compared as compared_widths
from viz.subpixel.low_pass import width
from viz.subpixel.spectra import PRINTED_DISTANCE, clamped_spectrum, peaks, spectra_figure
from viz.subpixel.spectra import compared as compared_spectra
from viz.subpixel.surfaces import surfaces_figure


def with_fits(name: str, **changes: Any) -> Display:
    one = display(name)
    return dataclasses.replace(one, fits=tuple(dataclasses.replace(found, **changes) for found in one.fits))


# --- parameters of the fits ---------------------------------------------------------------------------------------


def test_fits_are_compared_with_the_table() -> None:
    rgbg = display_rows(display("rgbg"), DESCRIPTION)
    assert [row.subpixel for row in rgbg] == ["R", "G₁", "B", "G₂"]
    assert {row.agreement for row in rgbg} == {"agrees"}
    assert rgbg[0].thesis_a == pytest.approx(math.pi / 12)
    assert rgbg[3].thesis_b == 479.06

    stripe = display_rows(display("rgb_stripe"), DESCRIPTION)
    assert [row.thesis_b for row in stripe] == [92.65, 76.58, 46.62]
    assert stripe[2].agreement == "differs"
    agreement, words = compared_fits(stripe, DESCRIPTION)
    assert agreement == "differs"
    assert f"{stripe[2].b:.4g} against 46.62" in words


def test_agreement_of_fits_follows_the_data() -> None:
    one = display("rgb_stripe")
    exact = [dataclasses.replace(found, a=math.pi / 3, b=b) for found, b in zip(one.fits, (92.65, 76.58, 46.62), strict=True)]
    agreeing = dataclasses.replace(one, fits=tuple(exact))
    assert compared_fits(display_rows(agreeing, DESCRIPTION), DESCRIPTION)[0] == "agrees"
    poor = dataclasses.replace(one, fits=tuple(dataclasses.replace(found, rms=0.03) for found in exact))
    agreement, words = compared_fits(display_rows(poor, DESCRIPTION), DESCRIPTION)
    assert agreement == "differs"
    assert "not all below 0.02" in words
    assert "0.03" in words


def test_parameters_of_another_viewer_are_not_judged() -> None:
    rows = display_rows(display("rgb_stripe"), NEAR)
    assert {row.agreement for row in rows} == {"not comparable"}
    agreement, words = compared_fits(rows, NEAR)
    assert agreement == "agrees"
    assert "only the errors are judged" in words


def test_separable_fits_stand_beside_radial_ones_for_the_table() -> None:
    one = with_fits("rgbw", model="separable", a_down=1.0, b_down=2.0)
    rows = display_rows(one, DESCRIPTION)
    assert [row.applied for row in rows] == [True] * 4 + [False] * 4
    assert all(row.thesis_a is None for row in rows[:4])
    assert [row.thesis_a for row in rows[4:]] == [2.06, 1.75, 1.89, 3.04]
    assert {row.model for row in rows[4:]} == {"radial"}


# --- kernels and spectra ------------------------------------------------------------------------------------------


def test_kernels_are_drawn_in_their_channels_colors(tmp_path: pathlib.Path) -> None:
    found = kernels_figure(display("rgb_stripe"), DESCRIPTION, tmp_path / "new")
    picture = pixels(found.file)
    assert all(has_color(picture, PRIMARY_COLORS[letter]) > 200 for letter in "RGB")
    third = picture.shape[1] // 3
    assert has_color(picture[:, :third], PRIMARY_COLORS["R"]) > 2 * has_color(picture[:, third : 2 * third], PRIMARY_COLORS["R"])
    assert found.agreement == "differs"
    assert "46.62" in found.comparison


def test_what_is_told_of_the_table_holds() -> None:
    layout, told = DESCRIPTION.displays()["rgb_stripe"], WHY["BGR"]
    found = fit(derive(layout, DESCRIPTION.viewing, exponential(2.0)))
    assert all(f"{letter} {one.b:.0f}" in told for letter, one in zip("RGB", found, strict=True))
    for constants in ((2.3, 2.0, 2.3), (2.3, 1.5, 1.0), (4.0, 2.0, 1.5)):
        found = fit(derive(layout, DESCRIPTION.viewing, exponential(constants)))
        assert found[2].b > found[0].b


def test_maps_of_two_dimensional_kernels_have_both_signs(tmp_path: pathlib.Path) -> None:
    found = surfaces_figure(display("rgbw"), DESCRIPTION, tmp_path)
    picture = pixels(found.file).astype(int)[:, :1100]
    assert ((picture[..., 0] - picture[..., 2]) > 60).sum() > 2000  # orange: positive
    assert ((picture[..., 2] - picture[..., 1]) > 30).sum() > 2000  # purple: negative
    assert found.agreement == "differs"
    assert "against 16.36" in found.comparison
    assert f"{display('rgbw').fits[0].rms:.2g}" in found.caption


def test_cross_kernels_peak_at_the_pixel_nyquist_frequency(tmp_path: pathlib.Path) -> None:
    one = display("rgb_stripe")
    cross = [peak for peak in peaks(one) if not peak.own]
    assert len(cross) == 6
    assert all(peak.frequency == pytest.approx(0.5 / DESCRIPTION.viewing.degrees_per_pixel, abs=0.01) for peak in cross)
    assert spectra_figure(one, DESCRIPTION, tmp_path).comparison.count(f"{max(peak.magnitude for peak in cross):.2f}") == 1


def test_what_is_told_of_strong_peaks_holds() -> None:
    """One sensitivity for all channels, whatever it is, gives one amplitude; a narrower one for color gives a larger; 25 cm give 8.6 cpd."""
    layout = DESCRIPTION.displays()["rgb_stripe"]
    curves = (exponential(2.3), exponential(1.6), gaussian(6.0), exponential((2.3, 2.0, 2.0)))
    derived = [dataclasses.replace(display("rgb_stripe"), kernels=derive(layout, DESCRIPTION.viewing, curve)) for curve in curves]
    default, other, bell, narrower = (max(peak.magnitude for peak in peaks(one) if not peak.own) for one in derived)
    assert default == pytest.approx(other, abs=1e-6) == pytest.approx(bell, abs=1e-6)
    assert narrower > 1.2 * default
    assert layout.opponent[0, 1] == 0.73
    assert f"{pixel_nyquist(DESCRIPTION.model_copy(update={'distance': 25.0})):.1f} cpd" in PRINTED_DISTANCE


def test_agreement_of_spectra_follows_the_amplitude() -> None:
    one = display("rgb_stripe")
    agreement, words = compared_spectra(one, DESCRIPTION, peaks(one))
    assert agreement == "differs"
    assert "Differs in: amplitudes of at most 0.5." in words
    weak = [peak if peak.own else dataclasses.replace(peak, magnitude=0.3 * peak.magnitude) for peak in peaks(one)]
    assert compared_spectra(one, DESCRIPTION, weak)[0] == "agrees"
    moved = [peak if peak.own else dataclasses.replace(peak, frequency=20.0) for peak in weak]
    agreement, words = compared_spectra(one, DESCRIPTION, moved)
    assert agreement == "differs"
    assert "20.0 cpd" in words
    assert compared_spectra(one, NEAR, weak)[0] == "not comparable"


def test_spectra_of_a_standing_stripe_are_those_of_a_lying_one() -> None:
    layout = LayoutDescription(pattern=["R", "G", "B"], cells=(1, 3)).layout("standing")
    lying, kernels = display("rgb_stripe"), derive(layout, DESCRIPTION.viewing, DESCRIPTION.sensitivity.sensitivity(), (300, 1))
    standing = dataclasses.replace(lying, layout=layout, kernels=kernels, fits=fit(kernels))
    for one, other in zip(peaks(lying), peaks(standing), strict=True):
        assert (one.frequency, one.magnitude) == pytest.approx((other.frequency, other.magnitude), abs=1e-9)
    frequency = np.linspace(0.0, 40.0, 30)
    found = [clamped_spectrum(which, DESCRIPTION, 1, frequency) for which in (lying, standing)]
    np.testing.assert_allclose(found[0], found[1], atol=1e-4)


@pytest.mark.parametrize("name", ["rgb_stripe", "rgbw"])
def test_spectrum_of_the_clamped_filter_is_normalized(name: str) -> None:
    one = display(name)
    found = clamped_spectrum(one, DESCRIPTION, 0, np.array([0.0, 200.0]))
    assert found[0] == pytest.approx(1.0, abs=1e-12)
    assert found[1] < 0.05


def test_widths_are_those_of_the_fits() -> None:
    one = display("rgbg")
    for i, found in enumerate(one.fits):
        x = np.linspace(0.0, 20.0, 20_001)
        values = found.values(x, np.zeros_like(x))
        half = x[np.argmax(values < 0.5 * values[0])]
        assert width(one, i) == pytest.approx(2 * half / one.layout.cells[0], rel=0.02)
    agreement, words = compared_widths(one)
    assert agreement == "agrees"
    assert f"R {width(one, 0):.3g}" in words

    # Red as wide as green: no larger support any more
    h = one.kernels.h.copy()
    h[0, 0] = h[1, 1]
    assert compared_widths(dataclasses.replace(one, kernels=dataclasses.replace(one.kernels, h=h)))[0] == "differs"


def test_every_column_of_panels_has_a_named_axis_below() -> None:
    figure, panels = new_panels(2, 2, 4.0, "three of four", sharex=True)
    label_panels(panels, 3, "x", "y")
    figure.canvas.draw()
    assert [axes.get_xlabel() for axes in panels.ravel()] == ["", "x", "x", ""]
    assert [any(tick.label1.get_visible() for tick in axes.xaxis.get_major_ticks()) for axes in panels.ravel()[:3]] == [False, True, True]
    assert not panels[1, 1].axison


def test_many_subpixels_are_shown_by_the_first_of_each_primary() -> None:
    layout = LayoutDescription(pattern=["R G B R G B", "G B R G B R"], cells=(3, 1)).layout("large")
    assert shown_subpixels(layout) == (0, 1, 2)
    assert subpixel_names(layout)[:4] == ("R₁", "G₁", "B₁", "R₂")
