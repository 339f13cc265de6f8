"""Cameras of pictures: the job's perspective to a fraction of a pixel, orbits that show the whole scene, descriptions that are refused."""

import copy
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh
from pydantic import ValidationError
from small_runs import scene_of_triangles

from queries.errors import QueryError
from queries.regions import SceneGeometry
from renderer.scene.load import load_scene
from viz.cameras import CameraDescription, Pose, job_pose, poses
from viz.look import Look
from viz.stage import Stage

BOX = trimesh.creation.box((2.0, 1.0, 4.0))


def scene_with(**camera: Any) -> Any:
    """A run, as far as cameras need it, whose sensor is the renderer's own."""
    sensor = {
        "type": "perspective",
        "fov": 40,
        "near_clip": 0.1,
        "to_world": [{"lookat": {"origin": [1.5, 2, -6], "target": [0.2, 0.1, 0], "up": [0.1, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 160, "height": 120},
    }
    film = camera.pop("film", {})
    to_world = camera.pop("to_world", [])
    sensor |= camera
    sensor["film"] = {**sensor["film"], **film}  # type: ignore[dict-item]
    sensor["to_world"] = [*sensor["to_world"], *to_world]  # type: ignore[misc]
    shape = {"type": "sphere", "emitter": {"type": "area", "radiance": 1.0}}
    arrays = load_scene({"type": "scene", "sensor": copy.deepcopy(sensor), "ball": shape}).arrays.sensor
    described = {name: float(getattr(arrays, name)) for name in ("tan_x", "tan_y", "shift_x", "shift_y", "width", "height", "near", "far")}
    described |= {name: np.asarray(getattr(arrays, name), np.float64)[:3].tolist() for name in ("to_world", "to_camera")}
    geometry = scene_of_triangles(BOX.triangles, described)
    return SimpleNamespace(geometry=geometry, manifest={"camera": described})


def points_before(geometry: SceneGeometry) -> tuple[np.ndarray, np.ndarray]:
    """Points of the world inside the film, and where the run's camera sees them."""
    points = np.random.default_rng(5).uniform(-2, 2, (200, 3)).astype(np.float32)
    raster, before = geometry.camera.raster(points)
    inside = before & (raster > 0).all(axis=1) & (raster < geometry.camera.film[4:6]).all(axis=1)
    assert inside.sum() > 30
    return points[inside], raster[inside]


def vtk_pixels(pose: Pose, points: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Where VTK's own camera puts points, set as a stage sets it."""
    stage = SimpleNamespace(plotter=SimpleNamespace(renderer=SimpleNamespace(camera=_camera())), size=size)
    Stage._aim(stage, pose)  # type: ignore[arg-type]
    camera = stage.plotter.renderer.camera
    matrix = camera.GetCompositeProjectionTransformMatrix(size[0] / size[1], -1, 1)
    rows = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    clip = np.c_[points, np.ones(len(points))] @ rows.T
    x, y = (clip[:, :2] / clip[:, 3:]).T
    pixels = np.stack([size[0] * (1 + x) / 2, size[1] * (1 - y) / 2], axis=1)
    if pose.mirrored:
        pixels[:, 0] = size[0] - pixels[:, 0]
    return pixels


def _camera() -> Any:
    import pyvista

    camera = pyvista.Camera()
    camera.SetClippingRange(0.1, 100)
    return camera


CAMERAS: dict[str, dict[str, Any]] = {
    "plain": {},
    "square": {"film": {"width": 100, "height": 100}},
    "tall": {"film": {"width": 90, "height": 200}},
    "shifted": {"principal_point_offset_x": 0.15, "principal_point_offset_y": -0.2},
    "mirrored": {"to_world": [{"scale": [-1, 1, 1]}], "principal_point_offset_x": 0.1},
}


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("shape", ["film", "wide", "tall"])
def test_the_job_camera_sees_what_the_run_saw(name: str, shape: str) -> None:
    run = scene_with(**copy.deepcopy(CAMERAS[name]))
    points, raster = points_before(run.geometry)
    width, height = (int(value) for value in run.geometry.camera.film[4:6])
    size = {"film": (width * 4, height * 4), "wide": (height * 12, height * 4), "tall": (width * 4, width * 12)}[shape]
    # A picture of another shape holds the film in its middle, as large as fits
    scale = min(size[0] / width, size[1] / height)
    expected = raster * scale + (np.array(size) - scale * np.array([width, height])) / 2
    pose = job_pose(run)
    assert np.abs(pose.project(points, size)[0] - expected).max() < 0.02
    assert np.abs(vtk_pixels(pose, points, size) - expected).max() < 0.02
    assert pose.mirrored == (name == "mirrored")


def test_a_bright_point_is_drawn_where_the_run_saw_it(cornell_run: Any) -> None:
    import pyvista

    size = (160, 120)
    pose = job_pose(cornell_run)
    points = np.array([[100, 100, 100], [450, 300, 400], [278, 500, 250]], np.float32)
    for point in points:
        with Stage(cornell_run, Look(scene="hidden", background="black"), size) as stage:
            stage.add(pyvista.PolyData(point[None]), color="white", point_size=4, lighting=False, render_points_as_spheres=False)
            image = stage.picture(pose)[..., 0].astype(float)
        y, x = (np.array(np.nonzero(image)) + 0.5) @ image[np.nonzero(image)] / image.sum()
        raster = cornell_run.geometry.camera.raster(point[None])[0][0]
        scale = size[1] / cornell_run.geometry.camera.film[5]
        expected = raster * scale + [(size[0] - size[1]) / 2, 0]
        assert np.abs(np.array([x, y]) - expected).max() < 0.51  # points are drawn at whole pixels, twice as fine


@pytest.mark.parametrize("angles", [(0, 0), (35, 25), (90, -90), (180, 90), (271, 89)])
def test_an_orbit_shows_the_whole_scene_and_fills_the_picture(angles: tuple[float, float]) -> None:
    run = scene_with()
    (pose,) = poses(run, CameraDescription.model_validate({"orbit": {"azimuth": angles[0], "elevation": angles[1]}}), {})
    pixels, depth = pose.project(BOX.vertices, (400, 400))
    assert (depth > 0).all()
    assert (pixels >= 0).all()
    assert (pixels <= 400).all()
    assert np.ptp(pixels, axis=0).max() > 240
    away = np.subtract(pose.position, pose.target)
    assert math.isclose(math.degrees(math.asin(away[1] / np.linalg.norm(away))), angles[1], abs_tol=1e-4)
    assert abs(np.dot(pose.up, away)) < 1e-9 * np.linalg.norm(away)


def test_azimuth_zero_is_the_job_cameras_side_and_grows_to_its_right() -> None:
    run = scene_with()
    job = job_pose(run)
    side = np.subtract(job.position, job.target) * [1, 0, 1]
    at = [poses(run, CameraDescription.model_validate({"orbit": {"azimuth": azimuth, "elevation": 0}}), {})[0] for azimuth in (0, 90)]
    away = [np.subtract(pose.position, pose.target) for pose in at]
    assert np.dot(away[0], side) / np.linalg.norm(away[0]) / np.linalg.norm(side) > 0.999
    assert np.dot(away[1], job.axes[0]) / np.linalg.norm(away[1]) > 0.9


def test_frames_go_once_around_at_one_distance() -> None:
    run = scene_with()
    found = poses(run, "turn", {"turn": CameraDescription.model_validate({"orbit": {"frames": 12, "distance": 2, "elevation": 30}})})
    assert len(found) == 12
    assert [pose.name for pose in found[:2]] == ["turn 00", "turn 01"]
    away = np.array([np.subtract(pose.position, pose.target) for pose in found])
    assert np.allclose(np.linalg.norm(away, axis=1), 2 * math.sqrt(4 + 1 + 16))
    angles = np.unwrap(np.arctan2(away[:, 2], away[:, 0]))
    assert np.allclose(np.abs(np.diff(angles)), 2 * math.pi / 12)


def test_a_place_straight_above_needs_no_up() -> None:
    run = scene_with()
    (pose,) = poses(run, CameraDescription.model_validate({"place": {"position": [0, 9, 0], "target": [0, 0, 0]}}), {})
    assert np.isfinite(pose.axes).all()
    assert np.allclose(np.linalg.norm(pose.axes, axis=1), 1)


def test_names_of_cameras() -> None:
    run = scene_with()
    named = {"front": CameraDescription.model_validate({"orbit": {}})}
    assert poses(run, None, named) == poses(run, "job", named) == [job_pose(run)]
    assert poses(run, "front", named)[0].name == "front"
    with pytest.raises(QueryError, match="there is no camera `fornt`: did you mean `front`"):
        poses(run, "fornt", named)
    with pytest.raises(QueryError, match="does not say where its camera is"):
        poses(SimpleNamespace(geometry=scene_of_triangles(BOX.triangles, None), manifest={}), "job", {})


@pytest.mark.parametrize(
    ("description", "complaint"),
    [
        ({}, "exactly one of `place` and `orbit`, found none"),
        ({"orbit": {}, "place": {"position": [0, 0, 1], "target": [0, 0, 0]}}, "found both"),
        ({"place": {"position": [0, 0, 1], "target": [0, 0, 1]}}, "a `target` that is not the `position`"),
        ({"place": {"position": [0, 0, 1], "target": [0, 0, 0], "up": [0, 0, 2]}}, "does not point along the view"),
        ({"orbit": {"elevation": 91}}, "less than or equal to 90"),
        ({"orbit": {"angle": 180}}, "less than 180"),
        ({"orbit": {"frames": 0}}, "greater than or equal to 1"),
        ({"orbit": {"distance": 0}}, "above 0"),
        ({"orbit": {"spin": 1}}, "Extra inputs"),
    ],
)
def test_refused_descriptions(description: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValidationError, match=complaint):
        CameraDescription.model_validate(description)
