"""Analytic subpixel filters: fits of windowed sincs, the filters of all methods, and spectra."""

import dataclasses
import math

import numpy as np
import pytest

from queries.subpixel.description import LayoutDescription, layout, shipped_layouts
from renderer.filters.reconstruction import FILTERS
from renderer.filters.subpixel import METHODS, TITLES, Fit, Layout, SubpixelFilter, derive, fit, subpixel_filter, windowed_sinc
from renderer.filters.subpixel import sensitivity as csf
from renderer.filters.subpixel.spectra import fitted_spectrum, peak, spectrum
from renderer.filters.subpixel.viewing import Viewing

SHIPPED = tuple(shipped_layouts())
SAMPLED = METHODS[:-1]  # all but the kernels are weights of samples


def drawn(*rows: str, cells: tuple[int, int]) -> Layout:
    """A layout of one's own."""
    return LayoutDescription(pattern=list(rows), cells=cells).layout("drawn")


VERTICAL = drawn("R", "G", "B", cells=(1, 3))
BAYER = drawn("R G", "G B", cells=(2, 2))
HOLE = drawn("R G", "B .", cells=(2, 2))
SHIFTED = drawn("R G B", "B R G", cells=(3, 1))


def weights(filter_: SubpixelFilter, subpixel: int, dx: np.ndarray, dy: np.ndarray) -> np.ndarray:
    """What samples at offsets in pixels are weighed with."""
    if filter_.down is None:
        return filter_.across[subpixel].weight(np.hypot(dx, dy))
    return filter_.across[subpixel].weight(dx) * filter_.down[subpixel].weight(dy)


# --- Fits -------------------------------------------------------------------------------------------------------------


def test_rgbg_has_the_coefficients_of_the_thesis() -> None:
    """Table 4.1: a = pi / 12 and pi / 6, b = 457, 477, 457, 479; with the default sensitivity 458, 473, 459, 473 within 1.3 %."""
    fits = fit(derive(layout("rgbg")))
    assert [f.a for f in fits] == pytest.approx([math.pi / 12, math.pi / 6, math.pi / 12, math.pi / 6], rel=0.005)
    assert [f.b for f in fits] == pytest.approx([458, 473, 459, 473], rel=0.013)
    assert [f.b for f in fits] == pytest.approx([457.37, 476.62, 457.37, 479.06], rel=0.025)
    assert [f.scale for f in fits] == pytest.approx([1 / 12, 1 / 6, 1 / 12, 1 / 6], abs=1e-12)


def test_the_stripe_has_the_zeros_of_the_thesis() -> None:
    """Table 4.1: a = pi / 3. Its b, 92.65, 76.58, 46.62, belong to another sensitivity: here they are 68.9, 54.0, 74.2."""
    fits = fit(derive(layout("rgb_stripe")))
    assert [f.a for f in fits] == pytest.approx([math.pi / 3] * 3, rel=0.001)
    assert [f.b for f in fits] == pytest.approx([68.93, 54.04, 74.16], rel=0.001)
    assert [f.scale for f in fits] == pytest.approx([1 / 3] * 3, abs=1e-12)
    narrower = fit(derive(layout("rgb_stripe"), sensitivity=csf.exponential(1.95)))
    assert [f.b for f in narrower[:2]] == pytest.approx([92.65, 76.58], rel=0.04)
    assert narrower[2].b > narrower[1].b  # the thesis has blue the smallest by far


@pytest.mark.parametrize("name", SHIPPED)
def test_residuals_are_those_of_the_filters(name: str) -> None:
    """rms, largest and relative, measured at every offset; in one dimension below the thesis's 0.02 and 4 % of the kernel."""
    kernels = derive(layout(name))
    for p, one in enumerate(fit(kernels)):
        residual = one.values(kernels.columns_at[None, :] * 1.0, kernels.rows_at[:, None] * 1.0) - kernels.own(p)
        assert one.rms == pytest.approx(np.sqrt((residual**2).mean()), rel=1e-9)
        assert one.largest == pytest.approx(np.abs(residual).max(), rel=1e-9)
        assert one.relative == pytest.approx(np.linalg.norm(residual) / np.linalg.norm(kernels.own(p)), rel=1e-9)
        assert one.warning == ""
        assert one.rms < 0.02
        assert one.relative < (0.04 if layout(name).one_dimensional else 0.25)


