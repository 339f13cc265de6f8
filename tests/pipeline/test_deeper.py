"""What ``max_depth`` cuts: walks traced again repeat themselves bit for bit and then go on; the estimate agrees with a deeper render."""

import json
import pathlib
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
import scipy.stats
import yaml
from tiny_job import SCENE

from pipeline.deeper import choose_walks, cut, run_scene, trace_again
from pipeline.errors import JobError
from pipeline.stages import run_job
from queries import open_run
from queries.diagnostics.convergence import convergence, pass_means
from queries.diagnostics.depths import segments
from queries.errors import QueryError
from queries.shards import Piece
from queries.statistics import Units
from renderer.trace import Tracer

LIMIT = 3


def bright_box() -> dict[str, Any]:
    """A closed box of bright walls around the camera: much of its light is indirect."""
    white = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.8, 0.7, 0.6]}}}
    sensor = SCENE["sensor"] | {"to_world": [{"lookat": {"origin": [0, 0, 0.9], "target": [0, 0, 0], "up": [0, 1, 0]}}]}
    lamp = SCENE["lamp"] | {
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"scale": 0.5}, {"translate": [0, 0.98, 0]}],
        "bsdf": {"type": "diffuse"},
    }
    return {"type": "scene", "sensor": sensor, "walls": {"type": "cube", "bsdf": white}, "lamp": lamp}


def render(folder: pathlib.Path, method: str, record: dict[str, Any] | None = None, scene: Any = None, **settings: Any) -> pathlib.Path:
    known = {"method": method, "resolution": [16, 16], "samples": 48, "max_depth": LIMIT, "seed": 3, "filter": "box", "sampler": "independent"}
    job = {"name": "box", "scene": scene or bright_box(), "render": known | settings, "record": record or {}}
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "job.yaml").write_text(yaml.safe_dump(job, sort_keys=False))
    return run_job(folder / "job.yaml", out=folder / "run", threads=1).path


