"""The light of displays, what is cut off, and pictures of subpixels."""

import numpy as np
import pytest

from queries.errors import QueryError
from queries.srgb import to_linear, to_srgb
from queries.subpixel import description, display
from queries.subpixel.display import clipped_share, drive_picture, fine_grid, shown, subpixel_picture
from renderer.filters.subpixel.layout import Layout

SHIPPED = tuple(description.shipped_layouts())


def custom(pattern: list[str], cells: tuple[int, int], **more: object) -> Layout:
    return description.LayoutDescription.model_validate({"pattern": pattern, "cells": cells, **more}).layout("custom")


def lattice_of(layout: Layout, width: int, height: int, value: float = 0.0) -> np.ndarray:
    return np.full((height * layout.cells[1], width * layout.cells[0]), value, np.float32)


def random_lattice(layout: Layout, width: int, height: int) -> np.ndarray:
    return np.random.default_rng(5).random((height * layout.cells[1], width * layout.cells[0])).astype(np.float32)


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("fine", [1, 5, 6, 12])
def test_everything_on_is_white_on_average(name: str, fine: int) -> None:
    layout = description.layout(name)
    light = shown(lattice_of(layout, 4, 2, 1.0), layout, fine)
    assert light.shape == (2 * fine, 4 * fine, 3)
    assert light.dtype == np.float32
    assert np.allclose(light.mean(axis=(0, 1), dtype=np.float64), 1.0 + layout.white_share, atol=1e-6)


def test_white_of_four_primaries_is_white() -> None:
    layout = description.layout("rgbw")
    lattice = lattice_of(layout, 3, 2)
    for (row, column), drive in zip(layout.active, layout.signal(np.ones(3))):
        lattice[row::2, column::2] = drive
    assert np.allclose(shown(lattice, layout, 2).mean(axis=(0, 1)), 1.0, atol=1e-6)
    assert layout.white_share == pytest.approx(0.5606, abs=1e-4)


@pytest.mark.parametrize("name", SHIPPED)
def test_light_is_the_sum_of_subpixels(name: str) -> None:
    layout = description.layout(name)
    lattice = random_lattice(layout, 6, 4)
    rows, columns = layout.pattern.shape
    drives = [lattice[row::rows, column::columns].mean(dtype=np.float64) for row, column in layout.active]
    counts = np.bincount(layout.active_primaries)[layout.active_primaries]
    want = (np.array(drives) / counts) @ layout.light()[layout.active_primaries]
    for fine in (6, 7):
        assert np.allclose(shown(lattice, layout, fine).mean(axis=(0, 1), dtype=np.float64), want, atol=1e-6)


def test_a_subpixel_lights_its_extent() -> None:
    layout = description.layout("rgbg")
    lattice = lattice_of(layout, 4, 2)
    lattice[1, 12 + 2] = 1.0  # R of the second period
    light = shown(lattice, layout, 6)
    want = np.zeros((12, 24, 3))
    want[6:12, 12:16, 0] = 3.0  # four positions wide, a third of the display's red area
    assert np.array_equal(light, want)

    # Blue ends in the next pixel, and on coarser samples that are lit in part
    lattice[:], lattice[0, 8] = 0.0, 0.5
    assert np.allclose(shown(lattice, layout, 2)[0, :, 2], np.array([0, 0, 1.5, 0.5, 0, 0, 0, 0]))
    lattice[0, 9] = 7.0  # a virtual position
    assert shown(lattice, layout, 2).sum() == pytest.approx(2 * 2.0)


def test_light_beside_the_display_is_left_out() -> None:
    layout = custom(["R G B"], (3, 1), origin=(0, 0.5))  # subpixels are centered at the left edges of their positions
    light = shown(lattice_of(layout, 2, 1, 1.0), layout, 6)
    assert np.array_equal(light[0, :, 0], [3, 0, 0, 0, 0, 3, 3, 0, 0, 0, 0, 0])
    assert np.array_equal(light[0, :, 1], [0, 3, 3, 0, 0, 0, 0, 3, 3, 0, 0, 0])


def test_drives_are_cut_where_asked() -> None:
    layout = description.layout("rgb_stripe")
    lattice = np.array([[-0.5, 0.5, 1.5]], np.float32)
    assert np.array_equal(shown(lattice, layout, 3)[0], np.diag([-1.5, 1.5, 4.5]))
    assert np.array_equal(shown(lattice, layout, 3, clip=True)[0], np.diag([0, 1.5, 3]))


