"""Meshes from files, read by trimesh, with Mitsuba's semantics of normals and texture coordinates."""

import logging
import pathlib
from typing import Any

import numpy as np

from renderer.errors import SceneError
from renderer.scene import transforms
from renderer.scene.description import listing
from renderer.scene.geometry import Mesh
from renderer.scene.paths import Paths
from renderer.scene.reader import Reader
from renderer.scene.transforms import F64

FORMATS = ("obj", "ply", "stl", "gltf", "glb", "off")
V_FROM_TOP = ("gltf", "glb", "obj")  # formats whose pictures stand upright only if v is turned around


def read_mesh(reader: Reader, paths: Paths) -> Mesh:
    """The mesh of an ``obj``, ``ply`` or ``mesh`` shape, in world space.

    Normals of the file are kept and give each triangle its front; a mesh without any gets smooth ones (obj and ply, as
    in Mitsuba) or flat faces (the other formats, or where ``face_normals`` is true).
    """
    path, place = paths.file(reader)
    kind = path.suffix.lower().removeprefix(".")
    plugin = reader.node.plugin
    if kind not in FORMATS or plugin not in ("mesh", kind):
        expected = listing(f".{f}" for f in FORMATS) if plugin == "mesh" else f".{plugin}"
        raise SceneError(f"{plugin}: expected a file of type {expected}, found {path.name!r}", place)
    flat, flip = reader.flag("face_normals", False), reader.flag("flip_normals", False)
    flip_v = reader.flag("flip_tex_coords", kind in V_FROM_TOP)
    to_world = reader.transform("to_world")

    mesh = read_file(path, kind, place)
    if mesh.uvs is not None and flip_v:
        mesh.uvs = np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], axis=1)
    mesh.positions = transforms.points(to_world, mesh.positions)
    check_positions(mesh, path, place)
    if flat:
        mesh.normals = None
    elif mesh.normals is not None:
        mesh.normals = transforms.normals(to_world, mesh.normals)
        turn_to_normals(mesh)
    elif kind in ("obj", "ply"):
        mesh.normals = smooth_normals(mesh)
    if flip and mesh.normals is not None:
        mesh.normals = -mesh.normals
    mesh.flip = flip
    return mesh


def read_file(path: pathlib.Path, kind: str, place: str) -> Mesh:
    """All triangles of a file as one mesh in the file's own space; its nodes' transforms are applied."""
    import trimesh

    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    options: dict[str, Any] = {"file_type": kind, "process": False, "maintain_order": True}
    try:
        scene = trimesh.load_scene(str(path), **options)
        parts = [(scene.geometry[name], np.asarray(m, np.float64)) for m, name in map(scene.graph.get, scene.graph.nodes_geometry)]
    except Exception as error:  # whatever a parser makes of a broken file
        reason = str(error).strip().splitlines()[0][:120] if str(error).strip() else type(error).__name__
        raise SceneError(f"cannot read the mesh {str(path)!r} as {kind}: {reason}", place) from None
    meshes = [part_mesh(part, m) for part, m in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    if not meshes:
        raise SceneError(f"the mesh {str(path)!r} has no triangles", place)
    return join(meshes)


def part_mesh(part: Any, m: F64) -> Mesh:
    """One trimesh object under its node's transform; only what the file itself says of normals and coordinates."""
    normals = np.asarray(part.vertex_normals, np.float64) if "vertex_normals" in part._cache else None
    uv = getattr(part.visual, "uv", None)
    positions, faces = np.asarray(part.vertices, np.float64), np.asarray(part.faces, np.int64)
    uvs = np.asarray(uv, np.float64)[:, :2] if uv is not None and len(uv) == len(positions) else None
    if not np.array_equal(m, np.eye(4)):
        positions = transforms.points(m, positions)
        normals = transforms.normals(m, normals) if normals is not None else None
    return Mesh(positions, faces, normals, uvs)


def join(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one; normals and texture coordinates are kept where all have them."""
    if len(meshes) == 1:
        return meshes[0]
    starts = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    normals = [mesh.normals for mesh in meshes if mesh.normals is not None]
    uvs = [mesh.uvs for mesh in meshes if mesh.uvs is not None]
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        np.concatenate(normals) if len(normals) == len(meshes) else None,
        np.concatenate(uvs) if len(uvs) == len(meshes) else None,
    )


def check_positions(mesh: Mesh, path: pathlib.Path, place: str) -> None:
    """Refuse faces that name no vertex, and positions that are not finite."""
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.positions):
        raise SceneError(f"the mesh {str(path)!r} has faces that name vertices which it does not have", place)
    if not np.isfinite(mesh.positions).all():
        raise SceneError(f"the mesh {str(path)!r} has vertices that are not finite numbers", place)


def turn_to_normals(mesh: Mesh) -> None:
    """Turn around each triangle whose corners' normals point to its back: a mesh's own normals say which side is the front."""
    assert mesh.normals is not None
    p = mesh.positions[mesh.faces]
    facing = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), mesh.normals[mesh.faces].sum(axis=1))
    mesh.faces = np.where((facing < 0)[:, None], mesh.faces[:, [0, 2, 1]], mesh.faces)


def smooth_normals(mesh: Mesh) -> F64:
    """Unit normals at the vertices: face normals weighted by the angle of each corner (thuermer1998)."""
    p = mesh.positions[mesh.faces]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    total = np.zeros_like(mesh.positions)
    for i in range(3):
        a, b = p[:, (i + 1) % 3] - p[:, i], p[:, (i + 2) % 3] - p[:, i]
        lengths = np.maximum(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), np.finfo(np.float64).tiny)
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", a, b) / lengths, -1, 1))
        for axis in range(3):
            total[:, axis] += np.bincount(mesh.faces[:, i], angle * normal[:, axis], minlength=len(total))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(np.where(length > 0, total / np.where(length > 0, length, 1), 0))
