"""Energy by class, by depth and by technique: every figure against plain Python over the paths, and distrust of heavy tails."""

import collections
import pathlib
import re
import statistics
from collections.abc import Callable
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from running import run_job, shared_kernels
from synthetic import SyntheticRun, make_run
from test_diagnostics_fireflies import luminance, plant

from pipeline.deeper import run_scene, trace_again
from queries import Run, open_run
from queries.classify import select_all
from queries.diagnostics import DIAGNOSTICS
from queries.diagnostics.answers import meanings
from queries.diagnostics.classes_energy import classes
from queries.diagnostics.depths import depths
from queries.diagnostics.effective import effective
from queries.diagnostics.fireflies import fireflies
from queries.errors import QueryError
from queries.images import image
from queries.lpe import compile
from renderer.tables import EMITTER_HIT, TECHNIQUES

SCENE = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "spheres.yaml"
NAMES = re.compile(r"@\w+:(?:'(?:\\.|[^'])*'|\w+)")  # of objects and lights in expressions
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
Rows = list[dict[str, Any]]


@pytest.fixture(params=["path", "light", "both"])
def run(request: pytest.FixtureRequest, tmp_path: pathlib.Path) -> SyntheticRun:
    # 40 passes: each is a unit of the error
    return make_run(tmp_path / "run", request.param, seed=13, passes=40, sampler="independent", keep=0.5)


def owner(settings: dict[str, Any]) -> str:
    return "light_walk" if settings["method"] == "light" else "camera_walk"


def walk_values(rows: Rows, settings: dict[str, Any]) -> dict[int, float]:
    """What each walk adds with these rows."""
    values: dict[int, float] = collections.defaultdict(float)
    for row in rows:
        values[row[owner(settings)]] += luminance(row)
    return values


