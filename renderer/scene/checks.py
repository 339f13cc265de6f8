"""Checks of surfaces that a renderer cannot make sense of, and of cameras that would see nothing."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from renderer.bsdfs.base import KINDS
from renderer.errors import SceneError
from renderer.scene.context import Context
from renderer.scene.description import Node
from renderer.scene.geometry import Mesh, Quadric, Surface
from renderer.scene.transforms import F64
from renderer.sensors.base import Sensor
from renderer.shapes.base import SPHERE

if TYPE_CHECKING:
    from renderer.scene.bsdfs import MaterialTable, Sides

LARGEST = 1e15  # coordinates whose squares and cubes still fit float32 sums in float64; beyond, distances lose all meaning
TRANSPARENT = {KINDS.index(kind) for kind in ("dielectric", "roughdielectric", "thindielectric")}


def sound_surface(surface: Surface, node: Node, context: Context) -> Surface:
    """A surface whose coordinates are in range, without the triangles that have no area."""
    extent = surface.positions if isinstance(surface, Mesh) else surface.to_world
    if not np.abs(extent).max() < LARGEST:
        raise SceneError(f"{node.plugin}: the shape {node.name!r} reaches beyond {LARGEST:g}; use smaller units", node.place)
    if isinstance(surface, Quadric):
        return surface
    p = surface.corners()
    e1, e2 = (p[:, 1] - p[:, 0]).astype(np.float64), (p[:, 2] - p[:, 0]).astype(np.float64)
    squared_area = np.sum(np.cross(e1, e2) ** 2, axis=1)
    flat = ~(squared_area > 1e-24 * np.sum(e1 * e1, axis=1) * np.sum(e2 * e2, axis=1))
    if flat.all():
        raise SceneError(f"{node.plugin}: every triangle of {node.name!r} is degenerate: it has no area in single precision", node.place)
    if flat.any():
        context.warn(f"{node.plugin}: {flat.sum()} of {len(flat)} triangles of {node.name!r} have no area and were left out", node.place)
        surface.faces = surface.faces[~flat]
    return surface


def warn_of_inside(
    sensor: Sensor, nodes: Sequence[Node], surfaces: Sequence[Surface], sides: Sequence["Sides"], materials: "MaterialTable", context: Context
) -> None:
    """Warn of a camera inside a shape whose back is black: it sees nothing else."""
    eye = sensor.to_world[:, 3].astype(np.float64)
    for node, surface, side in zip(nodes, surfaces, sides, strict=True):
        if side.two_sided or (side.back >= 0 and materials.kinds[side.back] in TRANSPARENT):
            continue
        low, high = surface.bounds()
        if np.all(eye > low) and np.all(eye < high) and encloses(surface, eye):
            context.warn(f"the camera is inside {node.name!r}, whose back is black: wrap its BSDF in 'twosided' or flip its normals", node.place)


def encloses(surface: Surface, point: F64) -> bool:
    """Whether a point is inside a closed surface whose normals point outward."""
    if isinstance(surface, Quadric):
        return surface.kind == SPHERE and not surface.flip and bool(np.linalg.norm(np.linalg.inv(surface.to_world)[:3] @ [*point, 1.0]) < 1)
    return winding_number(surface, point) * (-1 if surface.flip else 1) > 0.5


def winding_number(mesh: Mesh, point: F64) -> float:
    """How often a mesh winds around a point: 1 inside a closed one, 0 outside (vanoosterom1983)."""
    a, b, c = np.moveaxis(mesh.positions[mesh.faces] - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    numerator = np.einsum("ij,ij->i", a, np.cross(b, c))
    dots = [np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a))]
    return float(np.sum(np.arctan2(numerator, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb)) / (2 * np.pi))
