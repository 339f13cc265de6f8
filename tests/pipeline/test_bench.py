"""The benchmark's arithmetic and its judgments; whole runs at tiny size. No time is asserted."""

import importlib.util
import json
import os
import pathlib

import numpy as np
import pytest
from tiny_job import write_job
from typer.testing import CliRunner

from pipeline.bench import contenders, main, pictures, questions
from pipeline.bench.config import load_benchmark
from pipeline.bench.contenders import Contenders, NotAvailable
from pipeline.bench.diffuse_alone import REPLACED
from pipeline.bench.error import Curve, Reference, error_rows
from pipeline.bench.llvm import candidates, usable, version
from pipeline.bench.rates import rate_rows, recording_rows
from pipeline.bench.timing import Timing, alternate, ratio, spread
from pipeline.bench.worker import Worker, WorkerError
from pipeline.cli import app
from pipeline.errors import JobError
from pipeline.prepare import prepare_job
from renderer.integrators import path as path_tracer
from viz.charts import ErrorCurve, error_chart

ROOT = pathlib.Path(__file__).parents[2]
SHIPPED = ROOT / "configs" / "benchmarks" / "path.yaml"
TINY = """
name: tiny
job: tiny.yaml
settings: {render.samples: 4, render.resolution: [16, 16]}
threads: 2
rounds: 2
"""


def write_benchmark(folder: pathlib.Path, more: str) -> pathlib.Path:
    write_job(folder)
    path = folder / "bench.yaml"
    path.write_text(TINY + more)
    return path


# --- the file -----------------------------------------------------------------------------------------------------


def test_the_shipped_benchmark_is_the_goal_tables() -> None:
    loaded = load_benchmark(SHIPPED)
    settings = prepare_job(loaded.job, loaded.overrides).settings
    assert (settings.width, settings.height, settings.passes, settings.max_depth, loaded.benchmark.threads) == (256, 256, 64, 8, 2)
    assert loaded.benchmark.memory.samples == [64, 512]
    assert set(loaded.benchmark.sections) == {"rates", "size", "memory", "error", "start", "features"}


def test_settings_change_the_file() -> None:
    loaded = load_benchmark(SHIPPED, ["rounds=1", "sections=[size]", "error.rounds=2", "settings.render.samples=2"])
    assert (loaded.benchmark.rounds, loaded.benchmark.sections, loaded.benchmark.error.rounds) == (1, ["size"], 2)
    assert "render.samples=2" in loaded.overrides


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("round: 3", "unknown key `round`: did you mean `rounds`"),
        ("sections: [speed]", "`sections.0`"),
        ("rounds: 0", "`rounds`"),
        ("job: nowhere.yaml", "there is no job file"),
        ("out: [", "not valid YAML"),
        ("questions: {ask: [{what: a, most_seconds: 1}]}", "expected either `expression` or `rank`"),
    ],
)
def test_bad_files_are_explained(tmp_path: pathlib.Path, more: str, message: str) -> None:
    path = write_benchmark(tmp_path, "")
    path.write_text("\n".join(line for line in TINY.splitlines() if line.split(":")[0] != more.split(":")[0]) + "\n" + more)
    with pytest.raises(JobError, match=message) as found:
        load_benchmark(path)
    assert str(path) in str(found.value)


# --- arithmetic ---------------------------------------------------------------------------------------------------


def test_contenders_alternate_and_every_other_round_goes_backwards() -> None:
    order: list[tuple[str, int]] = []

    def note(name: str, number: int) -> Timing:
        order.append((name, number))
        return Timing(1.0, 1.0)

    found = alternate({name: lambda number, name=name: note(name, number) for name in "abc"}, 2)
    assert order == [("a", 0), ("b", 0), ("c", 0), ("c", 1), ("b", 1), ("a", 1)]
    assert {name: len(timings) for name, timings in found.items()} == {"a": 2, "b": 2, "c": 2}