def figures(rows: Rows, settings: dict[str, Any]) -> dict[str, float]:
    """Energy, its standard error over passes, and numbers of samples, walk by walk."""
    pixels = settings["width"] * settings["height"]
    values = walk_values(rows, settings)
    passes = [0.0] * settings["passes"]
    for walk, value in values.items():
        passes[walk // pixels] += value / pixels / settings["keep"]
    return {
        "paths": len(rows),
        "samples": len(values),
        "energy": statistics.fmean(passes),
        "standard_error": statistics.stdev(passes) / len(passes) ** 0.5,
        "effective_samples": sum(values.values()) ** 2 / sum(value**2 for value in values.values()),
    }


def distrusted(rows: Rows, settings: dict[str, Any]) -> bool:
    """The documented verdict: one walk has a tenth of the squares, or squares count as fewer than 20."""
    squares = [value**2 for value in walk_values(rows, settings).values()]
    return max(squares) > 0.1 * sum(squares) or sum(squares) ** 2 / sum(square**2 for square in squares) < 20


def assert_figures(line: dict[str, Any], rows: Rows, settings: dict[str, Any]) -> None:
    expected = figures(rows, settings)
    for name in ("paths", "samples", "energy", "effective_samples"):
        if name in line:
            assert line[name] == pytest.approx(expected[name], rel=1e-6), name
    if distrusted(rows, settings):
        assert line["verdict"]
        assert line["standard_error"] is None
        assert all(line[name] is None for name in ("variance", "relative_error", "efficiency") if name in line)
    else:
        assert line["verdict"] is None
        assert line["standard_error"] == pytest.approx(expected["standard_error"], rel=1e-6)
        if "variance" in line:
            assert line["variance"] == pytest.approx(expected["standard_error"] ** 2, rel=1e-6)
            assert line["relative_error"] == pytest.approx(expected["standard_error"] / expected["energy"], rel=1e-6)


def by_letters(run: SyntheticRun) -> dict[tuple[tuple[str, str | None], ...], Rows]:
    found: dict[tuple[tuple[str, str | None], ...], Rows] = collections.defaultdict(list)
    for row, word in zip(run.rows, run.words):
        found[tuple((event.type, event.scattering) for event in word)].append(row)
    return found


def test_classes(run: SyntheticRun) -> None:
    with open_run(run.folder) as opened:
        opened.manifest["stats"] = {"render_seconds": 2.5}
        found, settings = classes(opened).to_pylist(), opened.settings
    expected = by_letters(run)
    assert len(found) == len(expected) > 20
    for number, line in enumerate(found):
        letters = tuple((letter[0], letter[1:] or None) for letter in line["expression"].replace("<", "").replace(">", "").split())
        if number < 8:
            expression = compile(line["expression"])
            assert [key for key in expected if expression.accepts([(*event, ()) for event in key])] == [letters]
        assert_figures(line, expected[letters], settings)
        assert line["units"] == settings["passes"]
        assert line["description"]
        if line["verdict"] is None:
            assert line["efficiency"] == pytest.approx(1 / (line["variance"] * 2.5))
    assert {line["verdict"] is None for line in found} == {True, False}
    assert [line["energy"] for line in found] == sorted((line["energy"] for line in found), reverse=True)
    assert sum(line["share"] for line in found) == pytest.approx(1.0)


def test_classes_of_objects_are_parts_of_those_without(run: SyntheticRun) -> None:
    with open_run(run.folder) as opened:
        coarse, fine = classes(opened).to_pylist(), classes(opened, with_objects=True, most=10**6).to_pylist()
        top = classes(opened, most=3).to_pylist()
        named = [line for line in fine if "@light:" in line["expression"] and "@object:" in line["expression"]]
        assert len(named) > 20
        for line in named[:4]:
            selected = sum(int(chosen.sum()) for chosen in select_all(opened, opened.compile(line["expression"])))
            assert selected == line["paths"] > 0
    assert len(fine) > len(coarse)
    for name in ("energy", "paths", "share"):
        by_class: dict[str, float] = collections.defaultdict(float)
        for line in fine:
            by_class[NAMES.sub("", line["expression"])] += line[name]
        assert by_class == pytest.approx({line["expression"]: line[name] for line in coarse}), name
    assert top == coarse[:3]


def test_depths(run: SyntheticRun) -> None:
    with open_run(run.folder) as opened:
        found, settings = depths(opened).to_pylist(), opened.settings
    expected: dict[int, Rows] = collections.defaultdict(list)
    for row, word in zip(run.rows, run.words):
        expected[len(word) - 1].append(row)  # segments: one less than events, camera and light included
    assert len(expected) > 3
    assert [line["depth"] for line in found] == list(range(1, len(found) + 1))
    assert {line["depth"] for line in found if line["paths"]} == set(expected)
    for line in found:
        if line["paths"]:
            assert_figures(line, expected[line["depth"]], settings)
    assert sum(line["share"] for line in found) == pytest.approx(1.0)


def test_effective(run: SyntheticRun) -> None:
    with open_run(run.folder) as opened:
        found, settings = effective(opened).to_pylist(), opened.settings
    assert_figures(found[0], run.rows, settings)
    recorded = settings["passes"] * settings["width"] * settings["height"] * settings["keep"]
    assert found[0]["effectiveness"] == pytest.approx(found[0]["effective_samples"] / recorded)
    parts = {TECHNIQUES.index(line["technique"]): line for line in found[1:]}
    assert found[0]["technique"] == "all"
    assert set(parts) == {row["technique"] for row in run.rows} != set()
    for technique, line in parts.items():
        assert_figures(line, [row for row in run.rows if row["technique"] == technique], settings)
    assert sum(line["energy"] for line in found[1:]) == pytest.approx(found[0]["energy"])


@pytest.mark.parametrize("ask", [classes, depths, effective])
def test_a_heavy_tail_is_distrusted_instead_of_printed(tmp_path: pathlib.Path, ask: Callable[[Run], pa.Table]) -> None:
    run = make_run(tmp_path / "run", seed=17, passes=40, sampler="independent")
    before, after = [], []
    number = next(i for i, row in enumerate(run.rows) if row["technique"] == EMITTER_HIT and len(run.words[i]) == 3)
    with open_run(run.folder) as opened:
        before = ask(opened).to_pylist()
    plant(run, number, 1e5)
    with open_run(run.folder) as opened:
        after = ask(opened).to_pylist()
    struck = max(after, key=lambda line: line["energy"])
    key = next(name for name in ("expression", "depth", "technique") if name in struck)
    was = next(line for line in before if line[key] == struck[key])
    assert was["verdict"] is None
    assert was["standard_error"] > 0
    assert "one walk" in struck["verdict"]
    assert struck["standard_error"] is None


def test_threads_do_not_matter(run: SyntheticRun) -> None:
    for name, (ask, _) in DIAGNOSTICS.items():
        tables = []
        for threads in (1, 3):
            with open_run(run.folder, threads=threads) as opened:
                tables.append(ask(opened))
        assert tables[0].equals(tables[1]), name
        assert tables[0].num_rows > 0 or name == "fireflies"


def test_every_figure_says_what_it_means(run: SyntheticRun) -> None:
    assert set(DIAGNOSTICS) == {"fireflies", "classes", "convergence", "depths", "effective"}
    with open_run(run.folder) as opened:
        for ask, title in DIAGNOSTICS.values():
            assert title
            assert all(len(meaning) > 3 for meaning in meanings(ask(opened)).values())


@pytest.mark.parametrize("name", list(DIAGNOSTICS))
def test_runs_that_cannot_answer_are_refused(tmp_path: pathlib.Path, name: str) -> None:
    with open_run(make_run(tmp_path / "none", keep=0).folder) as opened, pytest.raises(QueryError, match="recorded no paths"):
        DIAGNOSTICS[name][0](opened)
    with open_run(make_run(tmp_path / "part").folder, shards=range(1)) as opened, pytest.raises(QueryError, match="open all of it"):
        DIAGNOSTICS[name][0](opened)


# --- runs of the renderer -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["path", "light"])
def real(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    place = tmp_path_factory.mktemp("diagnosed")
    render = f"method: {request.param}, resolution: [20, 16], samples: 12, seed: 3, sampler: independent, max_depth: 7, rr_depth: 4"
    (place / "job.yaml").write_text(f"name: spheres\nscene: {SCENE}\nrender: {{{render}}}\n")
    return run_job(place / "job.yaml", out=place / "run", threads=1).path


def test_energies_sum_to_the_image(real: pathlib.Path) -> None:
    pixels = image(real)
    whole = float(pixels.mean(axis=(0, 1), dtype=np.float64) @ WEIGHTS)
    assert whole > 0
    with open_run(real) as opened:
        for ask in (classes, depths):
            assert sum(ask(opened)["energy"].to_pylist()) == pytest.approx(whole, rel=1e-5)
        assert effective(opened)["energy"][0].as_py() == pytest.approx(whole, rel=1e-5)


def test_the_walk_of_an_outlier_traced_again_gives_its_path(real: pathlib.Path) -> None:
    with open_run(real) as opened:
        found = fireflies(opened, variance_share=0.05, deviations=1.0).to_pylist()  # to have some
        assert len(found) > 3
        settings, rows = opened.settings, []
        walks = np.array(sorted({line["walk"] for line in found}), np.uint64)
        with shared_kernels():  # those of the run: the same bits
            trace_again(
                opened,
                walks,
                settings["max_depth"],
                run_scene(opened),
                lambda table, batch: rows.extend(batch.to_pylist() if table == "paths" else []),
            )
    again = {(row[owner(settings)], row["path"]): row for row in rows}
    for line in found:
        row = again[line["walk"], line["path"]]
        assert luminance(row) == line["path_luminance"]
        assert (int(row["raster_x"]), int(row["raster_y"])) == (line["pixel_x"], line["pixel_y"])
        if settings["method"] == "path":
            assert line["walk"] % (20 * 16) == line["pixel_y"] * 20 + line["pixel_x"]


def test_no_path_is_longer_than_the_limit_and_ends_are_those_of_the_vertices(real: pathlib.Path) -> None:
    with open_run(real) as opened:
        found = depths(opened).to_pylist()
        side = "light" if opened.settings["method"] == "light" else "camera"
        ends = opened.connection.execute(f"SELECT depth, event, count(*) FROM {side}_vertices WHERE event < 4 GROUP BY ALL").fetchall()
        walks = opened.connection.execute(f"SELECT count(DISTINCT walk) FROM {side}_vertices").fetchone()
    assert max(line["depth"] for line in found if line["paths"]) == 7
    names = ("absorbed", "escaped", "roulette", "depth_limit")
    counted = {(line["depth"], key): line[name] for line in found for key, name in enumerate(names) if line[name]}
    assert counted == {(depth, event): count for depth, event, count in ends}
    assert len({event for _, event in counted}) == 4
    ended = sum(counted.values())
    # a light walk may be dropped at its emitter; every camera walk ends somewhere
    assert walks is not None
    assert ended == walks[0] if side == "camera" else 0.9 * walks[0] < ended <= walks[0]
