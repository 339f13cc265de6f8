"""Subpixels of recorded samples, against every sample weighed for every subpixel by hand."""

import pathlib
from typing import Any

import numpy as np
import pytest
from synthetic import SyntheticRun, make_run
from test_any_filter import without_unlit

from queries import open_run
from queries.errors import QueryError
from queries.images import aov_image, image
from queries.lpe.parser import parse
from queries.subpixel.description import layout, shipped_layouts
from queries.subpixel.expected import expected_weights
from queries.subpixel.resolve import accumulate_samples, grid, resolve
from queries.subpixel.weights import weight_tables
from renderer.filters import FILTERS, ReconstructionFilter
from renderer.filters.subpixel.filter import SubpixelFilter

F64 = np.ndarray
WIDTH, HEIGHT = 7, 5


def sinc(radius: float) -> ReconstructionFilter:
    return ReconstructionFilter("sinc", radius, lambda x: np.sinc(2 * x / radius) * np.exp(-1.5 * (x / radius) ** 2))


def filter_of(name: str, kind: str) -> SubpixelFilter:
    """``own row``: as 1-D layouts take samples; subpixels of several radii."""
    shape = layout(name)
    count = len(shape.active)
    several, one = tuple(sinc(2.0 if k % 2 else 3.0) for k in range(count)), (FILTERS["mitchell"],) * count
    if kind == "own row":
        return SubpixelFilter(kind, shape, several, (FILTERS["box"],) * count)
    if kind == "mixed":
        return SubpixelFilter(kind, shape, several, tuple(sinc(2.0) if k % 2 else FILTERS["tent"] for k in range(count)))
    if kind == "pixel":
        return SubpixelFilter(kind, shape, one, one, at_pixel=True)
    return SubpixelFilter(kind, shape, several, None)


KINDS = ("own row", "mixed", "pixel", "radial")
PAIRS = (("rgb_stripe", "own row"), ("rgbg", "mixed"), ("rgbw", "radial"), ("rgbw", "pixel"))  # together they reach every kernel


def weights(filter: SubpixelFilter, x: F64, y: F64) -> dict[tuple[int, int], F64]:
    """The weight of every sample for each subpixel, by its position."""
    shape = filter.layout
    rows, columns = shape.pattern.shape
    found = {}
    for i in range(HEIGHT * shape.cells[1]):
        for j in range(WIDTH * shape.cells[0]):
            which = np.flatnonzero((shape.active == [i % rows, j % columns]).all(axis=1))
            if not len(which):
                continue
            a, center = int(which[0]), filter.centers()[which[0]]
            dx = x - center[0] - j // columns * (columns // shape.cells[0])
            dy = y - center[1] - i // rows * (rows // shape.cells[1])
            if filter.down is None:
                found[i, j] = inside(filter.across[a], np.hypot(dx, dy))
            else:
                found[i, j] = inside(filter.across[a], dx) * inside(filter.down[a], dy)
    return found


def inside(one: ReconstructionFilter, offset: F64) -> F64:
    return np.where(np.abs(offset) < one.radius, one.weight(offset), 0.0)


def by_hand(filter: SubpixelFilter, x: F64, y: F64, rgb: F64) -> F64:
    """The lattice of some samples; NaN where neither a subpixel's weights nor its pixel's samples say anything."""
    shape = filter.layout
    lattice = np.zeros((HEIGHT * shape.cells[1], WIDTH * shape.cells[0]))
    for (i, j), weight in weights(filter, x, y).items():
        if weight.sum() > 0.1 * np.abs(weight).sum():
            color = weight @ rgb / weight.sum()
        else:
            column, row = int((j + shape.origin[0]) / shape.cells[0]), int((i + shape.origin[1]) / shape.cells[1])
            here = (np.floor(x) == column) & (np.floor(y) == row)
            color = rgb[here].mean(axis=0) if here.any() else np.full(3, np.nan)
        primary = shape.pattern[i % len(shape.pattern), j % shape.pattern.shape[1]]
        lattice[i, j] = shape.signal(color)[primary]
    return lattice


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", list(shipped_layouts()))
def test_samples(name: str, kind: str) -> None:
    generator = np.random.default_rng(1)
    filter = filter_of(name, kind)
    for count in (30, 500):  # few: weights that cancel, and pixels without samples
        x, y, rgb = generator.random(count) * WIDTH, generator.random(count) * HEIGHT, generator.random((count, 3)).astype(np.float32)
        x[0], y[1] = WIDTH - 1e-9, 1e-9
        found, expected = accumulate_samples(x, y, rgb, filter, WIDTH, HEIGHT), by_hand(filter, x, y, rgb)
        known = np.isfinite(expected)
        assert known.mean() > 0.5
        assert np.isfinite(found).all()
        np.testing.assert_allclose(found[known], expected[known], atol=1e-4 if count == 30 else 1e-5)


