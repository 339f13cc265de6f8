"""Scenes without a run: what a run's catalogues would say of some meshes, spheres and a camera; and plain ways to trace rays."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import trimesh

from queries.regions import SceneGeometry

CORNERS = [f"{axis}{corner}" for corner in range(3) for axis in "xyz"]
CAMERA: dict[str, Any] = {
    "to_world": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
    "to_camera": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]],
    "tan_x": 0.5,
    "tan_y": 0.5,
    "shift_x": 0.0,
    "shift_y": 0.0,
    "width": 100,
    "height": 100,
    "near": 0.01,
    "far": 1000.0,
    "lens_radius": None,
    "focus": None,
}


def scene_of(
    meshes: dict[str, trimesh.Trimesh] | None = None,
    spheres: dict[str, np.ndarray] | None = None,
    camera: dict[str, Any] | None = CAMERA,
    kinds: dict[str, int] | None = None,
) -> SceneGeometry:
    """Objects in order: meshes, then spheres (or other quadrics, by ``kinds``) that matrices (3, 4) place."""
    meshes, spheres = meshes or {}, spheres or {}
    names = [*meshes, *spheres]
    triangles = [np.asarray(mesh.triangles, np.float32).reshape(-1, 9) for mesh in meshes.values()]
    corners = np.concatenate(triangles) if triangles else np.empty((0, 9), np.float32)
    owner = np.repeat(np.arange(len(meshes), dtype=np.uint16), [len(part) for part in triangles])
    matrices = np.array([*spheres.values()], np.float64).reshape(-1)
    tables = {
        "objects": pa.table({"object": pa.array(range(len(names)), pa.uint16()), "name": pa.array(names, pa.string())}),
        "triangles": pa.table({"object": pa.array(owner), **{name: pa.array(corners[:, i].copy()) for i, name in enumerate(CORNERS)}}),
        "quadrics": pa.table(
            {
                "object": pa.array(range(len(meshes), len(names)), pa.uint16()),
                "kind": pa.array([(kinds or {}).get(name, 0) for name in spheres], pa.uint8()),
                "to_world": pa.FixedSizeListArray.from_arrays(pa.array(matrices), 12),
            }
        ),
    }
    return SceneGeometry(SimpleNamespace(manifest=json.loads(json.dumps({"camera": camera})), tables=tables))


def triangle_hits(corners: np.ndarray, o: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distances (rays, triangles) to triangles (m, 3, 3) along rays (n, 3); inf where they miss. One formula for each, in float64."""
    corners, o, d = (np.asarray(array, np.float64) for array in (corners, o, d))
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ab, ac)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.einsum("nmk,mk->nm", a[None] - o[:, None], normal) / (d @ normal.T)
        to_plane = o[:, None] + t[..., None] * d[:, None] - a[None]
        square = np.sum(normal * normal, axis=1)
        b = np.einsum("nmk,mk->nm", np.cross(to_plane, ac[None]), normal) / square
        c = np.einsum("nmk,mk->nm", np.cross(ab[None], to_plane), normal) / square
        return np.where((b >= 0) & (c >= 0) & (b + c <= 1), t, np.inf)


def quadric_hits(kind: int, to_world: np.ndarray, o: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distances (n, 2) along rays to the sphere, disk or open cylinder (kinds 0, 1, 2) that ``to_world`` (3, 4) places; inf where they miss.

    Schoolbook formulas in the frame where it is a unit shape.
    """
    inverse = np.linalg.inv(np.vstack([to_world, [0, 0, 0, 1]]))
    o = np.asarray(o, np.float64) @ inverse[:3, :3].T + inverse[:3, 3]
    d = np.asarray(d, np.float64) @ inverse[:3, :3].T
    used = slice(0, 2 if kind == 2 else 3)
    a, b, c = (np.sum(x[:, used] * y[:, used], axis=1) for x, y in ((d, d), (2 * o, d), (o, o)))
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b * b - 4 * a * (c - 1))
        t = np.stack([(-b - root) / (2 * a), (-b + root) / (2 * a)], axis=1)
        if kind == 1:
            t = np.repeat(-o[:, 2:] / d[:, 2:], 2, axis=1)
        p = o[:, None] + t[..., None] * d[:, None]
        there = {0: np.isfinite(t), 1: p[..., 0] ** 2 + p[..., 1] ** 2 <= 1, 2: (p[..., 2] >= 0) & (p[..., 2] <= 1)}[kind]
    return np.where(there & np.isfinite(t), t, np.inf)


def mixed(found: np.ndarray, least: int = 20) -> bool:
    """Whether there are at least so many answers of each kind: a comparison of one kind alone shows nothing."""
    return int(found.sum()) >= least and int((~found).sum()) >= least
