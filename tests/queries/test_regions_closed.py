"""What meshes and spheres enclose, and what segments meet of them, against trimesh and against formulas."""

import pathlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import trimesh
from region_scenes import mixed, quadric_hits, scene_of, triangle_hits

from queries.errors import QueryError
from queries.regions import Inside, Mesh, SceneGeometry, Surface, region

TURN = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (0, 0, 0))
ELLIPSOID = np.hstack([TURN[:3, :3] @ np.diag([0.9, 0.5, 0.3]), [[0.1], [0.2], [-0.1]]])


def hollow() -> trimesh.Trimesh:
    """A ball with a cavity."""
    cavity = trimesh.creation.icosphere(2, 0.5)
    cavity.invert()
    return trimesh.util.concatenate([trimesh.creation.icosphere(3, 1.0), cavity])


def inside_out() -> trimesh.Trimesh:
    mesh = trimesh.creation.capsule(1, 0.4)
    mesh.invert()
    return mesh


def unmerged() -> trimesh.Trimesh:
    """Each triangle has its own corners, as in the catalogue, and one is turned over."""
    mesh = trimesh.creation.cylinder(0.6, 1.5)
    corners = np.asarray(mesh.triangles).copy()
    corners[7] = corners[7][::-1]
    return trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)


MESHES = {
    "box": trimesh.creation.box((1.2, 0.7, 1.0), TURN),
    "ring": trimesh.creation.torus(0.8, 0.3),
    "hollow": hollow(),
    "inside_out": inside_out(),
    "unmerged": unmerged(),
    "fine": trimesh.creation.icosphere(5, 0.9),
}
ORACLES = MESHES | {"inside_out": trimesh.creation.capsule(1, 0.4), "unmerged": trimesh.creation.cylinder(0.6, 1.5)}
SCENE = scene_of(MESHES, {"egg": ELLIPSOID})
NOWHERE = np.full(100_000, 65535, np.uint16)


def some_points(count: int = 3000, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (count, 3)).astype(np.float32)


@pytest.mark.parametrize("name", MESHES)
def test_inside_is_what_trimesh_says(name: str) -> None:
    points = some_points()
    expected = ORACLES[name].contains(points)
    assert mixed(expected, 100)
    assert (SCENE.inside(name, points) == expected).all()
    assert (Inside(name).contains(SCENE, points, NOWHERE[: len(points)]) == expected).all()


def test_inside_of_overlapping_parts_is_inside_of_one_of_them() -> None:
    """Rays alone, counted odd or even, would call the overlap outside."""
    parts = [trimesh.creation.box((1, 1, 1), trimesh.transformations.translation_matrix((x, 0.1 + x, -x / 2))) for x in (0.0, 0.45)]
    scene = scene_of({"both": trimesh.util.concatenate(parts)})
    points = some_points()
    expected = parts[0].contains(points) | parts[1].contains(points)
    assert mixed(parts[0].contains(points) & parts[1].contains(points))
    assert (scene.inside("both", points) == expected).all()


def test_inside_of_an_ellipsoid_is_the_unit_ball_s() -> None:
    points = some_points()
    unit = np.linalg.solve(ELLIPSOID[:, :3], (points.astype(np.float64) - ELLIPSOID[:, 3]).T)
    expected = np.sum(unit**2, axis=0) <= 1
    assert mixed(expected, 100)
    assert (SCENE.inside("egg", points) == expected).all()


@pytest.mark.parametrize("name", MESHES)
def test_vertices_on_a_closed_object_are_inside_however_they_were_rounded(name: str) -> None:
    points, _ = trimesh.sample.sample_surface(MESHES[name], 500, seed=1)
    on = np.full(500, list(MESHES).index(name), np.uint16)
    assert Inside(name).contains(SCENE, points.astype(np.float32), on).all()


