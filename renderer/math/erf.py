"""The error function and its inverse in float32."""

import math

import numpy as np

from renderer.kernel import kernel
from renderer.math.vec import ONE

FIVE = np.float32(5.0)
THREE = np.float32(3.0)
TWO_AND_A_HALF = np.float32(2.5)

# Polynomials of Giles' single-precision inverse: around the center, and for the tails
C0, C1, C2, C3, C4, C5, C6, C7, C8 = (
    np.float32(c)
    for c in (1.50140941, 0.246640727, -0.00417768164, -0.00125372503, 0.00021858087, -4.39150654e-06, -3.5233877e-06, 3.43273939e-07, 2.81022636e-08)
)
T0, T1, T2, T3, T4, T5, T6, T7, T8 = (
    np.float32(c)
    for c in (2.83297682, 1.00167406, 0.00943887047, -0.0076224613, 0.00573950773, -0.00367342844, 0.00134934322, 0.000100950558, -0.000200214257)
)


@kernel
def erf(x: np.float32) -> np.float32:
    """The error function."""
    return np.float32(math.erf(x))


@kernel
def erfinv(x: np.float32) -> np.float32:
    """Inverse of ``erf`` for -1 < x < 1 (not at the ends) with relative error below 1e-6 (giles2012)."""
    w: np.float32 = -np.log((ONE - x) * (ONE + x))
    if w < FIVE:
        w -= TWO_AND_A_HALF
        p = C0 + w * (C1 + w * (C2 + w * (C3 + w * (C4 + w * (C5 + w * (C6 + w * (C7 + w * C8)))))))
    else:
        w = np.sqrt(w) - THREE
        p = T0 + w * (T1 + w * (T2 + w * (T3 + w * (T4 + w * (T5 + w * (T6 + w * (T7 + w * T8)))))))
    return p * x
