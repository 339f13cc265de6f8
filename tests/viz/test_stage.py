"""Stages: the same pixels each time, looks that show what they say, machines that cannot draw, and golden pictures."""

import hashlib
import json
import os
import pathlib
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import pyvista
from PIL import Image
from pydantic import ValidationError
from similarity import structural_similarity

from pipeline.identity import processor
from queries import open_run
from queries.errors import QueryError
from queries.run import Run
from viz.cameras import CameraDescription, Pose, job_pose, poses
from viz.look import Look
from viz.opengl import renderer_name
from viz.pictures import write_png
from viz.stage import Stage
from viz.tools.bundles import Bundles

SIZE = (160, 120)
ROOT = pathlib.Path(__file__).parent.parent.parent
GOLDEN = pathlib.Path(__file__).parent / "golden"
REGENERATE = "PATHSPACE_NEW_GOLDEN_PICTURES"  # set it to draw them anew; then look at them
ABOVE = CameraDescription.model_validate({"orbit": {"azimuth": 35, "elevation": 25}})


def curves(run: Run) -> pyvista.PolyData:
    """A few hundred colored lines through the scene."""
    low, high = run.geometry.caster.bounds
    ends = np.random.default_rng(3).uniform(low, high, (300, 2, 3))
    mesh = pyvista.PolyData(ends.reshape(-1, 3), lines=np.column_stack([np.full(300, 2), np.arange(600).reshape(-1, 2)]).ravel())
    mesh["rgb"] = (np.abs(np.sin(np.arange(600)[:, None] * [1, 2, 3])) * 255).astype(np.uint8)
    return mesh


def drawn(run: Run, look: Look, camera: Any = None, lines: bool = True, size: tuple[int, int] = SIZE, **options: Any) -> np.ndarray:
    with Stage(run, look, size) as stage:
        if lines:
            stage.add(curves(run), **{"scalars": "rgb", "rgb": True, "line_width": 1.5, "lighting": False} | options)
        return stage.picture(poses(run, camera, {})[0])


def as_array(look: str, **options: Any) -> Look:
    return Look.model_validate({"scene": look, **options})


@pytest.mark.parametrize("look", ["translucent", "solid", "cut", "silhouette", "hidden"])
def test_two_stages_draw_the_same_pixels(spheres_run: Run, look: str) -> None:
    first = drawn(spheres_run, as_array(look), ABOVE)
    assert first.shape == (120, 160, 3)
    assert first.dtype == np.uint8
    assert np.ptp(first) > 100
    assert np.array_equal(first, drawn(spheres_run, as_array(look), ABOVE))


def test_a_stage_forgets_earlier_pictures(cornell_run: Run) -> None:
    there, back = poses(cornell_run, ABOVE, {})[0], job_pose(cornell_run)
    with Stage(cornell_run, Look(), SIZE) as stage:
        line = stage.add(curves(cornell_run), scalars="rgb", rgb=True, line_width=1.5)
        first = stage.picture(there)
        middle = stage.picture(back)
        again = stage.picture(there)
        assert line.prop.line_width == 1.5
    assert np.array_equal(first, again)
    assert not np.array_equal(first, middle)


def test_another_process_draws_the_same_pixels_and_is_silent(cornell_run: Run) -> None:
    code = (
        "import sys, hashlib; from queries import open_run; from viz.stage import Stage; from viz.cameras import job_pose\n"
        "with open_run(sys.argv[1]) as run, Stage(run, size=(160, 120)) as stage: image = stage.picture(job_pose(run))\n"
        "print(hashlib.sha256(image.tobytes()).hexdigest())"
    )
    found = python(code, str(cornell_run.path))
    here = drawn(cornell_run, Look(), lines=False)
    assert found.stdout.strip() == hashlib.sha256(here.tobytes()).hexdigest()
    assert found.stderr == ""


def test_translucent_lines_blend_in_the_order_of_adding(cornell_run: Run) -> None:
    pose = job_pose(cornell_run)
    low, high = cornell_run.geometry.caster.bounds
    middle, size = (low + high) / 2, 200
    found = []
    for colors in (("red", "blue"), ("blue", "red")):
        with Stage(cornell_run, Look(scene="hidden", background="black"), SIZE) as stage:
            for color in colors:
                stage.add(pyvista.Plane(center=middle, direction=(0, 0, 1), i_size=size, j_size=size), color=color, opacity=0.6, lighting=False)
            found.append(stage.picture(pose)[60, 80].astype(int))
    assert found[0].tolist() == found[1][::-1].tolist()
    assert found[0] == pytest.approx([0.4 * 0.6 * 255, 0, 0.6 * 255], abs=3)