def met(name: str, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Whether segments pierce an object, by trying every triangle."""
    o, d = start.astype(np.float64), end.astype(np.float64) - start
    t = quadric_hits(0, ELLIPSOID, o, d) if name == "egg" else triangle_hits(SCENE.object_caster(name).corners, o, d)
    return ((t >= 0) & (t <= 1)).any(axis=1)


@pytest.mark.parametrize("name", ["box", "ring", "hollow", "egg"])
def test_segments_cross_a_surface_where_they_pierce_it(name: str) -> None:
    start, end = some_points(600, 2), some_points(600, 3)
    expected = met(name, start, end)
    assert mixed(expected, 100)
    assert (Surface(name).crosses(SCENE, start, end) == expected).all()


@pytest.mark.parametrize("name", ["box", "ring", "hollow", "egg"])
def test_segments_cross_an_inside_where_they_pierce_it_or_start_in_it(name: str) -> None:
    start = some_points(1000, 4)
    end = (start + 0.3 * some_points(1000, 5)).astype(np.float32)
    start_inside = SCENE.inside(name, start)
    expected = start_inside | met(name, start, end)
    assert mixed(expected, 50)
    assert mixed(start_inside & ~met(name, start, end), 5)
    assert (Inside(name).crosses(SCENE, start, end) == expected).all()


@pytest.mark.parametrize("name", [*MESHES, "egg"])
def test_segments_that_end_on_a_surface_cross_it_at_any_angle(name: str) -> None:
    """Ends as tables store them, rounded to float32, on either side; directions down to grazing and along the surface."""
    generator = np.random.default_rng(7)
    if name == "egg":
        unit = generator.normal(size=(2000, 3))
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        points = unit @ ELLIPSOID[:, :3].T + ELLIPSOID[:, 3]
        normals = unit @ np.linalg.inv(ELLIPSOID[:, :3])
    else:
        points, face = trimesh.sample.sample_surface(MESHES[name], 2000, seed=2)
        normals = MESHES[name].face_normals[face] * (1 if name != "inside_out" else -1)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    along = np.cross(normals, generator.normal(size=normals.shape))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    slope = generator.choice([0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0], len(points))
    d = along + slope[:, None] * normals
    other = (points + 0.5 * d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)
    points = points.astype(np.float32)
    assert Surface(name).crosses(SCENE, points, other).all()
    assert Surface(name).crosses(SCENE, other, points).all()
    assert Surface(name).crosses(SCENE, points, points).all()

    # The same segments, begun a little off the surface, mostly do not
    off = (points + 1e-3 * normals).astype(np.float32)
    away = (off + 0.05 * normals).astype(np.float32)
    assert Surface(name).crosses(SCENE, off, away).mean() < 0.05


def test_open_objects_enclose_nothing() -> None:
    box = trimesh.creation.box()
    box.update_faces(np.arange(len(box.faces)) != 3)
    disk = np.hstack([np.eye(3), np.zeros((3, 1))])
    scene = scene_of({"lid": box}, {"tube": disk}, kinds={"tube": 2})
    with pytest.raises(QueryError, match=r"`lid` encloses nothing: expected a closed mesh.*3 open sides"):
        Inside("lid").check(scene)
    with pytest.raises(QueryError, match="`tube` encloses nothing: expected a sphere or a closed mesh"):
        Inside("tube").contains(scene, some_points(3), NOWHERE[:3])
    Surface("lid").check(scene)
    assert Surface("tube").crosses(scene, np.array([[0, 0, 0.5]], np.float32), np.array([[3, 0, 0.5]], np.float32)).all()


# --- meshes from files --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["ply", "obj", "stl", "off"])
def test_mesh_files(tmp_path: pathlib.Path, suffix: str) -> None:
    MESHES["ring"].export(tmp_path / f"ring.{suffix}")
    one = region({"mesh": {"file": f"ring.{suffix}", "scale": 0.5, "translate": [0.2, 0, -0.1]}}, tmp_path)
    assert isinstance(one, Mesh)
    one.check()
    one.check(SCENE)
    moved = trimesh.creation.torus(0.4, 0.15)
    moved.apply_translation((0.2, 0, -0.1))
    points = some_points() / 2
    expected = moved.contains(points)
    assert mixed(expected)
    assert (one.contains(SCENE, points, NOWHERE[: len(points)]) == expected).mean() > 0.9995  # text files round coordinates
    start, end = points[:500], points[500:1000]
    pierced = (lambda t: ((t >= 0) & (t <= 1)).any(axis=1))(triangle_hits(np.asarray(moved.triangles), start, end - start))
    crossed = pierced | moved.contains(start)
    assert mixed(crossed)
    assert (one.crosses(SCENE, start, end) == crossed).mean() > 0.995
    outer = one.enlarged(2).contains(SCENE, points, NOWHERE[: len(points)])
    assert (outer >= expected).all()
    assert mixed(outer & ~expected)


def test_bad_mesh_files(tmp_path: pathlib.Path) -> None:
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    sheet.export(tmp_path / "open.ply")
    (tmp_path / "noise.ply").write_bytes(b"ply\nnot really")
    (tmp_path / "empty.off").write_bytes(b"")
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\n")
    (tmp_path / "folder.ply").mkdir()
    messages = {
        "open.ply": "expected a closed mesh, whose triangles meet along every side, found 3 open sides",
        "noise.ply": "noise.ply` cannot be read",
        "empty.off": "empty.off` cannot be read",
        "points.obj": "points.obj`",
        "missing.ply": "there is no mesh file .*missing.ply`: names are relative to the job's file",
        "folder.ply": "there is no mesh file",
        "scene.glb": "expected a mesh file that ends in .ply, .obj, .stl, .off",
    }
    for file, message in messages.items():
        one = region({"mesh": file}, tmp_path)
        for scene in (None, SCENE):
            with pytest.raises(QueryError, match=message):
                one.check(scene)


# --- threads ------------------------------------------------------------------------------------------------------


def test_threads_share_what_is_made_once() -> None:
    points = some_points(2000, 8)
    end = some_points(2000, 9)

    def answers(scene: SceneGeometry) -> list[np.ndarray]:
        inside = [
            one.contains(scene, points, NOWHERE[: len(points)]) for one in (Inside("ring"), Inside("egg").enlarged(), Surface("box").enlarged())
        ]
        return [*inside, Surface("ring").crosses(scene, points, end), scene.occluded(points, end - points, np.ones(len(points), np.float32))]

    expected = answers(SCENE)
    assert all(mixed(found) for found in expected)
    for _ in range(3):
        fresh = scene_of(MESHES, {"egg": ELLIPSOID})
        with ThreadPoolExecutor(8) as pool:
            for found in pool.map(lambda _, fresh=fresh: answers(fresh), range(8)):
                assert all((a == b).all() for a, b in zip(found, expected, strict=True))
