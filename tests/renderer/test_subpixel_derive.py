"""Subpixel kernels: exact reproduction, the dense solve, what constant images become, closed-form limits, and the symmetries of displays."""

import dataclasses
import re

import numpy as np
import pytest

from queries.subpixel.description import LayoutDescription, layout, shipped_layouts
from renderer.filters.subpixel import sensitivity as csf
from renderer.filters.subpixel.derive import Kernels, derive
from renderer.filters.subpixel.layout import OPPONENT_RGB, PRIMARIES, Layout, stripe
from renderer.filters.subpixel.viewing import Viewing
from tests.renderer.dense_subpixel import apply_kernels, dense_solution

SHIPPED = tuple(shipped_layouts())
CONSTANT = csf.table([0.0], [[1.0]] * 3)  # W of white noise: errors count alike at all frequencies
ONLY_MEANS = csf.table([0.0, 1e-6], [[1.0, 0.0]] * 3)


def drawn(*rows: str, cells: tuple[int, int]) -> Layout:
    """A layout of one's own."""
    return LayoutDescription(pattern=list(rows), cells=cells).layout("drawn")


BAYER = drawn("R G", "G B", cells=(2, 2))
HOLE = drawn("R G", "B .", cells=(2, 2))
SHIFTED = drawn("R G B", "B R G", cells=(3, 1))
VERTICAL = drawn("R", "G", "B", cells=(1, 3))
STRIPE_W = drawn("R G B W", cells=(4, 1))
EIGHTH = drawn("R G B G", "B G R G", cells=(2, 2))
OWN = {"bayer": BAYER, "hole": HOLE, "shifted": SHIFTED, "vertical": VERTICAL, "stripe_w": STRIPE_W, "eighth": EIGHTH}
ALL = {**{name: layout(name) for name in SHIPPED}, **OWN}


