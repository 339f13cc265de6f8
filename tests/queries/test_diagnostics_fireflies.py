"""Fireflies: a planted one is found with its provenance, the rule is the documented one, and light tails are left alone."""

import pathlib
import statistics
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import scipy.stats
from synthetic import SyntheticRun, make_run

from queries import open_run
from queries.diagnostics.fireflies import fireflies
from queries.diagnostics.outliers import LEAST_WALKS, PixelSums, outlier_pixels, pixel_sums
from queries.errors import QueryError
from queries.lpe import compile
from renderer.tables import TECHNIQUES

WEIGHTS = (0.2126, 0.7152, 0.0722)
SHARE, DEVIATIONS, RADIUS, PATH_SHARE = 0.25, 8.0, 2, 0.1  # the defaults
CHANCE = 1e-4  # of an outlier in a pixel of 16 light-tailed walks or more, as documented


def luminance(row: dict[str, Any]) -> float:
    return sum(weight * row[f"contribution_{channel}"] for weight, channel in zip(WEIGHTS, "rgb"))


def plant(run: SyntheticRun, number: int, light: float) -> dict[str, Any]:
    """Give the ``number``-th path so much light, on disk and in memory."""
    found = run.rows[number]
    owner = "light_walk" if not (run.folder / "tables" / "camera_vertices").exists() else "camera_walk"
    for file in sorted((run.folder / "tables" / "paths").glob("*.arrow")):
        table = pa.ipc.open_file(str(file)).read_all()
        here = np.flatnonzero((table[owner].to_numpy() == found[owner]) & (table["path"].to_numpy() == found["path"]))
        if not len(here):
            continue
        for channel in "rgb":
            column = table.schema.get_field_index(f"contribution_{channel}")
            values = table[column].to_numpy().copy()
            values[here] = np.float32(light)
            table = table.set_column(column, table.schema.field(column), pa.array(values))
            found[f"contribution_{channel}"] = float(values[here[0]])
        with pa.ipc.new_file(str(file), table.schema) as writer:
            writer.write_table(table)
        return found
    raise AssertionError("no such path")


def by_brute_force(run: SyntheticRun, settings: dict[str, Any]) -> list[tuple[int, int, int, int]]:
    """Column, row, walk and path of what should be listed, by the documented rule in plain Python."""
    width, height, owner = settings["width"], settings["height"], f"{'light' if settings['method'] == 'light' else 'camera'}_walk"
    walks = settings["passes"] * settings["keep"] * (width * height if settings["method"] == "light" else 1)
    values: dict[tuple[int, int], dict[int, float]] = {(x, y): {} for y in range(height) for x in range(width)}
    for row in run.rows:
        pixel = values[int(row["raster_x"]), int(row["raster_y"])]
        pixel[row[owner]] = pixel.get(row[owner], 0.0) + luminance(row)
    shown = {pixel: sum(found.values()) / settings["passes"] / settings["keep"] for pixel, found in values.items()}
    listed = []
    for (x, y), found in values.items():
        mean = sum(found.values()) / walks
        squares = sum((value - mean) ** 2 for value in found.values()) + (walks - len(found)) * mean**2
        carriers = {walk for walk, value in found.items() if value > mean and (value - mean) ** 2 > SHARE * squares}
        around = [shown[at] for at in shown if at != (x, y) and max(abs(at[0] - x), abs(at[1] - y)) <= RADIUS]
        typical = statistics.median(around)
        off = [abs(value - typical) for value in around]
        spread = max(1.4826 * statistics.median(off), 1.2533 * statistics.fmean(off))
        if carriers and shown[x, y] > typical + DEVIATIONS * spread:
            rows = [r for r in run.rows if (int(r["raster_x"]), int(r["raster_y"])) == (x, y) and r[owner] in carriers]
            rows = [r for r in rows if luminance(r) > PATH_SHARE * found[r[owner]]]
            listed += [(x, y, r[owner], r["path"]) for r in rows]
    return sorted(listed)


@pytest.fixture(params=["path", "light", "both"])
def planted(request: pytest.FixtureRequest, tmp_path: pathlib.Path) -> tuple[SyntheticRun, list[dict[str, Any]]]:
    run = make_run(tmp_path / "run", request.param, seed=7, passes=20, width=9, height=8)
    return run, [plant(run, number, 400.0) for number in (100, 900)]


