"""Fluence as a volume: where it is drawn, what its figures say, and that the same run gives the same pixels."""

import pathlib

import numpy as np
import pytest
from pydantic import ValidationError

from queries import open_run
from queries.errors import QueryError
from queries.voxels import Grid
from viz.cameras import CameraDescription, Orbit, job_pose, poses
from viz.grids import Corners, grid_of
from viz.look import Look
from viz.stage import Stage
from viz.tools.base import Drawn
from viz.tools.fluence import FluenceVolume
from viz.volume import add_volume

BARE = Look(scene="hidden", background="black")
REGIONS = {
    "ball": {"sphere": {"center": [0.1, 0.2, 0.3], "radius": 0.5}},
    "crate": {"box": {"center": [0, 1, 0], "size": [1, 2, 0.5], "rotate": {"axis": [0, 0, 1], "angle": 90}}},
    "glass": {"object": "glass"},
}


def picture(folder: pathlib.Path, tool: FluenceVolume, look: Look = BARE) -> tuple[Drawn, np.ndarray]:
    with open_run(folder, regions=REGIONS) as run, Stage(run, look, (120, 90)) as stage:
        drawn = tool.draw(run, stage)
        return drawn, stage.picture(job_pose(run))


def test_the_same_run_gives_the_same_picture(spheres_light: pathlib.Path) -> None:
    tool = FluenceVolume(resolution=16)
    drawn, first = picture(spheres_light, tool, Look())
    _, second = picture(spheres_light, tool, Look())
    np.testing.assert_array_equal(first, second)
    _, bare = picture(spheres_light, FluenceVolume(resolution=16, expression="C D L", box=Corners(min=(5, 5, 5), max=(6, 6, 6))), Look())
    assert np.abs(first.astype(int) - bare).mean() > 2
    assert drawn.color_bar is not None
    assert drawn.color_bar.logarithmic
    assert "16 x 14 x 16 voxels" in drawn.caption
    assert f"{drawn.figures['segments']:,} segments" in drawn.caption


def test_figures_do_not_depend_on_the_grid(spheres_light: pathlib.Path) -> None:
    box = Corners(min=(-1.0, 0.1, -1.0), max=(1.0, 1.9, 1.0))
    totals = [picture(spheres_light, FluenceVolume(resolution=n, box=box, scale="linear"))[0].figures["total_flux_times_length"] for n in (8, 24)]
    assert totals[0] == pytest.approx(totals[1], rel=1e-6)
    # Light straight from the lamp and the rest are all of it
    parts = [picture(spheres_light, FluenceVolume(resolution=8, box=box, expression=text))[0].figures for text in ("C L", "C .+ L")]
    assert sum(float(part["total_flux_times_length"]) for part in parts) == pytest.approx(float(totals[0]), rel=1e-6)


def test_a_volume_is_where_its_grid_is(spheres_light: pathlib.Path) -> None:
    """One bright voxel of a coarse grid covers the pixels that its center is seen in, in its own color, and no others far from it."""
    grid = Grid((-1.0, 0.0, -1.0), (1.0, 2.0, 1.0), (8, 8, 8))
    strength = np.zeros(grid.shape, np.float32)
    strength[6, 1, 3] = 1
    colors = np.zeros((*grid.shape, 3), np.uint8)
    colors[...] = 200, 100, 50
    center = np.array([grid.centers(axis)[at] for axis, at in enumerate((6, 1, 3))])
    with open_run(spheres_light) as run, Stage(run, BARE, (160, 120)) as stage:
        add_volume(stage, grid, colors, strength, 0.9)
        for orbit in (Orbit(azimuth=0, elevation=0), Orbit(azimuth=100, elevation=40)):
            (pose,) = poses(run, CameraDescription(orbit=orbit), {}, run.geometry)
            image = stage.picture(pose).astype(float)
            place = pose.project(center[None], (160, 120))[0][0]
            y, x = np.mgrid[:120, :160] + 0.5
            weight = np.maximum(image.sum(axis=2) - 24, 0)  # without the haze
            assert np.average(x, weights=weight) == pytest.approx(place[0], abs=1.0)
            assert np.average(y, weights=weight) == pytest.approx(place[1], abs=1.0)
            brightest = image.reshape(-1, 3)[weight.argmax()]
            np.testing.assert_allclose(brightest / brightest[0], [1, 0.5, 0.25], atol=0.06)


