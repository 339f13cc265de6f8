"""Emitters of a description as rows of the emitter table."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from renderer.emitters.base import (
    AREA,
    AREA_CYLINDER,
    AREA_DISK,
    AREA_MESH,
    AREA_RECTANGLE,
    AREA_SPHERE,
    CDF_FIRST,
    CONSTANT,
    DIRECTIONAL,
    ENVMAP,
    OFFSET,
    POINT,
    PRIMITIVE_COUNT,
    PRIMITIVE_FIRST,
    SPOT,
    Emitters,
    Environment,
)
from renderer.scene.arrays import EmitterInfo
from renderer.scene.context import Context
from renderer.scene.description import Node
from renderer.scene.geometry import Assembly, Mesh, Surface
from renderer.scene.reader import Reader
from renderer.scene.spectra import Rgb
from renderer.scene.textures import slot
from renderer.shapes.base import CYLINDER, DISK, SPHERE

AREA_KINDS = {SPHERE: AREA_SPHERE, DISK: AREA_DISK, CYLINDER: AREA_CYLINDER}
EMITTERS = ("area", "point", "spot", "directional", "constant", "envmap")
INFINITE = ("directional", "constant", "envmap")


@dataclass
class Light:
    """One emitter before it is packed."""

    kind: int
    info: EmitterInfo
    rgb: Rgb
    texture: int = -1
    frame: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(12))
    scalar: dict[int, float] = field(default_factory=dict)
    primitive: tuple[int, int] = (0, 0)
    cdf: npt.NDArray[np.float64] | None = None


def area_light(node: Node, object_index: int, name: str, surface: Surface, assembly: Assembly, context: Context) -> Light:
    """A shape that shines."""
    reader = Reader(node)
    rgb, texture = slot(reader, "radiance", 1.0, context, bounded=False)
    reader.number("sampling_weight", 1.0)
    reader.finish()
    first, count = assembly.first[object_index], assembly.count[object_index]
    info = EmitterInfo(name, "area", object_index, False, "L")
    light = Light(AREA_MESH, info, rgb, texture, primitive=(first, count))
    offsets = assembly.geometry.offset[first : first + count]
    light.scalar = {PRIMITIVE_FIRST: first, PRIMITIVE_COUNT: count, OFFSET: float(offsets.max())}
    if not isinstance(surface, Mesh):
        light.kind = AREA_KINDS[surface.kind]
        light.frame = surface.to_world[:3].reshape(-1)
        light.scalar[AREA] = surface.area()
        return light
    areas = surface.areas()
    light.scalar[AREA] = float(areas.sum())
    if surface.parallelogram:
        p = surface.positions
        light.kind = AREA_RECTANGLE
        light.frame = np.concatenate([p[0], p[1] - p[0], p[3] - p[0], assembly.geometry.ng[first]])
    else:
        cumulative = np.cumsum([0.0, *areas])
        light.cdf = cumulative / cumulative[-1]
    return light


def pack_emitters(lights: list[Light], bounds: tuple[Any, Any], environment: Environment | None) -> Emitters:
    """The emitter table as kernels read it; ``bounds`` are the scene's."""
    n = len(lights)
    scalar = np.zeros((n, 7), np.float32)
    cdfs: list[npt.NDArray[np.float64]] = []
    for i, light in enumerate(lights):
        if light.cdf is not None:
            light.scalar[CDF_FIRST] = sum(len(c) for c in cdfs)
            cdfs.append(light.cdf)
        for column, value in light.scalar.items():
            scalar[i, column] = value
    kinds = {light.kind for light in lights}
    low, high = np.asarray(bounds[0]), np.asarray(bounds[1])
    sphere = np.array([*(low + high) / 2, max(float(np.linalg.norm(high - low)) / 2 * (1 + 1e-4), 1e-4)], np.float32)
    return Emitters(
        np.array([light.kind for light in lights], np.int32),
        np.array([light.info.object for light in lights], np.int32),
        np.array([light.rgb for light in lights], np.float32),
        np.array([light.texture for light in lights], np.int32),
        np.array([light.frame for light in lights], np.float32),
        scalar,
        np.array([light.primitive for light in lights], np.int32),
        np.concatenate(cdfs).astype(np.float32) if cdfs else None,
        sphere,
        np.int32(next((i for i, light in enumerate(lights) if light.kind in (CONSTANT, ENVMAP)), -1)),
        True if kinds & {AREA_MESH, AREA_SPHERE, AREA_DISK, AREA_CYLINDER} else None,
        True if kinds & {POINT, SPOT, DIRECTIONAL} else None,
        True if kinds & {CONSTANT, ENVMAP} else None,
        environment,
    )