def test_lines_in_a_closed_room_are_seen_through_every_look_but_solid(spheres_run: Run) -> None:
    low, high = spheres_run.geometry.caster.bounds
    spot = pyvista.Sphere(radius=0.15, center=(low + high) / 2 + [0, 0.5, 0])
    outside = poses(spheres_run, CameraDescription.model_validate({"orbit": {"azimuth": 180, "elevation": 20}}), {})[0]
    seen = {}
    for look in ("translucent", "solid", "cut", "silhouette", "hidden"):
        with Stage(spheres_run, as_array(look), SIZE) as stage:
            stage.add(spot, color="red", lighting=False)
            image = stage.picture(outside).astype(int)
        seen[look] = int(((image[..., 0] > 120) & (image[..., 0] > 2 * image[..., 1])).sum())
    assert seen.pop("solid") == 0
    assert min(seen.values()) > 20


def test_a_plane_cuts_away_what_is_on_its_normals_side(spheres_run: Run) -> None:
    whole = drawn(spheres_run, as_array("solid"), ABOVE, lines=False)
    cut = {"point": [0, 1.0, 0], "normal": [0, 1, 0]}
    below = drawn(spheres_run, as_array("solid", cut=cut), ABOVE, lines=False)
    nothing = drawn(spheres_run, as_array("solid", cut={"point": [0, -1, 0], "normal": [0, 1, 0]}), ABOVE, lines=False)
    all_of_it = drawn(spheres_run, as_array("solid", cut={"point": [0, -1, 0], "normal": [0, -2, 0]}), ABOVE, lines=False)
    assert np.array_equal(whole, all_of_it)
    assert len(np.unique(nothing.reshape(-1, 3), axis=0)) == 1
    background = nothing[0, 0]
    covered = [int((image != background).any(axis=2).sum()) for image in (whole, below)]
    assert 0.4 * covered[0] < covered[1] < 0.9 * covered[0]


def test_hidden_objects_are_not_drawn_and_unknown_ones_are_refused(spheres_run: Run) -> None:
    shown = drawn(spheres_run, as_array("silhouette"), lines=False)
    less = drawn(spheres_run, as_array("silhouette", hide=["glass", "mirror"]), lines=False)
    assert not np.array_equal(shown, less)
    with pytest.raises(QueryError, match="no object `glas`: did you mean `glass`"):
        Stage(spheres_run, Look(hide=["glas"]))


def test_surfaces_can_be_left_to_a_tool(spheres_run: Run) -> None:
    with Stage(spheres_run, Look(scene="cut"), SIZE) as stage:
        stage.show_surfaces(False)
        bare = stage.picture(job_pose(spheres_run))
        stage.show_surfaces(True)
        full = stage.picture(job_pose(spheres_run))
    background = (np.array(Look().background_color) * 255).round()
    assert ((bare == background).all(axis=2)).mean() > 0.8
    assert ((full == background).all(axis=2)).mean() < 0.3


def test_hooks_are_told_the_pose(cornell_run: Run) -> None:
    told: list[Pose] = []
    pose = job_pose(cornell_run)
    with Stage(cornell_run, Look(scene="hidden"), SIZE) as stage:
        stage.before_picture.append(told.append)
        stage.picture(pose)
    assert told == [pose]


@pytest.mark.parametrize(("background", "color"), [("white", (255, 255, 255)), ("black", (0, 0, 0)), ("#102030", (16, 32, 48))])
def test_backgrounds(cornell_run: Run, background: str, color: tuple[int, int, int]) -> None:
    image = drawn(cornell_run, Look(scene="hidden", background=background), lines=False, size=(8, 6))
    assert (image == color).all()


def test_lines_are_as_wide_as_they_say(cornell_run: Run) -> None:
    low, high = cornell_run.geometry.caster.bounds
    x, y, z = (low + high) / 2
    ink = []
    for oversampling, width in ((1, 3), (2, 3), (2, 6)):
        with Stage(cornell_run, Look(scene="hidden", background="black"), SIZE) as stage:
            stage.oversampling = oversampling
            stage.add(pyvista.Line((x, y - 100, z), (x, y + 100, z)), color="white", line_width=width, lighting=False)
            ink.append(stage.picture(job_pose(cornell_run))[60, :, 0].sum() / 255)
    assert ink == pytest.approx([3, 3, 6], abs=0.51)