@pytest.fixture(scope="module", params=["path", "light"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return render(tmp_path_factory.mktemp("deeper"), request.param)


@pytest.fixture(scope="module", params=["path", "light"])
def open_folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Walks of this one escape, too."""
    return render(tmp_path_factory.mktemp("open"), request.param, scene=SCENE, samples=128)


def test_walks_traced_deeper_repeat_themselves_and_go_on(folder: pathlib.Path) -> None:
    rows: list[pa.Table] = []

    def write(table: str, batch: pa.RecordBatch) -> None:
        if table == "paths":
            sink = pa.BufferOutputStream()  # batches alias memory that is about to change
            with pa.ipc.new_stream(sink, batch.schema) as writer:
                writer.write_batch(batch)
            rows.append(pa.ipc.open_stream(sink.getvalue()).read_all())

    with open_run(folder) as run:
        ended, walks = choose_walks(run, Units.of_run(run), 10**9)
        trace_again(run, walks, 12, run_scene(run), write)
        recorded = run.tables["paths"].combine_chunks()
        owner = "light_walk" if run.settings["method"] == "light" else "camera_walk"
        kept = recorded.filter(pa.array(np.isin(recorded[owner].to_numpy(), walks)))
    assert ended.sum() == len(walks) > 1000
    again = pa.concat_tables(rows).combine_chunks()
    depth = segments(Piece({"paths": again.to_batches()[0]}, 0))
    old = again.filter(pa.array(depth <= LIMIT))
    assert old.num_rows == kept.num_rows > 1000
    assert old.column_names == kept.column_names
    for name in kept.column_names:
        assert old[name].to_numpy().tobytes() == kept[name].to_numpy().tobytes(), name
    assert np.count_nonzero(depth > LIMIT) > 1000
    assert depth.max() == 12


def test_only_walks_that_the_limit_ended_can_gain(open_folder: pathlib.Path) -> None:
    """All others, traced deeper, give the rows that they gave."""
    found = 0

    def write(table: str, batch: pa.RecordBatch) -> None:
        nonlocal found
        if table == "paths":
            found += batch.num_rows
            assert segments(Piece({"paths": batch}, 0)).max(initial=0) <= LIMIT

    with open_run(open_folder) as run:
        _, ended = choose_walks(run, Units.of_run(run), 10**9)
        assert len(ended) > 10
        settings = run.settings
        others = np.setdiff1d(np.arange(settings["passes"] * settings["width"] * settings["height"], dtype=np.uint64), ended)
        trace_again(run, others, 12, run_scene(run), write)
        owner = "light_walk" if settings["method"] == "light" else "camera_walk"
        assert found == np.count_nonzero(~np.isin(run.tables["paths"][owner].to_numpy(), ended)) > 0


@pytest.mark.parametrize("most", [10**9, 4000])
def test_the_estimate_agrees_with_a_deeper_render(folder: pathlib.Path, tmp_path: pathlib.Path, most: int) -> None:
    deep = 12
    with open_run(folder) as run:
        (line,) = cut(run, most=most, traced_to=deep).to_pylist()
        shallow = pass_means(run)
        method = run.settings["method"]
    with open_run(render(tmp_path, method, seed=99, max_depth=deep)) as other:
        deeper = pass_means(other)
        beyond = convergence(other, "C <[RT].>{3,} [LOB]").to_pylist()[-1]  # four segments or more, by itself
    assert line["verdict"] is None
    assert line["energy"] == pytest.approx(shallow.mean())
    assert (line["ended"] == line["replayed"]) == (most > line["ended"])
    assert line["replayed"] == pytest.approx(min(most, line["ended"]), abs=5 * most**0.5)
    assert line["cut"] > 10 * line["standard_error"] > 0
    # What was cut, against the paths of that length of an independent render, and against the difference of both images' means
    checks = [(beyond["mean"], beyond["standard_error"])]
    checks.append((deeper.mean() - shallow.mean(), np.hypot(deeper.std(ddof=1), shallow.std(ddof=1)) / len(deeper) ** 0.5))
    for expected, error in checks:
        z = abs(line["cut"] - expected) / np.hypot(error, line["standard_error"])
        assert z < scipy.stats.t.isf(0.005 / 8, len(deeper) - 1)
        assert error < 0.25 * expected, "so noisy a render would agree with anything"
    assert line["share"] == pytest.approx(line["cut"] / (line["cut"] + line["energy"]))
    assert line["share_error"] > 0
    assert LIMIT < line["deepest"] <= deep


@pytest.mark.slow
def test_standard_errors_cover_the_truth(tmp_path: pathlib.Path) -> None:
    """Over many small runs, the estimates scatter as their errors say."""
    estimates, errors = [], []
    for seed in range(24):
        with open_run(render(tmp_path / str(seed), "path", seed=seed, samples=16, resolution=[8, 8])) as run:
            (line,) = cut(run, most=400, traced_to=8, scene=run_scene(run)).to_pylist()
        estimates.append(line["cut"])
        errors.append(line["standard_error"] or np.nan)
    spread, said = np.std(estimates, ddof=1) ** 2, np.nanmean(np.square(errors))
    low, high = scipy.stats.f.ppf([0.005, 0.995], 23, 24 * 15)  # both are estimates, of 23 and of 15 degrees of freedom each
    assert np.isfinite(errors).sum() > 12
    assert low < spread / said < high


def test_a_kept_share_of_sobol_walks(tmp_path: pathlib.Path) -> None:
    with open_run(render(tmp_path / "whole", "path", sampler="sobol", replicates=8)) as run:
        (whole,) = cut(run, traced_to=12).to_pylist()
    with open_run(render(tmp_path / "part", "path", {"keep": 0.4}, sampler="sobol", replicates=8)) as run:
        (part,) = cut(run, traced_to=12).to_pylist()
    assert whole["units"] == part["units"] == 8
    assert part["ended"] == pytest.approx(0.4 * whole["ended"], rel=0.1)
    assert abs(part["cut"] - whole["cut"]) < scipy.stats.t.isf(0.005, 7) * np.hypot(part["standard_error"], whole["standard_error"])


def test_light_that_never_left_its_emitter(tmp_path: pathlib.Path) -> None:
    with open_run(render(tmp_path, "light", max_depth=1)) as run:
        (line,) = cut(run, traced_to=12).to_pylist()
    assert line["ended"] == line["replayed"] == 48 * 256
    assert line["cut"] > 0
    assert line["share"] > 0.3


def test_nothing_is_cut_where_no_walk_reached_the_limit(tmp_path: pathlib.Path) -> None:
    with open_run(render(tmp_path, "path", max_depth=200, rr_depth=2, samples=4)) as run:
        (line,) = cut(run).to_pylist()
    assert (line["ended"], line["cut"], line["standard_error"]) == (0, 0.0, None)
    assert "no recorded walk" in line["verdict"]


def test_a_limit_that_cannot_be_raised_is_said(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        for depth in (2, LIMIT, 256):
            with pytest.raises(QueryError, match=f"max_depth is {LIMIT}: expected a depth from 4 to 255"):
                cut(run, traced_to=depth)
        with pytest.raises(QueryError, match="at least one walk"):
            cut(run, most=0)
        run.manifest["settings"]["max_depth"] = 255
        (line,) = cut(run).to_pylist()
        assert (line["cut"], line["share"], line["replayed"]) == (None, None, 0)
        assert "the most that can be traced" in line["verdict"]


def test_few_walks_are_distrusted(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        (line,) = cut(run, most=15, traced_to=12).to_pylist()
    assert 0 < line["replayed"] < 60
    assert line["verdict"]
    assert line["standard_error"] is line["share_error"] is None


def test_another_scene_is_refused(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        description = json.loads(run.tables["run"]["scene"][0].as_py())
        assert run_scene(run).defaults.width == 16
        run.manifest["job"]["scene"]["walls"]["bsdf"]["bsdf"]["reflectance"]["value"] = [0.5, 0.5, 0.5]
        run_scene(run)  # the run's own description is still there
        description["walls"]["bsdf"]["bsdf"]["reflectance"]["value"] = [0.5, 0.5, 0.5]
        run.tables["run"] = run.tables["run"].set_column(
            run.tables["run"].schema.get_field_index("scene"), "scene", pa.array([json.dumps(description)])
        )
        with pytest.raises(JobError, match="has changed since it was rendered"):
            cut(run, traced_to=12)


def test_walks_that_come_out_differently_are_refused(open_folder: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trace = Tracer.trace

    def other(self: Tracer, walks: Any, write: Any, film: Any) -> Any:
        return trace(self, walks + np.uint64(1), write, film)

    with open_run(open_folder) as run:
        monkeypatch.setattr(Tracer, "trace", other)
        with pytest.raises(JobError, match="come out differently"):
            cut(run, traced_to=12)
