"""Finished pictures: nothing is cut off or overlaps, the color bar says what colors mean, animations keep their colors."""

import pathlib

import numpy as np
import pytest
from PIL import Image, ImageFont

from viz.colors import color_map
from viz.numbers import number
from viz.pictures import finished, message_picture, wrapped, write_animation, write_png
from viz.ticks import ticks
from viz.tools.base import ColorBar, Drawn

CAPTION = "Caustics on the floor, as bundled light paths: 2,000 of 314,159 paths of `C D S+ L`. Bundled curves are not physical paths."
LEGEND = tuple((f"object number {i}", (i / 9, 1 - i / 9, 0.5)) for i in range(10))
BAR = ColorBar("irradiance, flux / world unit²", color_map("viridis"), 0.002, 35.0, logarithmic=True)


def picture(width: int, height: int) -> np.ndarray:
    return np.full((height, width, 3), 40, np.uint8)


@pytest.mark.parametrize("width", [160, 320, 960, 1920])
def test_the_strip_holds_everything_inside_its_margins(width: int) -> None:
    image = picture(width, 90)
    done = finished(image, Drawn(CAPTION, LEGEND, BAR))
    assert done.shape[1:] == (width, 3)
    assert (done[:90] == 40).all()
    strip = done[90:]
    edge = 4
    assert (strip[:edge] == 255).all()
    assert (strip[-edge:] == 255).all()
    assert (strip[:, :edge] == 255).all()
    assert (strip[:, -edge:] == 255).all()
    assert 0.02 < (strip.min(axis=2) < 128).mean() < 0.3
    # Every color of the legend is there
    for _, color in LEGEND:
        assert (strip == np.round(np.array(color) * 255).astype(np.uint8)).all(axis=2).sum() > 20


def test_the_color_bar_has_all_its_colors_in_order() -> None:
    strip = finished(picture(960, 8), Drawn("", color_bar=BAR))[8:]
    colors = color_map("viridis")
    rows = [row for row in strip if (row == colors[128]).all(axis=1).any() and (row == colors[250]).all(axis=1).any()]
    assert len(rows) > 10
    row = rows[5]
    first, last = np.flatnonzero((row == colors[0]).all(axis=1))[0], np.flatnonzero((row == colors[-1]).all(axis=1))[-1]
    assert np.array_equal(changes(row[first : last + 1]), changes(colors))
    assert last - first > 400


def changes(colors: np.ndarray) -> np.ndarray:
    """Colors without those that are the same as the one before."""
    return colors[np.r_[True, (colors[1:] != colors[:-1]).any(axis=1)]]


def test_a_percent_sign_stays_with_its_number() -> None:
    font = ImageFont.load_default(12)
    for width in range(60, 200, 7):
        lines = wrapped("known to 93 %  of it, 7 % of which", width, font)
        assert not any(line.startswith("%") for line in lines)
        assert " ".join(lines).replace("\N{NO-BREAK SPACE}", " ") == "known to 93 % of it, 7 % of which"


def test_an_empty_strip_is_none() -> None:
    image = picture(64, 32)
    assert np.array_equal(finished(image, Drawn("")), image)


def test_frames_have_strips_of_one_height_whatever_their_notes() -> None:
    notes = ("", "short", "a note of so many words that it needs a second line and even a third one in a picture so narrow")
    drawn = Drawn("Light on its way", frame_notes=notes)
    heights = {finished(picture(200, 20), drawn, note).shape for note in notes}
    assert len(heights) == 1
    assert len({finished(picture(200, 20), drawn, note).tobytes() for note in notes}) == 3


def test_a_message_fills_a_picture() -> None:
    image = message_picture((240, 180), "No light here: no path of `C S+ L` reaches the film")
    assert image.shape == (180, 240, 3)
    ink = np.argwhere(image.min(axis=2) < 100)
    assert np.abs(ink.mean(axis=0) - [90, 120]).max() < 12
    assert not np.array_equal(image, message_picture((240, 180), "Something else"))


