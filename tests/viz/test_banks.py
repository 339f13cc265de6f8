"""Illuminated lines, against the largest reflection that any normal gives, found by trying many."""

import numpy as np
import pytest

from viz.bundles import Lighting, shade

EYE = np.array([0.3, -0.2, 5.0])
LIGHT = np.array([0.36, 0.48, 0.8], np.float32)


def shaded(curves: np.ndarray, lighting: Lighting, color: tuple[float, float, float] = (1, 1, 1), alpha: int = 77) -> np.ndarray:
    out = np.full((*curves.shape[:2], 4), alpha, np.uint8)
    shade(curves.astype(np.float32), np.tile(np.array(color, np.float32), (len(curves), 1)), EYE, LIGHT, lighting, out)
    return out


def straight(directions: np.ndarray, points: int = 5) -> np.ndarray:
    return directions[:, None] * np.linspace(-0.001, 0.001, points)[None, :, None]


def test_diffuse_and_specular_are_the_most_that_any_normal_gives() -> None:
    generator = np.random.default_rng(1)
    ways = generator.normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    view = EYE / np.linalg.norm(EYE)
    diffuse, specular = np.empty(200), np.empty(200)
    for i, way in enumerate(ways):
        a = np.linalg.svd(way[None])[2][1:]
        angle = np.linspace(0, 2 * np.pi, 20001)[:, None]
        normals = np.cos(angle) * a[0] + np.sin(angle) * a[1]
        diffuse[i] = (normals @ LIGHT).max() ** 4
        # The mirror image of the light about the normal that faces it most
        normal = normals[np.argmax(normals @ LIGHT)]
        across = np.cross(way, normal)
        light = np.array([LIGHT @ normal, LIGHT @ across, LIGHT @ way])
        eye = np.array([view @ way, np.linalg.norm(view - (view @ way) * way)])
        # A cone of reflected directions: the one nearest to the eye
        specular[i] = max(0.0, light[0] * eye[1] - light[2] * eye[0]) ** 32
    seen = shaded(straight(ways), Lighting(ambient=0, diffuse=1, specular=0))
    assert np.abs(seen[:, 2, 0] / 255 - diffuse).max() < 1 / 255
    seen = shaded(straight(ways), Lighting(ambient=0, diffuse=0, specular=1))
    assert np.abs(seen[:, 2, 0] / 255 - specular).max() < 1.5 / 255
    assert specular.max() > 0.9


def test_a_line_across_the_light_is_bright_and_one_along_it_dark() -> None:
    across = np.cross(LIGHT, [0, 0, 1])
    seen = shaded(straight(np.stack([across / np.linalg.norm(across), LIGHT])), Lighting(ambient=0.25, diffuse=0.75, specular=0))
    assert (seen[0, :, :3] == 255).all()
    assert (np.abs(seen[1, :, :3].astype(int) - 64) <= 1).all()


def test_colors_scale_the_diffuse_part_alone_and_opacity_is_kept() -> None:
    seen = shaded(straight(np.random.default_rng(2).normal(size=(50, 3))), Lighting(specular=0), (1.0, 0.5, 0.0))
    assert (np.abs(seen[..., 1] - seen[..., 0] / 2) <= 1).all()
    assert (seen[..., 2] == 0).all()
    assert (seen[..., 3] == 77).all()


def test_a_line_has_no_direction() -> None:
    curves = np.cumsum(np.random.default_rng(3).normal(size=(40, 24, 3)), axis=1) * 0.01
    assert np.array_equal(shaded(curves, Lighting()), shaded(curves[:, ::-1], Lighting())[:, ::-1])


def test_each_curve_is_lit_by_itself() -> None:
    curves = np.cumsum(np.random.default_rng(4).normal(size=(5000, 6, 3)), axis=1) * 0.01
    assert np.array_equal(shaded(curves, Lighting())[4990:4993], shaded(curves[4990:4993], Lighting()))


def test_curves_of_no_length_and_two_points_are_lit_too() -> None:
    seen = shaded(np.zeros((3, 4, 3)), Lighting(ambient=0.2, diffuse=0.8, specular=0))
    assert (seen[..., :3] == 255).all()  # no tangent: across the light
    assert shaded(straight(np.eye(3), 2), Lighting()).shape == (3, 2, 4)


def test_the_light_stands_beside_the_eye() -> None:
    axes = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]], np.float64)  # looks along x
    light = Lighting().toward(axes)
    assert np.linalg.norm(light) == pytest.approx(1, abs=1e-6)
    assert light @ axes[2] < -0.7
    assert light @ axes[1] > 0.3
    assert light @ axes[0] < -0.2
