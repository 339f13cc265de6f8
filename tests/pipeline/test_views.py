"""Views, the pass for inspection and the report as stages of a job, and by hand."""

import json
import pathlib
import shlex
import shutil
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tiny_job import results, write_job
from typer.testing import CliRunner

from pipeline.cli import app
from pipeline.config import Job
from pipeline.errors import JobError
from pipeline.job_file import checked_view
from pipeline.stages import run_job, validate_job
from queries import open_run

PAGE = pathlib.Path(__file__).parents[2] / "docs/pictures.md"
SIZE = [160, 120]
BUNDLES = {"bundles": {"expression": "C D L", "most": 50}, "size": SIZE}
IRRADIANCE = {"irradiance": {}, "size": SIZE}
INSPECTED = {"views": {"direct": BUNDLES, "light": IRRADIANCE}, "inspection": {"samples": 2}}


def pathspace(*arguments: object) -> "CliRunner.Result":
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A run with views and a pass for inspection. Never change it."""
    folder = tmp_path_factory.mktemp("views")
    return run_job(write_job(folder, **INSPECTED), out=folder / "run", threads=2).path


def manifest(run: pathlib.Path) -> dict:
    return json.loads((run / "manifest.json").read_bytes())


def test_views_are_pictures_that_the_manifest_knows(drawn: pathlib.Path) -> None:
    views = manifest(drawn)["views"]
    assert {name: view["tool"] for name, view in views.items()} == {"direct": "bundles", "light": "irradiance"}
    for name, view in views.items():
        picture = np.asarray(Image.open(drawn / view["files"]["png"]))
        assert picture.shape[1] == SIZE[0]
        assert picture.shape[0] > SIZE[1]  # the caption lies below
        assert picture[: SIZE[1]].std() > 5, name
        assert view["caption"]


def test_inspection_is_a_run_of_light_walks_beside_the_run(drawn: pathlib.Path, tiny_run: pathlib.Path) -> None:
    assert results(drawn) == results(tiny_run)  # and it changes nothing of the run itself
    with open_run(drawn / "inspection") as light:
        assert light.settings["method"] == "light"
        assert light.settings["passes"] == 2
        assert light.tables["light_vertices"].num_rows > 2 * 64 * 64
    assert manifest(drawn / "inspection")["views"] == {}


def test_the_estimate_counts_the_pass(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    _, plain = validate_job(write_job(tmp_path))
    _, inspected = validate_job(write_job(tmp_path, **INSPECTED))
    written = sum(file.stat().st_size for file in (drawn / "inspection/tables").rglob("*.arrow"))
    assert inspected.bytes - plain.bytes == pytest.approx(written, rel=0.15, abs=2e6)  # its films, too, until they are summed
    assert "inspection" in inspected.text()


def test_resume_draws_what_changed_alone(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(drawn, run)
    before = {file: file.stat().st_mtime_ns for file in (run / "views").iterdir()}
    walks = (run / "inspection/tables/light_vertices/00000.arrow").stat().st_mtime_ns
    changed = {"direct": {**BUNDLES, "bundles": {"most": 40}, "export": ["vtp", "gltf"]}, "light": IRRADIANCE}
    run_job(write_job(tmp_path, views=changed, inspection={"samples": 2}), out=run, resume=True)
    assert (run / "views/light.png").stat().st_mtime_ns == before[run / "views/light.png"]
    assert (run / "views/direct.png").stat().st_mtime_ns > before[run / "views/direct.png"]
    assert {file.name for file in (run / "views").iterdir()} == {"direct.png", "direct.vtp", "direct.glb", "light.png"}
    assert (run / "inspection/tables/light_vertices/00000.arrow").stat().st_mtime_ns == walks

    # Files that the view has no longer are removed; a damaged one is drawn again; another pass replaces the first
    (run / "views/light.png").write_bytes(b"damaged")
    run_job(write_job(tmp_path, views=INSPECTED["views"], inspection={"samples": 1}), out=run, resume=True)
    assert {file.name for file in (run / "views").iterdir()} == {"direct.png", "light.png"}
    assert (run / "views/light.png").read_bytes()[:4] == b"\x89PNG"
    assert manifest(run / "inspection")["settings"]["passes"] == 1


def test_orbit_is_a_sequence(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace(
        *("view", drawn, "direct", "--set", "camera={orbit: {frames: 3}}", "--set", "size=[96, 72]", "--out", tmp_path / "around.png"),
    )
    assert result.exit_code == 0, result.output
    frames = sorted((tmp_path / "around").iterdir())
    assert [frame.name for frame in frames] == ["0000.png", "0001.png", "0002.png"]
    pictures = [np.asarray(Image.open(frame)) for frame in frames]
    assert not np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(np.asarray(Image.open(tmp_path / "around.png")), pictures[1])
    animation = Image.open(tmp_path / "around.gif")
    assert animation.n_frames == 3


def test_a_sequence_replaces_its_own_pictures_alone(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    folder = tmp_path / "around"
    folder.mkdir()
    for name in ("0007.png", "7.png", "20261122.png", "9999.png", "0007-notes.png"):
        (folder / name).write_text("")
    result = pathspace("view", drawn, "direct", "--set", "camera={orbit: {frames: 2}}", "--set", "size=[96, 72]", "--out", tmp_path / "around.png")
    assert result.exit_code == 0, result.output
    assert {file.name for file in folder.iterdir()} == {"0000.png", "0001.png", "7.png", "20261122.png", "9999.png", "0007-notes.png"}


@pytest.mark.parametrize(
    ("view", "key"),
    [
        ({"bundles": {}, "look": {"hide": ["nobody"]}}, "look.hide"),
        ({"arrows": {"probes": [{"position": [0, 0, 0]}], "groups": {"lamp": ["nobody"]}}}, "arrows.groups"),
    ],
)
def test_objects_that_the_scene_lacks_are_told_before_rendering(view: dict[str, Any], key: str, tmp_path: pathlib.Path) -> None:
    with pytest.raises(JobError, match=rf"`views.a.{key}`: the scene has no object `nobody` \(it has "):
        validate_job(write_job(tmp_path, inspection={"samples": 1}, views={"a": view}))


def test_same_view_gives_the_same_pixels(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("view", drawn, "direct", "--out", tmp_path / "again.png")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "again.png").read_bytes() == (drawn / "views/direct.png").read_bytes()


def test_view_by_tool_with_a_region_of_its_own(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    near = "near={sphere: {center: [0, 0, 0], radius: 0.8}}"
    arguments = ("view", drawn, "bundles", "--expression", "C D D L", "--region", "near", "--define", near)
    result = pathspace(*arguments, "--set", "bundles.most=30", "--set", "size=[96, 72]", "--out", tmp_path / "a.png")
    assert result.exit_code == 0, result.output
    assert "C D D L".replace(" ", "") in result.stdout.replace(" ", "")
    assert (tmp_path / "a.png").exists()


def test_nothing_selected_gives_a_picture_that_says_so(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("view", drawn, "bundles", "--expression", "C <TS> L", "--set", "size=[200, 100]", "--out", tmp_path / "a.png")
    assert result.exit_code == 0, result.output
    assert "no light path" in result.stdout
    assert np.asarray(Image.open(tmp_path / "a.png")).std() > 5  # its message


def test_what_can_be_drawn_is_listed(drawn: pathlib.Path) -> None:
    result = pathspace("view", drawn)
    assert result.exit_code == 0
    for part in ("direct", "light", "bundles", "time_of_flight", "fluence"):
        assert part in result.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nothing"], "the job's views are direct, light; the tools are bundles"),
        (["bundles", "--set", "bundles.moost=3"], "did you mean `most`?"),
        (["bundles", "--set", "bundles.amount=7"], "`views.bundles.bundles.amount`"),
        (["bundles", "--set", "camera=front"], "front"),
        (["bundles", "--set", "fluence={}"], "exactly one of"),
        (["bundles", "--set", "size=[1, 2]"], "64 or more"),
        (["bundles", "--set", "most"], "key=value"),
        (["bundles", "--expression", "C D ("], "column"),
        (["bundles", "--expression", "nothruput; C D L"], "nothruput"),
        (["bundles", "--region", "nowhere"], "nowhere"),
        (["bundles", "--out", "a.jpg"], "such as bundles.png"),
        (["probe"], "`views.probe.probe.probes` is missing: "),
        (["irradiance", "--set", "look.scene=glass"], "translucent"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_views_give_one_clear_message(drawn: pathlib.Path, arguments: list[str], says: str, tmp_path: pathlib.Path) -> None:
    out = [] if "--out" in arguments else ["--out", tmp_path / "a.png"]
    result = pathspace("view", drawn, *arguments, *out)
    assert result.exit_code == 2, result.output
    assert says in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "a.png").exists()


def test_places_that_cannot_be_written_are_named(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "file").write_text("")
    for command in (("view", drawn, "direct", "--out", tmp_path / "file/a.png"), ("report", drawn, "--out", tmp_path / "file/report", "--paths", 0)):
        result = pathspace(*command)
        assert result.exit_code != 0
        assert "Traceback" not in result.output
        assert "fault of pathspace" not in result.stderr
        assert str(tmp_path / "file") in result.stderr


def test_a_run_without_light_walks_says_what_to_do(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("view", tiny_run, "irradiance", "--out", tmp_path / "a.png")
    assert result.exit_code == 2
    assert "inspection: {samples: 16}" in result.stderr


def test_report_is_a_stage_and_a_command(drawn: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("report", drawn, "--out", tmp_path / "report", "--top", 0, "--paths", 20)
    assert result.exit_code == 0, result.output
    page = tmp_path / "report/index.html"
    assert result.stdout.strip().splitlines()[-1] == str(page)
    assert "tiny" in page.read_text()

    shutil.copytree(drawn, tmp_path / "run")
    job = write_job(tmp_path, **INSPECTED, report={"top": 0, "paths": 0})
    result = pathspace("run", job, "--out", tmp_path / "run", "--resume")
    assert result.exit_code == 0, result.output
    assert result.stdout.strip().splitlines()[-1] == f"report: {tmp_path / 'run/report/index.html'}"


def test_views_of_the_schema_survive_the_manifest(drawn: pathlib.Path) -> None:
    """What the manifest notes of a job can be read as a job again."""
    job = Job.model_validate(manifest(drawn)["job"])
    assert job.views["direct"].tool.expression == "C D L"


def test_checked_view_names_the_place() -> None:
    with pytest.raises(JobError, match="did you mean `azimuth`"):
        checked_view("a", {"bundles": {}}, ["camera.orbit.azimut=3"])


def test_commands_of_the_page_are_good() -> None:
    """Every `pathspace view` on the page about pictures names a tool and keys that exist."""
    lines = [line for line in PAGE.read_text().splitlines() if line.startswith("pathspace view RUN bundles")]
    assert len(lines) >= 3
    for line in lines:
        words = shlex.split(line, comments=True)
        given = {words[i + 1] for i, word in enumerate(words) if word == "--set"}
        assert checked_view(words[3], {words[3]: {}}, sorted(given)).tool_name == "bundles"


def test_example_of_the_page_draws(
    drawn: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    code = PAGE.read_text().split("```python\n")[1].split("```")[0]
    changed = code.replace("runs/spheres", str(drawn)).replace(', region="focus"', "").replace("C D S+ L", "C D L").replace("(640, 480)", "(96, 72)")
    monkeypatch.chdir(tmp_path)
    exec(changed, {})
    assert "light paths" in capsys.readouterr().out
    assert (tmp_path / "pictures/caustics.png").exists()
