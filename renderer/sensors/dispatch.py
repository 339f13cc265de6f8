"""The perspective camera, pinhole or thin lens: rays for camera walks, importance for light walks."""

import numpy as np
import numpy.typing as npt

from renderer.kernel import kernel
from renderer.math.vec import ONE, TWO, ZERO, Vec3, add, dot, madd, normalize, scale, sub
from renderer.math.warp import sample_disk
from renderer.sensors.base import LensSample, Sensor

FOUR = np.float32(4.0)
BELOW_ONE = np.float32(np.nextafter(np.float32(1), np.float32(0)))


@kernel
def translation(m: npt.NDArray[np.float32]) -> Vec3:
    """The last column of a (3, 4) float32 matrix."""
    return (m[0, 3], m[1, 3], m[2, 3])


@kernel
def rotate(m: npt.NDArray[np.float32], a: Vec3) -> Vec3:
    """The linear part of a (3, 4) float32 matrix times a."""
    return (
        m[0, 0] * a[0] + m[0, 1] * a[1] + m[0, 2] * a[2],
        m[1, 0] * a[0] + m[1, 1] * a[1] + m[1, 2] * a[2],
        m[2, 0] * a[0] + m[2, 1] * a[1] + m[2, 2] * a[2],
    )


@kernel
def lens_point(lens_radius: np.float32 | None, u: np.float32, v: np.float32) -> Vec3:
    """A point of the lens in camera space, uniform by area; the origin where the camera is a pinhole."""
    if lens_radius is None:
        return (ZERO, ZERO, ZERO)
    x, y = sample_disk(u, v)
    return (lens_radius * x, lens_radius * y, ZERO)


@kernel
def refract_at_lens(focus: np.float32 | None, film: Vec3, lens: Vec3) -> Vec3:
    """The unit direction, in camera space, from a lens point through the focused image of a film point (at z = 1)."""
    if focus is None:
        return normalize(film)
    return normalize(sub(scale(film, focus), lens))


@kernel
def at_focus(focus: np.float32 | None, a: Vec3) -> Vec3:
    """A vector of the film plane, z = 1, as large as on the plane in focus; itself where the camera is a pinhole."""
    if focus is None:
        return a
    return scale(a, focus)


@kernel
def focused(focus: np.float32 | None, local: Vec3, lens: Vec3) -> Vec3:
    """Where on the film plane (z = 1) light lands that comes from ``local`` (camera space) through ``lens``."""
    if focus is None:
        return (local[0] / local[2], local[1] / local[2], ONE)
    s = focus / local[2]
    inverse = ONE / focus
    return ((lens[0] + s * (local[0] - lens[0])) * inverse, (lens[1] + s * (local[1] - lens[1])) * inverse, ONE)


@kernel
def sample_ray(sensor: Sensor, x: np.float32, y: np.float32, u: np.float32, v: np.float32) -> tuple[Vec3, Vec3]:
    """The world ray (o, unit d) of film position (x, y) in pixels; (u, v) choose the point of the lens.

    The ray starts on the near clipping plane, as Mitsuba's does; ``clip_distance`` is how far it reaches.
    """
    film = (
        sensor.tan_x * (ONE - TWO * (x / np.float32(sensor.width) + sensor.shift_x)),
        sensor.tan_y * (ONE - TWO * (y / np.float32(sensor.height) + sensor.shift_y)),
        ONE,
    )
    lens = lens_point(sensor.lens_radius, u, v)
    local = refract_at_lens(sensor.focus, film, lens)
    d = rotate(sensor.to_world, local)
    o = add(translation(sensor.to_world), rotate(sensor.to_world, lens))
    return madd(d, sensor.near / local[2], o), d


