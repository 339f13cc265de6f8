"""False colors: what is painted is what was measured, and what is known in closed form."""

import pathlib

import numpy as np
import pytest
from furnace import AREA, KD, LE, RADIANCE, SIDE
from pydantic import ValidationError

from queries import Run, open_run
from queries.irradiance import irradiance
from queries.kernels.luminance import LUMINANCE
from queries.patches import patches
from queries.selection import Selection
from viz.cameras import CameraDescription, Orbit, job_pose, poses
from viz.colors import color_map
from viz.false_color import FalseColor, fitting_range
from viz.look import Look
from viz.patch_surface import PatchSurface
from viz.stage import Stage
from viz.tools.base import Drawn
from viz.tools.irradiance import Irradiance

SIZE = (160, 120)
EXPECTED = np.pi * RADIANCE
OUTSIDE = CameraDescription(orbit=Orbit())


def draw(folder: pathlib.Path, look: Look | None = None, camera: CameraDescription | None = None, **given: object) -> tuple[Drawn, np.ndarray]:
    """What the tool says, and the picture."""
    with open_run(folder) as run, Stage(run, look, SIZE) as stage:
        drawn = Irradiance(**given).draw(run, stage)
        return drawn, stage.picture(poses(run, camera, {})[0]) if drawn.image is None else drawn.image


def told(folder: pathlib.Path, look: Look | None = None, **given: object) -> Drawn:
    """What the tool says."""
    with open_run(folder) as run, Stage(run, look, SIZE) as stage:
        return Irradiance(**given).draw(run, stage)


# --- on the meshes ------------------------------------------------------------------------------------------------


def test_the_mesh_holds_what_was_estimated(furnace: pathlib.Path) -> None:
    drawn = told(furnace, patch=0.6)
    mesh = drawn.meshes["irradiance"]
    with open_run(furnace) as run:
        cut = patches(run.geometry, 0.6)
        found = irradiance(run, Selection(), cut)
    np.testing.assert_array_equal(mesh.cell_data["patch"], cut.patch)
    np.testing.assert_array_equal(mesh.cell_data["irradiance"], found.values[cut.patch])
    np.testing.assert_array_equal(mesh.cell_data["standard_error"], found.error[cut.patch])
    np.testing.assert_array_equal(mesh.cell_data["arrivals"], found.hits[cut.patch])
    np.testing.assert_allclose(mesh.cell_data["luminance"], found.values[cut.patch] @ LUMINANCE, rtol=1e-6)
    np.testing.assert_array_equal(np.asarray(mesh.points).reshape(-1, 3, 3), cut.corners)
    assert drawn.figures["patches"] == len(cut) > 150
    assert drawn.figures["arrivals"] == found.hits.sum() > 10_000


def test_irradiance_is_what_the_closed_room_has(furnace: pathlib.Path) -> None:
    drawn = told(furnace, patch=0.6)
    mesh, figures = drawn.meshes["irradiance"], drawn.figures
    assert figures["area"] == pytest.approx(AREA, rel=1e-6)
    assert abs(figures["total_flux"] - EXPECTED @ LUMINANCE * AREA) < 4 * figures["total_standard_error"]
    assert 0 < figures["total_standard_error"] < 0.01 * figures["total_flux"]
    first = np.unique(mesh.cell_data["patch"], return_index=True)[1]
    z = (mesh.cell_data["luminance"][first] - EXPECTED @ LUMINANCE) / mesh.cell_data["standard_error"][first]
    # The mean of n squares of normal numbers is 1 to within sqrt(2 / n)
    assert abs(np.mean(z**2) - 1) < 4 * np.sqrt(2 / len(z))


def test_direct_light_alone(furnace: pathlib.Path) -> None:
    drawn = told(furnace, patch=1.0, expression="C L")
    assert abs(drawn.figures["total_flux"] - np.pi * LE @ LUMINANCE * AREA) < 4 * drawn.figures["total_standard_error"]
    assert "`CL`" in drawn.caption


