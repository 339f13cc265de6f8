"""Cameras of a description: their rays are Mitsuba's, and the film, sampler and integrator become defaults."""

from typing import Any

import numpy as np
import pytest

from renderer.scene.arrays import RenderDefaults, Scene
from renderer.scene.load import load_scene
from renderer.scene.to_mitsuba import mitsuba_dict
from renderer.sensors.dispatch import sample_ray

TURN = [{"lookat": {"origin": [1, 2, 3], "target": [0, 0.5, 0], "up": [0.1, 1, 0]}}]
CAMERAS: dict[str, dict[str, Any]] = {
    "plain": {},
    "fov": {"fov": 70, "to_world": TURN},
    "fov_y": {"fov": 30, "fov_axis": "y"},
    "fov_diagonal": {"fov": 50, "fov_axis": "diagonal", "to_world": TURN},
    "fov_smaller": {"fov": 50, "fov_axis": "smaller"},
    "fov_larger": {"fov": 50, "fov_axis": "larger"},
    "focal_length": {"focal_length": "35mm"},
    "shifted": {"fov": 40, "principal_point_offset_x": 0.2, "principal_point_offset_y": -0.1, "to_world": TURN},
    "mirrored": {"fov": 40, "to_world": [{"scale": [-1, 1, 1]}, *TURN]},
    "clipped": {"fov": 40, "near_clip": 0.5, "far_clip": 7.0},
}


def with_sensor(sensor: dict[str, Any], **more: Any) -> Scene:
    """A scene with this camera."""
    return load_scene({"type": "scene", "sensor": sensor, "light": {"type": "constant"}, "ball": {"type": "sphere", "center": [0, 0, 9]}, **more})


@pytest.mark.parametrize("size", [(30, 20), (16, 24)])
@pytest.mark.parametrize("name", CAMERAS)
def test_rays_are_mitsubas(name: str, size: tuple[int, int]) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    width, height = size
    scene = with_sensor({"type": "perspective", **CAMERAS[name], "film": {"type": "hdrfilm", "width": width, "height": height}})
    theirs = mi.load_dict(mitsuba_dict(scene.description)).sensors()[0]
    sensor = scene.arrays.sensor
    for x, y in ((0.0, 0.0), (0.5, 0.5), (0.2, 0.9), (0.999, 0.01)):
        ray, _ = theirs.sample_ray(0, 0, [x, y], [0.5, 0.5])
        o, d = sample_ray(sensor, np.float32(x * width), np.float32(y * height), np.float32(0.5), np.float32(0.5))
        assert np.allclose(d, ray.d, atol=2e-6)
        # Both begin on the near plane and end on the far one
        assert np.allclose(o, ray.o, atol=2e-6)
        axis = sensor.to_world[:, 2]
        assert (np.array(ray.o) - sensor.to_world[:, 3]) @ axis == pytest.approx(sensor.near, rel=1e-4)
        assert ray.maxt * (axis @ np.array(d)) == pytest.approx(sensor.far - sensor.near, rel=1e-4)


def test_thin_lens() -> None:
    sensor = with_sensor({"type": "thinlens", "aperture_radius": 0.25, "focus_distance": 3.0}).arrays.sensor
    assert (sensor.lens_radius, sensor.focus) == (np.float32(0.25), np.float32(3.0))
    assert with_sensor({"type": "perspective"}).arrays.sensor.lens_radius is None


def test_defaults() -> None:
    assert with_sensor({"type": "perspective"}).defaults == RenderDefaults(768, 576, "gaussian", 4, "path", -1, 5)
    film = {"type": "hdrfilm", "width": 64, "height": 32, "rfilter": {"type": "tent"}, "pixel_format": "rgb"}
    sensor = {"type": "perspective", "film": film, "sampler": {"type": "multijitter", "sample_count": 9}}
    scene = with_sensor(sensor, tracer={"type": "ptracer", "max_depth": 7, "rr_depth": 3})
    assert scene.defaults == RenderDefaults(64, 32, "tent", 9, "light", 7, 3)
    assert any("multijitter" in warning for warning in scene.warnings)


def test_a_camera_inside_a_shape_is_told() -> None:
    camera = {"type": "perspective"}
    for inner, warned in (({"type": "diffuse"}, True), ({"type": "twosided", "a": {"type": "diffuse"}}, False), ({"type": "dielectric"}, False)):
        for shape in ("sphere", "cube"):
            scene = with_sensor(camera, room={"type": shape, "bsdf": inner})
            assert any("inside 'room'" in warning for warning in scene.warnings) == warned, (shape, inner)
            flipped = with_sensor(camera, room={"type": shape, "bsdf": inner, "flip_normals": True})
            assert not any("inside 'room'" in warning for warning in flipped.warnings)
