"""Images filtered for subpixels by every method: constants, gratings, symmetry, areas and samples; and image files, good and bad."""

import functools
import pathlib

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from queries.errors import QueryError
from queries.subpixel import description, images
from queries.subpixel.accumulate import accumulate_samples
from queries.subpixel.display import clipped_share, shown
from queries.subpixel.full import apply_kernels
from queries.subpixel.images import apply, display_size, read_image, resample, resolve_image, signal_of_image
from renderer.filters import reconstruction_filter
from renderer.filters.subpixel.derive import Kernels, derive
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import METHODS, subpixel_filter
from renderer.filters.subpixel.windowed_sinc import Fit, fit

SHIPPED = tuple(description.shipped_layouts())
ANALYTIC = METHODS[:-1]
FINE = 6


@functools.cache
def derived(name: str) -> tuple[Layout, Kernels, tuple[Fit, ...]]:
    layout = description.layout(name)
    kernels = derive(layout)
    return layout, kernels, fit(kernels)


def random_image(width: int, height: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((height, width, 3), dtype=np.float32)


def of_subpixels(lattice: np.ndarray, layout: Layout) -> list[np.ndarray]:
    rows, columns = layout.pattern.shape
    return [lattice[row::rows, column::columns] for row, column in layout.active]


def samples(image: np.ndarray, scale: float, filter: SubpixelFilter) -> np.ndarray:
    """The image's pixels as samples at their centers, resolved as those of a run are."""
    height, width, _ = image.shape
    y, x = (np.indices((height, width)) + 0.5) / scale
    across, down = display_size(image, scale)
    lattice = accumulate_samples(x.ravel(), y.ravel(), image.reshape(-1, 3), filter, across + 1, down + 1)
    return lattice[: down * filter.layout.cells[1], : across * filter.layout.cells[0]]


# --- what filters must keep ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("scale", [1.0, 2.5, 6.0])
def test_a_constant_stays_itself(name: str, scale: float) -> None:
    layout, kernels, fits = derived(name)
    color = np.array([0.3, 0.5, 0.7], np.float32)
    image = np.broadcast_to(color, (31, 43, 3)).copy()
    for method in ANALYTIC:
        lattice = apply(image, method, layout, kernels, fits, scale=scale)
        for values, primary in zip(of_subpixels(lattice, layout), layout.active_primaries):
            assert np.abs(values - layout.signal(color)[primary]).max() < 1e-6, method
    assert np.abs(signal_of_image(image, layout, scale) - color).max() < 1e-6


@pytest.mark.parametrize(("name", "most"), [("rgb_stripe", 1e-5), ("bgr_stripe", 1e-5), ("rgbg", 0.006), ("rgbw", 1e-5)])
def test_all_kernels_keep_the_light_of_a_constant(name: str, most: float) -> None:
    layout, kernels, _ = derived(name)
    image = np.broadcast_to(np.float32([0.3, 0.5, 0.7]), (48, 48, 3)).copy()
    light = shown(apply(image, "kernels", layout, kernels, scale=6.0), layout, FINE).mean(axis=(0, 1), dtype=np.float64)
    assert np.abs(light - [0.3, 0.5, 0.7]).max() < most  # least squares give up a little of it, to be even over the two pixels of RGBG


@pytest.mark.parametrize("name", SHIPPED)
def test_a_gray_grating_stays_gray(name: str) -> None:
    # Whole cycles in the inner part of the display, so that every subpixel's mean is the grating's, whatever the filter does to its height
    layout, kernels, fits = derived(name)
    x = (np.arange(72 * FINE) + 0.5) / FINE
    grating = (0.5 + 0.2 * np.cos(2 * np.pi * x / 8.0)).astype(np.float32)
    image = np.repeat(np.repeat(grating[None, :, None], 2 * FINE, axis=0), 3, axis=2)
    for method in METHODS:
        lattice = apply(image, method, layout, kernels, fits, scale=FINE)
        inner = lattice[:, 12 * layout.cells[0] : 60 * layout.cells[0]]
        mean = shown(inner, layout, FINE).mean(axis=(0, 1), dtype=np.float64)
        most = 1e-6 if method != "kernels" else 0.012 if name == "rgbg" else 1e-3
        assert np.ptp(mean) < most, method
        assert np.abs(mean - 0.5).max() < most, method


@pytest.mark.parametrize("name", ["rgb_stripe", "rgbg"])
@pytest.mark.parametrize("method", ANALYTIC)
def test_gratings_have_the_phase_of_each_subpixel(name: str, method: str) -> None:
    # The response at a subpixel is the grating at the center of its filter, times the filter's own transfer, which is real
    layout, _, fits = derived(name)
    filter, f = subpixel_filter(method, layout, fits), 1 / 12.0
    x = (np.arange(96 * 12) + 0.5) / 12
    image = np.repeat(np.repeat((0.5 + 0.4 * np.cos(2 * np.pi * f * x)).astype(np.float32)[None, :, None], 24, axis=0), 3, axis=2)
    lattice = resolve_image(image, filter, 12.0)
    offset = np.linspace(-1, 1, 20001)
    for p, values in enumerate(of_subpixels(lattice, layout)):
        one = filter.across[p]
        weight = one.weight(offset * one.radius)
        transfer = float((weight * np.cos(2 * np.pi * f * offset * one.radius)).sum() / weight.sum())
        centers = filter.centers()[p, 0] + np.arange(values.shape[1]) * layout.pattern.shape[1] / layout.cells[0]
        want = 0.5 + 0.4 * transfer * np.cos(2 * np.pi * f * centers)
        inside = (centers > 5) & (centers < 91)
        assert np.abs(values[:, inside] - want[inside]).max() < 1e-3
        assert transfer > 0.85


@pytest.mark.parametrize("method", METHODS)
def test_a_mirrored_display_shows_the_mirrored_image(method: str) -> None:
    image = random_image(40, 12)
    rgb, bgr = (derived(name) for name in ("rgb_stripe", "bgr_stripe"))
    found = apply(image, method, *rgb, scale=2.0)
    mirrored = apply(np.ascontiguousarray(image[:, ::-1]), method, *bgr, scale=2.0)
    assert np.abs(mirrored[:, ::-1] - found).max() < 1e-5
    assert np.abs(apply(image, method, *bgr, scale=2.0) - found).max() > 0.1


@pytest.mark.parametrize("name", SHIPPED)
def test_clamped_filters_converge(name: str) -> None:
    layout, kernels, fits = derived(name)
    image = random_image(120, 60, 3)
    far = apply(image, "optimal", layout, kernels, fits, 20, 3.0)
    errors = [float(np.sqrt(np.mean((apply(image, "optimal", layout, kernels, fits, zeros, 3.0) - far) ** 2))) for zeros in (2, 3, 4, 6)]
    assert errors[0] > errors[1] > errors[2] > errors[3]
    assert errors[3] < 1e-3
    assert errors[0] > 5e-4


def test_the_analytic_filter_is_near_the_low_pass_kernel() -> None:
    layout, kernels, fits = derived("rgb_stripe")
    image = np.repeat(np.repeat(random_image(40, 8, 4), 3, axis=0), 3, axis=1)  # even over pixels, so that cells hold what samples do
    analytic = apply(image, "optimal", layout, kernels, fits, 8, 3.0)
    low_pass = apply_kernels(signal_of_image(image, layout, 3.0), kernels, only_own=True)
    inside = slice(24, -24)
    error, of_box = (np.sqrt(np.mean((found - low_pass)[:, inside] ** 2)) for found in (analytic, apply(image, "box", layout, scale=3.0)))
    assert error < 0.01
    assert of_box > 0.04


# --- areas and samples --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("scale", [1.0, 3.0, 3.7])
def test_smooth_filters_take_samples(name: str, scale: float) -> None:
    layout, _, _ = derived(name)
    image = random_image(50, 41)
    for method in ("mitchell", "pixel_mitchell"):
        filter = subpixel_filter(method, layout)
        assert np.abs(resolve_image(image, filter, scale) - samples(image, scale, filter)).max() < 1e-5


def test_radial_filters_take_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = description.layout("rgbw")
    filter = SubpixelFilter("radial", layout, (reconstruction_filter("gaussian"),) * 4, None)
    image, scale = random_image(30, 47), 2.5
    y, x = (np.indices((47, 30)) + 0.5) / scale
    want = np.zeros((36, 24))
    for (row, column), primary in zip(layout.active, layout.active_primaries):
        for i in range(row, 36, 2):
            for j in range(column, 24, 2):
                weight = filter.across[0].weight(np.hypot(x - (j + 0.5) / 2, y - (i + 0.5) / 2)) * (
                    np.hypot(x - (j + 0.5) / 2, y - (i + 0.5) / 2) < 2
                )
                want[i, j] = layout.signal((weight[..., None] * image).sum(axis=(0, 1)) / weight.sum())[primary]
    found = resolve_image(image, filter, scale)
    assert np.abs(found - want).max() < 1e-4  # its weights are tabulated
    monkeypatch.setattr(images, "_BAND", 1)
    assert np.abs(resolve_image(image, filter, scale) - found).max() < 1e-6


@pytest.mark.parametrize("name", SHIPPED)
def test_boxes_take_areas(name: str) -> None:
    # Image pixels are squares: cut into 24, of which a display pixel of one and a half has 36, they tell every area here exactly
    layout, _, _ = derived(name)
    image = random_image(12, 9)
    fine = np.repeat(np.repeat(image.astype(np.float64), 24, axis=0), 24, axis=1)
    for method in ("pixel_box", "none", "box"):
        filter = subpixel_filter(method, layout)
        lattice = resolve_image(image, filter, 1.5)
        for p, values in enumerate(of_subpixels(lattice, layout)):
            half_x, half_y = (round(36 * one.radius) for one in (filter.across[p], filter.down[p]))
            for i in range(values.shape[0]):
                for j in range(values.shape[1]):
                    x, y = (
                        round(36 * (c + k * size / of))
                        for c, k, size, of in zip(filter.centers()[p], (j, i), layout.pattern.shape[::-1], layout.cells)
                    )
                    color = fine[max(y - half_y, 0) : y + half_y, max(x - half_x, 0) : x + half_x].mean(axis=(0, 1))
                    assert values[i, j] == pytest.approx(layout.signal(color)[layout.active_primaries[p]], abs=1e-6)


@pytest.mark.parametrize("name", SHIPPED)
def test_signals_are_means_of_cells(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    layout, _, _ = derived(name)
    image = random_image(20, 14)
    signal = signal_of_image(image, layout, 2.0)
    assert signal.shape == (7 * layout.cells[1], 10 * layout.cells[0], 3)
    assert signal.dtype == np.float32
    fine = np.repeat(np.repeat(image.astype(np.float64), 6, axis=0), 6, axis=1)  # 12 across a pixel: two and more across a cell
    across, down = (12 // cells for cells in layout.cells)
    shift = round((layout.origin[0] - 0.5) * across)
    for i, j in ((0, 1), (1, 2), (5, 9), (len(signal) - 1, 17)):
        cell = fine[i * down : (i + 1) * down, j * across + shift : (j + 1) * across + shift]
        assert np.allclose(signal[i, j], cell.mean(axis=(0, 1)), atol=1e-6)

    # No filter at each subpixel is the signal in the subpixel's primary
    lattice = resolve_image(image, subpixel_filter("none", layout), 2.0)
    for values, (row, column), primary in zip(of_subpixels(lattice, layout), layout.active, layout.active_primaries):
        own = layout.signal(signal)[row :: len(layout.pattern), column :: layout.pattern.shape[1], primary]
        assert np.abs(values - own).max() < 1e-6
    monkeypatch.setattr(images, "_BAND", 1)
    assert np.array_equal(signal_of_image(image, layout, 2.0, threads=3), signal)
    assert np.array_equal(resolve_image(image, subpixel_filter("none", layout), 2.0, threads=3), lattice)


def test_images_on_a_fine_grid_are_means_of_squares() -> None:
    image = random_image(17, 11)
    assert np.abs(resample(image, 2.0, 2) - image[:10, :16]).max() < 1e-6  # a sample for each image pixel
    assert np.abs(resample(image, 2.0, 6) - np.repeat(np.repeat(image[:10, :16], 3, axis=0), 3, axis=1)).max() < 1e-6
    tenths = np.repeat(np.repeat(image.astype(np.float64), 4, axis=0), 4, axis=1)[:40, :60]  # of a pixel of two and a half image pixels
    found = resample(image, 2.5, 2)
    assert found.shape == (8, 12, 3)
    assert np.abs(found - tenths.reshape(8, 5, 12, 5, 3).mean(axis=(1, 3))).max() < 1e-6
    assert np.array_equal(resample(image, 2.5, 2, (1, 2, 5, 4)), found[4:8, 2:10])
    with pytest.raises(QueryError, match="window in a display of 6 x 4 pixels"):
        resample(image, 2.5, 2, (1, 2, 5, 5))


def test_left_over_pixels_count_within_reach() -> None:
    layout, _, _ = derived("rgb_stripe")
    image = np.zeros((10, 21, 3), np.float32)
    image[:, 20] = 1.0  # beyond the last whole pixel of two
    assert display_size(image, 2.0) == (10, 5)
    assert not resolve_image(image, subpixel_filter("pixel_box", layout), 2.0).any()
    found = resolve_image(image, subpixel_filter("mitchell", layout), 2.0)
    assert found.shape == (5, 30)
    assert (found[:, -1] > 0.05).all()
    assert not found[:, :18].any()
    assert display_size(np.zeros((7, 33, 3), np.float32), 1.1) == (30, 6)  # 33 / 1.1 is a little less than 30 in floating point


def test_displays_smaller_than_a_period() -> None:
    tall = description.LayoutDescription(pattern=["R .", "G .", ". B", ". G"], cells=(2, 2)).layout("tall")  # two pixels high
    wide = description.layout("rgbg")  # two pixels wide
    image = np.full((3, 3, 3), 0.25, np.float32)
    for layout in (tall, wide):
        kernels = derive(layout, size=(24, 24) if layout is tall else None)
        for method in METHODS:
            lattice = apply(image, method, layout, kernels, fit(kernels), scale=3.0)
            assert lattice.shape == layout.cells[::-1]
            lit = [values.item() for values in of_subpixels(lattice, layout) if values.size]
            assert len(lit) == 2
            if method != "kernels":
                assert lit == pytest.approx([0.25, 0.25], abs=1e-6)
            assert shown(lattice, layout, 4).shape == (4, 4, 3)


def test_scale_one_takes_the_image_as_it_is() -> None:
    layout, _, fits = derived("rgb_stripe")
    image = random_image(16, 5)
    pixels = resolve_image(image, subpixel_filter("pixel_box", layout), 1.0)
    assert np.array_equal(pixels.reshape(5, 16, 3), image)
    ideal = resolve_image(image, subpixel_filter("optimal", layout, fits), 1.0)  # zeros of the sinc lie on the other pixels' centers
    assert np.abs(ideal[:, 1::3] - image[:, :, 1]).max() < 1e-3
    assert np.abs(ideal[:, 0::3] - image[:, :, 0]).max() > 0.05


def test_values_beyond_the_display_pass_and_are_cut_when_shown() -> None:
    layout, kernels, fits = derived("rgb_stripe")
    image = np.full((8, 24, 3), 0.5, np.float32)
    image[4:, 8:16], image[:4, 8:16] = -2.0, 1e30
    for method in METHODS:
        lattice = apply(image, method, layout, kernels, fits, scale=1.0)
        assert np.isfinite(lattice).all()
        assert lattice.max() > 1e29
        assert lattice.min() < -1.9
        assert clipped_share(lattice, layout) > 0.3
        light = shown(lattice, layout, 3, clip=True)
        assert light.min() == 0.0
        assert light.max() == 3.0


def test_bad_arrays_and_scales_are_refused() -> None:
    layout, kernels, _ = derived("rgb_stripe")
    image = random_image(6, 4)
    for scale in (0.5, 0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(QueryError, match="scale of 1 or more"):
            apply(image, "box", layout, scale=scale)
    with pytest.raises(QueryError, match="fills no pixel of 5 x 5"):
        signal_of_image(image, layout, 5.0)
    with pytest.raises(QueryError, match=r"image of \(height, width, 3\), found the shape \(4, 6\)"):
        apply(image[..., 0], "box", layout)
    with pytest.raises(QueryError, match="needs the kernels"):
        apply(image, "kernels", layout)
    image[2, 3, 1] = np.nan
    image[3, 0] = np.inf
    for method in ("box", "kernels"):
        with pytest.raises(QueryError, match="2 pixels that are not finite numbers, the first in column 3, row 2"):
            apply(image, method, layout, kernels)


# --- files --------------------------------------------------------------------------------------------------------


def write_exr(file: pathlib.Path, values: np.ndarray, names: tuple[str, ...] | None = None) -> pathlib.Path:
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], oiio.FLOAT)
    if names:
        spec.channelnames = names
    out = oiio.ImageOutput.create(str(file))
    assert out.open(str(file), spec)
    assert out.write_image(np.ascontiguousarray(values, np.float32))
    assert out.close()
    return file


def test_files_of_integers_are_decoded(tmp_path: pathlib.Path) -> None:
    rgba = np.array([[[0, 188, 255, 255], [255, 188, 0, 0]]], np.uint8)
    Image.fromarray(rgba).save(tmp_path / "rgba.png")
    want = np.array([[[0, 0.5029, 1], [1, 0.5029, 0]]])
    found = read_image(tmp_path / "rgba.png")
    assert found.dtype == np.float32
    assert np.allclose(found, want, atol=1e-4)
    Image.fromarray(rgba[..., :3]).save(tmp_path / "rgb.tif")
    assert np.array_equal(read_image(str(tmp_path / "rgb.tif")), found)
    Image.fromarray(np.array([[0, 48316, 65535]], np.uint16)).save(tmp_path / "gray.png")
    assert np.allclose(read_image(tmp_path / "gray.png"), np.repeat([[[0], [0.5029], [1]]], 3, axis=2), atol=1e-4)


def test_files_of_floats_are_as_they_are(tmp_path: pathlib.Path) -> None:
    values = np.random.default_rng(6).standard_normal((4, 5, 3)).astype(np.float32)
    values[0, 0] = 3e38
    assert np.array_equal(read_image(write_exr(tmp_path / "rgb.exr", values)), values)
    more = np.random.default_rng(7).random((2, 3, 5)).astype(np.float32)
    assert np.array_equal(read_image(write_exr(tmp_path / "more.exr", more, ("Z", "G", "R", "B", "u"))), more[..., [2, 1, 3]])
    assert np.array_equal(read_image(write_exr(tmp_path / "gray.exr", more[..., :1], ("Y",))), more[..., [0, 0, 0]])


def test_bad_files_are_refused(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(QueryError, match=r"none.png` cannot be read: No such file"):
        read_image(tmp_path / "none.png")
    with pytest.raises(QueryError, match="cannot be read: Is a directory"):
        read_image(tmp_path)
    for name, content in (("empty.png", b""), ("text.png", b"hello"), ("notes.txt", b"hello")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(QueryError, match="expected an image file"):
            read_image(tmp_path / name)
    pixels = (255 * random_image(40, 30)).astype(np.uint8)
    for kind in ("png", "jpg", "tif"):
        whole, cut = tmp_path / f"whole.{kind}", tmp_path / f"cut.{kind}"
        Image.fromarray(pixels).save(whole)
        cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
        assert read_image(whole).shape == (30, 40, 3)
        with pytest.raises(QueryError, match=r"is damaged: .*[a-z]"):
            read_image(cut)
    broken = random_image(5, 4)
    broken[1, 3, 2], broken[2, 2, 0] = np.nan, -np.inf
    with pytest.raises(QueryError, match="2 pixels that are not finite numbers, the first in column 3, row 1"):
        read_image(write_exr(tmp_path / "broken.exr", broken))
    monkeypatch.setattr(images, "MOST_PIXELS", 1199)
    with pytest.raises(QueryError, match="40 x 30 pixels, more than 1,199: scale it down"):
        read_image(tmp_path / "whole.png")
