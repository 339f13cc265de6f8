"""Arrows: as thick as the light is strong, from where it comes to where it is measured."""

import pathlib

import numpy as np
import pytest
from furnace import LE, RADIANCE
from pydantic import ValidationError

from queries import open_run
from queries.clusters import Clusters, clusters
from queries.errors import QueryError
from queries.kernels.luminance import LUMINANCE
from queries.probes import Probe
from queries.selection import Selection
from viz.cameras import job_pose
from viz.colors import chrominance, object_colors
from viz.glyphs import HEAD_RADIUS, arrow
from viz.stage import Stage
from viz.tools.arrows import Arrows
from viz.tools.base import Drawn

SPACE = {"position": [-0.6, 0.3, -0.2], "radius": 0.4}
FLOOR = {"position": [-0.5, -1.5, 0.3], "radius": 0.4, "normal": [0, 1, 0]}
PROBE = Probe((-0.6, 0.3, -0.2), 0.4)
SIDES = 32


def draw(folder: pathlib.Path, *probes: dict[str, object], **given: object) -> tuple[Drawn, np.ndarray]:
    """What the tool says, and the picture."""
    with open_run(folder) as run, Stage(run, size=(160, 120)) as stage:
        return Arrows.model_validate({"probes": list(probes), **given}).draw(run, stage), stage.picture(job_pose(run))


def told(folder: pathlib.Path, *probes: dict[str, object], **given: object) -> Drawn:
    """What the tool says."""
    with open_run(folder) as run, Stage(run, size=(160, 120)) as stage:
        return Arrows.model_validate({"probes": list(probes), **given}).draw(run, stage)


def found_at(folder: pathlib.Path, **given: object) -> Clusters:
    with open_run(folder) as run:
        return clusters(run, Selection(), PROBE, **given)


def tips_and_tails(drawn: Drawn, key: str = "arrows_1") -> list[tuple[np.ndarray, np.ndarray, float]]:
    """Where each arrow of a mesh begins and ends and the radius of its shaft, measured from its points: four parts, two rings each."""
    mesh = drawn.meshes[key]
    points, rows = np.asarray(mesh.points, np.float64), np.asarray(mesh.point_data["arrow"])
    measured = []
    for i in np.unique(rows):
        rings = points[rows == i].reshape(8, SIDES, 3)
        tail, tip = rings[0].mean(axis=0), rings[7].mean(axis=0)
        measured.append((tail, tip, float(np.linalg.norm(rings[2] - tail, axis=1).mean())))
    return measured


# --- numbers ------------------------------------------------------------------------------------------------------


def test_cross_sections_are_proportional_to_flux(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, width=0.05, threshold=0.0)
    mesh, found = drawn.meshes["arrows_1"], found_at(furnace, threshold=0.0)
    first = np.unique(mesh.point_data["arrow"], return_index=True)[1]
    flux = mesh.point_data["luminance"][first]
    assert len(flux) == len(found.arrows) >= 4
    np.testing.assert_allclose(flux, [a.value @ LUMINANCE for a in found.arrows], rtol=1e-12)
    np.testing.assert_array_equal(mesh.point_data["irradiance"][first], np.array([a.value for a in found.arrows], np.float32))
    np.testing.assert_array_equal(mesh.point_data["share"][first], [a.share for a in found.arrows])
    radii = np.array([radius for _, _, radius in tips_and_tails(drawn)])
    np.testing.assert_allclose(radii, mesh.point_data["radius"][first], rtol=1e-4)
    # An arrow that carried all of it would be as thick as `width` says
    np.testing.assert_allclose(radii**2, 0.05**2 * flux / (found.value @ LUMINANCE), rtol=2e-4)
    assert (radii**2).sum() == pytest.approx(0.05**2, rel=1e-3)


def test_shares_are_those_of_the_closed_room(furnace: pathlib.Path) -> None:
    """The share 1 - Kd of each channel comes straight from emitters; reflected light has the rest, and its color."""
    drawn = told(furnace, SPACE, threshold=0.0, groups={})
    found = found_at(furnace, threshold=0.0)
    emitted = [a for a in found.arrows if a.event == "emitter"]
    total = sum(a.value for a in emitted) @ LUMINANCE
    error = float(np.sqrt(sum(a.error**2 for a in emitted)))
    assert abs(total - 4 * np.pi * LE @ LUMINANCE) < 4 * error
    assert error < 0.03 * total
    assert abs(drawn.figures["probe_1_fluence"] - 4 * np.pi * RADIANCE @ LUMINANCE) < 4 * drawn.figures["probe_1_standard_error"]
    assert sum(a.share for a in found.arrows) == pytest.approx(1, abs=1e-12)
    share = LE @ LUMINANCE / (RADIANCE @ LUMINANCE)
    assert total / (found.value @ LUMINANCE) == pytest.approx(share, abs=4 * error / (found.value @ LUMINANCE))


def test_arrows_lead_from_surfaces_to_the_probe(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, FLOOR)
    found = found_at(furnace)
    with open_run(furnace) as run:
        bounds = run.geometry.caster.bounds
    for (tail, tip, _), cluster in zip(tips_and_tails(drawn), found.arrows):
        np.testing.assert_allclose(tail, cluster.start, atol=1e-5)
        assert ((tail > bounds[0] - 1e-4) & (tail < bounds[1] + 1e-4)).all()
        assert np.linalg.norm(tip - SPACE["position"]) == pytest.approx(0.4, abs=1e-4)
        # It points to the probe's middle
        assert np.linalg.norm(np.cross(tip - tail, SPACE["position"] - tail)) < 1e-4
    assert set(drawn.meshes) == {"arrows_1", "marker_1", "arrows_2", "marker_2"}