def test_samples_beside_the_film_are_left_out() -> None:
    filter = filter_of("rgb_stripe", "mixed")
    x, y = np.array([1.5, -0.1, 7.0, np.nan, 3.0]), np.array([1.5, 1.0, 1.0, 2.0, 5.0])
    rgb = np.ones((5, 3), np.float32) * [[1], [9], [9], [9], [9]]
    assert accumulate_samples(x, y, rgb.astype(np.float32), filter, WIDTH, HEIGHT).max() == 1.0
    with pytest.raises(QueryError, match="as many"):
        accumulate_samples(x, y[:2], rgb.astype(np.float32), filter, WIDTH, HEIGHT)


def test_weights_that_cancel_take_the_pixel_s_mean() -> None:
    """Two samples of one pixel, on a negative lobe of red and blue."""
    sharp = ReconstructionFilter("sharp", 0.5, lambda x: np.where(np.abs(x) < 0.1, 1.0, -1.0))
    filter = SubpixelFilter("sharp", layout("rgb_stripe"), (sharp,) * 3, (FILTERS["box"],) * 3)
    x, y = np.array([0.45, 0.55]), np.array([0.2, 0.7])
    rgb = np.array([[1, 2, 3], [3, 4, 5]], np.float32)
    assert accumulate_samples(x, y, rgb, filter, 1, 1).tolist() == [[2, 3, 4]]


def samples_of(made: SyntheticRun, chosen: list[int]) -> tuple[F64, F64, F64]:
    """One sample for each camera walk, with what its chosen paths carry."""
    with open_run(made.folder) as run:
        walks: dict[int, tuple[float, float, F64]] = {
            row["camera_walk"]: (row["raster_x"], row["raster_y"], np.zeros(3)) for row in [*made.rows, *run.tables["unlit"].to_pylist()]
        }
    for i in chosen:
        row = made.rows[i]
        walks[row["camera_walk"]][2][:] += [row[f"contribution_{c}"] for c in "rgb"]
    x, y, rgb = zip(*walks.values())
    return np.array(x), np.array(y), np.array(rgb)


@pytest.mark.parametrize(("name", "kind"), PAIRS)
def test_runs(path_run: SyntheticRun, name: str, kind: str) -> None:
    filter = filter_of(name, kind)
    every = list(range(len(path_run.rows)))
    with open_run(path_run.folder) as run:
        found = resolve(run, filter)
        some = resolve(run, filter, "C.*L").lattice
    expected = by_hand(filter, *samples_of(path_run, every))
    np.testing.assert_allclose(found.lattice, expected, atol=1e-5 * expected.max())
    assert found.weak == 0
    chosen = path_run.matched(parse("C.*L").tree)
    np.testing.assert_allclose(some, by_hand(filter, *samples_of(path_run, chosen)), atol=1e-5 * expected.max())


def test_blocked_connections_add_color_alone(path_run: SyntheticRun) -> None:
    filter = filter_of("rgb_stripe", "own row")
    x, y, rgb = samples_of(path_run, [])
    place = {(a, b): i for i, (a, b) in enumerate(zip(x, y))}
    for row in path_run.occluded:
        rgb[place[row["raster_x"], row["raster_y"]]] += np.array([row[f"contribution_{c}"] for c in "rgb"]) / row["mis_weight"]
    expected = by_hand(filter, x, y, rgb)
    np.testing.assert_allclose(resolve(path_run.folder, filter, "shadows; C .* .").lattice, expected, atol=1e-5 * expected.max())


@pytest.mark.parametrize("method", ["path", "light"])
@pytest.mark.parametrize("name", ["rgbg", "rgbw"])
def test_the_same_bits_on_any_number_of_threads(tmp_path: pathlib.Path, method: str, name: str) -> None:
    made = make_run(tmp_path / "run", method, passes=1, shards=6)  # a sample a pixel: bands, and subpixels that take their pixel's mean
    filter = filter_of(name, "radial")
    alone = resolve(made.folder, filter, threads=1)
    assert (alone.weak > 0) == (method == "path")
    assert alone.lattice.max() > 0
    for threads in (2, 5):
        assert np.array_equal(resolve(made.folder, filter, threads=threads).lattice, alone.lattice)
        assert np.array_equal(grid(made.folder, 2, 3, threads=threads), grid(made.folder, 2, 3, threads=1))
    if method == "path":
        x, y, rgb = samples_of(made, list(range(len(made.rows))))
        np.testing.assert_allclose(alone.lattice, accumulate_samples(x, y, rgb.astype(np.float32), filter, 7, 5), atol=1e-6 * rgb.max())


