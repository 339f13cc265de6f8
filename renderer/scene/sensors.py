"""Sensors of a description: perspective and thin-lens cameras, with their film and sampler."""

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from renderer.filters import FILTERS
from renderer.scene import transforms
from renderer.scene.context import Context
from renderer.scene.description import Node
from renderer.scene.reader import Reader
from renderer.scene.transforms import F64
from renderer.sensors.base import Sensor

SENSORS = ("perspective", "thinlens")
FILMS = ("hdrfilm",)
SAMPLERS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
FOV_AXES = ("x", "y", "diagonal", "smaller", "larger")
FULL_FRAME_DIAGONAL = math.hypot(36, 24)  # mm, of the 35 mm film that focal lengths refer to
LARGEST_FILM = 65535  # pixels across
FILTER_SETTINGS = {"gaussian": {"stddev": 0.5}, "mitchell": {"A": 1 / 3, "B": 1 / 3, "C": 1 / 3}, "lanczos": {"lobes": 3.0}, "tent": {"radius": 1.0}}


@dataclass(frozen=True)
class Film:
    """Size in pixels, and reconstruction filter."""

    width: int = 768
    height: int = 576
    filter: str = "gaussian"


def read_film(node: Node | None) -> Film:
    """A film; Mitsuba's default where there is none."""
    reader = Reader(node or Node("hdrfilm", "film", ""))
    width, height = (reader.integer(name, default, 1, LARGEST_FILM) for name, default in (("width", 768), ("height", 576)))
    for name, whole in (("crop_width", width), ("crop_height", height), ("crop_offset_x", 0), ("crop_offset_y", 0)):
        if reader.integer(name, whole) != whole:
            raise reader.error(f"{name!r}: cropped films are not supported; render the whole film", name)
    reader.ignore("file_format", "pixel_format", "component_format", "banner", "compensate", "high_quality_edges", "sample_border")
    chosen = reader.children(tuple(FILTERS), "reconstruction filters")
    reader.finish(tuple(FILTERS))
    name = "gaussian"
    for item in chosen:
        inner = Reader(item)
        for parameter, default in FILTER_SETTINGS.get(item.plugin, {}).items():
            if not math.isclose(inner.number(parameter, default), default, rel_tol=1e-3):
                raise inner.error(f"{parameter!r} must be Mitsuba's default, {default:g}: filters have no settings here", parameter)
        inner.finish()
        name = item.plugin
    return Film(width, height, name)


class Sampling(NamedTuple):
    """Samples for each pixel, how they are placed ("independent" or "sobol"), and the seed of their numbers."""

    samples: int
    sampler: str
    seed: int


def read_sampler(node: Node | None, context: Context) -> Sampling:
    """A sampler; Mitsuba's number of samples, placed by ``sobol``, where there is none."""
    reader = Reader(node or Node("independent", "sampler", ""))
    count = reader.integer("sample_count", 4, 1, 2**31 - 1)
    seed = reader.integer("seed", 0, 0, 2**63 - 1)
    reader.ignore("jitter", "strength")
    reader.finish()
    if node is not None and node.plugin != "independent":
        context.warn(f"the sampler {node.plugin!r} gives the number of samples only; they are placed by 'sobol', or as the job says", node.place)
    return Sampling(count, "sobol" if node is None or node.plugin != "independent" else "independent", seed)


def half_tangents(reader: Reader, film: Film) -> tuple[float, float]:
    """Tangents of half the horizontal and the vertical angle of view."""
    aspect = film.width / film.height
    axis = reader.choice("fov_axis", "x", FOV_AXES)
    if reader.has("fov") and reader.has("focal_length"):
        raise reader.error("give either 'fov' or 'focal_length', not both", "focal_length")
    if reader.has("fov"):
        tangent = math.tan(math.radians(reader.number("fov", above=0)) / 2)
        if not 0 < reader.number("fov") < 180:
            raise reader.error(f"'fov' must be more than 0 and less than 180 degrees; it is {reader.number('fov'):g}", "fov")
    else:
        tangent, axis = FULL_FRAME_DIAGONAL / 2 / focal_length(reader), "diagonal"
    if axis == "smaller":
        axis = "y" if aspect > 1 else "x"
    elif axis == "larger":
        axis = "x" if aspect > 1 else "y"
    if axis == "diagonal":
        tangent *= aspect / math.hypot(aspect, 1)
    elif axis == "y":
        tangent *= aspect
    return tangent, tangent / aspect


def focal_length(reader: Reader) -> float:
    """Focal length in millimeters of a 35 mm camera, written as 50mm or 50."""
    data = reader.value("focal_length", "50mm")
    found = re.fullmatch(r"\s*([0-9.]+)\s*(mm)?\s*", str(data))
    try:
        length = float(found[1]) if found else math.nan
    except ValueError:
        length = math.nan
    if not length > 0:
        raise reader.error(f"'focal_length' must be a length such as '50mm', not {data!r}", "focal_length")
    return length


def camera_frame(reader: Reader) -> F64:
    """The camera's rigid placement, (4, 4). Mitsuba too refuses scales other than mirrors."""
    to_world = reader.transform("to_world")
    if np.abs(np.linalg.norm(to_world[:3, :3], axis=0) - 1).max() > 1e-3:
        raise reader.error("'to_world' must not scale: move and turn the camera only", "to_world")
    return transforms.without_scale(to_world)


def read_sensor(node: Node, context: Context) -> tuple[Sensor, Film, Sampling]:
    """A camera, its film, and how it is sampled."""
    reader = Reader(node)
    films, samplers = reader.children(FILMS, "films"), reader.children(SAMPLERS, "samplers")
    film, sampling = read_film(films[0] if films else None), read_sampler(samplers[0] if samplers else None, context)
    to_world = camera_frame(reader)
    tan_x, tan_y = half_tangents(reader, film)
    near = reader.number("near_clip", 1e-2, above=0)
    far = reader.number("far_clip", 1e4, above=near)
    shift = reader.number("principal_point_offset_x", 0.0), reader.number("principal_point_offset_y", 0.0)
    lens_radius = focus = None
    if node.plugin == "thinlens":
        lens_radius = np.float32(reader.number("aperture_radius", above=0))
        focus = np.float32(reader.number("focus_distance", far, above=0))
    else:
        reader.ignore("focus_distance")
    reader.ignore("shutter_open", "shutter_close")
    reader.finish((*FILMS, *SAMPLERS))
    sensor = Sensor(
        to_world[:3].astype(np.float32),
        np.linalg.inv(to_world)[:3].astype(np.float32),
        np.float32(tan_x),
        np.float32(tan_y),
        np.float32(shift[0]),
        np.float32(shift[1]),
        np.int32(film.width),
        np.int32(film.height),
        np.float32(near),
        np.float32(far),
        lens_radius,
        focus,
    )
    return sensor, film, sampling
