"""Colors: told apart, encoded as screens do, and what they refuse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from queries.errors import QueryError
from queries.srgb import to_linear, to_srgb
from viz.colors import MAPS, chrominance, color_map, distinct_colors, from_oklab, mapped


@pytest.mark.parametrize("count", [1, 8, 20])
def test_objects_have_colors_that_differ_and_do_not_change(count: int) -> None:
    colors = distinct_colors(count, lamp=0)
    assert colors.shape == (count + 1, 3)
    assert colors.min() >= 0
    assert colors.max() <= 1
    apart = np.linalg.norm(colors[:, None] - colors[None], axis=2) + 9 * np.eye(count + 1)
    assert apart.min() > (0.2 if count <= 8 else 0.08)
    # More objects leave the colors of those that were there
    assert np.array_equal(colors[:-1], distinct_colors(count + 5, lamp=0)[:count])


def test_colors_of_objects_are_light_enough_for_a_dark_ground() -> None:
    luminance = to_linear(distinct_colors(40, lamp=3)) @ np.array([0.2126, 0.7152, 0.0722])
    assert luminance.min() > 0.12


def test_chrominance_forgets_brightness() -> None:
    light = np.array([[0.2, 0.1, 0.05]])
    assert np.allclose(chrominance(light), chrominance(1e4 * light), atol=1e-6)
    assert np.allclose(to_linear(chrominance(light)), [[1.0, 0.5, 0.25]], atol=1e-6)


def test_light_without_color_is_white() -> None:
    odd = np.array([[0, 0, 0], [-1, -2, 0], [np.nan, np.inf, 0]])
    assert np.allclose(chrominance(odd), 1, atol=1e-6)
    assert chrominance(np.zeros((0, 3))).shape == (0, 3)


@given(st.floats(0, 1))
def test_srgb_and_linear_are_inverse(value: float) -> None:
    assert to_linear(to_srgb(np.array([value])))[0] == pytest.approx(value, abs=1e-5)
    assert to_srgb(np.array([0.21404114]))[0] == pytest.approx(0.5, abs=1e-5)  # a known pair


def test_oklab_of_white_and_gray() -> None:
    assert np.allclose(from_oklab(np.array([[1.0, 0, 0]])), 1, atol=1e-4)
    gray = from_oklab(np.array([[0.5, 0, 0]]))
    assert np.allclose(to_linear(gray), 0.125, atol=1e-4)  # lightness is the cube root


@pytest.mark.parametrize("name", MAPS)
def test_maps_run_from_low_to_high(name: str) -> None:
    colors = color_map(name)
    assert (colors.shape, colors.dtype) == ((256, 3), np.dtype(np.uint8))
    luminance = to_linear(colors / 255) @ np.array([0.2126, 0.7152, 0.0722])
    if name != "turbo":  # the rainbow, whose brightness rises and falls
        assert np.diff(luminance[::16]).min() > 0
    assert np.array_equal(mapped(name, np.array([-1, 0, 1, 2, np.nan])), colors[[0, 0, 255, 255, 0]])


def test_an_unknown_map_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(QueryError, match="viridis"):
        color_map("jet")