@kernel
def film_ray(sensor: Sensor, x: np.float32, y: np.float32, lens: Vec3) -> tuple[Vec3, Vec3, Vec3, Vec3]:
    """The world ray of film position (x, y) from a point of the lens (camera space): origin, direction, and its derivatives by x and by y.

    The direction is not of unit length: it is linear in x and y, so its derivatives are the same all over the film (igehy1999).
    """
    film = (
        sensor.tan_x * (ONE - TWO * (x / np.float32(sensor.width) + sensor.shift_x)),
        sensor.tan_y * (ONE - TWO * (y / np.float32(sensor.height) + sensor.shift_y)),
        ONE,
    )
    o = add(translation(sensor.to_world), rotate(sensor.to_world, lens))
    d = rotate(sensor.to_world, sub(at_focus(sensor.focus, film), lens))
    d_x = rotate(sensor.to_world, at_focus(sensor.focus, (-TWO * sensor.tan_x / np.float32(sensor.width), ZERO, ZERO)))
    d_y = rotate(sensor.to_world, at_focus(sensor.focus, (ZERO, -TWO * sensor.tan_y / np.float32(sensor.height), ZERO)))
    return o, d, d_x, d_y


@kernel
def back_to_lens(sensor: Sensor, o: Vec3, d: Vec3) -> Vec3:
    """The point of the lens that a camera ray came through, from its start on the near clipping plane."""
    cos_theta = sensor.to_world[0, 2] * d[0] + sensor.to_world[1, 2] * d[1] + sensor.to_world[2, 2] * d[2]
    return madd(d, -sensor.near / cos_theta, o)


@kernel
def clip_distance(sensor: Sensor, d: Vec3) -> np.float32:
    """How far along unit ``d`` a camera ray reaches from the near to the far clipping plane."""
    cos_theta = sensor.to_world[0, 2] * d[0] + sensor.to_world[1, 2] * d[1] + sensor.to_world[2, 2] * d[2]
    return np.float32((sensor.far - sensor.near) / cos_theta)


@kernel
def inside(raster: np.float32, size: np.int32) -> np.float32:
    """A raster coordinate of the film, kept strictly below the film's size against rounding."""
    return min(raster, np.float32(size) * BELOW_ONE)


@kernel
def sample_lens(sensor: Sensor, p: Vec3, u: np.float32, v: np.float32) -> LensSample:
    """Connect the world point ``p`` to a point of the lens.

    With A the area of one pixel on the plane z = 1, a lens point gives a direction the importance 1 / (A cos³) per
    steradian (veach1997, section 8.3); the lens's uniform density cancels its normalization. So the *mean* over light
    walks of f cos beta times importance, summed where it lands, is a pixel's mean radiance.
    """
    lens = lens_point(sensor.lens_radius, u, v)
    local = add(translation(sensor.to_camera), rotate(sensor.to_camera, p))
    visible = local[2] > sensor.near and local[2] < sensor.far

    # Where it lands on the film
    film = focused(sensor.focus, local, lens)
    raster_x = np.float32(sensor.width) * ((ONE - film[0] / sensor.tan_x) / TWO - sensor.shift_x)
    raster_y = np.float32(sensor.height) * ((ONE - film[1] / sensor.tan_y) / TWO - sensor.shift_y)
    visible = visible and raster_x >= ZERO and raster_x < np.float32(sensor.width)
    visible = visible and raster_y >= ZERO and raster_y < np.float32(sensor.height)

    # Geometry and importance
    from_lens = sub(local, lens)
    squared_distance = dot(from_lens, from_lens)
    distance = np.sqrt(squared_distance)
    cos_theta = local[2] / distance
    pixel = FOUR * sensor.tan_x * sensor.tan_y / (np.float32(sensor.width) * np.float32(sensor.height))
    importance = ONE / (pixel * cos_theta * cos_theta * cos_theta * squared_distance)
    if not visible:
        importance = ZERO
    point = add(translation(sensor.to_world), rotate(sensor.to_world, lens))
    d = rotate(sensor.to_world, scale(from_lens, -ONE / distance))
    free = distance - sensor.near / cos_theta
    return LensSample(visible, point, d, distance, importance, inside(raster_x, sensor.width), inside(raster_y, sensor.height), free)
