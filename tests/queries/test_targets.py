"""The project's own test images: what they show, at any resolution, and that they are hard to show."""

import itertools
import typing

import numpy as np
import pytest

from queries.errors import QueryError
from queries.subpixel.description import Target
from queries.subpixel.targets import DESCRIPTIONS, TITLES, base, target
from queries.subpixel.targets.zone_plate import NYQUIST

NAMES = typing.get_args(Target)
WIDTH, HEIGHT = 64, 48
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.fixture(scope="module")
def targets():
    return {name: target(name, WIDTH, HEIGHT, 6) for name in NAMES}


def power(image, fine):
    """The power of each frequency, and the frequencies, in cycles per pixel."""
    light = image.astype(np.float64) @ LUMINANCE if image.ndim == 3 else image
    down, across = (np.fft.fftfreq(n, 1.0 / fine) for n in light.shape)
    return np.abs(np.fft.fft2(light - light.mean())) ** 2, np.hypot(down[:, None], across)


def test_every_target_has_a_title_and_a_description():
    assert tuple(TITLES) == tuple(DESCRIPTIONS) == NAMES


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("width", "height", "fine"), [(64, 48, 6), (16, 16, 1), (33, 17, 5), (17, 40, 2)])
def test_shape_and_range(name, width, height, fine):
    image = target(name, width, height, fine)
    assert image.shape == (height * fine, width * fine, 3)
    assert image.dtype == np.float32
    assert image.min() >= 0.0
    assert image.max() <= 1.0
    assert image.std() > 0.04


@pytest.mark.parametrize("name", NAMES)
def test_the_same_bits_whatever_came_before(name, targets):
    np.random.seed(1)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    target("noise", 20, 20, 2)
    assert target(name, WIDTH, HEIGHT, 6).tobytes() == targets[name].tobytes()
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002


@pytest.mark.parametrize("name", NAMES)
def test_a_coarser_target_is_the_average_of_a_finer_one(name, targets):
    # 6 and 3 samples are averages of the same points; where shapes cover a part, the background is taken at the center of samples of either size
    assert np.abs(base.average(targets[name], 2) - target(name, WIDTH, HEIGHT, 3)).max() < 0.01

    # 10 and 5 are not, but of the same scene: points differ along edges, and letters, which fonts fit to the points, by up to 1/50 pixel
    difference = base.average(target(name, 24, 18, 10), 2) - target(name, 24, 18, 5)
    assert np.sqrt((difference**2).mean()) < (0.04 if name.startswith("text") else 0.02)
    assert abs(difference.mean()) < 0.002


@pytest.mark.parametrize("name", NAMES)
def test_details_reach_beyond_what_pixels_can_show(name, targets):
    # Shares of the contrast energy: an octave below the pixels' Nyquist frequency, and above it. The least are of noise and foliage.
    energy, frequency = power(targets[name], 6)
    assert energy[(frequency >= 0.25) & (frequency < 0.5)].sum() > 0.1 * energy.sum()
    assert energy[frequency >= 0.5].sum() > 0.2 * energy.sum()


@pytest.mark.parametrize("name", NAMES)
def test_color(name, targets):
    difference = np.ptp(targets[name], axis=2)
    assert difference.max() == 0.0 if name.startswith("text") else difference.mean() > 0.05


def test_text_is_black_on_white_and_inverted_exactly_its_opposite(targets):
    page = targets["text"]
    assert np.array_equal(targets["text_inverted"], np.float32(1.0) - page)
    assert (page[:6] == 1.0).all()  # the margin
    assert (page > 0.95).mean() > 0.7
    assert (page < 0.05).mean() > 0.07
    assert ((page < 0.1) | (page > 0.9)).mean() > 0.87
    assert 0.1 < 1.0 - page.mean() < 0.25  # the share of ink


def test_text_keeps_its_size_on_a_larger_display(targets):
    # Lines fill a larger page, and what both pages show is the same
    wide = target("text", WIDTH, 2 * HEIGHT, 6)
    assert np.array_equal(wide[: HEIGHT * 6 - 12], targets["text"][:-12])
    assert 0.1 < 1.0 - wide[HEIGHT * 6 :].mean() < 0.25


def test_lines_of_the_wire_frame_are_thin(targets):
    bright = targets["wire_frame"] @ LUMINANCE.astype(np.float32) > 0.25
    assert 0.15 < bright.mean() < 0.45
    ends = np.diff(np.pad(bright, ((0, 0), (1, 1))).astype(int), axis=1)
    lengths = np.argwhere(ends == -1)[:, 1] - np.argwhere(ends == 1)[:, 1]
    assert np.median(lengths) <= 4  # sixths of a pixel


def test_foliage_is_green_before_a_blue_sky(targets):
    red, green, blue = np.moveaxis(targets["foliage"], 2, 0)
    assert ((green > 1.2 * red) & (green > 1.2 * blue)).mean() > 0.25
    upper = slice(0, HEIGHT * 3)
    assert ((blue > 1.02 * red) & (blue > 0.8))[upper].mean() > 0.15


def test_hair_goes_before_dark_and_light(targets):
    columns = targets["hair"].mean(axis=(0, 2)).reshape(4, -1).mean(axis=1)
    assert columns[-1] > 1.5 * columns[0]
    assert targets["hair"].reshape(-1, 3).std(axis=0).min() > 0.1