def test_ratios_are_of_medians_and_ranges_of_rounds() -> None:
    found = ratio([2.0, 9.0, 3.0], [1.0, 3.0, 2.0])
    assert (found.median, found.low, found.high) == (3.0 / 2.0, 1.5, 3.0)
    assert spread([3.0, 1.0, 2.0]).text(".1f", " s") == "2.0 s (1.0–3.0)"


def test_rates_are_judged_by_time_of_theirs_over_ours() -> None:
    walls = {"independent": [1.0], "recorded": [1.5], "mitsuba_llvm": [1.31]}
    rows = {row.what: row for row in rate_rows(walls, walls, {"mitsuba_scalar": "not installed"}) if "llvm" in row.goal}
    assert rows["samples per second, nothing recorded (ours, independent)"].passed is True
    assert rows["samples per second, every path recorded to disk (ours, recorded)"].passed is False
    (missing,) = [row for row in rate_rows(walls, walls, {"mitsuba_scalar": "not installed"}) if "scalar" in row.goal]
    assert (missing.measured, missing.passed) == ("not installed", None)
    assert [row.passed for row in recording_rows(walls, walls)] == [False]


def test_a_power_law_is_interpolated_exactly() -> None:
    seconds = [0.1, 0.2, 0.4, 0.8]
    errors = [0.03 * s**-1.3 for s in seconds]
    curve = Curve([1, 2, 4, 8], errors, errors, seconds, seconds)
    for s in (0.05, 0.1, 0.33, 0.8, 3.0):
        assert curve.at(s, curve.error) == pytest.approx(0.03 * s**-1.3, rel=1e-9)


def test_error_is_compared_at_the_time_of_the_other() -> None:
    """Ours has a third of the error at equal samples, and takes twice as long for them."""
    n = [16, 64, 256]
    theirs = Curve(n, [1 / k for k in n], [1 / k for k in n], [k / 100 for k in n], [k / 100 for k in n])
    ours = Curve(n, [1 / (3 * k) for k in n], [1 / k for k in n], [k / 50 for k in n], [k / 50 for k in n])
    (row,) = error_rows({"sobol": ours, "mitsuba_llvm": theirs}, {}, 64)
    assert row.passed is True
    assert row.measured.startswith("0.67 × ")
    assert row.measured.endswith("relative squared error 2.00 ×")


def test_the_references_own_error_is_taken_off() -> None:
    """Noise of known variance: the estimate must be that variance, within four standard errors of a mean of squares."""
    rng = np.random.default_rng(1)
    shape, noise, reference_noise = (200, 200, 3), 0.1, 0.08
    a, b = (rng.normal(1.0, reference_noise, shape) for _ in range(2))
    reference = Reference((a + b) / 2, (a - b) ** 2 / 4, ("a", "b"), 0.0)
    image = rng.normal(1.0, noise, shape).astype(np.float32)
    found, relative = reference.error(image)
    spread_of_squares = np.sqrt(2.0 / np.prod(shape)) * (noise**2 + reference_noise**2 / 2)
    assert abs(found - noise**2) < 4.0 * np.sqrt(2.0) * spread_of_squares
    assert found + reference.squared_error.mean() == pytest.approx(np.mean((image - reference.image) ** 2), rel=1e-6)
    assert relative == pytest.approx(found / 1.01, rel=0.05)  # the picture is 1 everywhere


# --- LLVM and helper processes ------------------------------------------------------------------------------------


def test_newest_llvm_is_tried_first() -> None:
    versions = [version(path) for path in candidates()]
    assert versions == sorted(versions, reverse=True)


def test_a_library_that_is_no_llvm_is_not_usable(tmp_path: pathlib.Path) -> None:
    (tmp_path / "libLLVM-99.so").write_bytes(b"junk")
    assert not usable(str(tmp_path / "libLLVM-99.so"))


def test_a_helper_that_dies_is_named(tmp_path: pathlib.Path) -> None:
    with Worker("pipeline.bench.no_such_helper", [], tmp_path / "log") as worker, pytest.raises(WorkerError, match="no_such_helper"):
        worker.ask()
    assert "No module named" in (tmp_path / "log").read_text()