@pytest.mark.parametrize(("name", "kind"), PAIRS)
def test_light_walks_are_divided_by_expected_weights(light_run: SyntheticRun, name: str, kind: str) -> None:
    filter = filter_of(name, kind)
    place = (np.arange(12) + 0.5) / 12
    even_y, even_x = (a.ravel() for a in np.meshgrid(np.add.outer(np.arange(5), place), np.add.outer(np.arange(7), place), indexing="ij"))
    below = {where: weight.sum() / 12**2 for where, weight in weights(filter, even_x, even_y).items()}
    place_x, place_y = (np.array([row[f"raster_{a}"] for row in light_run.rows]) for a in "xy")
    rgb = np.array([[row[f"contribution_{c}"] for c in "rgb"] for row in light_run.rows])
    found = resolve(light_run.folder, filter).lattice
    shape, scale = filter.layout, found.max()
    for (i, j), weight in weights(filter, place_x, place_y).items():
        color = weight @ rgb / (below[i, j] * 12)
        assert found[i, j] == pytest.approx(
            shape.signal(color)[shape.pattern[i % len(shape.pattern), j % shape.pattern.shape[1]]], abs=float(5e-3 * scale)
        )


@pytest.mark.parametrize("name", ["rgbg", "rgbw"])
def test_expected_weights_of_a_large_film_repeat(name: str) -> None:
    """The short film that stands for a long one has the same borders and the same inner periods."""
    filter = filter_of(name, "mixed")
    tables = weight_tables(filter, 19, 17)
    place = (np.arange(24) + 0.5) / 24
    sums = tables.allocate(tables.rows)
    x = np.add.outer(np.arange(19), place).ravel()
    for line in np.add.outer(np.arange(17), place).ravel():
        tables.splat(x, np.full(len(x), line), np.zeros((len(x), 3), np.float32), 0, sums)
    expected, found = tables.to_lattice(sums[-1] / 24**2), tables.to_lattice(expected_weights(tables))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_box_for_each_pixel_is_the_image(path_run: SyntheticRun) -> None:
    shape = layout("rgb_stripe")
    filter = SubpixelFilter("pixel_box", shape, (FILTERS["box"],) * 3, (FILTERS["box"],) * 3, at_pixel=True)
    x, y, _ = samples_of(path_run, [])
    count = np.zeros((5, 7, 1))
    np.add.at(count, (y.astype(int), x.astype(int)), 1)
    with open_run(path_run.folder) as run:
        for text in (None, "C.*L"):
            expected = (image(run) if text is None else aov_image(run, text)) * run.settings["passes"] / count
            np.testing.assert_allclose(resolve(run, filter, text).lattice.reshape(5, 7, 3), expected, rtol=1e-5)
            np.testing.assert_allclose(grid(run, 1, 1, text), expected, rtol=1e-5)


def test_grid(path_run: SyntheticRun) -> None:
    x, y, rgb = samples_of(path_run, list(range(len(path_run.rows))))
    with open_run(path_run.folder) as run:
        for across, down, offset in ((3, 1, (0.0, 0.0)), (2, 2, (-0.5, 0.25))):
            found = grid(run, across, down, offset=offset)
            assert found.shape == (5 * down, 7 * across, 3)
            for i in range(5 * down):
                for j in range(7 * across):
                    here = (np.floor(x * across - offset[0]) == j) & (np.floor(y * down - offset[1]) == i)
                    if here.any():
                        np.testing.assert_allclose(found[i, j], rgb[here].mean(axis=0), rtol=1e-5)
        part = grid(run, 2, 1, window=(2, 1, 6, 4))
        assert np.array_equal(part, grid(run, 2, 1)[1:4, 4:12])
        with pytest.raises(QueryError, match="within the film"):
            grid(run, 2, 1, window=(2, 1, 8, 4))


def test_cells_without_samples_take_their_neighbors_mean(tmp_path: pathlib.Path) -> None:
    made = make_run(tmp_path / "run", passes=1)
    x, y, rgb = samples_of(made, list(range(len(made.rows))))
    found = grid(made.folder, 1, 1)
    means: dict[tuple[int, int], Any] = {}
    for i in range(5):
        for j in range(7):
            here = (y.astype(int) == i) & (x.astype(int) == j)
            if here.any():
                means[i, j] = rgb[here].mean(axis=0)
    empty = [(i, j) for i in range(5) for j in range(7) if (i, j) not in means]
    assert empty
    checked = 0
    for i, j in empty:
        near = [means[i + a, j + b] for a in (-1, 0, 1) for b in (-1, 0, 1) if (i + a, j + b) in means]
        if near:
            np.testing.assert_allclose(found[i, j], np.mean(near, axis=0), rtol=1e-5)
            checked += 1
    assert checked


def test_older_runs_are_refused(tmp_path: pathlib.Path) -> None:
    older = without_unlit(make_run(tmp_path / "run").folder)
    with pytest.raises(QueryError, match="Render it again"):
        resolve(older, filter_of("rgbg", "pixel"))
