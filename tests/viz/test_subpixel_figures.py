"""Figures of subpixel filters: that pictures show the data, that words carry its numbers, and that verdicts follow it."""

import dataclasses
import functools
import math
import pathlib
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pytest
from PIL import Image

from queries.subpixel.analysis import Analysis, Display
from queries.subpixel.description import LayoutDescription, SubpixelDescription
from queries.subpixel.preference import layouts_ranked, methods_ranked
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.sensitivity import exponential, gaussian
from renderer.filters.subpixel.windowed_sinc import fit
from viz.subpixel import figures, fit_rows
from viz.subpixel.band_pass import Influence, influence
from viz.subpixel.band_pass import compared as compared_influence
from viz.subpixel.comparison import compared_layouts, compared_methods, methods_figure, paired
from viz.subpixel.cost import Cost, costs, spread
from viz.subpixel.cost import compared as compared_costs
from viz.subpixel.fits import WHY, compared_fits, display_rows
from viz.subpixel.kernels import kernels_figure
from viz.subpixel.look import PRIMARY_COLORS, label_panels, new_panels, pixel_nyquist, shown_subpixels, subpixel_names
from viz.subpixel.low_pass import compared as compared_widths
from viz.subpixel.low_pass import width
from viz.subpixel.mosaic import enlarged, mosaic, pixel_light, reduced
from viz.subpixel.renderings import compared as compared_rendering
from viz.subpixel.renderings import means, rendering_figure, strongest
from viz.subpixel.spectra import PRINTED_DISTANCE, clamped_spectrum, peaks, spectra_figure
from viz.subpixel.spectra import compared as compared_spectra
from viz.subpixel.surfaces import surfaces_figure

F32 = npt.NDArray[np.float32]

DESCRIPTION = SubpixelDescription(layouts=["rgb_stripe", "rgbg", "rgbw"])
NEAR = DESCRIPTION.model_copy(update={"distance": 23.0})


@functools.cache
def display(name: str) -> Display:
    """A display with a random picture on 32 x 24 pixels, beside the same a little blurred."""
    layout = DESCRIPTION.displays()[name]
    kernels = derive(layout, DESCRIPTION.viewing, DESCRIPTION.sensitivity.sensitivity())
    random = np.random.default_rng(5)
    lattice = random.random((24 * layout.cells[1], 32 * layout.cells[0]), np.float32)
    standard = np.asarray(0.9 * lattice + 0.05, np.float32)
    return Display(layout, kernels, fit(kernels), lattice, standard, 0.25)


def with_fits(name: str, **changes: Any) -> Display:
    one = display(name)
    return dataclasses.replace(one, fits=tuple(dataclasses.replace(found, **changes) for found in one.fits))


def scores(values: dict[tuple[str, str], list[float]], seconds: float = 0.5) -> pa.Table:
    """Scores of (layout, method), image by image."""
    rows = [
        {"layout": layout, "image": f"image {i}", "method": method, "scielab": value, "scielab_unclipped": value, "seconds": seconds}
        for (layout, method), found in values.items()
        for i, value in enumerate(found)
    ]
    return pa.Table.from_pylist(rows)


def pixels(file: pathlib.Path) -> npt.NDArray[np.uint8]:
    return np.asarray(Image.open(file).convert("RGB"))


def has_color(picture: npt.NDArray[np.uint8], color: str) -> int:
    """How many pixels have a color, #rrggbb."""
    wanted = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return int((np.abs(picture.astype(int) - wanted).max(axis=2) <= 2).sum())


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


# --- pictures -----------------------------------------------------------------------------------------------------


def test_pixel_light_of_a_stripe_is_its_drive() -> None:
    one = display("rgb_stripe")
    expected = one.lattice.reshape(24, 32, 3)
    np.testing.assert_allclose(pixel_light(one.lattice, one.layout), expected, atol=1e-6)
    np.testing.assert_allclose(pixel_light(3 * one.lattice - 1, one.layout), np.clip(3 * expected - 1, 0, 1), atol=1e-6)


@pytest.mark.parametrize("name", ["rgb_stripe", "rgbg", "rgbw"])
def test_pixel_light_of_an_even_display_is_even(name: str) -> None:
    one = display(name)
    light = pixel_light(np.full_like(one.lattice, 0.5), one.layout)
    assert light.shape == (24, 32, 3)
    np.testing.assert_allclose(light, np.broadcast_to(0.5 * one.layout.light().sum(axis=0), light.shape), atol=1e-6)