def shown(display: Layout, rows: int, columns: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A random image that the display can show: its drive, and its signal, which has light at lit positions alone, brighter by the spacing."""
    pattern = np.tile(display.pattern, (rows // display.pattern.shape[0], columns // display.pattern.shape[1]))
    alpha = np.where(pattern >= 0, rng.uniform(-1.0, 2.0, pattern.shape), 0.0)
    signal = np.zeros((*pattern.shape, len(display.primaries)))
    for d in range(len(display.primaries)):
        signal[pattern == d, d] = alpha[pattern == d] * display.period / (display.pattern == d).sum()
    return alpha, signal


# --- The exact test ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHIPPED)
def test_an_image_that_the_display_can_show_is_reproduced(name: str) -> None:
    """To 1e-12, for the default size, by the kernels as they are applied."""
    display = layout(name)
    kernels = derive(display, size=None if display.one_dimensional else (24, 24))
    alpha, signal = shown(display, *kernels.h.shape[2:], np.random.default_rng(7))
    assert not kernels.singular
    np.testing.assert_allclose(apply_kernels(kernels, signal), alpha, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ALL)
def test_kernels_vanish_where_they_land_on_their_own_color(name: str) -> None:
    """h_pp(0) = 1 / s; h_pp at other positions of the color of d = p, and cross kernels there, are 0."""
    kernels = derive(ALL[name])
    display = kernels.layout
    rows, columns = display.pattern.shape
    for p, (row, column) in enumerate(display.active):
        landing = display.pattern[(row + kernels.rows_at[:, None]) % rows, (column + kernels.columns_at) % columns]
        for d in range(len(display.primaries)):
            wanted = np.zeros(landing.shape)
            if d == display.active_primaries[p]:
                wanted[(kernels.rows_at == 0)[:, None] & (kernels.columns_at == 0)] = 1.0 / display.spacing[p]
            np.testing.assert_allclose(kernels.h[p, d][landing == d], wanted[landing == d], rtol=0, atol=1e-12)


# --- The dense solve --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("rgb_stripe", (1, 30)),
        ("bgr_stripe", (1, 33)),
        ("rgbg", (1, 60)),
        ("stripe_w", (1, 32)),
        ("rgbw", (8, 12)),
        ("bayer", (10, 6)),
        ("hole", (6, 8)),
        ("shifted", (4, 15)),
        ("vertical", (15, 4)),
        ("eighth", (4, 12)),
    ],
)
def test_kernels_are_those_of_the_dense_solve(name: str, size: tuple[int, int]) -> None:
    """C_d = A^-1 B_d entry by entry, for odd and even sizes, unlike channels and an unusual viewer."""
    viewing, sensitivity = Viewing(90.0, 40.0), csf.exponential((2.5, 2.0, 3.0))
    kernels = derive(ALL[name], viewing, sensitivity, size)
    solution, active = dense_solution(ALL[name], viewing, sensitivity, *size)
    pattern_rows, pattern_columns = ALL[name].pattern.shape
    first = {(int(row), int(column)): p for p, (row, column) in enumerate(ALL[name].active)}
    scale = np.abs(solution).max()
    for i, position in enumerate(active):
        row, column = divmod(int(position), size[1])
        p = first[row % pattern_rows, column % pattern_columns]
        rolled = np.roll(kernels.h[p], (row + int(kernels.rows_at[0]), column + int(kernels.columns_at[0])), axis=(1, 2))
        np.testing.assert_allclose(rolled, solution[i].reshape(-1, *size), rtol=0, atol=1e-6 * scale)


def test_kernels_make_the_error_least() -> None:
    """Any other drive of a random image has a larger error, Eq. 4.4: the gradient of the cost vanishes."""
    display, sensitivity, rng = layout("rgbg"), csf.exponential((2.3, 1.5, 4.0)), np.random.default_rng(3)
    kernels = derive(display, sensitivity=sensitivity, size=(1, 120))
    signal = rng.uniform(0.0, 1.0, (1, 120, 3))
    alpha = apply_kernels(kernels, signal)

    def cost(drive: np.ndarray) -> float:
        pattern = np.tile(display.pattern, (1, 10))
        light = np.zeros((1, 120, 3))
        for d in range(3):
            light[..., d] = np.where(pattern == d, drive * 12 / (display.pattern == d).sum(), 0.0)
        error = np.fft.fft((light - signal)[0] @ display.opponent.T, axis=0)
        frequency = np.abs(np.fft.fftfreq(120)) * 6 / kernels.viewing.degrees_per_pixel
        return float((sensitivity.weights(frequency) * np.abs(error.T) ** 2).sum())

    best = cost(alpha)
    for _ in range(5):
        change = np.where(np.tile(display.pattern, (1, 10)) >= 0, rng.normal(size=(1, 120)), 0.0)
        more, less = cost(alpha + 1e-3 * change), cost(alpha - 1e-3 * change)
        assert more > best
        assert less > best
        assert abs(more - less) < 1e-6 * (more + less - 2 * best) + 1e-9 * best


# --- Constant images --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "tint"), [("rgb_stripe", 1e-5), ("bgr_stripe", 1e-5), ("rgbw", 1e-5), ("rgbg", 0.0094), ("bayer", 1e-5)])
def test_gray_stays_gray(name: str, tint: float) -> None:
    """White, and with it every gray, keeps its color: but for RGBG, whose red repeats in every other pixel, which the sensitivity still sees."""
    kernels = derive(ALL[name])
    assert np.abs(kernels.white - 1.0).max() < tint
    alpha = apply_kernels(kernels, np.broadcast_to(ALL[name].signal(np.full(3, 0.5)), (*kernels.h.shape[2:], len(ALL[name].primaries))))
    light = sum(
        ALL[name].light()[d] * alpha[np.tile(ALL[name].pattern, np.array(alpha.shape) // ALL[name].pattern.shape) == d].mean()
        for d in range(len(ALL[name].primaries))
    )
    np.testing.assert_allclose(light, 0.5 * kernels.white, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["rgb_stripe", "rgbg", "rgbw", "bayer", "stripe_w"])
def test_sums_of_kernels_are_the_optimum_for_constant_images(name: str) -> None:
    """They solve the small problem at the frequencies of the pattern itself, so sums other than 1 and 0 belong to the recipe."""
    kernels = derive(ALL[name])
    display = kernels.layout
    rows, columns = display.pattern.shape
    f_row, f_column = (np.array([min(j, n - j) for j in range(n)]) / n * c for n, c in ((rows, display.cells[1]), (columns, display.cells[0])))
    root = np.sqrt(kernels.sensitivity.weights(np.hypot(f_row[:, None], f_column) / kernels.viewing.degrees_per_pixel))
    turn = np.exp(-2j * np.pi * (np.outer(np.arange(rows), display.active[:, 0]) / rows)[:, None])
    turn = turn * np.exp(-2j * np.pi * np.outer(np.arange(columns), display.active[:, 1]) / columns)
    seen = root[..., None] * turn * (display.spacing * display.opponent[:, display.active_primaries])[:, None, None]
    constant = np.zeros((*root.shape, len(display.primaries)))
    constant[:, 0, 0] = root[:, :1, 0] * display.opponent * display.period
    wanted = np.linalg.lstsq(seen.reshape(-1, len(display.active)), constant.reshape(-1, len(display.primaries)).astype(complex), rcond=None)[0]
    np.testing.assert_allclose(kernels.h.sum(axis=(2, 3)), wanted.real, rtol=0, atol=1e-9)


def test_sums_go_to_one_as_the_viewer_steps_back() -> None:
    """What keeps RGBG from summing to 1 is that the pattern of its red is visible."""
    off = [np.abs(derive(layout("rgbg"), Viewing(100.0, distance)).white - 1.0).max() for distance in (30.0, 46.0, 70.0, 100.0)]
    assert off == sorted(off, reverse=True)
    assert off[0] > 0.05
    assert off[-1] < 1e-5


def test_colors_keep_their_light_as_signals() -> None:
    """What W is given is taken from the others: any color is the same light."""
    rgb = np.random.default_rng(2).uniform(0.0, 1.0, (50, 3))
    for name in SHIPPED:
        np.testing.assert_allclose(layout(name).signal(rgb) @ layout(name).light(), rgb, atol=1e-12)
    display = layout("rgbw")
    assert display.white_share == pytest.approx(0.37 / 0.66)
    assert display.signal(np.ones((1, 3), np.float32)).dtype == np.float32
    bright = dataclasses.replace(display, opponent=display.opponent * [1, 1, 1, 3])
    np.testing.assert_allclose(bright.signal(rgb) @ bright.light(), rgb, atol=1e-12)
    assert bright.signal(rgb).min() > -1e-15


# --- Limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
def test_white_noise_weights_leave_no_freedom_in_space(name: str) -> None:
    """Errors count alike everywhere, so A is diagonal: each subpixel shows the projection of its own position, (m_p . m_d) / (s |m_p|²)."""
    kernels = derive(ALL[name], sensitivity=CONSTANT, size=None if ALL[name].one_dimensional else tuple(4 * n for n in ALL[name].pattern.shape))
    display = kernels.layout
    own = display.opponent[:, display.active_primaries]
    wanted = np.zeros(kernels.h.shape)
    center = (int(np.flatnonzero(kernels.rows_at == 0)[0]), int(np.flatnonzero(kernels.columns_at == 0)[0]))
    wanted[:, :, center[0], center[1]] = own.T @ display.opponent / (display.spacing * (own**2).sum(axis=0))[:, None]
    np.testing.assert_allclose(kernels.h, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ALL)
def test_weights_at_frequency_zero_alone_show_the_mean(name: str) -> None:
    """All other frequencies are open and stay dark: each subpixel shows the mean of its color over the whole signal (with W: of a mixture)."""
    display = ALL[name]
    kernels = derive(display, sensitivity=ONLY_MEANS, size=None if display.one_dimensional else tuple(4 * n for n in display.pattern.shape))
    total = display.opponent[:, display.active_primaries] * display.spacing
    mixture = np.linalg.pinv(total) @ display.opponent * display.period
    if "W" not in display.primaries:  # as many equations as colors: subpixels of one color share it
        np.testing.assert_allclose(mixture, display.active_primaries[:, None] == np.arange(3), atol=1e-12)
    np.testing.assert_allclose(kernels.h, np.broadcast_to(mixture[..., None, None], kernels.h.shape) / kernels.h[0, 0].size, rtol=0, atol=1e-12)
    assert kernels.deficient >= kernels.residues - 1
    assert kernels.unseen == kernels.residues - 1
    assert "singular" in kernels.warnings()[0]


def test_the_length_of_the_signal_only_folds_kernels() -> None:
    """Kernels of N positions are those of 2 N, wrapped around: exactly; and they have decayed long before."""
    for name, short in (("rgb_stripe", (1, 150)), ("rgbg", (1, 120)), ("rgbw", (12, 16))):
        display = layout(name)
        small, large = derive(display, size=short), derive(display, size=(short[0] * (1 if display.one_dimensional else 2), short[1] * 2))
        folded = np.zeros(small.h.shape)
        row, column = (large.rows_at - small.rows_at[0]) % short[0], (large.columns_at - small.columns_at[0]) % short[1]
        np.add.at(folded, (slice(None), slice(None), row[:, None], column), large.h)
        np.testing.assert_allclose(folded, small.h, rtol=0, atol=1e-12)
    stripes = [derive(layout("rgb_stripe"), size=(1, n)) for n in (150, 600)]
    np.testing.assert_allclose(stripes[0].h[..., 75 - 12 : 75 + 13], stripes[1].h[..., 300 - 12 : 300 + 13], atol=1e-5)


def test_viewing_enters_as_the_angle_of_a_pixel_alone() -> None:
    """Twice the resolution seen from nearly half the distance, and weights that scale with frequency, are the same problem."""
    near, far = Viewing(100.0, 46.0), Viewing(100.0, 92.0)
    scale = near.degrees_per_pixel / far.degrees_per_pixel
    assert derive(layout("rgbg"), far, csf.exponential(2.3 * scale)).h == pytest.approx(derive(layout("rgbg"), near).h, abs=1e-12)
    assert Viewing(200.0, 23.0).degrees_per_pixel == pytest.approx(near.degrees_per_pixel, rel=1e-12)
    steps = derive(layout("rgb_stripe")).step  # 300 subpixels: Δf = 0.32 cycles per degree, and 16 of them per cycle of a pixel pair
    assert steps[1] * 50 == pytest.approx(16.0, rel=0.015)


# --- Symmetries -------------------------------------------------------------------------------------------------------


def reflected(kernels: Kernels, axis: int) -> np.ndarray:
    """h at the opposite offsets along an axis of (…, rows, columns)."""
    size = kernels.h.shape[axis]
    return np.take(kernels.h, (-np.arange(size) - 2 * (kernels.columns_at if axis == 3 else kernels.rows_at)[0]) % size, axis=axis)


def test_bgr_is_rgb_in_a_mirror() -> None:
    """A display that is turned around has mirrored kernels."""
    rgb, bgr = derive(layout("rgb_stripe")), derive(layout("bgr_stripe"))
    np.testing.assert_allclose(bgr.h[::-1], reflected(rgb, 3), rtol=0, atol=1e-13)


def test_displays_that_are_their_own_mirror_image_have_even_kernels() -> None:
    """RGBG about its red: red and blue are even, and the greens each other's mirror. RGBW: all, along both axes."""
    rgbg, rgbw = derive(layout("rgbg")), derive(layout("rgbw"))
    np.testing.assert_allclose(reflected(rgbg, 3), rgbg.h[[0, 3, 2, 1]], rtol=0, atol=1e-12)
    for axis in (2, 3):
        np.testing.assert_allclose(reflected(rgbw, axis), rgbw.h, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("name", "shift"), [("rgb_stripe", (0, 1)), ("rgbg", (0, 5)), ("rgbw", (1, 0)), ("rgbw", (1, 1)), ("eighth", (1, 3))])
def test_where_a_period_begins_does_not_matter(name: str, shift: tuple[int, int]) -> None:
    """Rolling the pattern renumbers the subpixels."""
    display = ALL[name]
    rolled = dataclasses.replace(display, pattern=np.roll(display.pattern, shift, axis=(0, 1)))
    size = None if display.one_dimensional else (12, 12)
    before, after = derive(display, size=size), derive(rolled, size=size)
    moved = [tuple(p) for p in (display.active + shift) % display.pattern.shape]
    order = [moved.index(tuple(p)) for p in rolled.active]
    np.testing.assert_allclose(after.h, before.h[order], rtol=0, atol=1e-10)


def test_exchanged_roles_exchange_kernels() -> None:
    """Primaries that trade places in the pattern and in the opponent matrix trade their kernels."""
    swap = [1, 0, 2]
    for name in ("rgb_stripe", "rgbg"):
        display = layout(name)
        pattern = np.where(display.pattern >= 0, np.array(swap)[display.pattern], display.pattern)
        traded = dataclasses.replace(display, pattern=pattern, opponent=display.opponent[:, swap])
        np.testing.assert_allclose(derive(traded).h, derive(display).h[:, swap], rtol=0, atol=1e-12)


def test_a_display_on_its_side_has_transposed_kernels() -> None:
    """RGBW transposed has G and B in each other's place; stripes that lie are stripes that stand, to images that change along them alone."""
    upright = derive(layout("rgbw"), size=(12, 16))
    lying = derive(dataclasses.replace(layout("rgbw"), pattern=layout("rgbw").pattern.T.copy()), size=(16, 12))
    order = [0, 2, 1, 3]
    np.testing.assert_allclose(np.swapaxes(lying.h, 2, 3), upright.h[order], rtol=0, atol=1e-10)
    down, across = derive(VERTICAL, size=(72, 4)), derive(layout("rgb_stripe"), size=(1, 72))
    np.testing.assert_allclose(down.h.sum(axis=3), across.h[:, :, 0], rtol=0, atol=1e-12)


def test_weights_have_no_unit() -> None:
    """Three thousand times the weights, or all of a far viewer's, which are tiny: the same kernels, exact as ever."""
    display, base = layout("rgb_stripe"), csf.exponential()
    scaled = csf.Sensitivity("scaled", tuple((lambda f, w=w: 3e3 * w(f)) for w in base.weight))  # type: ignore[arg-type]
    np.testing.assert_allclose(derive(display, sensitivity=scaled).h, derive(display).h, rtol=0, atol=1e-13)
    far = derive(display, Viewing(100.0, 1500.0))
    assert not far.singular
    assert far.own(0).max() == pytest.approx(1 / 3, abs=1e-12)


# --- Conditioning -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rgb_stripe", "rgbg", "rgbw", "bayer", "stripe_w"])
@pytest.mark.parametrize(
    "sensitivity",
    [csf.box((10.0, 1.0, 1.0)), csf.box(3.0), csf.gaussian(1.0), csf.gaussian((5.0, 1.0, 1.0)), csf.exponential(0.2)],
    ids=lambda s: s.name,
)
def test_singular_systems_have_sane_kernels_and_are_named(name: str, sensitivity: csf.Sensitivity) -> None:
    """Finite, no larger than the signal times a few, means kept; whoever is not warned has exact kernels."""
    kernels = derive(ALL[name], sensitivity=sensitivity, size=None if ALL[name].one_dimensional else (24, 24))
    assert np.isfinite(kernels.h).all()
    assert np.isfinite(kernels.condition)
    assert np.abs(kernels.h).max() < 3.0
    assert np.abs(kernels.white - 1.0).max() < 0.01
    text = " ".join(kernels.warnings())
    assert kernels.singular == ("is singular for" in text)
    if kernels.singular:
        assert f"{kernels.deficient} of {kernels.residues} residues" in text
        assert sensitivity.name in text
    else:
        alpha, signal = shown(ALL[name], *kernels.h.shape[2:], np.random.default_rng(5))
        np.testing.assert_allclose(apply_kernels(kernels, signal), alpha, rtol=0, atol=1e-6)


def test_which_residues_are_singular_can_be_counted() -> None:
    """A box that ends at 10 cycles per degree for luminance and at 1 for color settles the stripe below 1 alone, and weighs nothing above 10."""
    kernels = derive(layout("rgb_stripe"), sensitivity=csf.box((10.0, 1.0, 1.0)))
    begins = np.minimum(np.arange(100), 100 - np.arange(100)) * kernels.step[1]  # the pattern's own frequency is 31.6
    assert kernels.deficient == (begins > 1.0).sum()
    assert kernels.unseen == (begins > 10.0).sum()
    assert kernels.open == pytest.approx((begins[begins > 1.0].min(), begins.max()))
    numbers = re.findall(r"[\d.]+", kernels.warnings()[0])
    assert float(numbers[0]) == kernels.deficient
    assert "weighs none of their errors" in derive(layout("rgb_stripe"), sensitivity=csf.box(3.0)).warnings()[0]


def test_a_box_that_does_not_see_color_gives_the_smallest_drive() -> None:
    """Luminance alone counts, up to a frequency: the pseudo-inverse spreads it over the subpixels by their luminance."""
    seen = csf.table([0.0], [[1.0], [0.0], [0.0]])
    kernels = derive(layout("rgb_stripe"), sensitivity=csf.Sensitivity("luminance", (csf.box(12.0).weight[0], *seen.weight[1:])))
    luminance = OPPONENT_RGB[0]
    np.testing.assert_allclose(kernels.h.sum(axis=(2, 3)), np.outer(luminance, luminance) / (luminance**2).sum(), atol=1e-9)


def test_kernels_that_darken_or_overdrive_are_warned_of() -> None:
    """From so near that the pattern is seen, white is dimmed; color that hardly counts is traded for overdrive. Of the defaults only RGBW's W is."""
    for name in SHIPPED:
        kernels = derive(layout(name))
        assert kernels.white_drive[0] == pytest.approx(
            apply_kernels(kernels, np.ones((*kernels.h.shape[2:], 1)) * layout(name).signal(np.ones(3)))[tuple(layout(name).active[0])]
        )
        if name == "rgbw":
            assert kernels.white_drive == pytest.approx([0.275, 0.275, 0.275, 1.295], abs=0.002)
            assert "white drives W to 1.29" in " ".join(kernels.warnings())
        else:
            assert kernels.warnings() == ()
    near = derive(layout("rgbg"), Viewing(100.0, 10.0))
    assert "white is shown as" in " ".join(near.warnings())
    assert near.white.max() < 0.9
    loud = derive(layout("rgb_stripe"), sensitivity=csf.exponential((2.3, 1.0, 0.5)))
    assert loud.gain == pytest.approx(np.abs(loud.h).sum(axis=(1, 2, 3)).max())
    assert "times the signal" in " ".join(loud.warnings())


# --- Refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pattern": np.array([[0, 1, 3]])}, "rectangle of primaries"),
        ({"pattern": np.array([0, 1, 2])}, "rectangle of primaries"),
        ({"pattern": np.array([[0, 1, 1]])}, "has no B"),
        ({"primaries": ("R", "B", "G")}, "primaries R, G, B"),
        ({"cells": (2, 1)}, "whole pixels"),
        ({"cells": (0, 1)}, "whole pixels"),
        ({"origin": (float("nan"), 0.5)}, "finite origin"),
        ({"opponent": OPPONENT_RGB[:2]}, "opponent matrix"),
        ({"opponent": OPPONENT_RGB * np.nan}, "opponent matrix"),
        ({"extent": ((1, 1), (1, 1), (0, 1))}, "width and a height"),
    ],
)
def test_layouts_that_do_not_fit_together_are_refused(change: dict[str, object], words: str) -> None:
    """With what is wrong."""
    with pytest.raises(ValueError, match=words):
        dataclasses.replace(stripe("broken", "RGB"), **change)  # type: ignore[arg-type]


