"""Emitters of a description as rows of the emitter table, with Mitsuba's defaults."""

import math
from collections.abc import Callable
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
    BEAM,
    CDF_FIRST,
    CONSTANT,
    CUTOFF,
    DIRECTIONAL,
    ENVMAP,
    POINT,
    PRIMITIVE_COUNT,
    PRIMITIVE_FIRST,
    SPOT,
    Emitters,
    Environment,
)
from renderer.errors import SceneError
from renderer.scene import transforms
from renderer.scene.arrays import EmitterInfo
from renderer.scene.context import Context
from renderer.scene.description import Node
from renderer.scene.geometry import Assembly, Mesh, Surface
from renderer.scene.reader import Reader
from renderer.scene.shapes import frame
from renderer.scene.spectra import COLORS, Rgb, color
from renderer.scene.textures import TEXTURES, slot
from renderer.shapes.base import CYLINDER, DISK, SPHERE

AREA_KINDS = {SPHERE: AREA_SPHERE, DISK: AREA_DISK, CYLINDER: AREA_CYLINDER}
EMITTERS = ("area", "point", "spot", "directional", "constant", "envmap")


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
    environment: Environment | None = None


# --- emitters without a shape -------------------------------------------------------------------------------------


def point_light(reader: Reader, info: EmitterInfo, context: Context) -> Light:
    """An intensity that is the same in all directions, from a position or the origin of ``to_world``."""
    if reader.has("position") and reader.has("to_world"):
        raise reader.error("give either 'position' or 'to_world', not both", "position")
    to_world = transforms.translate(reader.vector("position", [0.0, 0.0, 0.0])) @ reader.transform("to_world")
    return Light(POINT, info, color(reader, "intensity", 1.0, bounded=False), frame=to_world[:3].reshape(-1))


def spot_light(reader: Reader, info: EmitterInfo, context: Context) -> Light:
    """A cone of light along +z: full intensity within the beam, then falling linearly in the angle to zero at the cutoff."""
    if reader.has("texture"):
        raise reader.error("projected textures are not supported", "texture")
    cutoff = reader.number("cutoff_angle", 20.0, above=0, high=180)
    beam = reader.number("beam_width", cutoff * 0.75, low=0, high=cutoff)
    to_world = transforms.without_scale(reader.transform("to_world"))
    scalar = {CUTOFF: 2 * math.sin(math.radians(cutoff) / 2) ** 2, BEAM: 2 * math.sin(math.radians(beam) / 2) ** 2}
    return Light(SPOT, info, color(reader, "intensity", 1.0, bounded=False), frame=to_world[:3].reshape(-1), scalar=scalar)


def directional_light(reader: Reader, info: EmitterInfo, context: Context) -> Light:
    """Parallel light along ``direction``, or along +z of ``to_world``."""
    if reader.has("direction") and reader.has("to_world"):
        raise reader.error("give either 'direction' or 'to_world', not both", "direction")
    to_world = transforms.without_scale(reader.transform("to_world"))
    if reader.has("direction"):
        direction = np.array(reader.vector("direction"))
        length = np.linalg.norm(direction)
        if not length > 0:
            raise reader.error("'direction' must not be zero", "direction")
        to_world[:3, :3] = np.stack([*frame(direction / length), direction / length], axis=1)
    return Light(DIRECTIONAL, info, color(reader, "irradiance", 1.0, bounded=False), frame=to_world[:3].reshape(-1))


def constant_light(reader: Reader, info: EmitterInfo, context: Context) -> Light:
    """The same radiance from everywhere."""
    return Light(CONSTANT, info, color(reader, "radiance", 1.0, bounded=False))


def environment_light(reader: Reader, info: EmitterInfo, context: Context) -> Light:
    """Radiance from an image in latitude and longitude."""
    from renderer.emitters.envmap import build_environment

    path, place = context.paths.file(reader)
    scale = reader.number("scale", 1.0, low=0)
    reader.flag("mis_compensation", False)  # changes how the map is sampled, not the picture
    to_world = reader.transform("to_world")[:3, :3]
    if not np.allclose(to_world @ to_world.T, np.eye(3), atol=1e-4):
        raise reader.error("'to_world' must only turn an environment map, not scale or shear it", "to_world")
    try:
        environment = build_environment(context.textures.image(path, False), to_world)
    except SceneError as error:
        raise SceneError(f"envmap: {error}", place) from None
    return Light(ENVMAP, info, (scale, scale, scale), environment=environment)


FREE_LIGHTS: dict[str, Callable[[Reader, EmitterInfo, Context], Light]] = {
    "point": point_light,
    "spot": spot_light,
    "directional": directional_light,
    "constant": constant_light,
    "envmap": environment_light,
}


def free_light(node: Node, context: Context) -> Light:
    """An emitter that belongs to no shape."""
    if node.plugin == "area":
        raise SceneError("an 'area' emitter must stand inside a shape, which then shines", node.place)
    reader = Reader(node)
    infinite = node.plugin in ("directional", "constant", "envmap")
    symbol = "B" if node.plugin in ("constant", "envmap") else "L"
    reader.number("sampling_weight", 1.0)
    light = FREE_LIGHTS[node.plugin](reader, EmitterInfo(node.name, node.plugin, -1, infinite, symbol), context)
    reader.finish()
    return light


# --- shapes that shine --------------------------------------------------------------------------------------------


def area_light(node: Node, object_index: int, name: str, surface: Surface, assembly: Assembly, context: Context) -> Light:
    """A shape that shines."""
    reader = Reader(node)
    rgb, texture = slot(reader, "radiance", 1.0, context, bounded=False)
    reader.number("sampling_weight", 1.0)
    reader.finish(COLORS + TEXTURES)
    first, count = assembly.first[object_index], assembly.count[object_index]
    info = EmitterInfo(name, "area", object_index, False, "L")
    light = Light(AREA_MESH, info, rgb, texture, primitive=(first, count))
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


# --- packing ------------------------------------------------------------------------------------------------------


def pack_emitters(lights: list[Light], bounds: tuple[Any, Any]) -> Emitters:
    """The emitter table as kernels read it; ``bounds`` are the scene's."""
    n = len(lights)
    scalar = np.zeros((n, 3), np.float32)
    primitive = np.zeros((n, 3), np.int32)
    cdfs: list[npt.NDArray[np.float64]] = []
    for i, light in enumerate(lights):
        if light.cdf is not None:
            primitive[i, CDF_FIRST] = sum(len(c) for c in cdfs)
            cdfs.append(light.cdf)
        primitive[i, [PRIMITIVE_FIRST, PRIMITIVE_COUNT]] = light.primitive
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
        primitive,
        np.concatenate(cdfs).astype(np.float32) if cdfs else None,
        sphere,
        np.int32(next((i for i, light in enumerate(lights) if light.kind in (CONSTANT, ENVMAP)), -1)),
        True if kinds & {AREA_MESH, AREA_SPHERE, AREA_DISK, AREA_CYLINDER} else None,
        True if kinds & {POINT, SPOT, DIRECTIONAL} else None,
        True if kinds & {CONSTANT, ENVMAP} else None,
        next((light.environment for light in lights if light.environment is not None), None),
    )