def test_rays_through_empty_voxels_lose_no_light(spheres_light: pathlib.Path) -> None:
    """Fog around an empty ball: the fewer voxels with fog a ray passes through, the darker, and smoothly so."""
    grid = Grid((-1.2, 0.0, -1.2), (1.2, 2.4, 1.2), (48, 48, 48))
    place = np.stack(np.meshgrid(*(grid.centers(axis) for axis in range(3)), indexing="ij"), axis=3)
    distance = np.linalg.norm(place - [0.0, 1.0, 0.0], axis=3)
    white = np.full((*grid.shape, 3), 255, np.uint8)
    with open_run(spheres_light) as run:
        (pose,) = poses(run, CameraDescription(orbit=Orbit(azimuth=0, elevation=0)), {}, run.geometry)
        images = []
        for hole in (0.0, 0.03):  # of strength: nothing, and hardly more
            with Stage(run, BARE, (120, 90)) as stage:
                add_volume(stage, grid, white, np.where(distance < 0.6, hole, 0.15).astype(np.float32), 0.7)
                images.append(stage.picture(pose).astype(int))
    difference = images[1] - images[0]
    assert difference.min() >= -1
    assert difference.max() <= 255 * (1 - (1 - 0.03 * 0.7) ** (1.2 / 0.24))  # what fog of strength 0.03 hides along the ball's diameter


def test_scales(spheres_light: pathlib.Path) -> None:
    linear = picture(spheres_light, FluenceVolume(resolution=12, scale="linear"))[0].color_bar
    given = picture(spheres_light, FluenceVolume(resolution=12, range=(0.5, 8.0), map="viridis"))[0].color_bar
    assert linear is not None
    assert given is not None
    assert linear.low == 0 < linear.high
    assert (given.low, given.high) == (0.5, 8.0)
    chromatic, image = picture(spheres_light, FluenceVolume(resolution=12, color="chrominance"))
    assert chromatic.color_bar is None
    assert image.max() > 20


def test_boxes(spheres_light: pathlib.Path) -> None:
    with open_run(spheres_light, regions=REGIONS) as run:
        ball = grid_of(run, "ball", 10)
        np.testing.assert_allclose([ball.low, ball.high], [[-0.4, -0.3, -0.2], [0.6, 0.7, 0.8]])
        assert ball.shape == (10, 10, 10)
        crate = grid_of(run, "crate", 8)  # turned: x and y change places
        np.testing.assert_allclose([crate.low, crate.high], [[-1, 0.5, -0.25], [1, 1.5, 0.25]], atol=1e-12)
        assert crate.shape == (8, 4, 2)
        with pytest.raises(QueryError, match="expected a box or a ball"):
            grid_of(run, "glass", 8)
        with pytest.raises(QueryError, match="no region `nowhere`"):
            grid_of(run, "nowhere", 8)


def test_nothing_selected(spheres_light: pathlib.Path) -> None:
    drawn, _ = picture(spheres_light, FluenceVolume(resolution=8, expression="C <TD> L"))
    assert drawn.empty
    assert "no such light" in drawn.caption


@pytest.mark.parametrize("bad", [{"range": (2.0, 1.0)}, {"resolution": 4}, {"box": {"min": (0, 0, 0), "max": (1, 0, 1)}}, {"map": "jet"}])
def test_bad_settings(bad: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        FluenceVolume.model_validate(bad)
