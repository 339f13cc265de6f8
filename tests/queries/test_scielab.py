"""S-CIELAB: published CIELAB values in uniform areas, the Gaussians' transfer functions for gratings, and blurs by another route."""

import numpy as np
import numpy.typing as npt
import pytest
from scipy.ndimage import gaussian_filter

from queries.errors import QueryError
from queries.subpixel.scielab import BLURS, OPPONENT_OF_RGB, WHITE, appearance, blurred, cielab, scielab, summary, transfer

F32 = npt.NDArray[np.float32]
DEGREES = 0.005  # a sample: 100 cycles per degree at most
ROWS, COLUMNS = 48, 80
XYZ = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])

# Linear sRGB -> CIELAB of D65, as published (Lindbloom's calculator)
PUBLISHED = {
    "red": ((1, 0, 0), (53.2408, 80.0925, 67.2032)),
    "green": ((0, 1, 0), (87.7347, -86.1827, 83.1793)),
    "blue": ((0, 0, 1), (32.2970, 79.1875, -107.8602)),
    "white": ((1, 1, 1), (100.0, 0.0, 0.0)),
    "black": ((0, 0, 0), (0.0, 0.0, 0.0)),
    "gray of 18.42 %": ((0.184187,) * 3, (50.0, 0.0, 0.0)),
}


def uniform(*rgb: float) -> F32:
    return np.tile(np.array(rgb, np.float32), (ROWS, COLUMNS, 1))


def grating(channel: int, down: int, across: int, amplitude: float) -> F32:
    """A gray picture with a cosine, mirrored at its edges, in one opponent channel: half periods over the picture, down and across."""
    wave = np.cos(np.pi * down * (np.arange(ROWS) + 0.5) / ROWS)[:, None] * np.cos(np.pi * across * (np.arange(COLUMNS) + 0.5) / COLUMNS)
    opponent = np.tile(OPPONENT_OF_RGB @ np.full(3, 0.5), (ROWS, COLUMNS, 1))
    opponent[..., channel] += amplitude * wave
    return (opponent @ np.linalg.inv(OPPONENT_OF_RGB).T).astype(np.float32)


def expected_transfer(channel: int, squared_frequency: float) -> float:
    """Fourier transform of Σ w exp(-r² / s²) / (π s²), in cycles per degree, over its value at 0."""
    terms = [(w, s) for w, s in BLURS[channel]]
    return sum(w * np.exp(-(np.pi**2) * s * s * squared_frequency) for w, s in terms) / sum(w for w, _ in terms)


@pytest.mark.parametrize("name", PUBLISHED)
def test_uniform_pictures_have_the_published_cielab(name: str) -> None:
    rgb, lab = PUBLISHED[name]
    np.testing.assert_allclose(appearance(uniform(*rgb), DEGREES), np.broadcast_to(lab, (ROWS, COLUMNS, 3)), atol=2e-3)
    np.testing.assert_allclose(scielab(uniform(*rgb), uniform(0, 0, 0), DEGREES), np.linalg.norm(lab), atol=2e-3)


def test_cielab_is_smooth_where_it_turns_linear_and_goes_on_below_zero() -> None:
    edge = (6 / 29) ** 3
    just = cielab(np.array([[edge * (1 - 1e-9)] * 3, [edge * (1 + 1e-9)] * 3]))
    np.testing.assert_allclose(just[0], just[1], atol=1e-5)
    np.testing.assert_allclose(just[0, 0], 8.0, atol=1e-5)  # L* = 8 there
    np.testing.assert_allclose(cielab(np.full(3, -0.001))[0], -0.001 * (29 / 3) ** 3, rtol=1e-5)


def test_equal_pictures_do_not_differ_and_order_does_not_matter() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.random((2, ROWS, COLUMNS, 3), np.float32)
    assert scielab(a, a, DEGREES).max() == 0.0
    np.testing.assert_array_equal(scielab(a, b, DEGREES), scielab(b, a, DEGREES))


