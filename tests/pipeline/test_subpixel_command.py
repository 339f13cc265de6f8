"""Subpixel filters as a stage of a job, and by hand, of runs and of images."""

import json
import pathlib
import re
import shutil

import numpy as np
import pyarrow as pa
import pytest
import yaml
from PIL import Image
from tiny_job import write_job
from typer.testing import CliRunner

from pipeline.cli import app
from pipeline.errors import JobError
from pipeline.images import read_exr, write_exr
from pipeline.stages import run_job, validate_job
from queries.subpixel.description import LayoutDescription, layout, shipped_layouts

PAGE = pathlib.Path(__file__).parents[2] / "docs/subpixel.md"
QUICK = {"targets": [], "layouts": ["rgb_stripe", "rgbw"]}


def pathspace(*arguments: object) -> "CliRunner.Result":
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def analyzed(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A run whose job asks for an analysis. Never change it."""
    folder = tmp_path_factory.mktemp("analysis")
    job = write_job(folder, render={"filter": "box"}, analysis={"subpixel": QUICK}, aovs={}, report={"top": 0, "paths": 0})
    return run_job(job, out=folder / "run", threads=2).path


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A gray image with a vertical edge, 60 x 48 pixels."""
    image = np.full((48, 60, 3), 0.2, np.float32)
    image[:, 31:] = 0.7
    file = tmp_path_factory.mktemp("image") / "edge.exr"
    write_exr(file, image, {})
    return file


def plane(file: pathlib.Path) -> np.ndarray:
    return read_exr(file)[..., 0]


def test_job_leaves_pictures_tables_and_a_page(analyzed: pathlib.Path) -> None:
    folder = analyzed / "subpixel"
    known = json.loads((folder / "subpixel.json").read_bytes())
    assert known["layouts"] == ["rgb_stripe", "rgbw"]
    assert plane(folder / "images/rgb_stripe.exr").shape == (64, 3 * 64)
    assert plane(folder / "images/rgbw.exr").shape == (2 * 64, 2 * 64)
    assert np.asarray(Image.open(folder / "pictures/rgb_stripe-drive.png")).shape == (64, 64, 3)
    scores = pa.ipc.open_stream((folder / "scores.arrow").read_bytes()).read_all()
    assert scores.num_rows == 2 * 7
    assert min(scores["scielab"].to_pylist()) > 0
    assert (folder / "index.html").stat().st_size > 1000
    assert "subpixel/index.html" in (analyzed / "report/index.html").read_text("utf-8")


def test_drive_of_the_box_of_each_pixel_is_the_image(analyzed: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("subpixel", analyzed, "--method", "pixel_box", "--no-evaluate", "--layout", "rgb_stripe", "--out", tmp_path / "a")
    assert result.exit_code == 0, result.output
    image = read_exr(analyzed / "images/beauty.exr")
    assert np.allclose(plane(tmp_path / "a/images/rgb_stripe.exr").reshape(64, 64, 3), image, rtol=2e-5, atol=1e-6)


def test_resumed_job_keeps_the_analysis(analyzed: pathlib.Path, tmp_path: pathlib.Path) -> None:
    shutil.copytree(analyzed, tmp_path / "run")
    page = tmp_path / "run/subpixel/index.html"
    before = page.stat().st_mtime_ns
    run_job(analyzed.parent / "tiny.yaml", out=tmp_path / "run", resume=True, threads=2)
    assert page.stat().st_mtime_ns == before
    run_job(analyzed.parent / "tiny.yaml", ["analysis.subpixel.evaluate=false"], out=tmp_path / "run", resume=True, threads=2)
    assert page.stat().st_mtime_ns > before
    assert not (tmp_path / "run/subpixel/scores.csv").exists()


def test_image_is_shown_on_displays_of_its_own(picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    described = tmp_path / "delta.yaml"
    described.write_text("pattern: [R G B, G B R]\ncells: [3, 1]\n")
    arguments = ["--layout", described, "--layout", "rgbg", "--scale", "3", "--no-evaluate", "--out", tmp_path / "out"]
    result = pathspace("subpixel", picture, *arguments)
    assert result.exit_code == 0, result.output
    drive = plane(tmp_path / "out/images/rgbg.exr")
    active = layout("rgbg").active[:, 1]
    assert drive.shape == (16, 6 * 20)
    for column in active:  # gray far from the edge, whatever the subpixel
        assert np.allclose(drive[:, column:24:12], 0.2, atol=1e-4)
    assert plane(tmp_path / "out/images/delta.exr").shape == (16, 60)
    shown = [Image.open(tmp_path / f"out/pictures/{name}.png") for name in ("delta", "delta-standard")]
    assert shown[0].size == shown[1].size
    assert shown[0].tobytes() != shown[1].tobytes()
    assert "delta" in result.output


def test_same_image_gives_the_same_folder(picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """All but the page, which tells how long it took."""
    contents = []
    for name in ("a", "b"):
        result = pathspace("subpixel", picture, "--set", "targets=[]", "--no-evaluate", "--out", tmp_path / name)
        assert result.exit_code == 0, result.output
        files = sorted(file for file in (tmp_path / name).rglob("*") if file.is_file())
        contents.append({file.relative_to(tmp_path / name): file.read_bytes() for file in files})
    assert contents[0].keys() == contents[1].keys()
    assert len(contents[0]) > 8
    different = [str(name) for name in contents[0] if contents[0][name] != contents[1][name]]
    assert set(different) <= {"index.html"}


def test_list_names_what_is_shipped() -> None:
    result = pathspace("subpixel", "--list")
    assert [line.split()[0] for line in result.output.splitlines()] == ["rgb_stripe", "bgr_stripe", "rgbg", "rgbw"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nothing.png"], "nothing.png"),
        (["IMAGE", "--layout", "rgbx"], "there is no layout `rgbx`"),
        (["IMAGE", "--method", "sharp"], "`analysis.subpixel.method`"),
        (["IMAGE", "--dpi", "0"], "`analysis.subpixel.dpi`: expected 1.0 or more"),
        (["IMAGE", "--expression", "C D L"], "an image does not know its paths"),
        (["IMAGE", "--set", "zeroes=3"], "did you mean `zeros`"),
        (["IMAGE", "--layout", "missing.yaml"], "missing.yaml"),
        (["RUN", "--scale", "2"], "--scale is for images"),
        (["RUN", "--expression", "C D ["], "expected `]`"),
        (["RUN", "--set", "custom={a: {pattern: [R G], cells: [2, 1]}}"], "has no B"),
        (["IMAGE", "--out", "FOREIGN"], "name another folder with --out"),
    ],
)
def test_bad_questions_are_told(arguments: list[str], says: str, analyzed: pathlib.Path, picture: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign/diary.txt").write_text("dear diary")
    named = {"IMAGE": picture, "RUN": analyzed, "FOREIGN": tmp_path / "foreign"}
    out = [] if "--out" in arguments else ["--out", tmp_path / "out"]
    result = pathspace("subpixel", *(named.get(word, word) for word in arguments), *out)
    assert result.exit_code == 2, result.output
    assert says in result.output
    assert (tmp_path / "foreign/diary.txt").read_text() == "dear diary"
    assert not (tmp_path / "out").exists()


def test_analysis_without_tables_is_refused_before_rendering(tmp_path: pathlib.Path) -> None:
    job = write_job(tmp_path, record={"keep": "none", "occluded": False}, aovs={}, analysis={"subpixel": {}})
    with pytest.raises(JobError, match=r"`analysis.subpixel` filters recorded samples"):
        validate_job(job)


# --- the page about it --------------------------------------------------------------------------------------------


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)


def test_layout_of_the_page_is_the_shipped_one() -> None:
    (text,) = blocks("yaml")
    assert LayoutDescription.model_validate(yaml.safe_load(text)) == shipped_layouts()["rgbg"]


def test_python_of_the_page_runs(analyzed: pathlib.Path, capsys: pytest.CaptureFixture[str]) -> None:
    (text,) = blocks("python")
    exec(compile(text.replace("runs/wires", str(analyzed)), str(PAGE), "exec"), {})
    assert "(64, 64, 3) Fit(a=1.0" in capsys.readouterr().out


def test_options_of_the_page_exist() -> None:
    for line in "".join(blocks("sh")).splitlines():
        known = CliRunner().invoke(app, [line.split()[1], "--help"], terminal_width=200).output
        for option in re.findall(r"--[a-z-]+", line):
            assert option in known, line