def test_mitsuba_renders_the_same_picture(tmp_path: pathlib.Path) -> None:
    """Image means of both programs, within five standard errors that come from halves of each picture's own variance."""
    pytest.importorskip("mitsuba")
    job, overrides = write_job(tmp_path), ["aovs={}", "render.filter=box", "render.sampler=independent"]
    prepared = prepare_job(job, overrides)
    made = Contenders(prepared.scene, prepared.settings, 2, job, overrides, tmp_path, tmp_path)
    try:
        pictures = {name: [made.get(name).picture(32, seed)[0] for seed in (1, 2)] for name in ("independent", "mitsuba_scalar")}
    finally:
        made.close()
    assert not (tmp_path / "render").exists()
    (a, b), (c, d) = pictures["independent"], pictures["mitsuba_scalar"]
    assert a.shape == c.shape == (64, 64, 3)
    error = np.sqrt((np.mean((a - b) ** 2) + np.mean((c - d) ** 2)) / 4 * 3 / a.size)  # the three channels move together
    assert 0 < error < 0.02 * a.mean()
    assert abs((a.mean() + b.mean()) / 2 - (c.mean() + d.mean()) / 2) < 5 * error


def test_all_builds_of_the_kernels_trace_the_same_light(tmp_path: pathlib.Path) -> None:
    """As plain Python, since compiling three builds would take minutes."""
    assert all(hasattr(path_tracer, name) for name in REPLACED)
    arguments = ["1", str(write_job(tmp_path)), "render.resolution=[8, 8]", "render.samples=1", "aovs={}", "render.filter=box"]
    means = []
    for build in ("specialized", "alone", "everything"):
        with Worker("pipeline.bench.features_worker", [build, *arguments], tmp_path / build, NUMBA_DISABLE_JIT="1") as worker:
            means.append(worker.ask()["mean"])
    assert means[0] > 0
    assert means[1:] == pytest.approx([means[0]] * 2, rel=1e-6)


# --- whole benchmarks ---------------------------------------------------------------------------------------------


