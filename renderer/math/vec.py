"""Three-vectors as tuples of float32: small functions that inline into every kernel.

A vector is ``(x, y, z)``; colors are the same tuples ``(r, g, b)``. All constants are float32, since a Python literal
would silently widen a kernel to float64.
"""

import numpy as np

from renderer.kernel import kernel

ZERO = np.float32(0.0)
HALF = np.float32(0.5)
ONE = np.float32(1.0)
TWO = np.float32(2.0)
PI = np.float32(np.pi)
TWO_PI = np.float32(2 * np.pi)
INV_PI = np.float32(1 / np.pi)
FAR = np.float32(1e30)  # beyond any scene: the distance of what is infinitely far (embree wants finite ones)
BLACK = (ZERO, ZERO, ZERO)
WHITE = (ONE, ONE, ONE)

Vec3 = tuple[np.float32, np.float32, np.float32]


@kernel
def add(a: Vec3, b: Vec3) -> Vec3:
    """The sum a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def sub(a: Vec3, b: Vec3) -> Vec3:
    """The difference a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def mul(a: Vec3, b: Vec3) -> Vec3:
    """The product a * b, component by component."""
    return (a[0] * b[0], a[1] * b[1], a[2] * b[2])


@kernel
def scale(a: Vec3, s: np.float32) -> Vec3:
    """The vector a times the scalar s."""
    return (a[0] * s, a[1] * s, a[2] * s)


@kernel
def neg(a: Vec3) -> Vec3:
    """The opposite vector."""
    return (-a[0], -a[1], -a[2])


@kernel
def madd(a: Vec3, s: np.float32, b: Vec3) -> Vec3:
    """The sum a * s + b."""
    return (a[0] * s + b[0], a[1] * s + b[1], a[2] * s + b[2])


@kernel
def dot(a: Vec3, b: Vec3) -> np.float32:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vec3, b: Vec3) -> Vec3:
    """The vector product."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def normalize(a: Vec3) -> Vec3:
    """The unit vector a / |a|; a zero vector gives NaN."""
    return scale(a, ONE / np.sqrt(dot(a, a)))


@kernel
def max3(a: Vec3) -> np.float32:
    """The largest component."""
    return max(a[0], max(a[1], a[2]))


@kernel
def row(array: np.ndarray, i: int) -> Vec3:
    """Row i of a float32 array of shape (n, 3)."""
    return (array[i, 0], array[i, 1], array[i, 2])


@kernel
def tangents(n: Vec3) -> tuple[Vec3, Vec3]:
    """Two unit vectors that make a right-handed frame (s, t, n) with the unit normal n (duff2017)."""
    sign = np.float32(np.copysign(ONE, n[2]))
    a = -ONE / (sign + n[2])
    b = n[0] * n[1] * a
    return (ONE + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), (b, sign + n[1] * n[1] * a, -n[1])


@kernel
def to_local(s: Vec3, t: Vec3, n: Vec3, v: Vec3) -> Vec3:
    """World vector v in the frame (s, t, n)."""
    return (dot(s, v), dot(t, v), dot(n, v))


@kernel
def to_world(s: Vec3, t: Vec3, n: Vec3, v: Vec3) -> Vec3:
    """Local vector v of the frame (s, t, n) in the world."""
    return (
        s[0] * v[0] + t[0] * v[1] + n[0] * v[2],
        s[1] * v[0] + t[1] * v[1] + n[1] * v[2],
        s[2] * v[0] + t[2] * v[1] + n[2] * v[2],
    )