def test_bgr_has_the_fits_of_rgb_mirrored() -> None:
    """Filters are even."""
    rgb, bgr = fit(derive(layout("rgb_stripe"))), fit(derive(layout("bgr_stripe")))
    assert [(f.a, f.b) for f in bgr] == [pytest.approx((f.a, f.b), rel=1e-5) for f in rgb[::-1]]


def test_the_fit_finds_what_it_is_given() -> None:
    """Kernels that are windowed sincs: a, b to 1e-6 and nothing is left, in all four models."""
    cases = [
        (layout("rgb_stripe"), None, Fit(1.1, 40.0, 1 / 3, 0, 0)),
        (VERTICAL, None, Fit(0.9, 70.0, 1 / 3, 0, 0, model="down")),
        (layout("rgbw"), None, Fit(1.5, 9.0, 1 / 4, 0, 0, 0, "separable", 1.7, 20.0)),
        (layout("rgbw"), "radial", Fit(1.7, 6.0, 1 / 4, 0, 0, 0, "radial")),
    ]
    for display, model, truth in cases:
        kernels = derive(display, size=None if display.one_dimensional else (24, 24))
        h = np.zeros_like(kernels.h)
        values = truth.values(kernels.columns_at[None, :] * 1.0, kernels.rows_at[:, None] * 1.0)
        if truth.model == "down":  # alike across: the fit looks at the sum
            values = np.where(kernels.columns_at == 0, values, 0.0)
        for p, primary in enumerate(display.active_primaries):
            h[p, primary] = values
        for found in fit(dataclasses.replace(kernels, h=h), model):  # type: ignore[arg-type]
            assert (found.a, found.b) == pytest.approx((truth.a, truth.b), rel=1e-6)
            assert found.model == truth.model
            assert found.relative < 1e-7
            if truth.a_down is not None:
                assert (found.a_down, found.b_down) == pytest.approx((truth.a_down, truth.b_down), rel=1e-6)


def test_stripes_that_lie_have_the_fits_of_stripes_that_stand() -> None:
    """Along the other axis, with a box over the pixel's own column."""
    lying, standing = fit(derive(VERTICAL)), fit(derive(layout("rgb_stripe")))
    for one, other in zip(lying, standing, strict=True):
        assert (one.a, one.b, one.largest) == pytest.approx((other.a, other.b, other.largest), rel=1e-4)
        down = one.reconstruction_down(VERTICAL)
        assert down is not None
        assert down.radius == pytest.approx(other.reconstruction(layout("rgb_stripe")).radius, rel=1e-4)
        assert one.reconstruction(VERTICAL).radius == 0.5


def test_products_fit_square_grids_better_than_the_radial_model() -> None:
    """Where a color stands on a grid of its own, the radial sinc of Eq. 4.13 misses five times as much as the product; RGBW's red among them."""
    for display in (HOLE, BAYER):
        kernels = derive(display)
        for p, (product, radial) in enumerate(zip(fit(kernels), fit(kernels, "radial"), strict=True)):
            if (display.pattern == display.active_primaries[p]).sum() == 1:
                assert product.relative < 0.06
                assert radial.relative > 0.15
    kernels = derive(layout("rgbw"))
    relative = {model: [one.relative for one in fit(kernels, model)] for model in ("separable", "radial")}  # type: ignore[arg-type]
    assert relative["radial"] == pytest.approx([0.159, 0.178, 0.224, 0.145], abs=0.002)
    assert relative["separable"] == pytest.approx([0.077, 0.190, 0.245, 0.156], abs=0.002)


def test_fits_that_make_no_sense_are_said_to() -> None:
    """A kernel without zeros, without decay, of a singular system; none at all; a model that is not for the layout."""
    stripe = layout("rgb_stripe")
    assert "no zeros" in fit(derive(stripe, sensitivity=csf.exponential(10.0)))[0].warning
    wide = fit(derive(stripe, sensitivity=csf.box(3.0)))
    assert "singular" in wide[1].warning
    assert "does not decay" in wide[1].warning
    assert wide[1].a == pytest.approx(2 * math.pi * 3.0 * derive(stripe).viewing.degrees_per_pixel / 3, rel=0.03)  # the sinc that ends at 3 cpd
    assert "misses its kernel" in fit(derive(stripe, sensitivity=csf.exponential((5.0, 0.5, 0.5))))[0].warning
    kernels = derive(stripe)
    for broken in (0.0 * kernels.h, np.nan * kernels.h, -kernels.h):
        with pytest.raises(ValueError, match="not positive at its center"):
            fit(dataclasses.replace(kernels, h=broken))
    with pytest.raises(ValueError, match="expected the model across"):
        fit(kernels, "radial")
    with pytest.raises(ValueError, match="square positions"):
        fit(derive(SHIFTED), "radial")


