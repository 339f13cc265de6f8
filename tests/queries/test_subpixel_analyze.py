"""The whole analysis of an image: which part is compared, what is kept, and pictures that are brighter than white."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest

from queries.errors import QueryError
from queries.subpixel import analyze as module
from queries.subpixel.analyze import Derived, ImageSource, Kind, Window, analyze
from queries.subpixel.description import LayoutDescription, Method, SubpixelDescription, layout
from queries.subpixel.display import clipped_share
from queries.subpixel.evaluate import judge
from queries.subpixel.images import apply, resample
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.methods import METHODS
from renderer.filters.subpixel.windowed_sinc import fit

F32 = npt.NDArray[np.float32]


def bars() -> F32:
    """Gray, with bars of noise on the right below; 20 x 14 pixels."""
    image = np.full((14, 20, 3), 0.4, np.float32)
    image[7:, 11:] = np.random.default_rng(1).random((7, 9, 3))
    return image


def asked(**more: object) -> SubpixelDescription:
    return SubpixelDescription.model_validate({"targets": [], "layouts": ["rgb_stripe"]} | more)


@dataclass(frozen=True)
class Changes:
    """A source of which nothing but its picture, one sample for each pixel, is asked."""

    picture: F32
    name: str = "changes"
    kind: Kind = "image"

    @property
    def size(self) -> tuple[int, int]:
        return self.picture.shape[1], self.picture.shape[0]

    def lattice(self, method: Method, display: Derived, zeros: int) -> F32:
        raise AssertionError

    def samples(self, fine: int, window: Window) -> F32:
        assert (fine, window) == (1, (0, 0, *self.size))
        return self.picture


def test_pictures_brighter_than_white_are_compared_with_what_they_are() -> None:
    """The weighted error is relative and does not clip: ten times the light has the same. S-CIELAB is of what a display can show of it."""
    image = bars()
    dim, bright, cut = (analyze(ImageSource("bars", one, 1.0), asked()).scores for one in (0.9 * image, 9.0 * image, np.minimum(9.0 * image, 1.0)))
    assert dim is not None
    assert bright is not None
    assert cut is not None
    errors = dim["weighted_error"].to_pylist()
    assert bright["weighted_error"].to_pylist() == pytest.approx(errors, rel=1e-4)
    assert max(errors) < 0.3
    for one, other, method in zip(bright.to_pylist(), cut.to_pylist(), METHODS):
        if method in ("pixel_box", "none"):  # of single pixels: clipped before or after, the same light
            assert one["scielab"] == pytest.approx(other["scielab"], rel=1e-5)
        assert one["clipped"] > 0.5
        assert one["scielab_unclipped"] < 25.0  # most of it is nine times as bright as what a display can show


def test_the_part_that_is_compared_is_cut_out_of_what_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """The window with the most changes, on whole periods of both displays; its scores are those of that part of the filtered whole."""
    monkeypatch.setattr(module, "LARGEST_WINDOW", (8, 5))
    image = bars()
    found = analyze(ImageSource("bars", image, 1.0), asked(layouts=["rgbw", "rgbg"], method="box"))
    window = (12, 9, 20, 14)
    pictures = {"bars": resample(image, 1.0, 6, window)}
    displays = {name: layout(name) for name in ("rgbw", "rgbg")}
    kernels = {name: derive(one) for name, one in displays.items()}
    fits = {name: fit(one) for name, one in kernels.items()}
    given = {}
    for name, one in displays.items():
        for method in METHODS:
            (across, down), whole = one.cells, apply(image, method, one, kernels[name], fits[name])
            given["bars", name, method] = whole[9 * down : 14 * down, 12 * across : 20 * across]
    expected = judge(pictures, displays, kernels, fits, found.description.viewing, found.description.sensitivity.sensitivity(), 2, 6, given=given)
    assert found.scores is not None
    assert found.scores.drop(["seconds"]).equals(expected.drop(["seconds"]))

    # What is shown is whole, by the method that was asked for and by the standard one
    for display in found.displays:
        assert np.array_equal(display.lattice, apply(image, "box", display.layout))
        assert np.array_equal(display.standard, apply(image, "pixel_box", display.layout))
        assert display.clipped == clipped_share(display.lattice, display.layout)


def test_without_a_comparison_there_are_pictures_alone() -> None:
    found = analyze(ImageSource("bars", bars(), 1.0), asked(evaluate=False))
    assert (found.scores, found.layouts, found.methods, found.reasons) == (None, None, {}, ())
    assert [name for name in found.seconds if ":" in name] == ["rgb_stripe: pixel_box", "rgb_stripe: optimal"]


def test_the_window_has_the_most_changes_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against every window that begins with a period, one by one."""
    monkeypatch.setattr(module, "LARGEST_WINDOW", (7, 5))
    picture = np.random.default_rng(2).random((13, 17, 3)).astype(np.float32) ** 4
    picture[:4, :5] *= 5.0  # what is brighter than white does not change there
    stripes = layout("rgbg")  # a period of two pixels
    left, top, right, bottom = module._window(Changes(picture), [stripes])
    assert (right - left, bottom - top, left % 2) == (6, 5, 0)
    light = np.clip(picture, 0, 1) @ [0.212671, 0.715160, 0.072169]
    change = np.zeros(light.shape)
    change[1:] += np.abs(light[1:] - light[:-1])
    change[:, 1:] += np.abs(light[:, 1:] - light[:, :-1])
    sums = {(x, y): change[y : y + 5, x : x + 6].sum() for x in range(0, 12, 2) for y in range(9)}
    assert max(sums, key=lambda at: sums[at]) == (left, top)


def test_a_period_longer_than_the_largest_window_is_compared_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LARGEST_WINDOW", (3, 3))
    long = LayoutDescription(pattern=["R G B B G R G R B G B R"], cells=(3, 1)).layout("long")
    assert module._window(Changes(bars()), [long]) == (12, 9, 16, 12)
    with pytest.raises(QueryError, match="3 x 14 pixels of the display, less than a period of its pattern: 4 x 1"):
        module._window(Changes(bars()[:, :3]), [long])


def test_filters_that_cannot_be_found_are_named_by_their_layout() -> None:
    """Weights that begin at frequencies far above the display's own: no error has any."""
    blind = {"table": {"frequency": [0, 1e5, 1e6], "weights": [[0, 0, 1]] * 3}}
    with pytest.raises(QueryError, match="layout `rgb_stripe`: the contrast sensitivity"):
        analyze(ImageSource("bars", bars(), 1.0), asked(sensitivity=blind))