def test_pixel_light_of_shared_primaries_is_interpolated() -> None:
    """A ramp stays a ramp: red ones of RGBG stand at 1/3, 7/3, … pixels, greens at 5/6, 11/6, …, and pixels' centers at 1/2."""
    layout = display("rgbg").layout
    x = np.arange(6 * 32) / 6
    drive = np.where(layout.pattern[0][np.arange(6 * 32) % 12] >= 0, x / 40, 0.0).astype(np.float32)
    light = pixel_light(np.tile(drive, (3, 1)), layout)
    np.testing.assert_allclose(light[1, 2:-2], np.repeat((np.arange(2, 30) + 0.5)[:, None] / 40, 3, axis=1), atol=1e-6)


def test_reduced_pictures_keep_their_light() -> None:
    light = np.random.default_rng(3).random((30, 47, 3), np.float32)
    small = reduced(light, 20)
    assert small.shape == (13, 20, 3)
    np.testing.assert_allclose(small.mean(axis=(0, 1)), light.mean(axis=(0, 1)), atol=1e-5)
    np.testing.assert_allclose(reduced(light, 47), light, atol=1e-5)


def test_mosaics_hold_pictures_pixel_by_pixel(tmp_path: pathlib.Path) -> None:
    picture = np.random.default_rng(4).integers(0, 256, (20, 30, 3)).astype(np.uint8)
    file = mosaic(tmp_path / "mosaic.png", [[picture, enlarged(picture, 2)]], [["one", "two"]], "Title")
    found = pixels(file)
    windows = np.lib.stride_tricks.sliding_window_view(found, picture.shape)[:, :, 0]
    at = np.argwhere((windows[:, :, 0, 0] == picture[0, 0]).all(axis=-1))
    assert sum(bool((windows[y, x] == picture).all()) for y, x in at) == 1


def test_the_strongest_difference_is_enlarged(tmp_path: pathlib.Path) -> None:
    one = display("rgbg")
    change = np.zeros((40, 60, 3), np.float32)
    change[30, 45] = 1.0
    crop = strongest(change, one.layout)
    assert crop.left <= 45 < crop.left + crop.width
    assert crop.top <= 30 < crop.top + crop.height
    assert crop.left % 2 == 0
    assert crop.left + crop.width <= 60
    assert crop.top + crop.height <= 40
    assert rendering_figure(one, DESCRIPTION, tmp_path).file.stat().st_size > 10_000


def test_differences_are_means_over_each_primary() -> None:
    layout = display("rgbg").layout
    difference = np.zeros((4, 24), np.float32)
    for column, primary in zip(layout.active[:, 1], layout.active_primaries, strict=True):
        difference[:, column::12] = (0.1, 0.4, 0.2)[primary]
    assert means(difference, layout) == pytest.approx({"R": 0.1, "G": 0.4, "B": 0.2})


@pytest.mark.parametrize(
    ("name", "differences", "expected"),
    [
        ("rgb_stripe", {"R": 0.03, "G": 0.01, "B": 0.04}, "agrees"),
        ("rgb_stripe", {"R": 0.03, "G": 0.03, "B": 0.04}, "differs"),
        ("rgbg", {"R": 0.03, "G": 0.03, "B": 0.03}, "agrees"),
        ("rgbg", {"R": 0.03, "G": 0.01, "B": 0.03}, "differs"),
        ("rgbw", {"R": 0.03, "G": 0.03, "B": 0.04, "W": 0.03}, "agrees"),
        ("rgbw", {"R": 0.03, "G": 0.03, "B": 0.05, "W": 0.03}, "differs"),
        ("rgb_stripe", {"R": 0.0, "G": 0.0, "B": 0.0}, "not comparable"),
    ],
)
def test_agreement_of_renderings_follows_the_primaries(name: str, differences: dict[str, float], expected: str) -> None:
    drives = dict.fromkeys(differences, 0.5)
    agreement, words = compared_rendering(differences, drives, display(name).layout)
    assert agreement == expected
    assert f"green {differences['G']:g}" in words

    # A primary that is lit less differs less, and is judged by its own drive
    dim = compared_rendering({**differences, "B": 0.1 * differences["B"]}, {**drives, "B": 0.05}, display(name).layout)
    assert dim[0] == expected