def test_png_keeps_every_pixel(tmp_path: pathlib.Path) -> None:
    image = np.random.default_rng(1).integers(0, 256, (20, 30, 3)).astype(np.uint8)
    write_png(tmp_path / "a.png", image)
    write_png(tmp_path / "b.png", image)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), image)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def moving(count: int = 6) -> list[np.ndarray]:
    """A colored square moving over a gradient: more colors than a palette holds."""
    y, x = np.mgrid[0:60, 0:80]
    ground = np.stack([x * 3, y * 4, 255 - x * 2], axis=-1).astype(np.uint8)
    frames = []
    for i in range(count):
        frame = ground.copy()
        frame[10:20, 10 * i : 10 * i + 8] = (255, 0, 0)
        frames.append(frame)
    return frames


def test_an_animation_keeps_frames_times_and_colors(tmp_path: pathlib.Path) -> None:
    frames = moving()
    write_animation(tmp_path / "a.gif", iter(frames), 0.08)
    with Image.open(tmp_path / "a.gif") as animation:
        assert animation.n_frames == len(frames)
        assert animation.info["loop"] == 0
        shown = []
        for i in range(animation.n_frames):
            animation.seek(i)
            assert animation.info["duration"] == 80
            shown.append(np.asarray(animation.convert("RGB")).astype(int))
    for frame, found in zip(frames, shown):
        assert np.abs(found - frame).mean() < 8
        assert np.abs(found[12:18] - frame[12:18])[(frame[12:18] == (255, 0, 0)).all(axis=2)].max() < 20  # a rare color is not lost
    # What does not move does not flicker
    still = [found[30:] for found in shown]
    assert all(np.array_equal(still[0], other) for other in still[1:])
    write_animation(tmp_path / "b.gif", iter(frames), 0.08)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_few_colors_are_kept_exactly(tmp_path: pathlib.Path) -> None:
    frames = [np.full((10, 10, 3), color, np.uint8) for color in ((255, 255, 255), (18, 19, 23), (3, 200, 90))]
    write_animation(tmp_path / "a.gif", frames, 0.5)
    with Image.open(tmp_path / "a.gif") as animation:
        for i, frame in enumerate(frames):
            animation.seek(i)
            assert np.array_equal(np.asarray(animation.convert("RGB")), frame)


def test_bad_animations_are_refused(tmp_path: pathlib.Path) -> None:
    with pytest.raises(ValueError, match="at least one frame"):
        write_animation(tmp_path / "a.gif", [], 0.1)
    with pytest.raises(ValueError, match="one size"):
        write_animation(tmp_path / "a.gif", [picture(4, 4), picture(5, 4)], 0.1)


@pytest.mark.parametrize(
    ("scale", "expected"),
    [
        ((0.0, 1.0, False), [0, 0.2, 0.4, 0.6, 0.8, 1]),
        ((-3.0, 7.0, False), [-2, 0, 2, 4, 6]),
        ((1e-3, 1e3, True), [1e-3, 1e-1, 10, 1000]),
        ((0.5, 8.0, True), [0.5, 1, 2, 5]),
        ((2.0, 2.0, False), [2]),
        ((0.0, 5.0, True), [0]),
        ((3.1, 3.9, True), [3.1, 3.9]),
    ],
)
def test_ticks_are_round_and_in_their_places(scale: tuple[float, float, bool], expected: list[float]) -> None:
    found = ticks(*scale)
    assert [value for _, value in found] == pytest.approx(expected)
    assert all(0 <= place <= 1 for place, _ in found)


def test_numbers_are_read_easily() -> None:
    found = [number(value) for value in (0, 0.5, 1234, -0.00123, 1e-9, 3.14159e8, -1e6)]
    assert found == ["0", "0.5", "1230", "−0.00123", "10⁻⁹", "3.14·10⁸", "−10⁶"]