def test_a_w_without_light_is_refused() -> None:
    """Nothing could be given to it."""
    display = layout("rgbw")
    for columns in ([1, 1, 1, 0], [0, 0, 0, 1], [1, 1, 1, -1]):
        with pytest.raises(ValueError, match="W has a luminance"):
            dataclasses.replace(display, opponent=display.opponent * columns)


def test_other_arguments_that_make_no_sense_are_refused() -> None:
    """Sizes, viewers, and weights."""
    display = layout("rgb_stripe")
    assert display.primaries == PRIMARIES[:3]
    for size in ((1, 100), (1, 0), (2, 300), (0, 300)):
        with pytest.raises(ValueError, match="whole periods"):
            derive(display, size=size)
    for dpi, distance in ((0.0, 46.0), (100.0, -1.0), (float("nan"), 46.0), (100.0, float("inf"))):
        with pytest.raises(ValueError, match="positive distance"):
            Viewing(dpi, distance)
    for constants in (0.0, -1.0, float("nan"), (1.0, 2.0, float("inf"))):
        with pytest.raises(ValueError, match="positive constants"):
            csf.gaussian(constants)
    for frequency, weights in (([0, 0], [[1, 1]] * 3), ([0, 1], [[1, 1]] * 2), ([], [[]] * 3), ([0, float("nan")], [[1, 1]] * 3)):
        with pytest.raises(ValueError, match="ascending frequencies"):
            csf.table(frequency, weights)
    with pytest.raises(ValueError, match="as many weights"):
        csf.table([0.0, 1.0], [[1.0, 1.0], [1.0, 1.0], [1.0]])
    for value in (-1.0, float("nan"), 0.0):
        with pytest.raises(ValueError, match="some that are positive"):
            csf.table([0.0], [[value]] * 3)
        with pytest.raises(ValueError, match="non-negative"):
            derive(display, sensitivity=csf.Sensitivity("odd", (lambda f, value=value: np.full_like(f, value),) * 3))
