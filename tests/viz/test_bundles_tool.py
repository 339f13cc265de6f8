"""Bundles of a rendered run: what is drawn, said and exported."""

import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import pyvista
import yaml
from pydantic import ValidationError
from running import run_job

from queries import Run, open_run
from queries.errors import QueryError
from queries.path_sample import sample_paths
from queries.selection import Selection
from renderer.tables import EMITTER, LENS
from viz.bundles import bundled
from viz.bundles.names import class_words
from viz.bundles.normals import facing
from viz.cameras import poses
from viz.look import Look
from viz.stage import Stage
from viz.tools import bundles
from viz.tools.bundles import Bundles

SCENE = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "spheres.yaml"
SIZE = (120, 120)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    folder = tmp_path_factory.mktemp("bundles")
    scene = yaml.safe_load(SCENE.read_text())
    scene["sensor"]["film"] |= {"width": 32, "height": 32}
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene, sort_keys=False))
    render = {"samples": 16, "seed": 5, "sampler": "independent", "max_depth": 7, "filter": "box"}
    (folder / "job.yaml").write_text(yaml.safe_dump({"name": "bundles", "scene": "scene.yaml", "render": render, "record": {"keep": "all"}}))
    with open_run(run_job(folder / "job.yaml", out=folder / "run", threads=1).path) as found:
        yield found


def drawn(run: Run, look: Look | None = None, **fields: Any) -> tuple[Any, np.ndarray]:
    """What the tool says, and the picture from the job's camera."""
    with Stage(run, look or Look(scene="hidden"), SIZE) as stage:
        found = Bundles(**fields).draw(run, stage)
        return found, stage.picture(poses(run, None, {}, run.geometry)[0])


def test_curves_of_the_selected_paths_are_drawn_and_nothing_else(run: Run) -> None:
    found, image = drawn(run, expression="C D S+ L", most=100)
    every = sample_paths(run, Selection.of(run, "C D S+ L"), 10**6)
    assert found.figures["paths_found"] == every.found > 0
    assert found.figures["paths_drawn"] == min(100, every.found)
    assert "selected by `CDS+L`" in found.caption
    assert "not physical paths" in found.caption
    ground = np.rint(255 * np.array(Look().background_color)).astype(int)
    lit = np.abs(image.astype(int) - ground).max(axis=2) > 8
    assert 0.005 < lit.mean() < 0.9
    assert {name for name, _ in found.legend} <= {"light", "mirror", "glass"}


def test_the_same_view_has_the_same_pixels_and_another_seed_does_not(run: Run) -> None:
    fields = {"expression": "C D D L", "most": 60}
    first = drawn(run, **fields)[1]
    assert np.array_equal(first, drawn(run, **fields)[1])
    assert not np.array_equal(first, drawn(run, **fields, seed=1)[1])


def test_a_selection_without_light_says_so(run: Run) -> None:
    found, _ = drawn(run, expression="C <TG> L")
    assert found.empty
    assert "no light path selected by" in found.caption
    assert found.figures == {"paths_found": 0, "paths_drawn": 0}


def test_more_paths_than_fit_are_sampled_and_the_caption_says_so(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bundles, "MEMORY", (24 * bundles.BYTES_PER_POINT + bundles.BYTES_PER_SEGMENT) * 500)  # room for 500 segments
    found, _ = drawn(run, most=1_000_000, choose="uniform", to_camera=True)
    assert 250 < found.figures["segments_drawn"] <= 500
    drawn_paths, of = found.figures["paths_drawn"], found.figures["paths_found"]
    assert found.caption.startswith(f"{drawn_paths:,} of the 1,000,000 light paths asked for, of {of:,}")
    assert "would not fit" in found.caption


def test_curves_of_few_points_are_counted_with_what_their_segments_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """As measured, in bytes above an empty stage: 614 for a segment of 3 points, 2,080 for one of 24."""
    monkeypatch.setattr(bundles, "MEMORY", 1.5e9)
    for points, measured in ((3, 614), (24, 2080)):
        assert 0.9 * 1.5e9 < Bundles(points=points)._room() * measured <= 1.5e9


def test_straight_segments_are_called_true_paths_and_are(run: Run) -> None:
    found, _ = drawn(run, expression="C D D L", amount=0.0, most=50, to_camera=True)
    assert "true paths" in found.caption
    assert "physical" not in found.caption
    sample = sample_paths(run, Selection.of(run, "C D D L"), 50, "contribution")
    mesh = found.meshes["bundles"]
    points = np.asarray(mesh.points).reshape(-1, 24, 3)
    assert np.array_equal(points[0::3, 0], sample.points[sample.start[:-1]])
    assert np.array_equal(points[2::3, -1], sample.points[sample.start[1:] - 1])


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"flatten": True}, "inside of the paths"),
        ({"color": "chrominance"}, "a path brings"),
        ({"weigh": "opacity"}, "opacity: how much light"),
        ({"weigh": "width", "choose": "uniform"}, "width: how much light"),
        ({"by": ["normal", "material"]}, "bundles"),
        ({"opacity": 1.0}, "bundles"),
        ({"expression": "C L", "most": 5}, "light"),
    ],
)
def test_every_look_draws_something(run: Run, fields: dict[str, Any], said: str) -> None:
    found, image = drawn(run, **({"expression": "C D S+ L", "most": 40} | fields))
    assert said in found.caption
    assert found.figures["segments_drawn"] > 0
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 1