def test_fits_of_all_own_layouts_are_usable() -> None:
    """Filters that end somewhere, also for weights with which systems are singular."""
    for display in (VERTICAL, BAYER, HOLE, SHIFTED, drawn("R G B W", cells=(4, 1))):
        size = None if display.one_dimensional else (12, 12)
        for sensitivity in (csf.exponential(), csf.box((10.0, 1.0, 1.0)), csf.gaussian(1.0)):
            filter_ = subpixel_filter("optimal", display, fit(derive(display, sensitivity=sensitivity, size=size)))
            assert min(filter_.radius) > 0.0
            assert max(filter_.radius) <= 24.0


# --- Filters ----------------------------------------------------------------------------------------------------------


def test_the_optimal_filter_is_clamped_at_zeros_of_its_sinc() -> None:
    """Two zeros of a stripe are six subpixels, two pixels; beyond, nothing; inside, the fit's values in pixels."""
    display = layout("rgb_stripe")
    for zeros in (1, 2, 4):
        for one in fit(derive(display)):
            filter_ = one.reconstruction(display, zeros)
            assert filter_.radius == pytest.approx(zeros * math.pi / one.a / 3)
            assert filter_.radius == pytest.approx(zeros, rel=0.001)
            assert filter_.weight(np.array([filter_.radius])) == pytest.approx(0.0, abs=1e-12)
            assert filter_.weight(np.array([filter_.radius * 1.0001, -5.0 * filter_.radius])) == pytest.approx([0.0, 0.0], abs=0)
            x = np.linspace(-0.99, 0.99, 40) * filter_.radius
            assert filter_.weight(x) == pytest.approx(windowed_sinc(3.0 * x, one.a, one.b), abs=1e-15)
            assert filter_.weight(x) * one.scale == pytest.approx(one.values(3.0 * x, 0.0 * x), abs=1e-15)
    with pytest.raises(ValueError, match="number 1 or a later one"):
        fit(derive(display))[0].reconstruction(display, 0)


def test_a_product_has_its_own_filter_down() -> None:
    """Of positions that are three times as high as wide: each factor in its own pixels."""
    one = Fit(1.1, 30.0, 1 / 3, 0, 0, 0, "separable", 2.9, 2.0)
    filter_ = subpixel_filter("optimal", SHIFTED, (one,) * 6, zeros=3)
    assert filter_.radius == pytest.approx((3 * math.pi / 1.1 / 3, 3 * math.pi / 2.9))
    dx, dy = np.random.default_rng(4).uniform(-1.5, 1.5, (2, 30))
    assert weights(filter_, 2, dx, dy) * one.scale == pytest.approx(one.values(3.0 * dx, dy), abs=1e-15)


def test_a_fast_gaussian_ends_a_filter_before_its_zeros() -> None:
    """A sinc so wide that its zeros are far outside of the window costs no samples there."""
    filter_ = Fit(0.01, 4.0, 1 / 3, 0, 0).reconstruction(layout("rgb_stripe"), 2)
    assert filter_.radius == pytest.approx(math.sqrt(4.0 * math.log(1e6)) / 3)


def test_windowed_sinc_at_known_points() -> None:
    """1 at 0, 0 at multiples of pi / a, the window at the sinc's first minimum; without a window the sinc."""
    assert windowed_sinc(np.array([0.0, 3.0, 6.0]), math.pi / 3, 90.0) == pytest.approx([1.0, 0.0, 0.0], abs=1e-15)
    assert windowed_sinc(np.array([4.5]), math.pi / 3, 90.0)[0] == pytest.approx(-1 / (1.5 * math.pi) * math.exp(-0.225))
    assert windowed_sinc(np.array([1.0]), 2.0, math.inf)[0] == pytest.approx(math.sin(2.0) / 2.0)


@pytest.mark.parametrize("method", SAMPLED)
@pytest.mark.parametrize("name", [*SHIPPED, "vertical"])
def test_gray_stays_gray_under_every_filter(method: str, name: str) -> None:
    """Weighted means of one color are that color, exactly, wherever the samples fell; subpixels have some samples of 16 in a pixel."""
    display = VERTICAL if name == "vertical" else layout(name)
    filter_ = subpixel_filter(method, display, fit(derive(display)) if method == "optimal" else None)
    rng = np.random.default_rng(1)
    grid = (np.stack(np.meshgrid(np.arange(-20, 20), np.arange(-20, 20)), -1).reshape(-1, 2) + rng.uniform(size=(1600, 2))) / 4.0
    for p, center in enumerate(filter_.centers()):
        w = weights(filter_, p, grid[:, 0] + 0.5 - center[0], grid[:, 1] + 0.5 - center[1])
        assert w.sum() > 0.25
        assert (w @ np.full(1600, 0.5)) / w.sum() == pytest.approx(0.5, abs=1e-15)