def test_without_mitsuba_the_rows_say_so(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = importlib.util.find_spec
    monkeypatch.setattr(contenders.importlib.util, "find_spec", lambda name: None if name == "mitsuba" else known(name))
    more = "sections: [rates, size, memory, error]\nmemory: {samples: [4, 8]}\nerror: {samples: [2, 8], rounds: 1, reference_samples: 64}"
    assert main(write_benchmark(tmp_path, more), tmp_path / "out") == 0
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    rows = {(row["what"], row["goal"]): row for row in found["rows"]}
    missing = [row for (_, goal), row in rows.items() if "Mitsuba" in goal]
    assert len(missing) == 8
    assert all(row["measured"] == "not installed" and row["passed"] is None for row in missing)
    assert rows[("bytes a vertex, uncompressed", "≤ 32")]["passed"] is True
    assert rows[("bytes a path, uncompressed", "≤ 56")]["passed"] is True
    text = (tmp_path / "out" / "results.md").read_text()
    assert "not installed" in text
    assert "![Error against time](error.png)" in text
    for chart in ("error.png", "rates.png"):
        assert (tmp_path / "out" / chart).read_bytes().startswith(b"\x89PNG")
    assert sorted(os.listdir(tmp_path / "out")) == ["error.png", "logs", "rates.png", "results.json", "results.md"]


QUESTIONS = """
sections: [questions]
contenders: []
questions:
  regex: "C.D(..)*L"
  memory_samples: 8
  ask:
    - {what: direct, expression: "C D .* L", most_seconds: 100}
    - {what: around, expression: "C X* X@near X* L", most_seconds: 1.0e-9}
    - {what: ranking, rank: {region: near}, most_seconds: 100}
"""


@pytest.mark.slow
def test_questions_are_asked_of_a_recorded_run(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(questions, "AGAIN", ("mitsuba_scalar",))
    path = write_benchmark(tmp_path, QUESTIONS)
    settings = ["settings.regions.near={sphere: {center: [0, 0, 0], radius: 0.9}}"]
    assert main(path, tmp_path / "out", settings) == 0
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    rows = {row["what"]: row for row in found["rows"]}
    assert [rows[what]["passed"] for what in ("direct", "around", "ranking")] == [True, False, True]
    figures = found["sections"]["questions"]
    assert set(figures["wall_seconds"]) == {"direct", "around", "ranking", questions.REGEX, "rendering again (Mitsuba scalar)"}
    assert all(len(walls) == 2 for walls in figures["wall_seconds"].values())
    assert figures["answers"]["direct"]["answer"] > figures["answers"]["around"]["answer"] > 0
    assert figures["answers"]["ranking"]["answer"] > 2
    assert set(figures["peak_bytes"]) == {"direct", "around", "ranking"}
    assert (tmp_path / "out" / "questions.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_paths_are_bundled_and_drawn_beside_their_peers(tmp_path: pathlib.Path) -> None:
    more = "sections: [pictures]\ncontenders: []\npictures: {paths: 400, points: 8, size: [96, 72], most_drawing_seconds: 1.0e-9}\n"
    assert main(write_benchmark(tmp_path, more), tmp_path / "out", ["rounds=1"]) == 0
    found = json.loads((tmp_path / "out" / "results.json").read_text())
    assert [row["passed"] for row in found["rows"]] == [True, False]
    figures = found["sections"]["pictures"]
    assert set(figures["wall_seconds"]) == {pictures.BUNDLE, pictures.PYTHON, pictures.DRAW, pictures.STRAIGHT}
    assert figures["paths"] == 400
    assert figures["segments"] > figures["paths"]


@pytest.mark.slow
def test_a_regular_expression_that_asks_something_else_is_refused(tmp_path: pathlib.Path) -> None:
    path = write_benchmark(tmp_path, QUESTIONS.replace("C.D(..)*L", "C.D(..)+L"))
    with pytest.raises(JobError, match="not the same question"):
        main(path, tmp_path / "out", ["settings.regions.near={sphere: {center: [0, 0, 0], radius: 0.9}}"])


def test_the_command_explains_a_bad_file(tmp_path: pathlib.Path) -> None:
    result = CliRunner().invoke(app, ["bench", str(tmp_path / "nowhere.yaml")])
    assert result.exit_code == 2
    assert "there is no such benchmark file" in result.output


def test_a_contender_that_failed_once_is_not_tried_again(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    prepared = prepare_job(write_job(tmp_path), ["aovs={}"])
    made = Contenders(prepared.scene, prepared.settings, 1, tmp_path, [], tmp_path, tmp_path)
    calls: list[None] = []
    monkeypatch.setattr(contenders, "find_llvm", lambda: calls.append(None))
    for _ in range(2):
        with pytest.raises(NotAvailable, match="no usable LLVM found"):
            made.get("mitsuba_llvm")
    assert len(calls) == 1


def test_errors_that_are_not_positive_are_left_off_the_chart(tmp_path: pathlib.Path) -> None:
    error_chart(tmp_path / "a.png", [ErrorCurve("a", [1.0, 2.0], [0.1, -0.1], [1, 2]), ErrorCurve("b", [1.0], [0.0], [1])], "errors")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_subpixel_section_times_every_method_and_draws_a_chart(tmp_path: pathlib.Path) -> None:
    file = write_benchmark(tmp_path, "sections: [subpixel]\nsubpixel: {layouts: [rgb_stripe], methods: [pixel_box, optimal]}\n")
    assert main(file, tmp_path / "out", ()) == 0
    results = json.loads((tmp_path / "out/results.json").read_bytes())
    costs = results["sections"]["subpixel"]["costs"]
    assert [(cost["layout"], cost["method"]) for cost in costs] == [("rgb_stripe", "pixel_box"), ("rgb_stripe", "optimal")]
    assert costs[1]["scielab"] < costs[0]["scielab"]
    assert all(len(cost["seconds"]) == 2 and min(cost["seconds"]) > 0 for cost in costs)
    assert len(results["rows"]) == 2
    assert (tmp_path / "out/subpixel.png").stat().st_size > 5000
