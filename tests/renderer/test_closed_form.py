"""Scenes whose radiance is known in closed form; tolerances come from the estimates' own scatter."""

from typing import Any

import numpy as np
import pytest
from rendering import F64, replicate_images, settings_of, with_all_features
from scenes.parts import Dict, area, camera, diffuse, floor, move, rgb, scale, scene, shape, turn
from stats import assert_expected, blocks

from renderer.scene.load import load_scene

REPLICATES = 16
KD, LE = np.array([0.3, 0.6, 0.8]), np.array([2.0, 1.0, 0.5])


def images(description: Dict, samples: int, method: str = "path", **changes: Any) -> F64:
    loaded = with_all_features(load_scene(description))
    return replicate_images(loaded, settings_of(loaded, samples * REPLICATES, method, **changes), REPLICATES)


# --- light that fills a closed room -------------------------------------------------------------------------------


def room(type: str) -> Dict:
    """A closed room that shines and reflects alike everywhere, seen from within."""
    walls = shape(type, turn("y", 20), scale(1.5), bsdf=diffuse(*KD), emitter=area(*LE), flip_normals=True)
    return scene(camera((0.3, 0.2, 0.1), (-0.4, -0.1, -1), 16, 16, fov=70.0), -1, walls=walls)


@pytest.mark.parametrize("method", ["path", "light"])
@pytest.mark.parametrize("type", ["sphere", "cube"])
def test_closed_room(type: str, method: str) -> None:
    """Radiance is Le / (1 - Kd) in every direction, by both tracers."""
    found = images(room(type), 64 if method == "path" else 200, method)
    assert_expected(blocks(found, 4), LE / (1 - KD), tests=4)


@pytest.mark.slow
def test_closed_room_without_roulette() -> None:
    found = images(room("sphere"), 8, rr_depth=1000)
    assert_expected(blocks(found, 4), LE / (1 - KD))


@pytest.mark.parametrize("depth", [1, 2, 3, 4])
def test_closed_room_bounce_by_bounce(depth: int) -> None:
    """Up to ``depth`` segments, radiance is Le (1 + Kd + … + Kd^(depth - 1))."""
    found = images(room("sphere"), 32, max_depth=depth)
    assert_expected(blocks(found, 4), LE * sum(KD**k for k in range(depth)), tests=4)


# --- irradiance of a plane ----------------------------------------------------------------------------------------

RHO, RADIANCE, HEIGHT = np.array([0.5, 0.6, 0.7]), np.array([5.0, 4.0, 3.0]), 1.3
POINTS = (0.0, 0.45, 1.6)  # distances from below the light's center


def disk_irradiance(x: float, radius: float) -> float:
    """Of a disk that faces the plane, over its radiance, at distance x from its axis (howell2010, factor B-15)."""
    a, b = HEIGHT**2 + x**2 + radius**2, HEIGHT**2 + x**2 - radius**2
    return float(np.pi / 2 * (1 - b / np.sqrt(a**2 - 4 * radius**2 * x**2)))