def test_the_zone_plates_frequency_grows_with_the_distance_from_the_center():
    # Along the row left of the center: between two crossings of the mean lies half a wave, whose frequency the formula gives in the middle
    fine, width, height = 12, 97, 65
    row = target("zone_plate", width, height, fine)[height * fine // 2, :, 1]
    radius = 0.5 * width - (np.arange(len(row)) + 0.5) / fine
    value, radius = row[radius > 0][::-1].astype(np.float64) - 0.5, radius[radius > 0][::-1]
    at = np.flatnonzero(np.sign(value[1:]) != np.sign(value[:-1]))
    crossing = radius[at] - value[at] * (radius[at + 1] - radius[at]) / (value[at + 1] - value[at])
    found, middle = 0.5 / np.diff(crossing), 0.5 * (crossing[1:] + crossing[:-1])
    for wanted in (8.0, 16.0, 0.5 * height):  # pixels; the last is the nearest edge
        near = np.argmin(np.abs(middle - wanted))
        assert found[near] == pytest.approx(NYQUIST * middle[near] / (0.5 * height), rel=0.02)
    assert found[np.argmin(np.abs(middle - 0.5 * height))] == pytest.approx(0.5, abs=0.015)


def test_the_zone_plate_is_gray_on_the_left_and_of_opposite_colors_on_the_right(targets):
    red, green, blue = np.moveaxis(targets["zone_plate"], 2, 0)
    left, right, upper, lower = slice(0, WIDTH * 3), slice(WIDTH * 3, None), slice(0, HEIGHT * 3), slice(HEIGHT * 3, None)
    assert np.array_equal(red[:, left], green[:, left])
    assert np.array_equal(red[:, left], blue[:, left])
    assert np.abs(red[upper, right] + green[upper, right] - 1.0).max() < 1e-6
    assert np.abs(red[lower, right] + blue[lower, right] - 1.0).max() < 1e-6


def test_noise_has_the_spectrum_of_natural_images(targets):
    # Power f^-2; averages over samples multiply it by sinc² along each axis, which is undone
    energy, frequency = power(targets["noise"], 6)
    down, across = np.fft.fftfreq(HEIGHT * 6), np.fft.fftfreq(WIDTH * 6)
    energy = energy / (np.sinc(down)[:, None] * np.sinc(across)) ** 2
    edges = np.geomspace(0.08, 1.6, 12)
    means = [energy[(frequency >= a) & (frequency < b)].mean() for a, b in itertools.pairwise(edges)]
    slope = np.polyfit(np.log(np.sqrt(edges[1:] * edges[:-1])), np.log(means), 1)[0]
    assert slope == pytest.approx(-2.0, abs=0.15)


def test_the_channels_of_noise_vary_together(targets):
    correlation = np.corrcoef(targets["noise"].reshape(-1, 3).T)
    assert 0.7 < correlation[0, 2] < correlation[0, 1] < 0.99
    assert 0.3 < targets["noise"].mean() < 0.45


def test_polygons_cover_the_points_inside_them_later_ones_over_earlier_ones():
    # Against the definition: a point is inside when it lies on one side of all edges
    rng = np.random.default_rng(4)
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, (40, 5)), axis=1)
    size = rng.uniform(0.3, 6.0, (40, 1, 2))
    vertices = rng.uniform(-2.0, (34.0, 26.0), (40, 1, 2)) + size * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    wanted = np.zeros((24, 32), int)
    y, x = np.mgrid[:24, :32] + 0.5
    for i, polygon in enumerate(vertices):
        a, b = polygon, np.roll(polygon, -1, axis=0)
        side = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in zip(a, b)]
        wanted[np.min(side, axis=0) > 0.0] = i + 1
    assert np.array_equal(base._fill(vertices, 0, 24, 32), wanted)
    assert np.array_equal(base._fill(vertices, 7, 19, 32), wanted[7:19])
    assert len(np.unique(wanted)) > 20


def test_paint_measures_areas_and_does_not_depend_on_its_bands(monkeypatch):
    raster = base.Raster(20, 16, 6)
    quad = np.array([[[2.3, 1.1], [15.2, 4.7], [14.9, 9.3], [2.1, 8.8]]])
    black = lambda x, y: np.zeros((*np.broadcast_shapes(x.shape, y.shape), 3))  # noqa: E731
    image = base.paint(raster, quad, np.array([[1.0, 0.5, 0.0]]), black)
    x, y = quad[0].T
    area = 0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    assert image[..., 0].sum() / 36 == pytest.approx(area, rel=1e-3)
    assert np.array_equal(image[..., 1], 0.5 * image[..., 0])
    monkeypatch.setattr(base, "_BAND", 1)
    assert np.array_equal(base.paint(raster, quad, np.array([[1.0, 0.5, 0.0]]), black), image)


def test_ribbons_are_as_wide_as_asked():
    t = np.linspace(0.0, 1.0, 33)
    path = np.stack([8.0 + 5.0 * np.cos(t), 3.0 + 5.0 * np.sin(t)], axis=1)[None]
    pieces = base.ribbons(path, np.full((1, 33), 0.4))
    x, y = pieces[..., 0], pieces[..., 1]
    area = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)).sum()
    assert area == pytest.approx(0.4 * 5.0, rel=1e-3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("photo", 64, 64, 6), "there is no test image `photo`: known are text"),
        (("text", 15, 64, 6), "at least 16 x 16 pixels, found 15 x 64"),
        (("hair", 64, 4, 6), "at least 16 x 16 pixels, found 64 x 4"),
        (("noise", 64, 64, 0), "at least 1 sample"),
        (("noise", 4096, 4096, 6), "too large: take fewer pixels"),
    ],
)
def test_what_cannot_be_drawn_is_refused(arguments, message):
    with pytest.raises(QueryError, match=message):
        target(*arguments)
