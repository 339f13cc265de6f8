"""Images from tables: every path in its pixel, every filter, and partitions that sum to the whole."""

import pathlib
from typing import Any

import numpy as np
import pytest
from placed import make_placed_run
from synthetic import SyntheticRun, make_run

from queries import images as image_module
from queries import open_run
from queries.errors import ExpressionError, QueryError, RunError
from queries.images import aov_image, image, images, select
from queries.kernels.splat import splat_box, splat_filter
from queries.lpe import compile
from queries.lpe.parser import parse
from renderer.filters import reconstruction_filter
from renderer.tables import EMITTER_HIT


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


# --- many at once -------------------------------------------------------------------------------------------------


def test_many_images_in_one_pass_are_those_of_one(any_run: SyntheticRun) -> None:
    texts = {"a": "C.*L", "b": "CD.*.", "c": "C.*'glass_ball'.*.", "nothing": "CDDDDDDDDL"}
    with open_run(any_run.folder) as run:
        found = select(run, {**texts, "all": None})
        for name, text in texts.items():
            np.testing.assert_array_equal(found[name].image, aov_image(run, text))
            assert found[name].rows == len(any_run.matched(parse(text).tree))
        assert found["all"].rows == len(any_run.rows)
        np.testing.assert_array_equal(found["all"].image, image(run))
    assert found["nothing"].rows == 0
    assert not found["nothing"].image.any()
    assert list(images(any_run.folder, texts)) == list(texts)


@pytest.mark.parametrize("filter", ["box", "gaussian"])
def test_the_same_bits_on_any_number_of_threads(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, filter: str) -> None:
    made = make_run(tmp_path / "run", filter=filter, shards=9, passes=12)
    texts = {"a": "C.*L", "b": "CD.*."}
    alone = images(made.folder, texts, threads=1)
    monkeypatch.setattr(image_module, "_MEMORY", 1)  # an image at a time
    for threads in (2, 5):
        again = images(made.folder, texts, threads=threads)
        assert all(np.array_equal(alone[name], again[name]) for name in texts)
    assert alone["a"].any()


@pytest.mark.parametrize("filter", ["box", "gaussian"])
def test_shards_that_reach_a_band_of_the_film(tmp_path: pathlib.Path, filter: str) -> None:
    """Camera walks start in the order of the pixels: with fewer walks than pixels, a shard's sums are some rows of the film."""
    made = make_run(tmp_path / "run", filter=filter, passes=1, shards=7)
    with open_run(made.folder) as run:
        expected = made.image(list(range(len(made.rows))), run.settings)
        np.testing.assert_allclose(image(run), expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())


# --- prefixes -----------------------------------------------------------------------------------------------------


def summed(rows: list[dict[str, Any]], values: list[list[float]], settings: dict[str, Any]) -> np.ndarray:
    """The image of some rows, each counting a color, through a box."""
    found = np.zeros((settings["height"], settings["width"], 3))
    for row, value in zip(rows, values):
        found[int(row["raster_y"]), int(row["raster_x"])] += value
    return found / settings["passes"]


def test_prefixes_change_what_paths_count(tmp_path: pathlib.Path) -> None:
    made = make_placed_run(tmp_path / "run", "path", 3)
    colors = [[row[f"contribution_{c}"] for c in "rgb"] for row in made.rows["paths"]]
    whole = [[row[f"contribution_{c}"] / row["mis_weight"] for c in "rgb"] for row in made.rows["occluded"]]
    rows: dict[str, list[Any]] = {"shadows": made.rows["occluded"], "unoccluded": list(made.rows["occluded"])}
    values = {"shadows": whole, "unoccluded": list(whole)}
    for row, color, word in zip(made.rows["paths"], colors, made.words["paths"]):
        competing = row["technique"] == 0 and len(word) > 2 and word[-2].scattering not in ("S", "s")
        if not competing:
            rows["unoccluded"].append(row)
            values["unoccluded"].append([value / row["mis_weight"] for value in color])
    assert 0 < len(rows["unoccluded"]) - len(rows["shadows"]) < len(made.rows["paths"])
    with open_run(made.folder) as run:
        for prefix in rows:
            expected = summed(rows[prefix], values[prefix], run.settings)
            np.testing.assert_allclose(aov_image(run, f"{prefix}; C .* ."), expected, rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(aov_image(run, "noclamp; C .* ."), image(run))
        throughput = {(row["walk"], row["depth"]): row for row in run.tables["camera_vertices"].to_pylist()}
        bare = []
        for row, color in zip(made.rows["paths"], colors):
            vertex = throughput.get((row["camera_walk"], max(row["camera_depth"] - (row["technique"] == EMITTER_HIT), 1)))
            bare.append([value / vertex[f"throughput_{c}"] if vertex else 0.0 for value, c in zip(color, "rgb")])
        np.testing.assert_allclose(aov_image(run, "nothruput; C .* ."), summed(made.rows["paths"], bare, run.settings), rtol=1e-5, atol=1e-6)


def test_prefixes_that_a_run_cannot_answer(tmp_path: pathlib.Path, both_run: SyntheticRun) -> None:
    made = make_run(tmp_path / "run")
    for text, message in (("unoccluded; C L", r"record: \{occluded: true\}"), ("shadows; C L", "blocked connections")):
        with pytest.raises(QueryError, match=message):
            aov_image(made.folder, text)
    with pytest.raises(QueryError, match="light walks"):
        aov_image(both_run.folder, "nothruput; C .* L")


# --- kernels, by hand ---------------------------------------------------------------------------------------------


def test_splat_box() -> None:
    x, y = np.array([0.5, 1.9, 1.0, 7.0, np.nan, 0.2], np.float32), np.array([2.5, 3.1, 2.0, 2.0, 2.0, 9.0], np.float32)
    color = np.arange(1, 7, dtype=np.float32)
    found = np.zeros((2, 2, 3))
    splat_box(np.array([1, 1, 1, 1, 1, 1], np.bool_), x, y, color, 2 * color, 3 * color, 2, found)
    assert found.tolist() == [[[1, 2, 3], [3, 6, 9]], [[0, 0, 0], [2, 4, 6]]]
    splat_box(np.array([0, 0, 1, 0, 0, 0], np.bool_), x, y, color, color, color, 2, found)
    assert found[0, 1].tolist() == [6, 9, 12]


def test_splat_filter_with_a_tent() -> None:
    """Weights of a tent of radius 1 at a quarter of a pixel from the center: 0.75 there, 0.25 beside."""
    table, found = np.linspace(1.0, 0.0, 5), np.zeros((3, 3, 3))
    one, center, beside = np.ones(1, np.float32), np.array([1.5], np.float32), np.array([1.75], np.float32)
    splat_filter(np.ones(1, np.bool_), beside, center, one, one, 2 * one, 0, table, np.float64(1.0), np.zeros(3), found)
    assert found[1, :, 0].tolist() == [0, 0.75, 0.25]
    assert found[1, :, 2].tolist() == [0, 1.5, 0.5]
    assert found.sum() == 4