def test_blurs_are_those_of_the_authors_software() -> None:
    """It has full widths at half maximum, which differ from the paper's spreads by 6 % at most, and weights that are normalized to five digits."""
    widths = ((0.05, 0.225, 7.0), (0.0685, 0.826), (0.0920, 0.6451))
    weights = ((1.00327, 0.114416, -0.117686), (0.616725, 0.383275), (0.567885, 0.432115))
    for blur, width, weight in zip(BLURS, widths, weights, strict=True):
        assert [2.0 * np.sqrt(np.log(2.0)) * s for _, s in blur] == pytest.approx(width, rel=0.065)
        assert [w / sum(v for v, _ in blur) for w, _ in blur] == pytest.approx(weight, abs=2e-3)


def test_opponent_channels_of_white_and_of_primaries() -> None:
    """White is light and hardly colored; red is on one side of green, blue of yellow."""
    white, red, green, blue = (OPPONENT_OF_RGB @ np.array(color) for color in ((1, 1, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    assert white == pytest.approx([0.871, -0.053, 0.037], abs=1e-3)
    assert np.abs(white[1:]).max() < 0.1 * white[0]
    assert red[1] < 0.0 < green[1]  # the software's red is negative
    assert green[2] < 0.0 < blue[2]


@pytest.mark.parametrize("channel", [0, 1, 2])
@pytest.mark.parametrize(("down", "across"), [(0, 0), (0, 1), (0, 5), (3, 0), (4, 7)])
def test_gratings_are_scaled_by_the_transfer_function(channel: int, down: int, across: int) -> None:
    squared = (down / (2 * ROWS * DEGREES)) ** 2 + (across / (2 * COLUMNS * DEGREES)) ** 2
    expected = expected_transfer(channel, squared)
    before = grating(channel, down, across, 0.2) @ OPPONENT_OF_RGB.T.astype(np.float32)
    after = blurred(before, DEGREES)
    base = OPPONENT_OF_RGB @ np.full(3, 0.5)
    np.testing.assert_allclose(after - base, (before - base) * np.where(np.arange(3) == channel, expected, 0.0), atol=3e-6)

    # and the difference that is seen is that of the scaled grating
    seen = cielab((base + (before - base) * expected) @ np.linalg.inv(OPPONENT_OF_RGB @ np.linalg.inv(XYZ)).T / WHITE)
    gray = cielab(np.full(3, 0.5))
    found = scielab(grating(channel, down, across, 0.2), uniform(0.5, 0.5, 0.5), DEGREES)
    np.testing.assert_allclose(found, np.linalg.norm(seen - gray, axis=2), atol=5e-3)


def test_color_vanishes_before_luminance() -> None:
    f = np.array([2.0, 4.0, 8.0, 16.0, 24.0])
    luminance, red_green, blue_yellow = (transfer(c, np.zeros(1), f)[0] for c in range(3))
    assert (red_green < luminance).all()
    assert (blue_yellow < red_green).all()
    assert transfer(0, np.zeros(1), np.array([0.5]))[0] > 1.0  # the surround's negative weight: a band is raised
    np.testing.assert_allclose(luminance[3] / red_green[3], expected_transfer(0, 256.0) / expected_transfer(1, 256.0), rtol=1e-12)


def test_blur_equals_convolution_of_the_mirrored_picture() -> None:
    """The same sums of Gaussians by direct convolution with sampled Gaussians, edges mirrored; the widest reaches many pictures far."""
    opponent = np.random.default_rng(2).random((24, 36, 3)).astype(np.float32)
    found = blurred(opponent, DEGREES)
    for channel in range(3):
        total = sum(w for w, _ in BLURS[channel])
        expected = sum(
            w / total * gaussian_filter(opponent[..., channel].astype(np.float64), s / np.sqrt(2) / DEGREES, mode="reflect", truncate=6.0)
            for w, s in BLURS[channel]
        )
        np.testing.assert_allclose(found[..., channel], expected, atol=2e-6)


def test_a_pattern_too_fine_to_see_is_its_mean() -> None:
    """Bars and checks of two samples, which go on in the mirrored picture: 50 cycles per degree."""
    down, across = (np.array([0, 1, 1, 0])[np.arange(n) % 4] for n in (ROWS, COLUMNS))
    checks = down[:, None] ^ across
    pattern = np.where(checks[..., None] == 1, np.float32([1.0, 0.2, 0.0]), np.float32([0.0, 0.6, 0.8])).astype(np.float32)
    mean = uniform(0.5, 0.4, 0.4)
    assert scielab(pattern, mean, DEGREES).max() < 2e-3
    assert scielab(pattern, uniform(0.5, 0.4, 0.5), DEGREES).mean() == pytest.approx(scielab(mean, uniform(0.5, 0.4, 0.5), DEGREES).mean(), abs=2e-3)
    assert scielab(pattern, mean, 10.0).min() > 40.0  # seen from so near that every sample is an area of its own


def test_blur_is_linear_and_keeps_the_mean() -> None:
    a, b = np.random.default_rng(3).random((2, ROWS, COLUMNS, 3), np.float32)
    np.testing.assert_allclose(blurred(a - 2 * b, DEGREES), blurred(a, DEGREES) - 2 * blurred(b, DEGREES), atol=2e-6)
    np.testing.assert_allclose(blurred(a, DEGREES).mean(axis=(0, 1), dtype=np.float64), a.mean(axis=(0, 1), dtype=np.float64), atol=1e-6)


def test_flipped_pictures_look_flipped() -> None:
    a, b = np.random.default_rng(4).random((2, ROWS, COLUMNS, 3), np.float32)
    np.testing.assert_allclose(scielab(a[::-1, ::-1], b[::-1, ::-1], DEGREES), scielab(a, b, DEGREES)[::-1, ::-1], atol=2e-3)
    np.testing.assert_allclose(scielab(a.swapaxes(0, 1), b.swapaxes(0, 1), DEGREES), scielab(a, b, DEGREES).T, atol=2e-3)


def test_summary_gathers_the_map_and_its_parts() -> None:
    a, b = np.random.default_rng(5).random((2, ROWS, COLUMNS, 3), np.float32)
    one, other = appearance(a, 0.03), appearance(b, 0.03)
    found, whole = summary(one, other), scielab(a, b, 0.03)
    assert found.mean == pytest.approx(whole.mean(), rel=1e-5)
    assert found.high == pytest.approx(np.quantile(whole, 0.95), rel=1e-5)
    assert found.lightness == pytest.approx(np.abs(one - other)[..., 0].mean(), rel=1e-5)
    assert found.chroma == pytest.approx(np.linalg.norm((one - other)[..., 1:], axis=2).mean(), rel=1e-5)
    gray = summary(appearance(uniform(0.2, 0.2, 0.2), 0.03), appearance(uniform(0.4, 0.4, 0.4), 0.03))
    assert gray.chroma < 1e-3 * gray.lightness
    assert gray.mean == pytest.approx(gray.lightness, rel=1e-4)


@pytest.mark.parametrize(
    ("reference", "shown", "degrees", "message"),
    [
        (uniform(0, 0, 0), uniform(0, 0, 0)[1:], DEGREES, "one size"),
        (uniform(0, 0, 0), uniform(0, 0, np.nan), DEGREES, "not finite"),
        (uniform(0, np.inf, 0), uniform(0, 0, 0), DEGREES, "not finite"),
        (uniform(0, 0, 0), uniform(0, 0, 0), 0.0, "positive angle"),
        (uniform(0, 0, 0), uniform(0, 0, 0), np.nan, "positive angle"),
        (uniform(0, 0, 0)[..., :2], uniform(0, 0, 0)[..., :2], DEGREES, "3 colors"),
    ],
)
def test_pictures_that_cannot_be_compared_are_refused(reference: F32, shown: F32, degrees: float, message: str) -> None:
    with pytest.raises(QueryError, match=message):
        scielab(reference, shown, degrees)
