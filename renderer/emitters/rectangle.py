"""A parallelogram that shines on its front side, sampled uniformly by area."""

import numpy as np
import numpy.typing as npt

from renderer.emitters.base import AREA, NO_DIRECTION, DirectionSample, Emitters
from renderer.kernel import kernel
from renderer.math.vec import ONE, ZERO, Vec3, dot, madd, scale, sub
from renderer.shapes.base import Geometry, Index
from renderer.textures.base import Textures
from renderer.textures.lookup import texture_rgb


@kernel
def frame_vec(frame: npt.NDArray[np.float32], emitter: Index, first: int) -> Vec3:
    """Three consecutive numbers of an emitter's frame: (12,) = corner, edge, edge, unit normal of a rectangle."""
    return (frame[emitter, first], frame[emitter, first + 1], frame[emitter, first + 2])


@kernel
def push_off(point: Vec3, normal: Vec3, offset: np.float32) -> Vec3:
    """A point of a light moved off its front by the error bound, so that shadow rays end before the surface."""
    return madd(normal, offset, point)


@kernel
def pdf_area(distance: np.float32, cos_light: np.float32, density: np.float32) -> np.float32:
    """Density per steradian of a point sampled with ``density`` per squared unit; zero behind the light."""
    if cos_light <= ZERO:
        return ZERO
    return density * distance * distance / cos_light


@kernel
def area_direction(emitter: Index, p: Vec3, point: Vec3, normal: Vec3, offset: np.float32, radiance: Vec3, density: np.float32) -> DirectionSample:
    """The direction from ``p`` to a light point that was sampled with ``density`` per squared unit (choice of the emitter included)."""
    to_light = sub(point, p)
    squared_distance = dot(to_light, to_light)
    if squared_distance <= ZERO:
        return NO_DIRECTION
    distance = np.sqrt(squared_distance)
    d = scale(to_light, ONE / distance)
    pdf = pdf_area(distance, -dot(normal, d), density)
    if pdf <= ZERO:
        return NO_DIRECTION
    return DirectionSample(np.int32(emitter), d, push_off(point, normal, offset), distance, scale(radiance, ONE / pdf), pdf)


@kernel
def rectangle_point(emitters: Emitters, geometry: Geometry, emitter: Index, u: np.float32, v: np.float32) -> tuple[Vec3, Vec3, np.float32]:
    """The point (u, v) of a rectangle, its unit normal and its error-bound offset."""
    corner = frame_vec(emitters.frame, emitter, 0)
    point = madd(frame_vec(emitters.frame, emitter, 3), u, madd(frame_vec(emitters.frame, emitter, 6), v, corner))
    first = emitters.primitive[emitter, 0]
    offset = max(geometry.offset[first], geometry.offset[first + emitters.primitive[emitter, 1] - 1])
    return point, frame_vec(emitters.frame, emitter, 9), offset


@kernel
def sample_rectangle(
    emitters: Emitters, geometry: Geometry, textures: Textures | None, emitter: Index, p: Vec3, u: np.float32, v: np.float32, select: np.float32
) -> DirectionSample:
    """Light from a uniform point of the rectangle toward ``p``; ``select`` is the probability of choosing the emitter."""
    point, normal, offset = rectangle_point(emitters, geometry, emitter, u, v)
    radiance = texture_rgb(textures, emitters.texture[emitter], (emitters.rgb[emitter, 0], emitters.rgb[emitter, 1], emitters.rgb[emitter, 2]), u, v)
    return area_direction(emitter, p, point, normal, offset, radiance, select / emitters.scalar[emitter, AREA])