def polygon_irradiance(x: float, corners: np.ndarray) -> float:
    """Of a polygon, over its radiance, at (x, 0, 0) with the normal along y: Lambert's formula."""
    to_corners = corners - (x, 0, 0)
    to_corners /= np.linalg.norm(to_corners, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(to_corners, np.roll(to_corners, -1, axis=0)):
        side = np.cross(a, b)
        total += np.arccos(a @ b) * side[1] / np.linalg.norm(side)
    return abs(total) / 2


def sphere_irradiance(x: float, radius: float) -> float:
    """Of a sphere, over its radiance: pi sin² cos, where the whole sphere is above the horizon."""
    squared_distance = HEIGHT**2 + x**2
    return float(np.pi * radius**2 / squared_distance * HEIGHT / np.sqrt(squared_distance))


SQUARE = np.array([(-0.3, HEIGHT, -0.2), (0.3, HEIGHT, -0.2), (0.3, HEIGHT, 0.2), (-0.3, HEIGHT, 0.2)])
AREA_LIGHTS: dict[str, tuple[Dict, Any]] = {
    "rectangle": (shape("rectangle", scale(0.3, 0.2, 1), turn("x", 90), move(0, HEIGHT, 0)), lambda x: polygon_irradiance(x, SQUARE)),
    "cube": (shape("cube", scale(0.3, 1e-4, 0.2), move(0, HEIGHT + 1e-4, 0)), lambda x: polygon_irradiance(x, SQUARE)),
    "disk": (shape("disk", scale(0.4), turn("x", 90), move(0, HEIGHT, 0)), lambda x: disk_irradiance(x, 0.4)),
    "small disk": (shape("disk", scale(0.01), turn("x", 90), move(0, HEIGHT, 0)), lambda x: disk_irradiance(x, 0.01)),
    "sphere": (shape("sphere", scale(0.4), move(0, HEIGHT, 0)), lambda x: sphere_irradiance(x, 0.4)),
    "small sphere": (shape("sphere", scale(0.01), move(0, HEIGHT, 0)), lambda x: sphere_irradiance(x, 0.01)),
}


def plane_seen_at(x: float, fov: float = 0.002, **lights: Dict) -> Dict:
    """A diffuse plane, looked at so narrowly that irradiance does not change over the film."""
    return scene(camera((x + 1.5, 1.0, 2.0), (x, 0, 0), 4, 4, fov=fov), 2, ground=floor(diffuse(*RHO), 5), **lights)


@pytest.mark.parametrize("x", POINTS)
@pytest.mark.parametrize("name", AREA_LIGHTS)
def test_area_light_over_a_plane(name: str, x: float) -> None:
    light, irradiance = AREA_LIGHTS[name]
    found = images(plane_seen_at(x, light={**light, "emitter": area(*RADIANCE)}), 1024)
    assert_expected(found.mean(axis=(1, 2)), RHO / np.pi * RADIANCE * irradiance(x), tests=len(AREA_LIGHTS) * len(POINTS))


def spot_share(angle: float, beam: float, cutoff: float) -> float:
    """The share of a spot light's intensity at an angle from its axis, degrees."""
    return float(np.clip((cutoff - angle) / (cutoff - beam), 0, 1))


@pytest.mark.parametrize("x", POINTS)
def test_delta_lights_over_a_plane(x: float) -> None:
    """Point, spot and directional lights have no noise: the value is exact to float32."""
    distance = np.hypot(x, HEIGHT)
    bulb = {"type": "point", "position": [0.0, HEIGHT, 0.0], "intensity": rgb(*RADIANCE)}
    sun = {"type": "directional", "direction": [1.0, -2.0, 0.5], "irradiance": rgb(*RADIANCE)}
    down = {"lookat": {"origin": [0, HEIGHT, 0], "target": [0, 0, 0], "up": [0, 0, 1]}}
    spot = {"type": "spot", "to_world": [down], "intensity": rgb(*RADIANCE), "cutoff_angle": 60.0, "beam_width": 30.0}
    bulb_irradiance = HEIGHT / distance**3
    cases = (
        (bulb, bulb_irradiance),
        (sun, 2 / np.sqrt(1 + 4 + 0.25)),
        (spot, bulb_irradiance * spot_share(np.degrees(np.arctan2(x, HEIGHT)), 30, 60)),
    )
    for light, irradiance in cases:
        found = images(plane_seen_at(x, 1e-4, light=light), 1)
        np.testing.assert_allclose(found, np.broadcast_to(RHO / np.pi * RADIANCE * irradiance, found.shape), rtol=2e-5)


@pytest.mark.parametrize("method", ["path", "light"])
def test_plane_under_sun_and_sky(method: str) -> None:
    """A plane that nothing shadows: rho E cos / pi of a sun, rho L of a sky; the light tracer finds the same."""
    sensor = camera((0.3, 1.2, 0.9), (0, 0, 0), 16, 16)
    sun = {"type": "directional", "direction": [1.0, -2.0, 0.5], "irradiance": rgb(*RADIANCE)}
    sky = {"type": "constant", "radiance": rgb(*LE)}
    ground = floor(diffuse(*RHO), 2)
    expected = RHO * RADIANCE / np.pi * 2 / np.sqrt(5.25)
    found = images(scene(sensor, 3, ground=ground, sun=sun), 64, method)
    assert_expected(blocks(found, 4), expected, tests=4)
    found = images(scene(sensor, 3, ground=ground, sky=sky), 64, method)
    assert_expected(blocks(found, 4), RHO * LE, tests=4)


# --- the white furnace --------------------------------------------------------------------------------------------

LOSSLESS: dict[str, Dict] = {
    "diffuse": diffuse(1, 1, 1),
    "mirror": {"type": "conductor"},
    "dielectric": {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0},
    "diamond": {"type": "dielectric", "int_ior": "diamond"},
    "bubble": {"type": "dielectric", "int_ior": 1.0, "ext_ior": 1.33},
    "thindielectric": {"type": "thindielectric", "int_ior": 1.7},
    "plastic": {"type": "plastic", "diffuse_reflectance": 1.0, "int_ior": 1.5, "ext_ior": 1.0},
    "plastic, nonlinear": {"type": "plastic", "diffuse_reflectance": 1.0, "nonlinear": True},
}


@pytest.mark.parametrize("kind", ["sphere", "cube"])
@pytest.mark.parametrize("name", LOSSLESS)
def test_white_furnace(name: str, kind: str) -> None:
    """A body that loses nothing cannot be told from the uniform light around it."""
    body = shape(kind, turn("x", 30), scale(0.8), bsdf=LOSSLESS[name])
    sky = {"type": "constant", "radiance": rgb(*LE)}
    found = images(scene(camera((0, 0, 3), (0, 0, 0), 8, 8), -1, body=body, sky=sky), 32)
    assert_expected(blocks(found, 4), LE, tests=2 * len(LOSSLESS))


@pytest.mark.parametrize("type", ["roughconductor", "roughdielectric", "roughplastic"])
@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
def test_rough_furnace_gains_nothing(type: str, distribution: str) -> None:
    """Microfacets scatter once: some light is lost, none is gained, and little is lost where they are nearly flat.

    (Rough plastic's base loses a little even there, as Mitsuba's does: what its rough coat turns back inside is estimated.)
    """
    sky = {"type": "constant", "radiance": 1.0}
    color = {"diffuse_reflectance": 1.0} if type == "roughplastic" else {}
    means = []
    for alpha in (0.02, 0.5):
        body = shape("sphere", scale(0.8), bsdf={"type": type, "alpha": alpha, "distribution": distribution, **color})
        found = images(scene(camera((0, 0, 3), (0, 0, 0), 8, 8, fov=20.0), -1, body=body, sky=sky), 32)
        error = found.mean(axis=(1, 2, 3)).std(ddof=1) / 4
        assert found.mean() <= 1 + 4 * error
        means.append(found.mean())
    assert means[0] > (0.97 if type == "roughplastic" else 0.99)
    assert means[1] < means[0]