def test_lines_are_lit_for_the_eye_of_each_picture(run: Run) -> None:
    from viz.cameras import CameraDescription

    with Stage(run, Look(scene="hidden"), SIZE) as stage:
        Bundles(expression="C D D L", most=30).draw(run, stage)
        places = poses(run, CameraDescription.model_validate({"orbit": {"frames": 2}}), {}, run.geometry)
        (actor,) = (a for a in stage.plotter.renderer.actors.values() if isinstance(getattr(a, "mapper", None), pyvista.DataSetMapper))
        colors = []
        for pose in places:
            stage.picture(pose)
            colors.append(np.asarray(actor.mapper.dataset.point_data["color"]).copy())
    assert not np.array_equal(*colors)


def test_meshes_say_what_each_line_is(run: Run) -> None:
    found, _ = drawn(run, most=150, to_camera=True)
    mesh = found.meshes["bundles"]
    sample = sample_paths(run, Selection.of(run), 150, "contribution")
    rows = np.asarray(mesh.cell_data["path_id"])
    assert np.array_equal(np.unique(rows), np.arange(150))
    assert np.array_equal(mesh.cell_data["walk"], sample.owner[rows])
    assert np.array_equal(mesh.cell_data["path"], sample.path[rows])
    assert len(mesh.field_data["bundles"]) == found.figures["bundles_drawn"]
    assert mesh.field_data["bundles"][mesh.cell_data["bundle_id"][0]].startswith("emitter light to ")
    # The spelling of each class selects the paths that have it
    words = list(mesh.field_data["classes"])
    for number in range(0, len(words), 4):
        every = sample_paths(run, Selection.of(run, str(words[number])), 10**6)
        known = set(zip(every.owner.tolist(), every.path.tolist()))
        mine = np.unique(rows[np.asarray(mesh.cell_data["class"]) == number])
        assert len(mine)
        assert {(int(sample.owner[p]), int(sample.path[p])) for p in mine} <= known


def test_classes_are_those_of_a_plain_loop(run: Run) -> None:
    sample = sample_paths(run, Selection.of(run), 300)
    numbers, words = class_words(run, sample)
    letters = {8: "<RD>", 9: "<RG>", 10: "<RS>", 12: "<TG>", 13: "<TS>", 14: "<Ts>"}
    for i in range(300):
        inner = sample.event[sample.start[i] : sample.start[i + 1]][::-1].tolist()
        assert words[numbers[i]] == "C" + "".join(letters[key] for key in inner if key not in (EMITTER, LENS)) + "L"


def test_surfaces_face_the_light_that_arrives(run: Run) -> None:
    sample = sample_paths(run, Selection.of(run), 3000)
    faces = facing(sample, run.geometry.caster)
    names = run.geometry.object_names
    up, down, toward_x, away_x, front = 3, 4, 1, 2, 6  # +y, -y, +x, -x, -z
    walls = {"floor": up, "ceiling": down, "back_wall": front, "left_wall": away_x, "right_wall": toward_x, "light": down}
    for name, way in walls.items():
        mine = faces[(sample.object == names.index(name)) & (sample.event != LENS)]
        assert len(mine)
        assert (mine == way).mean() > 0.99
    ball = np.flatnonzero(sample.object == names.index("mirror"))
    low, high = run.geometry.object_bounds("mirror")
    out = sample.points[ball] - (low + high) / 2
    axis = np.abs(out).argmax(axis=1)
    expected = 1 + 2 * axis + (out[np.arange(len(ball)), axis] < 0)
    clear = np.sort(np.abs(out), axis=1)[:, 1] < 0.95 * np.abs(out).max(axis=1)
    assert clear.sum() > 20
    assert (faces[ball][clear] == expected[clear]).mean() > 0.99
    assert (faces[sample.event == LENS] == 0).all()


@pytest.mark.parametrize("fields", [{"amount": 1.1}, {"by": []}, {"by": ["colour"]}, {"points": 2}, {"most": 0}, {"opacity": 0.0}, {"weigh": "both"}])
def test_descriptions_that_mean_nothing_are_refused(fields: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Bundles(**fields)


def test_unknown_regions_are_refused(run: Run) -> None:
    with pytest.raises(QueryError, match="no region"):
        drawn(run, region="nowhere")


@pytest.mark.slow
def test_a_hundred_thousand_paths_are_bundled_in_seconds() -> None:
    import time

    from bundled_paths import random_sample

    from viz.bundles import vertex_codes

    sample = random_sample(100_000, seed=1, longest=8)
    assert len(sample.event) - len(sample) > 380_000
    seconds = []
    for _ in range(3):
        began = time.perf_counter()
        bundled(sample, vertex_codes(sample, ("event", "object"), np.zeros(4, np.int64)), 0.8)
        seconds.append(time.perf_counter() - began)
    assert min(seconds) < 2
