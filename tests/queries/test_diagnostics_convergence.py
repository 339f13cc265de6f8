"""Convergence: running figures against plain Python, the last of them against the image."""

import pathlib
import statistics

import numpy as np
import pytest
import scipy.stats
from synthetic import SyntheticRun, make_run
from test_diagnostics_fireflies import plant
from words import matches

from queries import open_run
from queries.diagnostics.convergence import RunningMoments, convergence
from queries.errors import QueryError
from queries.images import aov_image, image
from queries.lpe.parser import parse

WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
EXPRESSION = "C <..>* <R.> <..>* L"


@pytest.fixture(params=[("path", "independent"), ("light", "independent"), ("path", "sobol"), ("both", "sobol")], ids="-".join)
def run(request: pytest.FixtureRequest, tmp_path: pathlib.Path) -> SyntheticRun:
    method, sampler = request.param
    # 18 passes: the last round of replicates is not complete
    return make_run(tmp_path / "run", method, seed=5, passes=18, sampler=sampler, replicates=4)


def pass_means(run: SyntheticRun, settings: dict, expression: str | None = None) -> list[float]:
    """Mean luminance of each pass, path by path."""
    tree = parse(expression).tree if expression else None
    pixels = settings["width"] * settings["height"]
    sums = [0.0] * settings["passes"]
    for row, word in zip(run.rows, run.words):
        if tree is None or matches(tree, word):
            walk = row["light_walk" if settings["method"] == "light" else "camera_walk"]
            sums[walk // pixels] += float(WEIGHTS @ [row[f"contribution_{c}"] for c in "rgb"]) / pixels / settings["keep"]
    return sums


def distrust(run: SyntheticRun, settings: dict, expression: str | None) -> list[bool]:
    """Whether one walk has a tenth of the squares, or squares count as fewer than 20, after each pass."""
    tree = parse(expression).tree if expression else None
    pixels, side = settings["width"] * settings["height"], "light_walk" if settings["method"] == "light" else "camera_walk"
    values: dict[int, float] = {}
    for row, word in zip(run.rows, run.words):
        if tree is None or matches(tree, word):
            values[row[side]] = values.get(row[side], 0.0) + float(WEIGHTS @ [row[f"contribution_{c}"] for c in "rgb"])
    found = []
    for number in range(settings["passes"]):
        squares = [value**2 for walk, value in values.items() if walk < (number + 1) * pixels]
        found.append(max(squares) > 0.1 * sum(squares) or sum(squares) ** 2 < 20 * sum(square**2 for square in squares))
    return found


@pytest.mark.parametrize("expression", [None, EXPRESSION])
def test_running_figures(run: SyntheticRun, expression: str | None) -> None:
    with open_run(run.folder) as opened:
        settings = opened.settings
        found = convergence(opened, expression).to_pylist()
    values, reasons = pass_means(run, settings, expression), distrust(run, settings, expression)
    assert [line["passes"] for line in found] == list(range(1, 19))
    for line in found:
        so_far = values[: line["passes"]]
        assert line["mean"] == pytest.approx(statistics.fmean(so_far))
        if settings["sampler"] == "sobol":
            replicates = [so_far[r::4] for r in range(4) if so_far[r::4]]
            units = [statistics.fmean(part) for part in replicates]
            weights = sum((len(part) / len(so_far)) ** 2 for part in replicates)
        else:
            units, weights = so_far, 1 / len(so_far)
        assert (line["unit"], line["units"]) == ("replicate" if settings["sampler"] == "sobol" else "pass", len(units))
        assert (line["verdict"] is not None) == (len(units) < 2 or reasons[line["passes"] - 1])
        if line["verdict"] is None:
            assert line["variance"] == pytest.approx(statistics.variance(units))
            assert line["standard_error"] == pytest.approx((statistics.variance(units) * weights) ** 0.5)
            assert line["relative_error"] == pytest.approx(line["standard_error"] / line["mean"])
        else:
            assert line["variance"] is line["standard_error"] is line["relative_error"] is None
    points = [(np.log(line["passes"]), np.log(line["standard_error"]), (line["units"] - 1) ** 0.5) for line in found if line["standard_error"]]
    x, y, weights = zip(*points)
    assert len(points) > 2
    if len(points) >= 4 and found[-1]["verdict"] is None:
        assert found[-1]["slope"] == pytest.approx(np.polyfit(x, y, 1, w=weights)[0])
    assert found[3]["slope"] is None


@pytest.mark.parametrize("expression", [None, EXPRESSION])
def test_the_last_mean_is_the_image_s(run: SyntheticRun, expression: str | None) -> None:
    pixels = image(run.folder) if expression is None else aov_image(run.folder, expression)
    with open_run(run.folder) as opened:
        last = convergence(opened, expression).to_pylist()[-1]["mean"]
    assert last > 0
    assert last == pytest.approx(float(pixels.mean(axis=(0, 1), dtype=np.float64) @ WEIGHTS), rel=1e-6)


def test_a_heavy_tail_is_said_from_the_pass_where_it_strikes(tmp_path: pathlib.Path) -> None:
    run = make_run(tmp_path / "run", seed=5, passes=40, sampler="independent")
    number = next(i for i, row in enumerate(run.rows) if row["camera_walk"] // 35 == 30)
    with open_run(run.folder) as opened:
        assert opened.settings["width"] * opened.settings["height"] == 35
        assert convergence(opened)["verdict"][-1].as_py() is None
    plant(run, number, 1e5)
    with open_run(run.folder) as opened:
        before, after = convergence(opened).to_pylist()[29:31]
    assert (before["verdict"], before["standard_error"] is None) == (None, False)
    assert "one walk" in after["verdict"]
    assert [after[name] for name in ("variance", "standard_error", "relative_error", "slope")] == [None] * 4


def test_few_rows_of_many_passes(run: SyntheticRun) -> None:
    with open_run(run.folder) as opened:
        whole, some = convergence(opened).to_pylist(), convergence(opened, most=6).to_pylist()
    assert 3 <= len(some) <= 6
    assert some[-1] == whole[-1]
    assert all(line in whole for line in some)


def test_the_error_of_independent_passes_falls_by_the_square_root(tmp_path: pathlib.Path) -> None:
    slopes = []
    for seed in range(12):
        with open_run(make_run(tmp_path / str(seed), seed=seed, passes=60, width=3, height=2, shards=1, sampler="independent").folder) as opened:
            slopes.append(convergence(opened).to_pylist()[-1]["slope"])
    error = statistics.stdev(slopes) / 12**0.5
    assert error < 0.1
    assert abs(statistics.fmean(slopes) + 0.5) < scipy.stats.t.isf(0.005, 11) * error


def test_incremental_moments_of_arrays() -> None:
    values = 1e6 + np.random.default_rng(1).random((50, 3))
    moments = RunningMoments()
    for value in values:
        moments.add(value)
    np.testing.assert_allclose(moments.mean, values.mean(axis=0), rtol=1e-14)
    np.testing.assert_allclose(moments.variance, values.var(axis=0, ddof=1), rtol=1e-9)


def test_a_kept_share_is_scaled(tmp_path: pathlib.Path) -> None:
    run = make_run(tmp_path / "run", seed=6, keep=0.5, sampler="independent")
    with open_run(run.folder) as opened:
        found = convergence(opened).to_pylist()[-1]["mean"]
        assert found == pytest.approx(statistics.fmean(pass_means(run, opened.settings)))


def test_a_run_without_paths_is_refused(tmp_path: pathlib.Path) -> None:
    with open_run(make_run(tmp_path / "run", keep=0).folder) as opened, pytest.raises(QueryError, match="recorded no paths"):
        convergence(opened)
