"""Irradiance against closed forms, with tolerances from the estimates' own errors."""

import pathlib
import shutil
from typing import Any

import numpy as np
import pytest
from metered import BLACK, assert_scatter, ceiling_lamp, floor, gray, point_light, trace

from queries import Run, open_run
from queries.errors import QueryError
from queries.irradiance import irradiance, irradiance_image
from queries.kernels.luminance import LUMINANCE
from queries.patches import patches
from queries.selection import Selection
from renderer.tables import ESCAPED

ALL = Selection()


def of_square(position: np.ndarray, half: float, height: float, steps: int = 40) -> np.ndarray:
    """The integral of cos² / distance² over a square lamp parallel to the floor, seen from points (n, 3) of it: irradiance over radiance."""
    side = (np.arange(steps) + 0.5) / steps * 2 * half - half
    x, z = (a.ravel() for a in np.meshgrid(side, side))
    squared = (position[:, :1] - x) ** 2 + (position[:, 2:] - z) ** 2 + height**2
    return (height**2 / squared**2).sum(axis=1) * (2 * half / steps) ** 2


def mean_over(made: Any, function: Any, steps: int = 4) -> np.ndarray:
    """The mean of a function of points over each patch, by the middles of its drawn triangles cut into smaller ones."""
    weights = [np.array(w) for w in ((4, 1, 1), (1, 4, 1), (1, 1, 4), (2, 2, 2))]  # of corners: a quarter's middle each
    corners = made.corners.astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    values = np.mean([function(np.einsum("i,tij->tj", w / 6, corners)) for w in weights], axis=0)
    return np.bincount(made.patch, values * area, len(made)) / np.bincount(made.patch, area, len(made))


@pytest.fixture(scope="module")
def lamp_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A small lamp over a gray floor, 4 shards."""
    place = tmp_path_factory.mktemp("lamp")
    return trace(place, {"floor": floor(1.5, bsdf=gray(0.5)), "lamp": ceiling_lamp(0.2, 1.0, 5.0)}, origin=(0, 0.4, 4), samples=64, max_depth=4)


@pytest.fixture(scope="module")
def furnace(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The inside of a gray box whose walls glow."""
    glow = {"type": "area", "radiance": {"type": "rgb", "value": [1.0, 2.0, 0.5]}}
    box = {"type": "cube", "flip_normals": True, "bsdf": gray(0.5), "emitter": glow}
    return trace(tmp_path_factory.mktemp("furnace"), {"box": box}, origin=(0, 0, 0.9), target=(0, 0, -1), fov=90, samples=32, max_depth=5, rr_depth=3)


