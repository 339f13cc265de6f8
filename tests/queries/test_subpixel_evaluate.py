"""The comparison of methods: each figure from its own definition, on tiny displays."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pytest

from queries.diagnostics.answers import meanings
from queries.errors import QueryError
from queries.subpixel.description import layout as layout_of
from queries.subpixel.display import shown
from queries.subpixel.evaluate import judge
from queries.subpixel.images import apply, signal_of_image
from queries.subpixel.scielab import appearance, scielab
from queries.subpixel.weighted_error import weighted_error
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.methods import METHODS
from renderer.filters.subpixel.sensitivity import exponential
from renderer.filters.subpixel.viewing import Viewing
from renderer.filters.subpixel.windowed_sinc import fit

F32 = npt.NDArray[np.float32]
FINE, WIDTH, HEIGHT = 6, 12, 8
VIEWING, SENSITIVITY = Viewing(), exponential()
LAYOUTS = {name: layout_of(name) for name in ("rgb_stripe", "rgbw")}
KERNELS = {name: derive(layout) for name, layout in LAYOUTS.items()}
FITS = {name: fit(kernels) for name, kernels in KERNELS.items()}


def edge() -> F32:
    """Black beside white, askew."""
    y, x = np.indices((HEIGHT * FINE, WIDTH * FINE))
    return np.repeat((x + 0.3 * y > 40)[..., None], 3, axis=2).astype(np.float32)


IMAGES: dict[str, F32] = {
    "edge": edge(),
    "noise": np.random.default_rng(1).random((HEIGHT * FINE, WIDTH * FINE, 3), np.float32),
    "gray": np.full((HEIGHT * FINE, WIDTH * FINE, 3), 0.5, np.float32),
}


def scores(**changed: Any) -> pa.Table:
    """Judged at a clock of whole seconds, at which one run of a filter is long enough to be timed once."""
    given: dict[str, Any] = {"images": IMAGES, "layouts": LAYOUTS, "methods": METHODS, "clock": itertools.count().__next__} | changed
    return judge(given.pop("images"), given.pop("layouts"), KERNELS, FITS, VIEWING, SENSITIVITY, 2, FINE, **given)


@pytest.fixture(scope="module")
def table() -> pa.Table:
    return scores()


def row(table: pa.Table, layout: str, image: str, method: str) -> dict[str, Any]:
    found = [r for r in table.to_pylist() if (r["layout"], r["image"], r["method"]) == (layout, image, method)]
    assert len(found) == 1
    return dict(found[0])


def test_every_layout_image_and_method_has_a_row_in_order(table: pa.Table) -> None:
    expected = [(layout, image, method) for layout in LAYOUTS for image in IMAGES for method in METHODS]
    assert list(zip(*(table[name].to_pylist() for name in ("layout", "image", "method")))) == expected
    assert all(meanings(table).values())
    assert scores(layouts={"rgbw": LAYOUTS["rgbw"]}).equals(table.slice(len(expected) // 2))


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("method", ["pixel_box", "optimal", "kernels"])
def test_figures_are_those_of_their_definitions(table: pa.Table, layout: str, method: str) -> None:
    display, reference = LAYOUTS[layout], IMAGES["edge"]
    lattice = apply(reference, method, display, KERNELS[layout], FITS[layout], 2, FINE)
    found, degrees = row(table, layout, "edge", method), VIEWING.degrees_per_pixel / FINE
    delta = scielab(reference, shown(np.clip(lattice, 0, 1), display, FINE), degrees)
    assert found["scielab"] == pytest.approx(delta.mean(), rel=1e-5)
    assert found["scielab_95"] == pytest.approx(np.percentile(delta, 95), rel=1e-5)
    assert found["scielab_unclipped"] == pytest.approx(scielab(reference, shown(lattice, display, FINE), degrees).mean(), rel=1e-5)
    parts = appearance(reference, degrees) - appearance(shown(np.clip(lattice, 0, 1), display, FINE), degrees)
    assert found["lightness"] == pytest.approx(np.abs(parts[..., 0]).mean(), rel=1e-5)
    assert found["chroma"] == pytest.approx(np.hypot(parts[..., 1], parts[..., 2]).mean(), rel=1e-5)
    lit = np.tile(display.pattern >= 0, (lattice.shape[0] // display.pattern.shape[0], lattice.shape[1] // display.pattern.shape[1]))
    assert found["clipped"] == pytest.approx(((lattice < -1e-6) | (lattice > 1 + 1e-6))[lit].mean(), abs=1e-12)
    signal = signal_of_image(reference, display, FINE)
    assert found["weighted_error"] == pytest.approx(weighted_error(lattice, signal, display, VIEWING, SENSITIVITY), rel=1e-9)
    assert found["seconds"] == 1.0


def test_what_is_not_clipped_scores_the_same_unclipped(table: pa.Table) -> None:
    """Boxes average, and cannot overshoot; the optimal filters do at an edge from black to white."""
    for layout in LAYOUTS:
        for method in ("pixel_box", "none", "box"):
            found = row(table, layout, "edge", method)
            assert found["clipped"] == 0.0
            assert found["scielab"] == found["scielab_unclipped"]
        assert row(table, layout, "edge", "optimal")["clipped"] > 0.0


def test_gray_shows_almost_alike_by_every_method_and_subpixels_resolve_edges(table: pa.Table) -> None:
    for layout in LAYOUTS:
        gray = [row(table, layout, "gray", method)["weighted_error"] for method in METHODS if method != "kernels"]
        assert max(gray) - min(gray) < 1e-5
        by = {method: row(table, layout, "edge", method)["weighted_error"] for method in METHODS}
        assert by["kernels"] < by["box"] < by["pixel_box"]
        assert by["optimal"] < by["pixel_box"]


def test_lattices_that_are_given_are_judged_as_they_are() -> None:
    layout = LAYOUTS["rgb_stripe"]
    white = np.full((HEIGHT, WIDTH * 3), 1.5, np.float32)
    white[0, 0] = 1.0
    black = np.zeros_like(white)
    given = {("gray", "rgb_stripe", "box"): white, ("gray", "rgb_stripe", "optimal"): black}
    found = scores(images={"gray": IMAGES["gray"]}, layouts={"rgb_stripe": layout}, methods=["box", "optimal", "mitchell"], given=given)
    over, under, filtered = found.to_pylist()
    assert over["clipped"] == pytest.approx(1 - 1 / white.size)
    assert over["scielab_unclipped"] > over["scielab"]
    assert (under["clipped"], under["weighted_error"]) == (0.0, pytest.approx(1.0))
    degrees = VIEWING.degrees_per_pixel / FINE
    assert under["scielab"] == pytest.approx(scielab(IMAGES["gray"], np.zeros_like(IMAGES["gray"]), degrees).mean(), rel=1e-5)
    assert over["seconds"] is None
    assert under["seconds"] is None
    assert filtered["seconds"] == 1.0


@pytest.mark.parametrize(("step", "repeats"), [(0.25, 1), (1 / 1024, 3)])
def test_seconds_are_the_median_of_runs_of_the_filter_alone(step: float, repeats: int) -> None:
    calls = 0

    def clock() -> float:
        nonlocal calls
        calls += 1
        return step * calls

    counted: Callable[[], float] = clock
    found = scores(images={"gray": IMAGES["gray"]}, layouts={"rgb_stripe": LAYOUTS["rgb_stripe"]}, methods=["box"], clock=counted)
    assert found["seconds"].to_pylist() == [step]
    assert calls == 2 * repeats


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"methods": ["box", "lanczos"]}, "lanczos"),
        ({"methods": []}, "none"),
        ({"images": {}}, "at least one image"),
        ({"layouts": {}}, "at least one image and one layout"),
        ({"images": {"odd": np.zeros((HEIGHT * FINE, WIDTH * FINE - 1, 3), np.float32)}}, "whole pixels"),
        ({"images": {"flat": np.zeros((HEIGHT * FINE, WIDTH * FINE), np.float32)}}, "3 colors"),
        ({"given": {("gray", "rgb_stripe", "box"): np.zeros((3, 3), np.float32)}}, "expected a lattice"),
    ],
)
def test_what_cannot_be_judged_is_refused(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(QueryError, match=message):
        scores(**changed)