def test_arrows_of_a_history_form_a_tree(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, history=2, threshold=0.02)
    found, measured = found_at(furnace, history=2, threshold=0.02), tips_and_tails(drawn)
    deeper = [i for i, a in enumerate(found.arrows) if a.level == 2]
    assert len(deeper) >= 2
    for i in deeper:
        np.testing.assert_allclose(measured[i][1], measured[found.arrows[i].parent][0], atol=1e-5)
    lines = [line for line, _ in drawn.legend]
    assert lines[0].startswith(found.arrows[0].label)
    below = [i for i in deeper if found.arrows[i].parent == 0]
    for line, i in zip(lines[1:], below):
        assert line.startswith(f"← {found.arrows[i].label}")
    assert "2 interactions back" in drawn.caption


# --- which arrows -------------------------------------------------------------------------------------------------


def test_groups_and_thresholds(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, groups={"room": ["walls", "block"]})
    assert [line for line, _ in drawn.legend] == ["room 100 %"] or drawn.legend[0][0].startswith("room 100")
    assert len(tips_and_tails(drawn)) == 1
    many = told(furnace, SPACE, threshold=0.0)
    few = told(furnace, SPACE, threshold=0.3)
    assert few.figures["probe_1_arrows"] < many.figures["probe_1_arrows"]
    assert few.figures["probe_1_left_out"] > 0
    assert "arrows below 30 % are left out" in few.caption
    assert "left out" not in many.caption


def test_colors(furnace: pathlib.Path) -> None:
    """By cluster, those of objects, set aside where one has several; by chrominance, those of the light."""
    drawn = told(furnace, SPACE, threshold=0.0)
    found = found_at(furnace, threshold=0.0)
    with open_run(furnace) as run:
        of_objects = object_colors(run)
    assert len({color for _, color in drawn.legend}) == len(found.arrows)
    walls = next(i for i, a in enumerate(found.arrows) if a.objects == ("walls",))
    np.testing.assert_allclose(drawn.legend[walls][1], of_objects[0], atol=1e-6)
    mesh = drawn.meshes["arrows_1"]
    first = np.unique(mesh.point_data["arrow"], return_index=True)[1]
    np.testing.assert_array_equal(mesh.point_data["color"][first], np.rint(255 * np.array([color for _, color in drawn.legend])))
    light = told(furnace, SPACE, threshold=0.0, color="chrominance")
    np.testing.assert_allclose([color for _, color in light.legend], chrominance(np.array([a.value for a in found.arrows])), atol=1e-6)


def test_unknown_objects_are_refused(furnace: pathlib.Path) -> None:
    with pytest.raises(QueryError, match="did you mean `walls`"):
        draw(furnace, SPACE, groups={"room": ["wals"]})


# --- the glyph ----------------------------------------------------------------------------------------------------


def test_an_arrow_is_closed_and_faces_outward() -> None:
    tail, tip, radius = np.array([1.0, 0.0, 2.0]), np.array([1.0, 3.0, -2.0]), 0.1
    mesh = arrow(tail, tip, radius, sides=256)
    a, b, c = (mesh.points[mesh.triangles[:, k]].astype(np.float64) - tail for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    head = 5 * radius
    wide = HEAD_RADIUS * radius
    assert volume == pytest.approx(np.pi * radius**2 * (5 - head) + np.pi * wide**2 * head / 3, rel=1e-3)
    faces = np.cross(b - a, c - a)
    agree = np.einsum("ij,ij->i", faces, mesh.normals[mesh.triangles].mean(axis=1))
    assert agree[np.linalg.norm(faces, axis=1) > 1e-9].min() > 0
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)
    along = (mesh.points - tail) @ (tip - tail) / 5
    assert along.min() == pytest.approx(0, abs=1e-5)
    assert along.max() == pytest.approx(5, abs=1e-5)


def test_an_arrow_without_length_is_nothing() -> None:
    mesh = arrow(np.ones(3), np.ones(3), 0.1)
    assert len(mesh.points) == len(mesh.triangles) == 0


# --- always -------------------------------------------------------------------------------------------------------


def test_no_light_is_said(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, FLOOR, expression="C S L")
    assert drawn.empty
    assert "No light" in drawn.caption
    assert "2 probes" in drawn.caption


def test_pictures_are_the_same_each_time(furnace: pathlib.Path) -> None:
    (one, first), (other, second) = draw(furnace, SPACE, FLOOR), draw(furnace, SPACE, FLOOR)
    np.testing.assert_array_equal(first, second)
    assert first.std() > 1
    assert (one.caption, one.legend, one.figures) == (other.caption, other.legend, other.figures)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"probes": []}, "at least 1"),
        ({"probes": [SPACE], "threshold": 1.0}, "less than 1"),
        ({"probes": [SPACE], "history": 4}, "less than or equal to 3"),
        ({"probes": [SPACE], "width": 0.0}, "above 0"),
        ({"probes": [SPACE], "groups": {"a": []}}, "at least 1"),
        ({"probes": [SPACE], "groups": {"a": ["x"], "b": ["x"]}}, "each object in one group, found `x` in `a` and in `b`"),
    ],
)
def test_refusals(given: dict[str, object], expected: str) -> None:
    with pytest.raises(ValidationError, match=expected):
        Arrows.model_validate(given)
