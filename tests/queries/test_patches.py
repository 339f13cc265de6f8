"""Patches against closed forms: areas, where points lie, what is drawn; and what is refused."""

import numpy as np
import pytest
import trimesh
from region_scenes import scene_of
from scipy import stats

from queries.errors import QueryError
from queries.patches import Patches, patches, surface_area
from queries.regions import SceneGeometry

TURN = trimesh.transformations.quaternion_matrix([0.8, 0.3, -0.4, 0.33])[:3, :3]
BALL = np.hstack([1.5 * TURN, [[4.0], [0.0], [1.0]]])
OVAL = np.hstack([TURN @ np.diag([2.0, 0.5, 1.0]), [[0.0], [4.0], [0.0]]])
TUBE = np.hstack([TURN @ np.diag([0.5, 0.5, 3.0]), [[-4.0], [0.0], [2.0]]])
SHEET = trimesh.Trimesh([[0, 0, 0], [3, 0, 1], [1, 2, 0]], [[0, 1, 2]], process=False)
BLOCK = trimesh.creation.box((1, 2, 3))
BLOCK = trimesh.Trimesh(BLOCK.vertices, BLOCK.faces[np.lexsort(BLOCK.face_normals.round(3).T)], process=False)  # halves of faces in pairs
BLOB = trimesh.creation.icosphere(3, 1.25)
BLOB.apply_translation((0, -5, 0))
AREAS = {"sheet": 0.5 * np.sqrt(4 + 1 + 36), "block": 22.0, "blob": BLOB.area, "ball": 4 * np.pi * 2.25, "oval": np.pi, "tube": 2 * np.pi * 1.5}


@pytest.fixture(scope="module")
def scene() -> SceneGeometry:
    meshes = {"sheet": SHEET, "block": BLOCK, "blob": BLOB}
    return scene_of(meshes, {"ball": BALL, "oval": OVAL, "tube": TUBE}, kinds={"oval": 1, "tube": 2})


def sampled(scene: SceneGeometry, name: str, count: int, seed: int = 3) -> np.ndarray:
    """Points spread evenly over an object, by formulas of their own."""
    draw = np.random.default_rng(seed)
    mesh = {"sheet": SHEET, "block": BLOCK, "blob": BLOB}.get(name)
    if mesh is not None:
        return np.asarray(trimesh.sample.sample_surface(mesh, count, seed=seed)[0], np.float32)
    if name == "ball":
        local = draw.normal(size=(count, 3))
        local /= np.linalg.norm(local, axis=1, keepdims=True)
    else:
        angle, share = draw.uniform(0, 2 * np.pi, count), draw.uniform(size=count)
        r, z = (np.sqrt(share), np.zeros(count)) if name == "oval" else (np.ones(count), share)
        local = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    matrix = {"ball": BALL, "oval": OVAL, "tube": TUBE}[name]
    return (local @ matrix[:, :3].T + matrix[:, 3]).astype(np.float32)


def drawn_areas(made: Patches) -> np.ndarray:
    a, b, c = made.corners.astype(np.float64).transpose(1, 0, 2)
    return np.bincount(made.patch, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2, len(made))


@pytest.mark.parametrize("size", [100.0, 0.7, 0.11])
def test_areas_are_exact_and_drawn(scene: SceneGeometry, size: float) -> None:
    made = patches(scene, size)
    for name, area in AREAS.items():
        mine = made.object == scene.object_id(name)
        assert made.area[mine].sum() == pytest.approx(area, rel=1e-6)
        drawn = drawn_areas(made)[mine]
        if name in ("sheet", "block", "blob"):
            np.testing.assert_allclose(drawn, made.area[mine], rtol=1e-4)
        else:
            assert 0.985 * area < drawn.sum() <= area * (1 + 1e-6)
    assert surface_area(scene) == pytest.approx(sum(AREAS.values()), rel=1e-6)


def test_sides_are_not_longer_than_the_size(scene: SceneGeometry) -> None:
    made = patches(scene, 0.3)
    reach = np.linalg.norm(made.corners - made.center[made.patch][:, None], axis=2).max()
    assert 0.1 < reach <= 0.3
    sheet = patches(scene, 0.3, ["sheet"])
    sides = np.linalg.norm(sheet.corners - np.roll(sheet.corners, 1, axis=1), axis=2)
    assert 0.25 < sides.max() <= 0.3
    small = patches(scene, 0.3, ["block"])
    assert len(small) == 2 * (4 * 7 + 4 * 10 + 7 * 10)