def test_planted_fireflies_are_found_with_their_provenance(planted: tuple[SyntheticRun, list[dict[str, Any]]]) -> None:
    run, rows = planted
    with open_run(run.folder) as opened:
        found = fireflies(opened).to_pylist()
        owner = "light_walk" if opened.settings["method"] == "light" else "camera_walk"
        assert len({(row[owner], int(row["raster_x"]), int(row["raster_y"])) for row in rows}) == 2
        for row in rows:
            line = next(line for line in found if (line["walk"], line["path"]) == (row[owner], row["path"]))
            assert (line["pixel_x"], line["pixel_y"]) == (int(row["raster_x"]), int(row["raster_y"]))
            assert line["technique"] == TECHNIQUES[row["technique"]]
            assert line["path_luminance"] == pytest.approx(luminance(row))
            assert line["variance_share"] > 0.9
            assert line["without"] < line["luminance"] / 4
            # the class is that of the path, and its expression selects it
            word = run.words[run.rows.index(row)]
            assert compile(line["expression"]).accepts([(event.type, event.scattering, event.labels) for event in word])
            names = [event.labels[0] for event in word[1:-1]]
            assert line["objects"] == ", ".join(names)
            assert line["description"]


def test_the_rule_is_the_documented_one(planted: tuple[SyntheticRun, list[dict[str, Any]]]) -> None:
    run, _ = planted
    with open_run(run.folder) as opened:
        expected = by_brute_force(run, opened.settings)
        found = [(line["pixel_x"], line["pixel_y"], line["walk"], line["path"]) for line in fireflies(opened).to_pylist()]
    assert len(expected) >= 2
    assert sorted(found) == expected


def test_the_largest_excess_comes_first_and_the_list_is_cut(planted: tuple[SyntheticRun, list[dict[str, Any]]]) -> None:
    run, _ = planted
    with open_run(run.folder) as opened:
        whole, first = fireflies(opened).to_pylist(), fireflies(opened, most=1).to_pylist()
    excess = [line["luminance"] - line["typical"] for line in whole]
    assert excess == sorted(excess, reverse=True)
    pixels = {(line["pixel_x"], line["pixel_y"]) for line in first}
    assert len(pixels) == 1
    assert first == [line for line in whole if (line["pixel_x"], line["pixel_y"]) in pixels]


def test_threads_do_not_matter(planted: tuple[SyntheticRun, list[dict[str, Any]]]) -> None:
    run, _ = planted
    tables = []
    for threads in (1, 3):
        with open_run(run.folder, threads=threads) as opened:
            tables.append(fireflies(opened))
    assert tables[0].num_rows > 0
    assert tables[0].equals(tables[1])


@pytest.mark.parametrize("method", ["path", "both"])
def test_a_run_with_light_tails_has_none(tmp_path: pathlib.Path, method: str) -> None:
    run = make_run(tmp_path / "run", method, seed=11, passes=24, width=16, height=12)
    with open_run(run.folder) as opened:
        sums = pixel_sums(opened)
        assert (sums.total > 0).all()
        assert fireflies(opened).num_rows == 0


@pytest.mark.parametrize("tail", ["uniform", "exponential", "chi-square"])
@pytest.mark.parametrize("walks", [16, 64])
def test_false_positives_are_as_rare_as_documented(tail: str, walks: int) -> None:
    side = 300
    generator = np.random.default_rng([walks, len(tail)])
    total, squares, largest = np.zeros(side * side), np.zeros(side * side), np.zeros(side * side)
    for _ in range(walks):
        draw = {"uniform": generator.random, "exponential": generator.standard_exponential, "chi-square": generator.standard_normal}[tail](
            side * side
        )
        value = draw**2 if tail == "chi-square" else draw
        total += value
        squares += value**2
        largest = np.maximum(largest, value)
    sums = PixelSums(total, squares, largest, walks, 1.0 / walks)
    assert (sums.deviation > 0).all()
    found = len(outlier_pixels(sums, side, SHARE, DEVIATIONS, RADIUS).pixel)
    assert found <= scipy.stats.binom.isf(0.01 / 6, side * side, CHANCE)
    # the same rule is not blind: a walk that brings as much light as ten pixels is seen
    struck = np.arange(50, side * side, 997)
    firefly = 10.0 * walks * total.mean() / walks
    total[struck] += firefly
    squares[struck] += firefly**2
    largest[struck] = firefly
    seen = outlier_pixels(PixelSums(total, squares, largest, walks, 1.0 / walks), side, SHARE, DEVIATIONS, RADIUS).pixel
    assert np.isin(struck, seen).mean() > 0.99


def test_few_samples_cannot_tell(tmp_path: pathlib.Path) -> None:
    run = make_run(tmp_path / "run", passes=LEAST_WALKS - 1)
    with open_run(run.folder) as opened, pytest.raises(QueryError, match="recorded walks for each pixel"):
        fireflies(opened)


def test_a_run_without_paths_is_refused(tmp_path: pathlib.Path) -> None:
    run = make_run(tmp_path / "run", keep=0)
    with open_run(run.folder) as opened, pytest.raises(QueryError, match="recorded no paths"):
        fireflies(opened)
