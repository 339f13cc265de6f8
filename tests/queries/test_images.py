"""Images from tables: every path in its pixel, every filter, and partitions that sum to the whole."""

import pathlib
from typing import Any

import numpy as np
import pytest
from synthetic import SyntheticRun, make_run

from queries import open_run
from queries.errors import ExpressionError, QueryError, RunError
from queries.images import aov_image, image
from queries.lpe import compile
from queries.lpe.parser import parse
from renderer.filters import reconstruction_filter


def test_beauty_sums_every_path(any_run: SyntheticRun) -> None:
    with open_run(any_run.folder) as run:
        expected = any_run.image(list(range(len(any_run.rows))), run.settings)
        found = image(run)
    assert found.dtype == np.float32
    assert expected.max() > 0
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("text", ["C.*L", "CD.*.", "C.*'glass_ball'.*."])
def test_aov_sums_matched_paths(any_run: SyntheticRun, text: str) -> None:
    with open_run(any_run.folder) as run:
        expected = any_run.image(any_run.matched(parse(text).tree), run.settings)
        np.testing.assert_allclose(aov_image(run, text), expected, rtol=1e-6)
        np.testing.assert_array_equal(aov_image(run, compile(text)), aov_image(any_run.folder, text))
    assert expected.max() > 0


def test_a_partition_sums_to_the_beauty(any_run: SyntheticRun) -> None:
    parts = ["C.", "C[^D].*.", "CD.*[OB]", "CD+L", "CD.*L - CD+L"]
    with open_run(any_run.folder) as run:
        layers = [aov_image(run, text).astype(np.float64) for text in parts]
        assert all(layer.max() > 0 for layer in layers)
        np.testing.assert_allclose(sum(layers), image(run), rtol=2e-6)


@pytest.mark.parametrize("method", ["path", "light"])
@pytest.mark.parametrize("filter", ["tent", "gaussian", "mitchell", "catmullrom", "lanczos"])
def test_filters(tmp_path: pathlib.Path, method: str, filter: str) -> None:
    made = make_run(tmp_path / "run", method, filter=filter, keep=0.5)
    with open_run(made.folder) as run:
        expected = made.image(list(range(len(made.rows))), run.settings)
        found = image(run)
        bound = interpolation_error(made, run.settings)
    assert np.abs(expected).max() > 100 * np.median(bound)
    assert (np.abs(found - expected) <= bound + 1e-6 * np.abs(expected)).all()


def interpolation_error(made: SyntheticRun, settings: dict[str, Any]) -> np.ndarray:
    """How far each pixel can be off because the film's table of the filter is linear between 1024 entries.

    That changes a weight along one axis by (radius / 1024)^2 / 8 times the filter's second derivative, which is below 5, and weights are at
    most 1: by 1e-5 in the plane for the widest filter. A pixel's error is that times what lies in its reach, over what the pixel is divided by.
    """
    filter = reconstruction_filter(settings["filter"])
    y, x = np.mgrid[: settings["height"], : settings["width"]] + 0.5
    reach = np.zeros((*y.shape, 3))
    for row in made.rows:
        near = (np.abs(row["raster_x"] - x) < filter.radius) & (np.abs(row["raster_y"] - y) < filter.radius)
        reach += near[..., None] * np.array([row[f"contribution_{c}"] for c in "rgb"])
    divisor = np.load(made.folder / "film" / "sum.npy")[..., 3:] if settings["method"] == "path" else settings["passes"] * filter.integral**2
    return 1e-5 * reach / np.abs(divisor * settings["keep"])


def test_a_share_of_the_walks_stands_for_all(tmp_path: pathlib.Path) -> None:
    whole, half = make_run(tmp_path / "whole"), make_run(tmp_path / "half", keep=0.5)
    np.testing.assert_allclose(image(half.folder), 2 * image(whole.folder), rtol=1e-6)


def test_a_run_without_paths_makes_no_image(tmp_path: pathlib.Path) -> None:
    made = make_run(tmp_path / "run", keep=0.0)
    with pytest.raises(QueryError, match="recorded no paths"):
        image(made.folder)


def test_the_weights_of_a_filter_are_needed(tmp_path: pathlib.Path) -> None:
    made = make_run(tmp_path / "run", filter="gaussian")
    (made.folder / "film" / "sum.npy").unlink()
    with pytest.raises(RunError, match=r"sum\.npy"):
        image(made.folder)


def test_bad_expression(path_run: SyntheticRun) -> None:
    with pytest.raises(ExpressionError, match="column 2"):
        aov_image(path_run.folder, "CQ")
