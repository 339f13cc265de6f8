"""Particles: where they are drawn, what they are told apart by, and how they move from frame to frame."""

import pathlib

import numpy as np
import pytest

from queries import open_run
from queries.errors import QueryError
from queries.flow import Tracks
from queries.regions import SceneGeometry
from viz.cameras import job_pose
from viz.comets import Comets
from viz.look import Look
from viz.stage import Stage
from viz.tools.base import Drawn
from viz.tools.particles import Particles


def drawn_with(folder: pathlib.Path, tool: Particles, look: Look | None = None) -> tuple[Drawn, list[np.ndarray], SceneGeometry]:
    with open_run(folder) as run, Stage(run, look, (120, 90)) as stage:
        drawn = tool.draw(run, stage)
        pictures = []
        for show in drawn.frames or (lambda: None,):
            show()
            pictures.append(stage.picture(job_pose(run)))
        return drawn, pictures, run.geometry


def test_direct_light_goes_down_from_the_lamp(spheres_light: pathlib.Path) -> None:
    drawn, (image,), geometry = drawn_with(spheres_light, Particles(expression="C L", resolution=16, most=400))
    mesh = drawn.meshes["particles"]
    points = mesh.points.reshape(-1, 2, 3).astype(np.float64)
    low, high = geometry.caster.bounds
    assert (points >= low - 0.5 * 2.4 / 16).all()  # within the voxels, which reach a little beyond the scene
    assert (points <= high + 0.5 * 2.4 / 16).all()
    way = points[:, 1] - points[:, 0]
    assert np.median(way[:, 1] / np.linalg.norm(way, axis=1)) < -0.7
    # From the middle outward
    assert np.corrcoef(points[:, 0, 0], way[:, 0])[0, 1] > 0.7
    assert float(drawn.figures["directed_share"]) > 0.9
    assert drawn.figures["particles"] == 400
    assert image.std() > 0
    np.testing.assert_array_equal(image, drawn_with(spheres_light, Particles(expression="C L", resolution=16, most=400))[1][0])


def test_diffuse_light_has_less_of_a_direction(spheres_light: pathlib.Path) -> None:
    shares = [
        float(drawn_with(spheres_light, Particles(expression=text, resolution=10, least_anisotropy=0.6, most=200))[0].figures["directed_share"])
        for text in ("C L", "C D D+ L")
    ]
    assert shares[1] < 0.6 < 0.9 < shares[0]


def test_a_field_without_direction_says_so(spheres_light: pathlib.Path) -> None:
    drawn, _, _ = drawn_with(spheres_light, Particles(expression="C D D D L", resolution=8, least_anisotropy=0.99))
    assert drawn.empty
    assert "no dominant direction" in drawn.caption
    drawn, _, _ = drawn_with(spheres_light, Particles(expression="C <TD> L", resolution=8))
    assert drawn.empty
    assert "does not pass here" in drawn.caption


def test_ways_that_do_not_fit_into_memory_are_refused(spheres_light: pathlib.Path) -> None:
    with pytest.raises(QueryError, match="ask for fewer"):
        drawn_with(spheres_light, Particles(resolution=8, most=50_000, frames=2, way=1e6))


@pytest.mark.parametrize("color", ["chrominance", "anisotropy", "fluence"])
def test_frames_and_colors(spheres_light: pathlib.Path, color: str) -> None:
    settings = {"expression": "C L", "resolution": 12, "most": 60, "frames": 3, "color": color}
    drawn, pictures, _ = drawn_with(spheres_light, Particles.model_validate(settings))
    assert len({picture.tobytes() for picture in pictures}) == len(drawn.frames) == 3
    assert (drawn.color_bar is None) == (color == "chrominance")


def test_a_comet_is_its_last_steps(spheres_light: pathlib.Path) -> None:
    """Trails begin where particles were, fade as they grow old, and go on fading when a particle is through."""
    points = np.stack([np.stack([np.arange(11) / 10, np.full(11, y), np.zeros(11)], axis=1) for y in (0.0, 1.0)])
    points[1, 5:] = points[1, 4]
    tracks = Tracks(points, np.array([11, 5], np.int32), 0.1)
    shown: list[tuple[np.ndarray, ...]] = []
    with open_run(spheres_light) as run, Stage(run, Look(scene="hidden"), (40, 30)) as stage:
        comets = Comets(stage, tracks, np.zeros((2, 11, 3), np.uint8), 1.0)
        comets._trails.show = lambda *given: shown.append(given)  # type: ignore[method-assign]
        for age in (3, 6, 9):
            comets.show(np.array([age, age]), 4)
    extents = [
        [(begin[begin[:, 1] == y, 0].min(), end[end[:, 1] == y, 0].max()) for y in (0.0, 1.0) if (begin[:, 1] == y).any()] for begin, end, *_ in shown
    ]
    np.testing.assert_allclose(extents[0], [(0.0, 0.3), (0.0, 0.3)])
    np.testing.assert_allclose(extents[1], [(0.2, 0.6), (0.2, 0.4)])
    np.testing.assert_allclose(extents[2], [(0.5, 0.9)])  # the second one's trail is gone
    opacity = shown[1][3]
    assert opacity.max() == 1
    assert opacity.min() == 0
    own = shown[1][0][:, 1] == 1.0
    np.testing.assert_allclose(opacity[own], np.array([[0.0, 0.25], [0.25, 0.5]]) ** 1.5)