@pytest.mark.parametrize("name", AREAS)
def test_points_fall_on_patches_by_area(scene: SceneGeometry, name: str) -> None:
    """Chi-square of how many even points fall on each patch."""
    made = patches(scene, 0.4, [name])
    count = 60 * len(made)
    found = made.find(sampled(scene, name, count), np.full(count, scene.object_id(name)))
    assert found.min() >= 0
    expected = count * made.area / made.area.sum()
    statistic = ((np.bincount(found, minlength=len(made)) - expected) ** 2 / expected).sum()
    assert stats.chi2.sf(statistic, len(made) - 1) > 1e-3 / len(AREAS)
    assert stats.chi2.cdf(statistic, len(made) - 1) > 1e-6


@pytest.mark.parametrize("name", AREAS)
def test_points_are_near_their_patches(scene: SceneGeometry, name: str) -> None:
    """A point is as near to the center of its patch as the corners are, and the drawn triangles' middles are found again."""
    made = patches(scene, 0.4)
    points = sampled(scene, name, 3000)
    found, normals = made.locate(points, np.full(3000, scene.object_id(name)))
    reach = np.zeros(len(made))
    np.maximum.at(reach, made.patch, np.linalg.norm(made.corners - made.center[made.patch][:, None], axis=2).max(axis=1))
    assert (np.linalg.norm(points - made.center[found], axis=1) <= reach[found] * 1.02 + 1e-5).all()
    assert np.einsum("ij,ij->i", normals, made.normal[found]).min() > 0.85
    mine = np.flatnonzero(made.object[made.patch] == scene.object_id(name))
    again = made.find(made.corners[mine].mean(axis=1), made.object[made.patch[mine]])
    assert (again == made.patch[mine]).all()
    assert (made.find(made.center, made.object) == np.arange(len(made))).all()


def test_triangles_of_meshes_are_patches(scene: SceneGeometry) -> None:
    made = patches(scene, 10.0, ["blob"])
    assert len(made) == len(BLOB.faces)
    points, faces = trimesh.sample.sample_surface(BLOB, 5000, seed=4)
    assert (made.find(points.astype(np.float32), np.full(5000, scene.object_id("blob"))) == faces).mean() > 0.999  # but for edges
    np.testing.assert_allclose(made.normal, BLOB.face_normals, atol=1e-5)


def test_normals_point_outward(scene: SceneGeometry) -> None:
    made = patches(scene, 0.5)
    for name, center in (("ball", BALL[:, 3]), ("blob", (0, -5, 0)), ("block", (0, 0, 0))):
        mine = made.object == scene.object_id(name)
        assert (np.einsum("ij,ij->i", made.normal[mine], made.center[mine] - np.float32(center)) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(made.normal, axis=1), 1, atol=1e-5)


def test_other_objects_have_no_patch(scene: SceneGeometry) -> None:
    made = patches(scene, 0.5, ["ball", "block"])
    assert set(made.object) == {scene.object_id("ball"), scene.object_id("block")}
    assert (made.find(sampled(scene, "tube", 10), np.full(10, scene.object_id("tube"))) == -1).all()
    assert (made.find(np.zeros((1, 3), np.float32), np.array([65535])) == -1).all()


def test_a_mesh_without_area_has_none() -> None:
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]], process=False)
    scene = scene_of({"flat": flat})
    made = patches(scene, 0.5)
    assert made.area.sum() == pytest.approx(0.5)
    assert (made.area[made.find(np.array([[0.5, 0.2, 0]], np.float32), np.zeros(1, np.int64))] > 0).all()


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan, np.inf])
def test_bad_sizes_are_refused(scene: SceneGeometry, size: float) -> None:
    with pytest.raises(QueryError, match="above 0"):
        patches(scene, size)


def test_too_many_patches_are_refused_with_a_size_that_is_not(scene: SceneGeometry) -> None:
    with pytest.raises(QueryError, match=r"ask for ([0-9.e-]+) or more") as error:
        patches(scene, 0.001)
    assert float(str(error.value).split("ask for ")[1].split()[0]) > 0.001


def test_unknown_objects_are_refused(scene: SceneGeometry) -> None:
    with pytest.raises(QueryError, match="did you mean `ball`"):
        patches(scene, 1.0, ["bal"])


def test_rays_of_the_camera_go_through_their_film_positions(scene: SceneGeometry) -> None:
    raster = np.random.default_rng(1).uniform(0, 100, (50, 2))
    rays = scene.camera.rays(raster)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1, atol=1e-6)
    again, before = scene.camera.raster((scene.camera.origin + 3 * rays).astype(np.float32))
    assert before.all()
    np.testing.assert_allclose(again, raster, atol=1e-3)
