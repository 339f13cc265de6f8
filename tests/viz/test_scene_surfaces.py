"""Surfaces of a run as meshes: areas, corners that are shared, creases and outlines, and the walls of rooms."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import trimesh

from queries.errors import QueryError
from queries.run import Run
from viz.scene.meshes import SceneMesh, merged, scene_meshes
from viz.scene.outlines import creased, face_normals, outlines
from viz.scene.shell import walls


def area(mesh: SceneMesh) -> float:
    return float(np.linalg.norm(face_normals(mesh.points, mesh.triangles), axis=1).sum() / 2)


def mesh_of(shape: trimesh.Trimesh, name: str = "thing", emits: bool = False) -> SceneMesh:
    return SceneMesh(0, name, "white", emits, *merged(shape.triangles))


def test_areas_and_names_are_those_of_the_catalogue(spheres_run: Run, cornell_run: Run) -> None:
    for run in (spheres_run, cornell_run):
        objects = {row["name"]: row for row in run.tables["objects"].to_pylist()}
        meshes = scene_meshes(run)
        assert [mesh.name for mesh in meshes] == list(objects)
        assert [mesh.name for mesh in meshes if mesh.emits] == ["light"]
        for mesh in meshes:
            row = objects[mesh.name]
            assert area(mesh) == pytest.approx(row["area"], rel=3e-3)  # round ones are inside of what they stand for
            low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
            assert np.allclose([*low, *high], [row[f"{end}_{axis}"] for end in ("min", "max") for axis in "xyz"], atol=2e-3 * np.ptp(mesh.points))


def test_corners_are_shared_and_orders_of_rows_are_kept(cornell_run: Run) -> None:
    blocks = [mesh for mesh in scene_meshes(cornell_run) if mesh.name.endswith("block")]
    assert [len(mesh.points) for mesh in blocks] == [8, 8]
    assert all(mesh.mesh.n_open_edges == 0 and mesh.mesh.n_cells == 12 for mesh in blocks)


def test_quadrics_look_round() -> None:
    import pyarrow as pa

    matrices = np.array([np.hstack([np.diag([2.0, 2.0, 3.0]), [[1], [0], [0]]])] * 3)
    placed = pa.FixedSizeListArray.from_arrays(pa.array(matrices.ravel()), 12)
    run = SimpleNamespace(
        path="run",
        tables={
            "objects": pa.table({"object": [0, 1, 2], "name": ["ball", "plate", "tube"], "material": ["m"] * 3}),
            "emitters": pa.table({"object": pa.array([None, 1], pa.uint16())}),
            "triangles": pa.table({"object": pa.array([], pa.uint16()), **{f"{a}{k}": pa.array([], pa.float32()) for k in range(3) for a in "xyz"}}),
            "quadrics": pa.table({"object": [0, 1, 2], "kind": pa.array([0, 1, 2], pa.uint8()), "to_world": placed}),
        },
    )
    ball, plate, tube = scene_meshes(run)  # type: ignore[arg-type]
    assert np.allclose((((ball.points - [1, 0, 0]) / [2, 2, 3]) ** 2).sum(axis=1), 1)
    assert area(plate) == pytest.approx(4 * np.pi, rel=2e-3)
    assert area(tube) == pytest.approx(2 * np.pi * 2 * 3, rel=2e-3)
    assert plate.emits
    assert not ball.emits
    assert ball.mesh.n_open_edges == 0
    assert tube.mesh.n_open_edges == 2 * 96


def test_a_run_without_surfaces_says_so() -> None:
    with pytest.raises(QueryError, match="does not store the surfaces of its scene"):
        scene_meshes(SimpleNamespace(path="old", tables={}))  # type: ignore[arg-type]


def test_creases_of_a_cube_and_of_a_ball() -> None:
    cube = creased(*merged(trimesh.creation.box().triangles))
    assert len(cube.edges) == 12
    assert len(cube.points) == 24
    ball = creased(*merged(trimesh.creation.icosphere(subdivisions=3).triangles))
    assert len(ball.edges) == 0
    assert np.abs((ball.normals * ball.points).sum(axis=1)).min() > 0.999


@pytest.mark.parametrize("seed", range(3))
def test_how_triangles_wind_does_not_matter(seed: int) -> None:
    generator = np.random.default_rng(seed)
    for shape, edges in ((trimesh.creation.box(), 12), (trimesh.creation.icosphere(subdivisions=2), 0)):
        points, triangles = merged(shape.triangles)
        turned = np.where(generator.random(len(triangles))[:, None] < 0.5, triangles[:, ::-1], triangles)
        found = creased(points, turned)
        assert len(found.edges) == edges
        assert np.allclose(np.linalg.norm(found.normals, axis=1), 1)
        sides = np.sign((found.normals * found.points).sum(axis=1))
        if not edges:
            assert abs(sides.sum()) == len(sides)  # all out, or all in


def test_borders_are_edges() -> None:
    points, triangles = merged(np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 1, 0], [0, 1, 0], [1, 0, 0]]], float))
    assert len(creased(points, triangles).edges) == 4


def test_the_outline_of_a_ball_is_the_circle_that_the_eye_sees() -> None:
    ball = creased(*merged(trimesh.creation.icosphere(subdivisions=4, radius=2.0).triangles))
    eye = np.array([1.0, -3.0, 4.0])
    found = outlines(ball, eye).reshape(-1, 3)
    assert len(found) > 100
    distance = np.linalg.norm(eye)
    assert np.allclose(found @ eye / distance, 4 / distance, atol=0.01)  # the plane of tangent points
    assert np.allclose(np.linalg.norm(found, axis=1), 2, atol=0.01)
    cube = creased(*merged(trimesh.creation.box().triangles))
    assert len(outlines(cube, eye)) == 0


def test_walls_of_rooms_are_found_and_things_inside_are_not(spheres_run: Run, cornell_run: Run) -> None:
    for run in (spheres_run, cornell_run):
        meshes = scene_meshes(run)
        outer = {mesh.name: normals for mesh, normals in zip(meshes, walls(meshes))}
        shell = {name for name, normals in outer.items() if normals.any()}
        assert shell == {"floor", "ceiling", "back_wall", "left_wall", "right_wall"}
        assert np.allclose(outer["ceiling"], [0, 1, 0], atol=1e-3)
        assert np.allclose(outer["floor"], [0, -1, 0], atol=1e-3)


def test_a_room_in_one_piece_opens_and_a_ball_on_a_floor_does_not() -> None:
    room = mesh_of(trimesh.creation.box((4, 3, 4)))
    inside = mesh_of(trimesh.creation.icosphere(subdivisions=3))
    outer, nothing = walls([room, inside])
    assert len(np.unique(np.round(outer, 6), axis=0)) == 6
    assert not nothing.any()
    floor = mesh_of(trimesh.creation.box((8, 0.02, 8)).apply_translation([0, -1, 0]))
    assert not walls([inside, floor])[0].any()


def test_no_objects_and_flat_scenes() -> None:
    assert walls([]) == []
    plane: Any = mesh_of(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    assert not walls([plane])[0].any()
