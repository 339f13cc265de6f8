"""Warps from the unit square to the shapes that light transport samples, each with its density."""

import numpy as np

from renderer.kernel import kernel
from renderer.math.vec import INV_PI, ONE, TWO, TWO_PI, ZERO, Vec3

QUARTER_PI = np.float32(np.pi / 4)
# Taylor coefficients of sine and cosine: 1e-8 over the eighth of a turn that the disk needs, and no call out of the kernel
S3, S5, S7 = np.float32(-1 / 6), np.float32(1 / 120), np.float32(-1 / 5040)
S9 = np.float32(1 / 362880)
C2, C4, C6, C8 = np.float32(-1 / 2), np.float32(1 / 24), np.float32(-1 / 720), np.float32(1 / 40320)


@kernel
def sincos_eighth(x: np.float32) -> tuple[np.float32, np.float32]:
    """Sine and cosine of an angle in [-pi/4, pi/4], to float32 accuracy."""
    x2 = x * x
    return x * (ONE + x2 * (S3 + x2 * (S5 + x2 * (S7 + x2 * S9)))), ONE + x2 * (C2 + x2 * (C4 + x2 * (C6 + x2 * C8)))


@kernel
def sample_disk(u: np.float32, v: np.float32) -> tuple[np.float32, np.float32]:
    """A point of the unit disk, uniform by area: the concentric map (shirley1997)."""
    a = TWO * u - ONE
    b = TWO * v - ONE
    if a == ZERO and b == ZERO:
        return ZERO, ZERO
    if abs(a) > abs(b):
        sine, cosine = sincos_eighth(QUARTER_PI * (b / a))
        return a * cosine, a * sine
    sine, cosine = sincos_eighth(QUARTER_PI * (a / b))
    return b * sine, b * cosine


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