def test_fine_grid_holds_all_edges() -> None:
    assert [fine_grid([description.layout(name)]) for name in SHIPPED] == [3, 3, 6, 2]
    assert fine_grid(description.layout(name) for name in SHIPPED) == 6
    assert fine_grid([custom(["R G B"], (3, 1), origin=(0, 0.5))]) == 6  # edges halfway between positions
    assert fine_grid([custom(["R G B"], (3, 1), extent={"R": (2, 1)})]) == 6
    assert fine_grid([custom(["R G B"], (3, 1)), custom(["R G B ."] * 5, (4, 5))]) == display.FINEST  # 60 are too many


def test_clipping_counts_subpixels() -> None:
    layout = description.layout("rgbg")
    lattice = lattice_of(layout, 4, 1, 0.5)  # eight subpixels
    assert clipped_share(lattice, layout) == 0.0
    lattice[0, [0, 1]] = 9.0  # virtual positions do not count
    assert clipped_share(lattice, layout) == 0.0
    lattice[0, 2], lattice[0, 5], lattice[0, 8] = -0.25, 1.125, 1.0 + 5e-7
    assert clipped_share(lattice, layout) == 2 / 8


def test_subpixel_pictures() -> None:
    stripe = description.layout("rgb_stripe")
    picture = subpixel_picture(np.array([[0.0, 0.5, 2.0]], np.float32), stripe)
    assert picture.shape == (3, 3, 3)
    assert picture.dtype == np.uint8
    assert np.array_equal(picture, np.broadcast_to(np.diag([0, 188, 255]), (3, 3, 3)))
    white = subpixel_picture(lattice_of(description.layout("rgbw"), 1, 1, 1.0), description.layout("rgbw"))
    assert np.array_equal(white, [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]])
    green = lattice_of(description.layout("rgbg"), 2, 1)
    green[0, 5] = 1.0
    assert np.argwhere(subpixel_picture(green, description.layout("rgbg"))).tolist() == [[y, x, 1] for y in range(6) for x in (4, 5)]


@pytest.mark.parametrize("tall", [False, True])
def test_pictures_in_bands_are_the_same(tall: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    layout = custom(["R .", "G B"], (2, 1), extent={"R": (1, 5), "B": (1, 2)}) if tall else description.layout("rgbw")
    lattice = 0.2 * random_lattice(layout, 5, 12)
    whole = subpixel_picture(lattice, layout)
    assert np.abs(to_linear(whole / 255) - shown(lattice, layout, fine_grid([layout]))).max() > 0.1  # a picture has no gain
    monkeypatch.setattr(display, "_BAND", 1)
    assert np.array_equal(subpixel_picture(lattice, layout), whole)


def test_drive_pictures() -> None:
    lattice = np.array([[0.0, 0.5, 1.0, 0.0, 0.0, 2.0]], np.float32)
    assert np.array_equal(drive_picture(lattice, description.layout("rgb_stripe")), [[[0, 188, 255], [0, 0, 255]]])
    assert np.array_equal(drive_picture(lattice, description.layout("bgr_stripe")), [[[255, 188, 0], [255, 0, 0]]])
    for name in ("rgbg", "rgbw"):
        layout = description.layout(name)
        assert drive_picture(lattice_of(layout, 2, 2), layout) is None
    swapped = custom(["R G B B G R"], (3, 1))  # each pixel has all three, in another order
    assert np.array_equal(drive_picture(lattice, swapped), [[[0, 188, 255], [255, 0, 0]]])
    assert drive_picture(lattice, custom(["R R G G B B"], (3, 1))) is None


def test_lattices_of_parts_of_pixels_are_refused() -> None:
    layout = description.layout("rgb_stripe")
    for draw in (lambda lattice: shown(lattice, layout, 3), lambda lattice: subpixel_picture(lattice, layout)):
        with pytest.raises(QueryError, match=r"whole pixels of 3 x 1 positions, found the shape \(2, 4\)"):
            draw(np.zeros((2, 4), np.float32))
    with pytest.raises(QueryError, match="at least one sample"):
        shown(np.zeros((2, 3), np.float32), layout, 0)


def test_the_curve_of_srgb() -> None:
    assert to_srgb(np.array([-1.0, 0.0, 0.002, 0.21404114, 1.0, 9.0])) == pytest.approx([0, 0, 0.02584, 0.5, 1, 1], abs=1e-5)
    assert to_linear(np.array([0.02, 0.04])) == pytest.approx([0.02 / 12.92, 0.04 / 12.92], rel=1e-6)
    values = np.linspace(0, 1, 101) ** 3
    assert np.abs(to_linear(to_srgb(values)) - values).max() < 1e-6