def test_methods_have_the_filters_that_their_names_say() -> None:
    """Radii, where they are centered, and names; the kernels are no filter of samples."""
    assert tuple(TITLES) == METHODS
    for method, radius, at_pixel in (
        ("pixel_box", (0.5, 0.5), True),
        ("pixel_mitchell", (2.0, 2.0), True),
        ("none", (1 / 12, 0.5), False),
        ("box", (0.5, 0.5), False),
        ("mitchell", (2.0, 2.0), False),
    ):
        filter_ = subpixel_filter(method, layout("rgbg"))
        assert filter_.name == method
        assert filter_.radius == pytest.approx(radius)
        assert filter_.at_pixel is at_pixel
    assert subpixel_filter("none", layout("rgbw")).radius == pytest.approx((0.25, 0.25))
    x = np.linspace(-2.0, 2.0, 9)
    assert subpixel_filter("mitchell", layout("rgbw")).across[3].weight(x) == pytest.approx(FILTERS["mitchell"].weight(x))
    optimal = subpixel_filter("optimal", layout("rgbg"), fit(derive(layout("rgbg"))))
    assert [one.radius for one in optimal.across] == pytest.approx([4.0, 2.0, 4.0, 2.0], rel=0.006)
    assert optimal.radius[1] == 0.5
    assert subpixel_filter("optimal", layout("rgbw"), fit(derive(layout("rgbw")), "radial")).down is None


def test_filters_are_centered_at_subpixels_or_pixels() -> None:
    """RGBG: every three sixths of a pixel, from the second on; or in the middle of the pixel that a subpixel's center is in."""
    centers = subpixel_filter("box", layout("rgbg")).centers()
    assert centers[:, 0] == pytest.approx([2 / 6, 5 / 6, 8 / 6, 11 / 6])
    assert centers[:, 1] == pytest.approx([0.5] * 4)
    assert subpixel_filter("pixel_box", layout("rgbg")).centers()[:, 0] == pytest.approx([0.5, 0.5, 1.5, 1.5])
    assert subpixel_filter("box", layout("rgbw")).centers() == pytest.approx(np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]))


def test_filters_that_do_not_exist_are_refused() -> None:
    """With what was expected."""
    display = layout("rgbg")
    with pytest.raises(ValueError, match="no filter of samples"):
        subpixel_filter("kernels", display)
    with pytest.raises(ValueError, match="known: pixel_box"):
        subpixel_filter("lanczos", display)
    for fits in (None, fit(derive(layout("rgb_stripe")))):
        with pytest.raises(ValueError, match="fits of its 4 subpixels"):
            subpixel_filter("optimal", display, fits)
    with pytest.raises(ValueError, match="expected 4 filters"):
        SubpixelFilter("odd", display, (FILTERS["box"],) * 4, (FILTERS["box"],) * 3)


# --- Spectra ----------------------------------------------------------------------------------------------------------


def test_cross_kernels_of_the_stripe_peak_at_16_cycles_per_degree() -> None:
    """The thesis's 16: half a cycle per pixel, 15.8 here; own kernels pass what is slow, all of it, and nothing of the pixels' own frequency."""
    kernels = derive(layout("rgb_stripe"))
    half = 0.5 / kernels.viewing.degrees_per_pixel
    assert half == pytest.approx(16.0, rel=0.02)
    for p in range(3):
        for d in range(3):
            frequency, magnitude = spectrum(kernels, p, d)
            assert frequency[-1] == pytest.approx(3 * half)
            if p == d:
                assert magnitude[0] == pytest.approx(1.0, abs=1e-5)
                assert magnitude[np.searchsorted(frequency, half)] == pytest.approx(0.5, abs=0.05)
                assert magnitude[frequency > 1.6 * half].max() < 0.02
            else:
                assert peak(kernels, p, d) == pytest.approx(half, abs=kernels.step[1])
                assert magnitude[0] < 1e-5


