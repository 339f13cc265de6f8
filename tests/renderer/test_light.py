"""The light tracer against the path tracer, image by image, where both see everything: no delta lobes in view, no sky behind."""

import pathlib
from typing import Any

import pytest
from rendering import F64, replicate_images, settings_of, with_all_features
from scenes.catalogue import delta_lights, diffuse_box, glowing_shapes, thin_lens
from scenes.files import sky_exr, write_obj
from scenes.parts import Dict, camera, diffuse, floor, lamp, move, rgb, scale, scene, shape, turn, two_sided
from stats import assert_same_image

from renderer.scene.load import load_scene

REPLICATES = 16
Folder = pathlib.Path


def smooth_mesh(folder: Folder, **light: Dict) -> Dict:
    """A mesh with vertex normals on a floor that fills the view: shading normals are where adjoints differ."""
    bsdf = {"type": "roughconductor", "alpha": 0.4, "distribution": "ggx"}
    return scene(
        camera((0, 3.0, 2.0), (0, 0.3, 0), fov=35.0),
        4,
        ground=floor(two_sided(diffuse(0.5, 0.5, 0.5)), 2.2),
        mesh=shape("obj", scale(0.5), move(-0.45, 0.6, 0), filename=write_obj(folder), bsdf=diffuse(0.8, 0.6, 0.4)),
        metal=shape("obj", scale(0.4), turn("y", 70), move(0.55, 0.5, 0), filename=write_obj(folder), bsdf=two_sided(bsdf)),
        **light,
    )


def under_an_environment(folder: Folder) -> Dict:
    return smooth_mesh(folder, sky={"type": "envmap", "filename": sky_exr(folder), "scale": 0.5, "to_world": [turn("y", 40)]})


def under_a_sky_and_a_sun(folder: Folder) -> Dict:
    sun = {"type": "directional", "direction": [0.5, -1.0, -0.3], "irradiance": rgb(1, 0.9, 0.8)}
    return smooth_mesh(folder, sky={"type": "constant", "radiance": rgb(0.3, 0.4, 0.6)}, sun=sun)


def through_rough_glass(folder: Folder) -> Dict:
    """Radiance and importance scale differently where they are refracted: eta² must be in one of them only."""
    glass = {"type": "roughdielectric", "alpha": 0.3, "distribution": "beckmann", "int_ior": 1.6}
    return scene(
        camera((0, 3.0, 2.0), (0, 0.3, 0), fov=35.0),
        6,
        ground=floor(diffuse(0.6, 0.5, 0.4), 2.2),
        slab=shape("cube", scale(0.5, 0.15, 0.5), turn("y", 20), move(0, 0.4, 0), bsdf=glass),
        ball=shape("sphere", scale(0.2), move(0.6, 0.25, 0.6), bsdf={"type": "roughplastic", "alpha": 0.3}),
        inside=shape("sphere", scale(0.1), move(0, 0.4, 0), bsdf=diffuse(0.2, 0.7, 0.3)),
        lamp=lamp(5, 5, 5, 1.0, 2.6),
    )


SCENES = {
    f.__name__: f for f in (diffuse_box, delta_lights, glowing_shapes, thin_lens, under_an_environment, under_a_sky_and_a_sun, through_rough_glass)
}
TESTS = len(SCENES) + 4 + 5


def images(description: Dict, samples: int, method: str, **changes: Any) -> F64:
    loaded = with_all_features(load_scene(description))
    return replicate_images(loaded, settings_of(loaded, samples * REPLICATES, method, **changes), REPLICATES)


# Shorter tests below compare the same scenes: the box by filters, the shapes by depths, the glass with roulette.
LONG = ("diffuse_box", "glowing_shapes", "thin_lens", "through_rough_glass")


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if name in LONG else name for name in SCENES])
def test_same_image(name: str, tmp_path: Folder) -> None:
    description = SCENES[name](tmp_path)
    assert_same_image(images(description, 192, "light"), images(description, 32, "path"), tmp_path, TESTS, bias=0.03)


@pytest.mark.parametrize("method", ["path", "light"])
def test_bulbs_are_not_seen(method: str) -> None:
    """A light without a surface shows in no picture: a pinhole cannot look at it, and it is not joined to the lens."""
    lights = {
        "bulb": {"type": "point", "position": [0.0, 0.6, 0.0], "intensity": 1.0},
        "beam": {"type": "spot", "to_world": [{"lookat": {"origin": [0.3, 0.5, 0], "target": [0, 1, 4], "up": [0, 1, 0]}}], "intensity": 2.0},
        "sun": {"type": "directional", "direction": [0, -1, 1], "irradiance": 1.0},
    }
    sensor = camera((0, 1, 4), (0, 0.6, 0), 16, 16)
    assert not images(scene(sensor, 1, ground=floor(diffuse(0.5, 0.5, 0.5)), **lights), 64, method).any()


@pytest.mark.parametrize("max_depth", [1, 2, 3, 4])
def test_depths_mean_the_same(max_depth: int, tmp_path: Folder) -> None:
    description = glowing_shapes(tmp_path)
    light, path = (images(description, 24, method, max_depth=max_depth) for method in ("light", "path"))
    assert_same_image(light, path, tmp_path, TESTS)


@pytest.mark.parametrize("filter", ["tent", "gaussian", "mitchell", "catmullrom", "lanczos"])
def test_filters_mean_the_same(filter: str, tmp_path: Folder) -> None:
    """Camera walks divide by weights and light walks by the filter's integral: inside the film both are the same picture."""
    description = diffuse_box(tmp_path)
    light, path = (images(description, 24, method, filter=filter)[:, 4:-4, 4:-4] for method in ("light", "path"))
    assert_same_image(light, path, tmp_path, TESTS)


def test_roulette_is_unbiased(tmp_path: Folder) -> None:
    description = through_rough_glass(tmp_path)
    light, path = images(description, 32, "light", rr_depth=1), images(description, 32, "path", rr_depth=100)
    assert_same_image(light, path, tmp_path, TESTS)
