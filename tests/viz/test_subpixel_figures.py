"""Figures of what subpixel filters do: pictures that show the data, and comparisons whose words and verdicts follow it."""

import dataclasses
import math
import pathlib
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from subpixel_displays import DESCRIPTION, display, has_color, pixels

from queries.subpixel.analysis import Analysis
from queries.subpixel.preference import layouts_ranked, methods_ranked
from viz.subpixel import figures, fit_rows
from viz.subpixel.band_pass import Influence, influence
from viz.subpixel.band_pass import compared as compared_influence
from viz.subpixel.comparison import compared_layouts, compared_methods, methods_figure, paired
from viz.subpixel.cost import Cost, costs, spread
from viz.subpixel.cost import compared as compared_costs
from viz.subpixel.mosaic import enlarged, mosaic, pixel_light, reduced
from viz.subpixel.renderings import compared as compared_rendering
from viz.subpixel.renderings import means, rendering_figure, strongest


def scores(values: dict[tuple[str, str], list[float]], seconds: float = 0.5) -> pa.Table:
    """Scores of (layout, method), image by image."""
    rows = [
        {"layout": layout, "image": f"image {i}", "method": method, "scielab": value, "scielab_unclipped": value, "seconds": seconds}
        for (layout, method), found in values.items()
        for i, value in enumerate(found)
    ]
    return pa.Table.from_pylist(rows)


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