@pytest.mark.parametrize(
    ("look", "complaint"),
    [
        ({"scene": "xray"}, "Input should be"),
        ({"background": "#12345"}, "a color such as"),
        ({"opacity": 0}, "greater than 0"),
        ({"cut": {"point": [0, 0, 0], "normal": [0, 0, 0]}}, "a `normal` that is not"),
        ({"hidden": ["lamp"]}, "Extra inputs"),
    ],
)
def test_refused_looks(look: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValidationError, match=complaint):
        Look.model_validate(look)


# --- machines without OpenGL ----------------------------------------------------------------------------------------------


def python(code: str, *arguments: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    given = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, env=given, timeout=120, cwd=ROOT, check=False)


DRAW = "from viz.opengl import new_plotter, DrawingError\ntry: new_plotter((8, 8))\nexcept DrawingError as error: print(error)\nelse: print('drawn')"


@pytest.mark.skipif(sys.platform != "linux", reason="other systems bring OpenGL along")
def test_missing_libraries_are_named_in_one_line(tmp_path: pathlib.Path) -> None:
    """The loader finds files that are no libraries: VTK would crash."""
    for name in ("libEGL.so.1", "libEGL.so", "libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"):
        (tmp_path / name).write_text("no library")
    found = python(DRAW, LD_LIBRARY_PATH=str(tmp_path))
    assert found.returncode == 0
    assert found.stderr == ""
    assert found.stdout.count("\n") == 1
    assert "libEGL.so.1 cannot be loaded" in found.stdout
    assert "install the packages `libegl1` and `libgl1-mesa-dri`" in found.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="other systems bring OpenGL along")
def test_missing_drivers_are_told_apart(tmp_path: pathlib.Path) -> None:
    """libEGL is there and finds no driver."""
    for name in ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"):
        (tmp_path / name).write_text("no library")
    found = python(DRAW, LD_LIBRARY_PATH=str(tmp_path), __EGL_VENDOR_LIBRARY_DIRS=str(tmp_path))
    if found.stdout == "drawn\n":
        pytest.skip("this machine's libEGL knows its driver without being told")
    assert (found.returncode, found.stderr) == (0, "")
    assert "libEGL.so.1 finds nothing to draw with" in found.stdout
    assert "install the packages" in found.stdout


# --- golden pictures ------------------------------------------------------------------------------------------------------


def machine_class() -> str:
    """Pictures are the same to the bit where this is: VTK, OpenGL's renderer and the processor."""
    import vtkmodules.vtkCommonCore as core

    plotter = pyvista.Plotter(off_screen=True, window_size=[8, 8])
    renderer = renderer_name(plotter)
    plotter.close()
    return f"VTK {core.vtkVersion.GetVTKVersion()}, {renderer}, {processor()}"


def golden_picture(run: Run) -> np.ndarray:
    """The scene with bundled paths in it."""
    with Stage(run, Look(), (240, 180)) as stage:
        Bundles(most=300).draw(run, stage)
        return stage.picture(poses(run, ABOVE, {})[0])


@pytest.mark.parametrize("name", ["cornell", "spheres"])
def test_golden_pictures(name: str, request: pytest.FixtureRequest) -> None:
    run = request.getfixturevalue(f"{name}_run")
    found, here = golden_picture(run), machine_class()
    file, note = GOLDEN / f"{name}.png", GOLDEN / "machine.json"
    if os.environ.get(REGENERATE):
        write_png(file, found)
        note.write_text(json.dumps({"machine": here}, indent=1) + "\n")
    golden = np.asarray(Image.open(file).convert("RGB"))
    if json.loads(note.read_text())["machine"] == here:
        assert np.array_equal(found, golden)
    similarity = structural_similarity(found, golden)
    assert similarity > 0.9
    # What the eye would see as another picture fails
    turned = CameraDescription.model_validate({"orbit": {"azimuth": 41, "elevation": 25}})
    assert structural_similarity(drawn(run, Look(), turned, size=(240, 180)), golden) < 0.9
    assert structural_similarity(drawn(run, Look(), ABOVE, size=(240, 180), lines=False), golden) < 0.9


def test_a_run_without_surfaces_can_be_drawn_hidden_only(tmp_path: pathlib.Path, cornell_run: Run) -> None:
    with open_run(cornell_run.path) as run:
        run.tables.pop("triangles")
        with pytest.raises(QueryError, match="does not store the surfaces"):
            Stage(run, Look(), SIZE)
        with Stage(run, Look(scene="hidden"), (8, 6)) as stage:
            assert stage.picture(job_pose(run)).shape == (6, 8, 3)