def test_a_small_lamp_over_a_floor(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        made = patches(run.geometry, 0.3, ["floor"])
        found = irradiance(run, Selection.of(run, "C L"), made)
        expected = 5.0 * mean_over(made, lambda p: of_square(p, 0.2, 1.0))
        assert_scatter(found.values @ np.float32(LUMINANCE), expected, found.error)
        inside = found.flux @ LUMINANCE
        assert abs(inside - (expected * made.area).sum()) < 4 * found.flux_error
        assert 0 < found.flux_error < 0.01 * inside


def test_a_point_light_and_the_inverse_square_cosine_law(tmp_path: pathlib.Path) -> None:
    tube = {"type": "cylinder", "p0": [0, 0.2, 0], "p1": [0, 1.8, 0], "radius": 1.5, "bsdf": BLACK}
    lid = {"type": "disk", "to_world": [{"scale": 1.4}, {"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, 2.5, 0]}], "bsdf": BLACK}
    objects = {"floor": floor(1.0), "tube": tube, "lid": lid, "bulb": point_light([0.1, 1.0, -0.2], [2.0, 1.0, 4.0])}
    with open_run(trace(tmp_path, objects, samples=64, max_depth=2)) as run:
        made = patches(run.geometry, 0.35)
        offset = np.array([0.1, 1.0, -0.2])
        found = irradiance(run, ALL, made)
        for name in ("floor", "tube", "lid"):
            some = patches(run.geometry, 0.35, [name])
            mine = made.object == run.geometry.object_id(name)

            def law(p: np.ndarray, some: Any = some) -> np.ndarray:
                index = some.patch.repeat(1)
                way = offset - p
                squared = (way * way).sum(axis=1)
                normal = some.normal[index].astype(np.float64)
                if name == "tube":  # noqa: B023
                    normal = p * (1, 0, 1) / np.linalg.norm(p * (1, 0, 1), axis=1, keepdims=True)
                return np.abs((way * normal).sum(axis=1)) / squared**1.5

            expected = mean_over(some, law)
            error = found.error[mine]
            assert_scatter(found.values[mine] @ np.float32(LUMINANCE), expected * ((2.0, 1.0, 4.0) @ np.array(LUMINANCE)), error)
        np.testing.assert_allclose(found.values[:, 2], 4 * found.values[:, 1], rtol=1e-5)


@pytest.mark.parametrize(("expression", "gathered"), [(None, 1 + 0.5 + 0.25 + 0.125), ("C L", 1.0), ("C D L", 0.5), ("C D D L", 0.25)])
def test_a_furnace_is_the_same_everywhere(furnace: pathlib.Path, expression: str | None, gathered: float) -> None:
    """Irradiance is pi x radiance x the sum of reflectances' powers, as far as walks go."""
    with open_run(furnace) as run:
        made = patches(run.geometry, 0.4)
        found = irradiance(run, Selection.of(run, expression), made)
        radiance = np.array([1.0, 2.0, 0.5])
        level = 1e-4 if expression is None else 1e-5
        assert_scatter(found.values @ np.float32(LUMINANCE), np.full(len(made), np.pi * gathered * radiance @ LUMINANCE), found.error, level)
        assert abs(found.flux @ LUMINANCE - np.pi * gathered * 24 * (radiance @ LUMINANCE)) < 5 * found.flux_error + 1e-4
        assert found.area == pytest.approx(24)


def test_a_glowing_sphere_from_within(tmp_path: pathlib.Path) -> None:
    glow = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    ball = {"type": "sphere", "center": [0, 1, 0], "radius": 2.0, "flip_normals": True, "bsdf": BLACK, "emitter": glow}
    with open_run(trace(tmp_path, {"ball": ball}, samples=16, max_depth=2)) as run:
        made = patches(run.geometry, 0.6)
        assert_scatter(irradiance(run, ALL, made).values[:, 1], np.full(len(made), np.pi), irradiance(run, ALL, made).error)


def test_patches_add_up_to_all_that_arrives(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        table = run.tables["light_vertices"]
        depth, event = table["depth"].to_numpy(), table["event"].to_numpy()
        rows = (depth > 0) & (event != ESCAPED)
        expected = np.array([table[f"throughput_{c}"].to_numpy()[rows].sum(dtype=np.float64) for c in "rgb"]) / (64 * 64 * 64)
        for size in (10.0, 0.1):
            made = patches(run.geometry, size)
            found = irradiance(run, ALL, made)
            np.testing.assert_allclose(found.flux, expected, rtol=1e-9)
            np.testing.assert_allclose((found.values * made.area[:, None]).sum(axis=0), expected, rtol=1e-5)
            assert found.hits.sum() == rows.sum() > 0
        parts = [irradiance(run, Selection.of(run, text), made).flux for text in ("C L", "C . L", "C . . L")]
        np.testing.assert_allclose(sum(parts), expected, rtol=1e-9)


def test_threads_do_not_change_a_bit(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        assert len(run.shard_files) > 1
        made = patches(run.geometry, 0.2)
        one, two = (irradiance(run, ALL, made, threads=threads) for threads in (1, 2))
        assert one.values.tobytes() == two.values.tobytes()
        assert one.error.tobytes() == two.error.tobytes()
        assert one.flux.tobytes() == two.flux.tobytes()
        assert one.flux_error == two.flux_error


def test_light_counts_on_the_face_that_it_comes_to(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        made = patches(run.geometry, 0.2)
        both, front, back = (irradiance(run, ALL, made, faces=faces) for faces in ("both", "front", "back"))
        on_floor = made.object == run.geometry.object_id("floor")
        assert back.hits[on_floor].sum() == 0 < front.hits[on_floor].sum()
        np.testing.assert_array_equal(both.hits, front.hits + back.hits)
        np.testing.assert_allclose(both.values, front.values + back.values, rtol=1e-5)


def test_importance_by_the_same_formulas(tmp_path: pathlib.Path) -> None:
    objects = {"floor": floor(1.5, bsdf=gray(0.5)), "lamp": ceiling_lamp(0.2, 1.0, 5.0)}
    with open_run(trace(tmp_path, objects, method="path", samples=8, max_depth=4)) as run:
        made = patches(run.geometry, 0.3)
        found = irradiance(run, ALL, made, side="camera")
        table = run.tables["camera_vertices"]
        rows = (table["event"].to_numpy() != ESCAPED) & (table["depth"].to_numpy() > 0)
        assert found.flux[1] == pytest.approx(table["throughput_g"].to_numpy()[rows].sum(dtype=np.float64) / (64 * 64 * 8), rel=1e-9)
        assert found.hits.sum() == rows.sum() > 1000
        with pytest.raises(QueryError, match="no light walks"):
            irradiance(run, ALL, made)


def test_nothing_selected_is_zero(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        found = irradiance(run, Selection.of(run, "C S L"), patches(run.geometry, 0.5))
        assert not found.values.any()
        assert not found.hits.any()
        assert found.flux_error == 0
        image = irradiance_image(run, Selection.of(run, "C S L"), 16, 16)
        assert not image.values.any()
        assert image.hits == 0
        assert image.seen.any()


def test_unknown_faces_are_refused(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run, pytest.raises(QueryError, match="`both`, `front` or `back`"):
        irradiance(run, ALL, patches(run.geometry, 1.0), faces="left")  # type: ignore[arg-type]


# --- image space --------------------------------------------------------------------------------------------------


def seen_on_floor(run: Run, width: int, height: int) -> np.ndarray:
    """Where the rays through the pixels' centers meet the plane y = 0: (pixels, 3)."""
    camera = run.geometry.camera
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    rays = camera.rays(np.column_stack([x.ravel(), y.ravel()]) * camera.film[4:6]).astype(np.float64)
    return camera.origin - rays * camera.origin[1] / rays[:, 1:2]


def test_an_image_of_a_floor_under_a_point_light(tmp_path: pathlib.Path) -> None:
    """Up to the floor's edges, seen from above; discs of radius 0.1 blur by less than the errors."""
    objects = {"floor": floor(1.0), "bulb": point_light([0.0, 1.0, 0.0], 3.0)}
    with open_run(trace(tmp_path, objects, origin=(0, 4, 0), target=(0, 0, 0), fov=30, samples=64, max_depth=2)) as run:
        points = seen_on_floor(run, 24, 24)
        inside = np.abs(points[:, [0, 2]]).max(axis=1) < 1
        expected = 3.0 / (1 + (points**2).sum(axis=1)) ** 1.5
        found = irradiance_image(run, ALL, 24, 24, radius=0.1)
        np.testing.assert_array_equal(found.seen.ravel(), inside)
        assert (found.object[found.seen] == run.geometry.object_id("floor")).all()
        z = ((found.values[..., 1].ravel() - expected) / np.maximum(found.error.ravel(), 1e-9))[inside]
        assert abs(z).max() < 5
        assert abs(z.mean()) < 0.3
        adaptive = irradiance_image(run, ALL, 24, 24, neighbors=100)
        off = (adaptive.values[..., 1].ravel() / expected - 1)[inside]
        assert np.sqrt((off**2).mean()) < 1.5 / np.sqrt(100)
        assert abs(off.mean()) < 2 / 100 + 0.005
        bare = irradiance_image(run, ALL, 24, 24, radius=0.1, faces="back")
        assert not bare.values.any()


def test_an_image_of_a_furnace_has_no_dark_corners(furnace: pathlib.Path) -> None:
    with open_run(furnace) as run:
        found = irradiance_image(run, Selection.of(run, "C L"), 32, 32, radius=0.15)
        assert found.seen.all()
        expected = np.pi * np.array([1.0, 2.0, 0.5]) @ LUMINANCE
        z = (found.values @ np.float32(LUMINANCE) - expected) / found.error
        assert abs(z).max() < 5
        assert 0.8 < z.std() < 1.25
        assert abs(z.mean()) < 0.25


def test_objects_can_be_left_out_of_images(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        whole, bare = irradiance_image(run, ALL, 96, 96), irradiance_image(run, ALL, 96, 96, objects=["floor"])
        lamp = run.geometry.object_id("lamp")
        assert (whole.object == lamp).any()
        assert not (bare.object == lamp).any()


def test_images_have_the_same_bits_again(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        one, two = (irradiance_image(run, ALL, 24, 24, threads=threads) for threads in (1, 2))
        assert one.values.tobytes() == two.values.tobytes()


def test_bad_images_are_refused(lamp_run: pathlib.Path) -> None:
    with open_run(lamp_run) as run:
        for width, neighbors, radius in ((0, 10, None), (8, 0, None), (8, 10, 0.0)):
            with pytest.raises(QueryError, match="above 0"):
                irradiance_image(run, ALL, width, 8, neighbors, radius)


def test_walks_of_the_pass_for_inspection(lamp_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """A run of camera walks with a light pass beside them: the same as from that pass."""
    objects = {"floor": floor(1.5, bsdf=gray(0.5)), "lamp": ceiling_lamp(0.2, 1.0, 5.0)}
    folder = trace(tmp_path, objects, method="path", samples=1, max_depth=4)
    shutil.copytree(lamp_run, folder / "inspection")
    with open_run(folder) as run, open_run(lamp_run) as light:
        made = patches(run.geometry, 0.3)
        np.testing.assert_array_equal(irradiance(run, ALL, made).values, irradiance(light, ALL, made).values)