def test_pixels_show_the_patch_behind_them(furnace: pathlib.Path) -> None:
    """Flat colors: each pixel of a wall has its patch's color, but for borders, edges and rounding."""
    drawn, image = draw(furnace, patch=0.6, smooth=False, range=(3.0, 8.0), map="cividis")
    with open_run(furnace) as run:
        camera = run.geometry.camera
        y, x = np.mgrid[4:120:8, 24:136:8]
        film = np.stack([(x.ravel() + 0.5 - 20) * 32 / 120, (y.ravel() + 0.5) * 32 / 120], axis=1)
        ways = camera.rays(film)
        origins = np.broadcast_to(camera.origin, ways.shape).astype(np.float32)
        things, t = run.geometry.closest(origins, ways, np.full(len(ways), 100, np.float32))
        cut = patches(run.geometry, 0.6)
        patch = cut.find(origins + t[:, None] * ways, things)
    values = drawn.meshes["irradiance"].cell_data["luminance"]
    of_patch = np.empty(len(cut))
    of_patch[drawn.meshes["irradiance"].cell_data["patch"]] = values
    expected = FalseColor("cividis", 3.0, 8.0, False).colors(of_patch[patch]).astype(int)
    close = np.abs(image[y.ravel(), x.ravel()].astype(int) - expected).max(axis=1) <= 3
    assert len({tuple(color) for color in expected}) > 20
    assert close.mean() > 0.9


def test_range_is_kept(furnace: pathlib.Path) -> None:
    drawn = told(furnace, range=(0.5, 6.25), scale="log", map="rainbow")
    bar, mesh = drawn.color_bar, drawn.meshes["irradiance"]
    assert bar is not None
    assert (bar.low, bar.high, bar.logarithmic) == (0.5, 6.25, True)
    assert "flux / world unit²" in bar.label
    np.testing.assert_array_equal(bar.colors, color_map("turbo"))
    share = np.log(mesh.cell_data["luminance"].astype(np.float64) / 0.5) / np.log(6.25 / 0.5)
    expected = color_map("turbo")[np.rint(np.clip(share, 0, 1) * 255).astype(int)]
    assert np.abs(mesh.cell_data["color"].astype(int) - expected).max() <= 6
    assert (mesh.cell_data["color"][share > 1] == color_map("turbo")[-1]).all()
    assert (share > 1).any()
    assert "brighter" in drawn.caption


def test_hidden_objects_are_left_out(furnace: pathlib.Path) -> None:
    drawn = told(furnace, Look(hide=["block"]), patch=1.0)
    assert set(drawn.meshes["irradiance"].cell_data["object"]) == {0}
    assert drawn.figures["area"] == pytest.approx(6 * SIDE**2)


def test_walls_before_the_eye_are_left_out(furnace: pathlib.Path) -> None:
    """From outside one looks into the room: the block, darker than the walls, is seen unless the look is solid."""

    def dark(look: Look) -> int:
        with open_run(furnace) as run, Stage(run, look, SIZE) as stage:
            cut = patches(run.geometry, 1.0)
            surface = PatchSurface(cut)
            surface.add(stage, surface.flat((cut.object == 0).astype(float)), color_map("gray"))
            stage.show_surfaces(False)
            image = stage.picture(poses(run, OUTSIDE, {})[0])
        return int((image.max(axis=2) == 0).sum())

    assert dark(Look(scene="solid", background="white")) < 20
    assert dark(Look(background="white")) > 200


def test_smooth_colors_stop_at_creases(furnace: pathlib.Path) -> None:
    with open_run(furnace) as run:
        cut = patches(run.geometry, 0.5, ["walls"])
    surface = PatchSurface(cut)
    sides = np.rint(cut.normal).astype(int) @ [1, 2, 3] + 3.0
    assert len(np.unique(sides)) == 6
    np.testing.assert_allclose(surface.interpolated(sides), surface.flat(sides), atol=1e-12)


