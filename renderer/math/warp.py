"""Warps from the unit square to the shapes that light transport samples, each with its density."""

import numpy as np

from renderer.kernel import kernel
from renderer.math.vec import INV_PI, ONE, TWO, TWO_PI, ZERO, Vec3

QUARTER_PI = np.float32(np.pi / 4)
HALF_PI = np.float32(np.pi / 2)


@kernel
def sample_disk(u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """A point of the unit disk, uniform by area: the concentric map (shirley1997)."""
    a = TWO * u - ONE
    b = TWO * v - ONE
    if a == ZERO and b == ZERO:
        return ZERO, ZERO
    if abs(a) > abs(b):
        r = a
        phi = QUARTER_PI * (b / a)
    else:
        r = b
        phi = HALF_PI - QUARTER_PI * (a / b)
    return r * np.cos(phi), r * np.sin(phi)


@kernel
def sample_cosine_hemisphere(u: np.float32, v: np.float32) -> Vec3:
    """A direction of the upper hemisphere with density cos(theta) / pi per steradian."""
    x, y = sample_disk(u, v)
    return (x, y, np.sqrt(max(ZERO, ONE - x * x - y * y)))


@kernel
def pdf_cosine_hemisphere(cos_theta: np.float32) -> np.float32:
    """Density per steradian of ``sample_cosine_hemisphere``; zero below the horizon."""
    return max(ZERO, cos_theta) * INV_PI


@kernel
def sample_sphere(u: np.float32, v: np.float32) -> Vec3:
    """A direction of the whole sphere, uniform by solid angle (density 1 / 4 pi)."""
    z = ONE - TWO * u
    r = np.sqrt(max(ZERO, ONE - z * z))
    phi = TWO_PI * v
    return (r * np.cos(phi), r * np.sin(phi), z)


@kernel
def sample_triangle(u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """Barycentric weights of the second and third corner, uniform by area."""
    s = np.sqrt(ONE - u)
    return ONE - s, v * s