def test_displays_without_cross_kernels_lose_nothing_without_them() -> None:
    one = display("rgb_stripe")
    h = one.kernels.h * np.eye(3)[:, :, None, None]
    alone = influence(dataclasses.replace(one, kernels=dataclasses.replace(one.kernels, h=h)), DESCRIPTION)
    assert alone.largest < 1e-5
    assert alone.scielab < 1e-3
    assert compared_influence(alone, DESCRIPTION)[0] == "agrees"

    # Red takes a 24th of green: a difference of more than a 32nd where green is above 3/4
    h[0, 1, 0, one.kernels.columns_at == 0] = 1 / 24
    some = influence(dataclasses.replace(one, kernels=dataclasses.replace(one.kernels, h=h)), DESCRIPTION)
    assert some.largest == pytest.approx(1 / 24, rel=0.2)
    assert 0.02 < some.above < 1 / 3


def test_agreement_of_the_influence_follows_the_difference() -> None:
    nothing = np.zeros((2, 2, 3), np.float32)
    faint = Influence(nothing, nothing, largest=0.02, mean=0.004, above=0.0, scielab=0.1, scielab_95=0.4, noticed=0.01, gray=0.0)
    agreement, words = compared_influence(faint, DESCRIPTION)
    assert agreement == "agrees"
    assert "0.004" in words
    assert compared_influence(dataclasses.replace(faint, noticed=0.2), DESCRIPTION)[0] == "differs"
    assert compared_influence(dataclasses.replace(faint, above=0.2), DESCRIPTION)[0] == "differs"


# --- comparisons --------------------------------------------------------------------------------------------------


def ranking(points: dict[str, Any]) -> list[dict[str, Any]]:
    return [{"method": name, "scielab": float(np.mean(values))} for name, values in sorted(points.items(), key=lambda item: np.mean(item[1]))]


def test_paired_tests_are_students() -> None:
    found = paired(np.array([1.0, 2.0, 3.0, 4.0]), np.array([2.0, 3.0, 5.0, 6.0]))
    assert found.difference == -1.5
    assert found.p == pytest.approx(0.013847, abs=1e-6)  # t = -1.5 / (0.57735 / 2) = -5.196 with 3 degrees of freedom
    assert paired(np.ones(5), np.ones(5)).p == 1.0
    assert not paired(np.ones(1), np.zeros(1)).better


def test_agreement_of_methods_follows_the_scores() -> None:
    base = np.array([1.0, 1.3, 2.0, 2.5, 0.8, 1.1])
    noise = np.array([0.0, 0.02, -0.02, 0.03, 0.01, -0.01])
    points = {"optimal": base, "pixel_mitchell": base + 1 + noise, "box": base + 0.5 + noise, "mitchell": base + 0.6 - noise}
    agreement, words = compared_methods(points, ranking(points), points)
    assert agreement == "agrees"
    assert "clipped" not in words
    assert "box per subpixel: −0.51 (p < 0.0001)" in words
    assert "ranks first" in words

    tied = points | {"box": base + 20 * noise - 0.2}
    agreement, words = compared_methods(tied, ranking(tied), points)
    assert agreement == "differs"
    assert "not told apart from box per subpixel" in words
    assert "ranks behind box per subpixel" in words
    assert "nothing is clipped: box per subpixel: −0.51 (p < 0.0001); clipping alone keeps it from that." in words
    assert "clipping alone is not why" in compared_methods(tied, ranking(tied), tied)[1]
    few = {name: values[:3] for name, values in points.items()}
    assert compared_methods(few, ranking(few), few)[0] == "not comparable"


def test_agreement_of_displays_follows_the_scores() -> None:
    base = np.array([1.0, 1.3, 2.0, 2.5, 0.8, 1.1])
    noise = np.array([0.1, -0.12, -0.02, 0.13, 0.01, -0.09])
    families = {"rgb_stripe": "RGB", "rgbw": "RGBW", "rgbg": "RGBG"}
    points = {"rgb_stripe": base, "rgbw": base + noise, "rgbg": base + 1 + noise}
    assert compared_layouts(points, families)[0] == "agrees"
    assert compared_layouts(points | {"rgbg": base - noise}, families)[0] == "differs"
    assert compared_layouts(points | {"rgbw": base - 0.5 + 0.1 * noise}, families)[0] == "differs"
    agreement, words = compared_layouts({"rgb_stripe": base, "rgbg": base}, families)
    assert agreement == "not comparable"
    assert "RGBW is not among" in words


