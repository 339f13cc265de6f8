"""Spectra of kernels and of analytic filters, in cycles per degree (thesis Figs. 4.4, 4.6)."""

import math
from typing import Literal

import numpy as np
import numpy.typing as npt

from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.viewing import Viewing
from renderer.filters.subpixel.windowed_sinc import Fit, windowed_sinc

F64 = npt.NDArray[np.float64]
Axis = Literal["across", "down"]

SAMPLES = 4096  # of a filter, in its spectrum's integral


def spectrum(kernels: Kernels, subpixel: int, primary: int, axis: Axis = "across") -> tuple[F64, F64]:
    """Frequencies, in cycles per degree, and the magnitude of a kernel's response there, both float64 (frequencies,).

    From 0 to half a cycle per position. Of 2-D kernels: to images that change along ``axis`` alone. ``primary`` is an index into
    ``layout.primaries``. Raises ValueError for ``down`` of a 1-D layout, whose kernels have one row.
    """
    if axis == "down" and kernels.layout.one_dimensional:
        raise ValueError(f"{kernels.layout.name}: kernels of a layout in one dimension have a spectrum across, none down")
    along = kernels.h[subpixel, primary].sum(axis=0 if axis == "across" else 1)
    magnitude = np.abs(np.fft.rfft(along))
    frequency = np.arange(len(magnitude)) * kernels.step[1 if axis == "across" else 0]
    return np.asarray(frequency, np.float64), np.asarray(magnitude, np.float64)


def fitted_spectrum(fit: Fit, layout: Layout, viewing: Viewing, frequency: F64, zeros: int | None = None, axis: Axis = "across") -> F64:
    """Magnitude of an analytic filter's response at frequencies in cycles per degree; 1 at frequency 0, as filters are normalized.

    ``zeros``: where it is clamped; None: not at all. Axes on which it has a box of a pixel's width give that box's response.
    """
    degrees = viewing.degrees_per_pixel
    if fit.model != "radial" and fit.model not in (axis, "separable"):
        return np.abs(np.sinc(frequency * degrees))
    a, b = fit.a, fit.b
    if fit.model == "separable" and axis == "down" and fit.a_down is not None and fit.b_down is not None:
        a, b = fit.a_down, fit.b_down
    cells = layout.cells[0 if axis == "across" else 1]
    reach = _reach(a, b) if zeros is None else zeros * math.pi / a
    x = np.asarray((np.arange(SAMPLES) + 0.5) * (reach / SAMPLES), np.float64)  # positions, on one side
    weight = _profile(fit, x, a, b, reach)
    response = np.cos(2.0 * math.pi * np.multiply.outer(frequency * degrees / cells, x)) @ weight
    return np.asarray(np.abs(response / weight.sum()), np.float64)


def _profile(fit: Fit, x: F64, a: float, b: float, reach: float) -> F64:
    """What images that change along one axis alone are weighed with, at offsets ``x`` in positions: radial filters are integrated across it."""
    if fit.model != "radial":
        return windowed_sinc(x, a, b)
    other = (np.arange(512) + 0.5) * (reach / 512)
    distance = np.hypot(x[:, None], other)
    return np.asarray(np.where(distance <= reach, windowed_sinc(distance, a, b), 0.0).sum(axis=1), np.float64)


def peak(kernels: Kernels, subpixel: int, primary: int, axis: Axis = "across") -> float:
    """The frequency, in cycles per degree, at which a kernel's response is largest: of cross kernels, that of their band."""
    frequency, magnitude = spectrum(kernels, subpixel, primary, axis)
    return float(frequency[np.argmax(magnitude)])


def _reach(a: float, b: float) -> float:
    """Where the Gaussian is below 1e-9, or, where there is none, after many zeros of the sinc."""
    return min(math.sqrt(b * math.log(1e9)), 200.0 * math.pi / a)
