"""Mesh files: what is kept of them, what is left out, and how fast they load."""

import pathlib
import time

import numpy as np
import pytest
import trimesh

from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from tests.scenes.files import write_ply

CHECKS = {"type": "diffuse", "reflectance": {"type": "checkerboard"}}


def load_mesh(path: pathlib.Path | str, plugin: str = "", **shape: object) -> Scene:
    """A scene of one mesh."""
    mesh = {"type": plugin or pathlib.Path(path).suffix[1:], "filename": str(path), **shape}
    return load_scene({"type": "scene", "sensor": {"type": "perspective"}, "sky": {"type": "constant"}, "mesh": mesh})


def test_degenerate_triangles_are_left_out_with_a_warning(tmp_path: pathlib.Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\n")
    scene = load_mesh(tmp_path / "a.obj")
    assert len(scene.triangles) == len(scene.arrays.geometry.p0) == 1
    assert any("2 of 3 triangles of 'mesh' have no area" in warning for warning in scene.warnings)


def test_normals_are_kept_only_where_they_matter(session_folder: pathlib.Path) -> None:
    path = write_ply(session_folder)
    assert load_mesh(path).arrays.geometry.normals is not None
    assert load_mesh(path, face_normals=True).arrays.geometry.normals is None
    assert load_mesh(path).arrays.geometry.uvs is None
    assert load_mesh(path, bsdf=CHECKS).arrays.geometry.uvs is not None


def test_triangles_face_the_way_of_their_normals(session_folder: pathlib.Path) -> None:
    for turn in ([], [{"scale": [1, -1, 1]}]):
        for flip in (False, True):
            g = load_mesh(write_ply(session_folder), to_world=turn or [{"scale": 1}], flip_normals=flip).arrays.geometry
            assert g.normals is not None
            assert (np.einsum("ij,ikj->ik", g.ng, g.normals) > 0).mean() > 0.99
            outward = np.einsum("ij,ij->i", g.ng, g.p0) > 0
            assert outward.mean() == (0 if flip else 1)


def test_geometry_and_rays_share_their_triangles(session_folder: pathlib.Path) -> None:
    scene = load_mesh(write_ply(session_folder))
    g = scene.arrays.geometry
    corners = scene.vertices[scene.triangles]
    assert np.array_equal(corners[:, 0], g.p0)
    assert np.array_equal(corners[:, 1] - corners[:, 0], g.e1)
    assert np.array_equal(corners[:, 2] - corners[:, 0], g.e2)


def test_nodes_of_a_gltf_are_placed(tmp_path: pathlib.Path) -> None:
    scene = trimesh.Scene()
    for x in (0, 5):
        scene.add_geometry(trimesh.creation.box(), transform=trimesh.transformations.translation_matrix([x, 0, 0]))
    scene.export(tmp_path / "two.glb")
    assert np.allclose(load_mesh(tmp_path / "two.glb", "mesh").objects[0].bounds, [[-0.5, -0.5, -0.5], [5.5, 0.5, 0.5]])


@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_a_large_mesh_loads_quickly(suffix: str, tmp_path: pathlib.Path) -> None:
    n = 224  # 2 (n - 1)² = 99 458 triangles
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n)))
    corner = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
    faces = np.concatenate([np.stack([corner, corner + 1, corner + n], axis=1), np.stack([corner + 1, corner + n + 1, corner + n], axis=1)])
    mesh = trimesh.Trimesh(np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], axis=1), faces, process=False)
    mesh.export(tmp_path / f"large.{suffix}")
    load_mesh(write_ply(tmp_path))  # imports are not what is timed
    start = time.process_time()
    scene = load_mesh(tmp_path / f"large.{suffix}")
    assert time.process_time() - start < 2
    assert len(scene.triangles) == len(faces)