def test_smooth_colors_are_means_of_neighbors(furnace: pathlib.Path, spheres_run: Run) -> None:
    """Within a side values that rise evenly stay so, but at its border, and on a ball neighbors meet at one value."""
    with open_run(furnace) as run:
        cut, ball = patches(run.geometry, 0.25, ["walls"]), patches(spheres_run.geometry, 0.2, ["mirror"])
    surface = PatchSurface(cut)
    inside = (np.abs(cut.corners) < SIDE / 2 - 1e-3).sum(axis=2) == 2
    values = surface.interpolated(cut.center[:, 0])
    np.testing.assert_allclose(values[inside], cut.corners[inside][:, 0], atol=1e-5)
    at = np.round(ball.corners.reshape(-1, 3), 4)
    found = PatchSurface(ball).interpolated(ball.center[:, 1]).ravel()
    point = np.unique(at, axis=0, return_inverse=True)[1].ravel()
    spread = [np.ptp(found[point == i]) for i in range(point.max() + 1)]
    assert max(spread) < 1e-6
    assert len(spread) > 50


# --- ranges -------------------------------------------------------------------------------------------------------


def test_ranges_are_robust() -> None:
    values = np.concatenate([np.linspace(0.1, 2.0, 1000), [1e6, 1e9]])
    assert fitting_range(values, np.ones(len(values)), False) == (0.0, 2.0)
    low, high = fitting_range(values, np.ones(len(values)), True)
    assert (low, high) == (0.11, 2.0)
    # A bright place that is large enough counts, by its area and not by its number of patches
    assert fitting_range(np.array([1.0, 10.0]), np.array([0.9, 0.1]), False) == (0.0, 10.0)
    assert fitting_range(np.zeros(3), np.ones(3), False) == (0.0, 1.0)
    assert fitting_range(np.full(3, 5.0), np.ones(3), True) == (0.5, 5.0)


# --- in the image -------------------------------------------------------------------------------------------------


def test_image_space(furnace: pathlib.Path) -> None:
    drawn, image = draw(furnace, space="image", neighbors=200)
    assert image.shape == (120, 120, 3)
    # Radii that grow until they hold n arrivals favor discs that hold many by chance, by at most about 1 / n; neighboring pixels share their arrivals
    assert drawn.figures["mean_of_pixels"] == pytest.approx(EXPECTED @ LUMINANCE, rel=0.02)
    assert 0.02 < drawn.figures["median_relative_error"] < 0.25
    assert drawn.color_bar is not None
    assert drawn.color_bar.low == 0


# --- always -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("space", ["surface", "image"])
def test_no_light_is_said(furnace: pathlib.Path, space: str) -> None:
    drawn = told(furnace, space=space, expression="C S L")
    assert drawn.empty
    assert "No light" in drawn.caption
    assert "`CSL`" in drawn.caption
    assert drawn.figures["arrivals"] == 0


@pytest.mark.parametrize("given", [{}, {"space": "image", "neighbors": 50}])
def test_pictures_are_the_same_each_time(furnace: pathlib.Path, given: dict[str, object]) -> None:
    (one, first), (other, second) = draw(furnace, **given), draw(furnace, **given)
    np.testing.assert_array_equal(first, second)
    assert first.std() > 1
    assert (one.caption, one.figures) == (other.caption, other.figures)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"range": [2, 1]}, "low below high"),
        ({"range": [0, 1], "scale": "log"}, "above 0 on a logarithmic scale"),
        ({"patch": 0.0}, "above 0"),
        ({"space": "image", "patch": 0.5}, "`patch` belongs to `space: surface`"),
        ({"neighbors": 10}, "`neighbors` belongs to `space: image`"),
        ({"map": "jet"}, "viridis"),
        ({"patches": 1}, "Extra inputs"),
    ],
)
def test_refusals(given: dict[str, object], expected: str) -> None:
    with pytest.raises(ValidationError, match=expected):
        Irradiance.model_validate(given)


def test_the_job_camera_s_pose_is_the_default(furnace: pathlib.Path) -> None:
    """As the other tests take it for granted."""
    with open_run(furnace) as run:
        assert poses(run, None, {}) == [job_pose(run)]
    assert ((KD > 0) & (KD < 1)).all()
