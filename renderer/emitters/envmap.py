"""An environment map: radiance over the sphere of directions, importance-sampled.

Mitsuba's conventions: in the map's own frame, y is up and direction (sin phi sin theta, cos theta, -cos phi sin theta)
has map coordinates (phi / 2 pi, theta / pi). Pixels are nodes, at ((i + 1/2) / width, j / (height - 1)), and radiance
is bilinear between them, periodic in phi.

Four nodes around make a *cell*, width x (height - 1) of them. A cell is chosen by its mean luminance times its solid
angle, then a direction uniform by solid angle within it. A cell is black only if all of its nodes are, so the density
is positive wherever there is light.
"""

import numpy as np
import numpy.typing as npt

from renderer.emitters.base import Environment
from renderer.emitters.cdf import sample_cdf
from renderer.errors import SceneError
from renderer.kernel import kernel
from renderer.math.vec import BLACK, HALF, ONE, PI, TWO, TWO_PI, ZERO, Vec3, madd, scale

LUMINANCE = (0.212671, 0.715160, 0.072169)
INV_TWO_PI = np.float32(0.5 / np.pi)


def build_environment(pixels: npt.NDArray[np.float32], to_world: npt.NDArray[np.floating]) -> Environment:
    """Tables of a map: ``pixels`` (height, width, 3) linear radiance, ``to_world`` (3, 3) rotation.

    Raises:
        SceneError: the map is smaller than 2 x 3 pixels, has negative or non-finite pixels, or is black.

    """
    height, width = pixels.shape[:2]
    if width < 2 or height < 3:
        raise SceneError(f"an environment map needs at least 2 x 3 pixels, found {width} x {height}")
    if not np.isfinite(pixels).all() or (pixels < 0).any():
        raise SceneError("an environment map's pixels must be finite and not negative")
    luminance = np.asarray(pixels, np.float64) @ LUMINANCE
    around = luminance + np.roll(luminance, -1, axis=1)
    theta = np.arange(height) * np.pi / (height - 1)
    weights = (around[:-1] + around[1:]) * (np.cos(theta[:-1]) - np.cos(theta[1:]))[:, None]
    rows = weights.sum(axis=1)
    if not rows.sum() > 0:
        raise SceneError("an environment map must not be black")

    # Cumulative tables; a black row, never chosen, gets a uniform one
    columns = np.where(rows[:, None] > 0, weights, 1.0)
    column_cdf = np.zeros((height - 1, width + 1))
    np.cumsum(columns / columns.sum(axis=1, keepdims=True), axis=1, out=column_cdf[:, 1:])
    row_cdf = np.concatenate([[0.0], np.cumsum(rows / rows.sum())])
    column_cdf[:, -1] = row_cdf[-1] = 1.0
    tables = (row_cdf.astype(np.float32), column_cdf.astype(np.float32))
    return Environment(np.ascontiguousarray(pixels, np.float32), *tables, np.ascontiguousarray(to_world, np.float32))


@kernel
def map_coordinates(environment: Environment, d: Vec3) -> tuple[np.float32, np.float32]:
    """Continuous node coordinates of a unit world direction: x in [0, width), y in [0, height - 1]."""
    m = environment.to_world
    x = m[0, 0] * d[0] + m[1, 0] * d[1] + m[2, 0] * d[2]
    y = m[0, 1] * d[0] + m[1, 1] * d[1] + m[2, 1] * d[2]
    z = m[0, 2] * d[0] + m[1, 2] * d[1] + m[2, 2] * d[2]
    width = np.float32(environment.pixels.shape[1])
    i = np.arctan2(x, -z) * INV_TWO_PI * width - HALF
    if i < ZERO:
        i += width
    theta = np.arctan2(np.sqrt(x * x + z * z), y)
    return i, theta / PI * np.float32(environment.pixels.shape[0] - 1)


@kernel
def cell_of(environment: Environment, x: np.float32, y: np.float32) -> tuple[int, int]:
    """Column and row of the cell at node coordinates (x, y)."""
    i = min(max(int(x), 0), environment.column_cdf.shape[1] - 2)
    j = min(max(int(y), 0), environment.column_cdf.shape[0] - 1)
    return i, j


@kernel
def node(environment: Environment, i: int, j: int) -> Vec3:
    """Radiance of node (i, j)."""
    return (environment.pixels[j, i, 0], environment.pixels[j, i, 1], environment.pixels[j, i, 2])


@kernel
def environment_radiance(environment: Environment | None, d: Vec3) -> Vec3:
    """Radiance that arrives from unit direction ``d``, before the emitter's own scale."""
    if environment is None:
        return BLACK
    x, y = map_coordinates(environment, d)
    i, j = cell_of(environment, x, y)
    fx = x - np.float32(i)
    fy = y - np.float32(j)
    right = i + 1 if i + 1 < environment.pixels.shape[1] else 0
    upper = madd(node(environment, right, j), fx, scale(node(environment, i, j), ONE - fx))
    lower = madd(node(environment, right, j + 1), fx, scale(node(environment, i, j + 1), ONE - fx))
    return madd(lower, fy, scale(upper, ONE - fy))


@kernel
def cell_solid_angle(environment: Environment, j: int) -> np.float32:
    """Solid angle of a cell of row j: 2 pi / width times the difference of the cosines of its edges."""
    step = PI / np.float32(environment.column_cdf.shape[0])
    cosines = TWO * np.sin((np.float32(j) + HALF) * step) * np.sin(HALF * step)
    return np.float32(TWO_PI * cosines / np.float32(environment.column_cdf.shape[1] - 1))


@kernel
def environment_pdf(environment: Environment | None, d: Vec3) -> np.float32:
    """Density per steradian of ``sample_environment``."""
    if environment is None:
        return ZERO
    x, y = map_coordinates(environment, d)
    i, j = cell_of(environment, x, y)
    probability = (environment.row_cdf[j + 1] - environment.row_cdf[j]) * (environment.column_cdf[j, i + 1] - environment.column_cdf[j, i])
    return np.float32(probability / cell_solid_angle(environment, j))


@kernel
def sample_environment(environment: Environment | None, u: np.float32, v: np.float32) -> tuple[Vec3, np.float32]:
    """A world direction toward the light and its density per steradian."""
    if environment is None:
        return BLACK, ZERO
    j, p_row, v_again = sample_cdf(environment.row_cdf, 0, environment.row_cdf.shape[0] - 1, v)
    i, p_column, u_again = sample_cdf(environment.column_cdf[j], 0, environment.column_cdf.shape[1] - 1, u)
    pdf = p_row * p_column / cell_solid_angle(environment, j)

    # Uniform by solid angle within the cell: in phi and in cos theta
    phi = TWO_PI * (np.float32(i) + HALF + u_again) / np.float32(environment.column_cdf.shape[1] - 1)
    step = PI / np.float32(environment.column_cdf.shape[0])
    top = np.float32(j) * step
    half_sine = np.sin(HALF * top)
    one_minus_cos = TWO * half_sine * half_sine + v_again * TWO * np.sin(top + HALF * step) * np.sin(HALF * step)
    sin_theta = np.sqrt(max(ZERO, one_minus_cos * (TWO - one_minus_cos)))
    x = np.sin(phi) * sin_theta
    y = ONE - one_minus_cos
    z = -np.cos(phi) * sin_theta
    m = environment.to_world
    d = (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )
    return d, pdf
