"""Jobs: what is accepted, what is refused and how, and that the page about them is true."""

import json
import pathlib

import pytest
import yaml
from tiny_job import SCENE
from typer.testing import CliRunner

from pipeline.catalogues import run_row
from pipeline.cli import app
from pipeline.errors import JobError
from pipeline.job_docs import job_docs
from pipeline.job_file import MAX_NESTING, load_job
from pipeline.prepare import prepare_job, resized

ROOT = pathlib.Path(__file__).parents[2]
BAD_JOBS = yaml.safe_load((pathlib.Path(__file__).parent / "bad_jobs.yaml").read_text())
GOOD = "name: a\nscene: scene.yaml\n"


def job_file(folder: pathlib.Path, text: str) -> pathlib.Path:
    (folder / "scene.yaml").write_text("type: scene\n")
    (folder / "job.yaml").write_text(text)
    return folder / "job.yaml"


@pytest.mark.parametrize("case", BAD_JOBS, ids=lambda case: case["title"])
def test_bad_job_gives_one_clear_message(case: dict, tmp_path: pathlib.Path) -> None:
    path = job_file(tmp_path, case["whole"] if "whole" in case else GOOD + case.get("job", ""))
    result = CliRunner().invoke(app, ["validate", str(path), *(part for text in case.get("set", []) for part in ("--set", text))])
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    assert result.stdout == ""
    if "at" in case:
        assert result.stderr.startswith(f"pathspace: {path}:{case['at']}: "), result.stderr
    for part in case["says"]:
        assert part in result.stderr


def test_table_of_bad_jobs_is_a_table() -> None:
    assert len(BAD_JOBS) >= 30
    assert len({case["title"] for case in BAD_JOBS}) == len(BAD_JOBS)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\xff\xfe\x00name", "UTF-8"),
        (b"[" * 5_000, "nested too deeply"),
        (b"a: " + b"[" * (MAX_NESTING + 1) + b"]" * (MAX_NESTING + 1), "nested too deeply"),
        (b"a: &a [x, x, x, x]\n" + b"".join(b"%c: &%c [%s]\n" % (c, c, b", ".join([b"*%c" % (c - 1)] * 9)) for c in range(98, 110)), "more than"),
        (b"a: " + b"9" * 5000, "cannot be read"),
    ],
    ids=["not text", "endless nesting", "deep nesting", "aliases of aliases", "long number"],
)
def test_hostile_file(content: bytes, says: str, tmp_path: pathlib.Path) -> None:
    (tmp_path / "job.yaml").write_bytes(content)
    with pytest.raises(JobError, match=says):
        load_job(tmp_path / "job.yaml")


def test_missing_job_file_and_folder(tmp_path: pathlib.Path) -> None:
    with pytest.raises(JobError, match="no such job file"):
        load_job(tmp_path / "job.yaml")
    with pytest.raises(JobError, match="found a folder"):
        load_job(tmp_path)


def test_settings_are_applied_in_order(tmp_path: pathlib.Path) -> None:
    path = job_file(tmp_path, GOOD + "render: {samples: 4, seed: 1}\n")
    job = load_job(path, ["render.samples=8", "render.samples=16", "render.resolution=[32, 16]", "aovs.direct=C D L", "images.exposure=1e0"]).job
    assert (job.render.samples, job.render.seed, job.render.resolution) == (16, 1, (32, 16))
    assert job.aovs == {"direct": "C D L"}
    assert job.images.exposure == 1.0


