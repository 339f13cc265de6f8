"""Fresnel's equations for unpolarized light, and the directions that go with them.

``eta`` is the interior's index of refraction over the exterior's; the exterior is where the normal points.
"""

import numpy as np

from renderer.kernel import kernel
from renderer.math.vec import HALF, ONE, TWO, ZERO, Vec3

FOUR = np.float32(4.0)


@kernel
def fresnel_dielectric(cos_theta_i: np.float32, eta: np.float32) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Reflectance, signed cosine of the transmitted direction, eta_t / eta_i and eta_i / eta_t of a dielectric interface.

    A negative ``cos_theta_i`` is light from inside. Under total internal reflection the reflectance is 1, the cosine 0.
    """
    if cos_theta_i >= ZERO:
        eta_it = eta
        eta_ti = ONE / eta
    else:
        eta_it = ONE / eta
        eta_ti = eta
    cos_i = abs(cos_theta_i)

    # Snell's law
    squared_cos_t = ONE - eta_ti * eta_ti * (ONE - cos_i * cos_i)
    cos_t = np.sqrt(max(ZERO, squared_cos_t))
    signed_cos_t = -cos_t if cos_theta_i >= ZERO else cos_t

    # Equal indices never reflect, grazing light always does; both are 0 / 0 below
    if eta == ONE:
        return ZERO, signed_cos_t, eta_it, eta_ti
    if cos_i == ZERO:
        return ONE, signed_cos_t, eta_it, eta_ti

    a_s = (cos_i - eta_it * cos_t) / (cos_i + eta_it * cos_t)
    a_p = (cos_t - eta_it * cos_i) / (cos_t + eta_it * cos_i)
    return HALF * (a_s * a_s + a_p * a_p), signed_cos_t, eta_it, eta_ti


@kernel
def fresnel_conductor(cos_theta_i: np.float32, eta: np.float32, k: np.float32) -> np.float32:
    """Reflectance of a conductor with index of refraction eta + ik, for cos_theta_i > 0 (moeller1988)."""
    squared_cos = cos_theta_i * cos_theta_i
    squared_sin = ONE - squared_cos
    t0 = eta * eta - k * k - squared_sin
    squared_a_plus_squared_b: np.float32 = np.sqrt(max(ZERO, t0 * t0 + FOUR * k * k * eta * eta))
    a: np.float32 = np.sqrt(max(ZERO, HALF * (squared_a_plus_squared_b + t0)))

    # Perpendicular, then parallel
    t1 = squared_a_plus_squared_b + squared_cos
    t2 = TWO * cos_theta_i * a
    r_s = (t1 - t2) / (t1 + t2)
    t3 = squared_a_plus_squared_b * squared_cos + squared_sin * squared_sin
    t4 = t2 * squared_sin
    r_p = r_s * (t3 - t4) / (t3 + t4)
    return HALF * (r_s + r_p)


@kernel
def fresnel_conductor_rgb(cos_theta_i: np.float32, eta: Vec3, k: Vec3) -> Vec3:
    """``fresnel_conductor`` for each color channel."""
    return (
        fresnel_conductor(cos_theta_i, eta[0], k[0]),
        fresnel_conductor(cos_theta_i, eta[1], k[1]),
        fresnel_conductor(cos_theta_i, eta[2], k[2]),
    )


@kernel
def reflect(w: Vec3) -> Vec3:
    """The mirror direction about the z axis."""
    return (-w[0], -w[1], w[2])


@kernel
def reflect_about(w: Vec3, n: Vec3) -> Vec3:
    """The mirror direction of w about the unit vector n."""
    d = TWO * (w[0] * n[0] + w[1] * n[1] + w[2] * n[2])
    return (d * n[0] - w[0], d * n[1] - w[1], d * n[2] - w[2])


@kernel
def refract(w: Vec3, signed_cos_t: np.float32, eta_ti: np.float32) -> Vec3:
    """The direction transmitted through an interface across z; cosine and ratio as ``fresnel_dielectric`` gives them."""
    return (-eta_ti * w[0], -eta_ti * w[1], signed_cos_t)


@kernel
def refract_about(w: Vec3, n: Vec3, signed_cos_t: np.float32, eta_ti: np.float32) -> Vec3:
    """The direction transmitted through an interface with unit normal n."""
    s = (w[0] * n[0] + w[1] * n[1] + w[2] * n[2]) * eta_ti + signed_cos_t
    return (s * n[0] - eta_ti * w[0], s * n[1] - eta_ti * w[1], s * n[2] - eta_ti * w[2])