def test_dot_plots_show_every_method(tmp_path: pathlib.Path) -> None:
    values = {("rgb_stripe", name): [0.5 + 0.1 * i + 0.3 * k for k in range(6)] for i, name in enumerate(("optimal", "box", "mitchell"))}
    table = scores(values)
    analysis = Analysis("x", "image", DESCRIPTION, (), (32, 24), table, {"rgb_stripe": methods_ranked(table, "rgb_stripe")})
    found = methods_figure(analysis, "rgb_stripe", tmp_path)
    assert found is not None
    assert found.agreement == "differs"
    picture = pixels(found.file)
    assert has_color(picture, "#0072b2") > 300
    assert has_color(picture, "#d55e00") > 600
    assert "1.25" in found.alt
    assert "6 images" in found.caption
    assert methods_figure(analysis, "rgbw", tmp_path) is None

    again = methods_figure(analysis, "rgb_stripe", tmp_path / "again")
    assert again is not None
    assert again.file.read_bytes() == found.file.read_bytes()


def test_of_few_images_no_interval_is_drawn(tmp_path: pathlib.Path) -> None:
    table = scores({("rgb_stripe", name): [1.0 + i] for i, name in enumerate(("optimal", "pixel_mitchell", "box", "mitchell"))})
    analysis = Analysis("x", "image", DESCRIPTION, (), (32, 24), table, {"rgb_stripe": methods_ranked(table, "rgb_stripe")})
    found = methods_figure(analysis, "rgb_stripe", tmp_path)
    assert found is not None
    assert found.agreement == "not comparable"
    assert "1 image is too few" in found.comparison
    assert "95 %" not in found.caption


def test_costs_are_medians_of_what_was_timed() -> None:
    table = scores({("rgb_stripe", "optimal"): [1.0, 3.0, 2.0, 2.0], ("rgb_stripe", "box"): [2.0, 2.0]})
    table = table.set_column(table.schema.get_field_index("seconds"), "seconds", pa.array([0.2, math.nan, 0.3, 9.0, None, math.nan]))
    assert costs(table) == [Cost("rgb_stripe", "optimal", 0.3, 2.0)]


def test_agreement_of_costs_follows_the_ratio() -> None:
    found = [Cost("rgb_stripe", "pixel_box", 0.1, 3.0), Cost("rgb_stripe", "optimal", 0.3, 2.0)]
    agreement, words = compared_costs(found, "rgb_stripe")
    assert agreement == "agrees"
    assert "3 times as long" in words
    assert "−33 %" in words
    assert compared_costs([found[0], dataclasses.replace(found[1], seconds=0.5)], "rgb_stripe")[0] == "differs"
    assert compared_costs(found, "rgbw")[0] == "not comparable"


def test_names_are_spread_evenly_about_their_points() -> None:
    heights = [0.9, 0.52, 0.51, 0.5, 0.1]
    found = spread(heights, 0.08)
    assert found[0] == 0.9
    assert found[4] == pytest.approx(0.1)
    assert np.diff(found).max() <= -0.08 + 1e-12
    assert np.mean(found) == pytest.approx(np.mean(heights))


# --- all together -------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_all_figures_that_apply_are_drawn(tmp_path: pathlib.Path) -> None:
    methods = ("pixel_box", "pixel_mitchell", "box", "mitchell", "optimal", "kernels")
    names = ("rgb_stripe", "rgbg", "rgbw")
    random = np.random.default_rng(8)
    table = scores({(layout, method): list(1 + random.random(6)) for layout in names for method in methods})
    ranked = {name: methods_ranked(table, name) for name in names}
    analysis = Analysis("x", "image", DESCRIPTION, tuple(map(display, names)), (32, 24), table, ranked, layouts_ranked(table))
    found = figures(analysis, tmp_path)
    assert len({figure.name for figure in found}) == len(found) == 3 * 5 + 1 + 2
    assert all(figure.file.is_file() and figure.alt and figure.caption and figure.comparison for figure in found)
    assert len(fit_rows(analysis)) >= 11

    bare = figures(Analysis("x", "image", DESCRIPTION, (display("rgb_stripe"),), (32, 24)), tmp_path)
    assert [figure.name for figure in bare] == [f"{kind}_rgb_stripe" for kind in ("rendering", "kernels", "spectra", "band_pass")]