def test_paths_are_relative_to_the_file(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = job_file(tmp_path, GOOD + "out: here/run\n")
    monkeypatch.chdir("/")
    loaded = load_job(path)
    assert loaded.scene == str(tmp_path / "scene.yaml")
    assert loaded.run_folder() == tmp_path / "here/run"
    assert loaded.run_folder(pathlib.Path("there")) == pathlib.Path("there")


def test_line_of_a_scene_error_in_a_job(tmp_path: pathlib.Path) -> None:
    path = job_file(tmp_path, "name: a\n\nscene: {type: scene, thing: {type: teapot}}\n")
    with pytest.raises(JobError, match=r"job.yaml:3: in the scene: .*teapot"):
        prepare_job(path)


@pytest.mark.parametrize("path", sorted((ROOT / "configs").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_jobs_are_good(path: pathlib.Path) -> None:
    prepared = prepare_job(path)
    assert prepared.loaded.job.name == path.stem
    assert prepared.settings.passes == 64


def test_resolution_changes_the_film_alone(tmp_path: pathlib.Path) -> None:
    scene = prepare_job(ROOT / "configs/cornell.yaml", ["render.resolution=[64, 32]"]).scene
    assert (scene.defaults.width, scene.defaults.height) == (64, 32)
    assert (int(scene.arrays.sensor.width), int(scene.arrays.sensor.height)) == (64, 32)
    whole = prepare_job(ROOT / "configs/cornell.yaml").scene
    assert [o.name for o in scene.objects] == [o.name for o in whole.objects]


def described(sampler: dict[str, object] | None, **integrator: object) -> dict[str, object]:
    """The tiny scene with this sampler, and with these settings of its integrator."""
    sensor = {**SCENE["sensor"], **({} if sampler is None else {"sampler": sampler})}
    return {**SCENE, "sensor": sensor, "walks": {"type": "path", **integrator}}


@pytest.mark.parametrize(
    ("sampler", "render", "expected"),
    [
        (None, {}, ("sobol", 0)),
        ({"type": "independent"}, {}, ("independent", 0)),
        ({"type": "independent", "seed": 9}, {}, ("independent", 9)),
        ({"type": "multijitter", "seed": 9}, {}, ("sobol", 9)),
        ({"type": "independent", "seed": 9}, {"sampler": "sobol", "seed": 0}, ("sobol", 0)),
        ({"type": "multijitter"}, {"sampler": "independent"}, ("independent", 0)),
        ({"type": "independent", "seed": 9}, {"resolution": [8, 4]}, ("independent", 9)),
    ],
)
def test_sampler_and_seed_are_the_scene_s_where_the_job_names_none(sampler, render: dict, expected: tuple[str, int], tmp_path: pathlib.Path) -> None:
    path = job_file(tmp_path, yaml.safe_dump({"name": "a", "scene": described(sampler), "render": render}))
    settings = prepare_job(path).settings
    assert (settings.sampler, settings.seed) == expected


@pytest.mark.parametrize(("asked", "expected"), [(3, 3), (255, 255), (256, 256), (100_000, 256)])
def test_roulette_that_a_scene_puts_off_for_ever(asked: int, expected: int, tmp_path: pathlib.Path) -> None:
    """No path is longer than 255 segments, so any greater depth is the same; it must fit into the table of the run."""
    path = job_file(tmp_path, yaml.safe_dump({"name": "a", "scene": described(None, rr_depth=asked)}))
    prepared = prepare_job(path)
    assert prepared.settings.rr_depth == expected
    assert run_row("a", prepared.settings, prepared.scene, {}, {})["rr_depth"].to_pylist() == [expected]


@pytest.mark.parametrize(
    ("scene", "says"),
    [
        (described(None, max_depth=0), "'max_depth' must be 1 or more, or -1"),
        (described({"type": "independent", "seed": -1}), "'seed' must be from 0"),
        ({**SCENE, "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 65536}}}, "'width' must be from 1 to 65535"),
    ],
    ids=["no depth", "negative seed", "film wider than a job may say"],
)
def test_scene_that_asks_for_what_no_job_may(scene: dict, says: str, tmp_path: pathlib.Path) -> None:
    with pytest.raises(JobError, match=says):
        prepare_job(job_file(tmp_path, yaml.safe_dump({"name": "a", "scene": scene})))


def test_resized_gives_a_film_to_a_sensor_without_one() -> None:
    scene = resized({"type": "scene", "sensor": {"type": "thinlens"}}, 8, 4)
    assert scene["sensor"]["film"] == {"type": "hdrfilm", "width": 8, "height": 4}


def test_expressions_of_shipped_jobs_match_some_path(caplog: pytest.LogCaptureFixture) -> None:
    for path in (ROOT / "configs").glob("*.yaml"):
        prepare_job(path)
    assert not caplog.records


def test_page_about_jobs_is_generated_from_the_schema() -> None:
    assert (ROOT / "docs/jobs.md").read_text() == job_docs(), "run `make docs`"


def test_example_in_the_page_is_a_good_job(tmp_path: pathlib.Path) -> None:
    text = job_docs().split("```yaml\n")[1].split("```")[0].replace("scenes/cornell.yaml", json.dumps(str(ROOT / "configs/scenes/cornell.yaml")))
    job = load_job(job_file(tmp_path, text)).job
    assert job == load_job(ROOT / "configs/cornell.yaml").job.model_copy(update={"scene": job.scene})