def test_the_spectrum_is_that_of_a_wave_through_the_kernel() -> None:
    """A cosine of one frequency along each axis comes out with the magnitude that the spectrum has there."""
    for name, axis in (("rgbg", "across"), ("rgbw", "across"), ("rgbw", "down")):
        kernels = derive(layout(name))
        at = kernels.columns_at if axis == "across" else kernels.rows_at
        wave = np.exp(2j * np.pi * 7 * at / len(at))
        through = (kernels.h[1, 2] * (wave if axis == "across" else wave[:, None])).sum()
        frequency, magnitude = spectrum(kernels, 1, 2, axis)  # type: ignore[arg-type]
        assert magnitude[7] == pytest.approx(abs(through), abs=1e-12)
        cells = kernels.layout.cells[0 if axis == "across" else 1]
        assert frequency[7] == pytest.approx(7 / len(at) * cells / kernels.viewing.degrees_per_pixel)
    with pytest.raises(ValueError, match="in one dimension"):
        spectrum(derive(layout("rgbg")), 0, 0, "down")


@pytest.mark.parametrize("name", SHIPPED)
def test_the_clamped_filter_converges_to_the_unclamped_one(name: str) -> None:
    """In its response, with every zero that is added; after many zeros nothing is missing."""
    kernels = derive(layout(name))
    frequency = np.linspace(0.0, 40.0, 81)
    for one in fit(kernels):
        whole = fitted_spectrum(one, layout(name), kernels.viewing, frequency)
        off = [1e-9 + np.abs(fitted_spectrum(one, layout(name), kernels.viewing, frequency, zeros) - whole).max() for zeros in (1, 2, 4, 6, 12)]
        assert whole[0] == pytest.approx(1.0, abs=1e-12)
        assert off == pytest.approx(sorted(off, reverse=True), rel=1e-3)
        assert off[-1] < 1e-4 < off[0]


def test_the_unclamped_filter_has_the_spectrum_of_its_kernel() -> None:
    """Within the fit's residual; a windowed sinc's is a box smoothed by a Gaussian, in closed form."""
    kernels = derive(layout("rgb_stripe"))
    for p, one in enumerate(fit(kernels)):
        frequency, magnitude = spectrum(kernels, p, p)
        found = fitted_spectrum(one, kernels.layout, kernels.viewing, frequency)
        inside = frequency < 1.4 / kernels.viewing.degrees_per_pixel  # of half a cycle per position the kernel has its own fold
        assert np.abs(found - magnitude)[inside].max() < 0.03
        omega = 2 * math.pi * frequency * kernels.viewing.degrees_per_pixel / 3
        smooth = [math.erf((one.a - w) * math.sqrt(one.b) / 2) + math.erf((one.a + w) * math.sqrt(one.b) / 2) for w in omega]
        assert found == pytest.approx(np.array(smooth) / smooth[0], abs=1e-5)


def test_spectra_of_the_other_axis_and_of_radial_filters() -> None:
    """A box of a pixel down; the product's other factor; the radial filter's is the same along both axes."""
    viewing = Viewing()
    frequency = np.linspace(0.0, 40.0, 9)
    stripe, rgbw = layout("rgb_stripe"), layout("rgbw")
    box = fitted_spectrum(fit(derive(stripe))[0], stripe, viewing, frequency, axis="down")
    assert box == pytest.approx(np.abs(np.sinc(frequency * viewing.degrees_per_pixel)))
    product = Fit(1.5, 9.0, 0.25, 0, 0, 0, "separable", 1.7, 20.0)
    turned = Fit(1.7, 20.0, 0.25, 0, 0, 0, "separable", 1.5, 9.0)
    assert fitted_spectrum(product, rgbw, viewing, frequency, 2, "down") == pytest.approx(fitted_spectrum(turned, rgbw, viewing, frequency, 2))
    radial = Fit(1.7, 6.0, 0.25, 0, 0, 0, "radial")
    across = fitted_spectrum(radial, rgbw, viewing, frequency, 2)
    assert across == pytest.approx(fitted_spectrum(radial, rgbw, viewing, frequency, 2, "down"))
    filter_ = radial.reconstruction(rgbw, 2)
    x = (np.arange(400) + 0.5) / 400 * 2 - 1
    w = filter_.weight(np.hypot(*np.meshgrid(x * filter_.radius, x * filter_.radius)))
    direct = np.abs(np.cos(2 * math.pi * np.outer(frequency * viewing.degrees_per_pixel, x * filter_.radius)) @ w.sum(axis=0)) / w.sum()
    assert across == pytest.approx(direct, abs=2e-3)
