"""Analytic filters: Gaussian-windowed sincs fitted to the kernels that lead from each subpixel's own primary to it (thesis 4.3.3, 4.3.5).

In one dimension the fit is all but exact (residuals of 1 to 3 % of the kernel), with a = pi / spacing within 0.5 %. In two dimensions the thesis's
radial model, Eq. 4.13, is not: a sinc of the distance cannot vanish at all positions of a square grid, as exact reproduction needs, but a
product of two sincs can. Residuals in units of the kernel, at the default viewing and sensitivity, and the weighted error (Eq. 4.4, root, relative)
of the filter clamped at two zeros on gray noise with amplitudes 1 / f, on colored noise 1 / sqrt(f), and on slanted black-and-white bars:

    layout    model        residuals of its subpixels   gray    colored  bars
    RGBW      radial       0.16  0.18  0.22  0.14       0.0048  0.0103   0.0203
    RGBW      separable    0.08  0.19  0.24  0.16       0.0032  0.0078   0.0101
    RGBW      tent, 3 x 3                               0.0051  0.0068   0.0221
    RGBW      all kernels                               0.0019  0.0022   0.0050
    RG/GB     radial       0.18  0.24  0.24  0.18       0.0110  0.0107   0.0588
    RG/GB     separable    0.05  0.33  0.33  0.05       0.0049  0.0049   0.0245
    RG/B.     radial       0.17  0.16  0.17             0.0094  0.0091   0.0502
    RG/B.     separable    0.03  0.02  0.02             0.0053  0.0055   0.0215

So the product is fitted unless ``radial`` is asked for. RGBW keeps the worst fits: W is a mixture of the others, so that every kernel leans on the
cross kernels, which analytic filters leave out.

The clamp costs more than the fit does, in one dimension as in two. Fitted Gaussians are still at 0.5 to 0.6 at the stripe's second zero, where the
filter ends, and narrower ones would leave less to cut off. Over the project's test images (means of S-CIELAB and of the weighted error), the
stripe has 1.87 and 0.0188 as fitted, and would have 1.78 and 0.0164 with b = 4 spacing²; RGBW has 1.81 and 0.0176, and would have 1.75 and 0.0150
with a = pi / 2 and b = 8, but 1.99 and 0.0177 with that a and b fitted. A third zero takes the stripe's weighted error, which
knows no clipping, to 0.0150, but S-CIELAB of what is clipped to 2.01. Coefficients stay those of the fit to the kernels, as the thesis has them.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from renderer.filters.reconstruction import ReconstructionFilter
from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout

F64 = npt.NDArray[np.float64]
Model = Literal["across", "down", "radial", "separable"]

POOR_FIT = 0.35  # residual in units of the kernel, both root mean squares: above it a warning is due
LEAST_A = 0.05  # of pi / spacing, in searches: a sinc that is wider has not been found in the kernel
NO_DECAY = 1e-6  # spacing² / b: a Gaussian that is wider has not been found either
NEGLIGIBLE = 1e-6  # where the Gaussian is smaller, filters end before they are clamped
WIDEST = 24.0  # pixels: no filter reaches farther, not even one whose sinc was not found


def windowed_sinc(x: F64, a: float, b: float) -> F64:
    """sin(ax) / ax · exp(-x² / b), Eq. 4.7 without its factor; ``b`` may be infinite, which is the bare sinc."""
    return np.asarray(np.sinc(a / math.pi * x) * np.exp(-x * x / b), np.float64)


@dataclass(frozen=True)
class Fit:
    """``scale`` · windowed_sinc(x, ``a``, ``b``), x in positions, fitted to one subpixel's own kernel.

    ``scale``: the kernel at offset 0, which is not fitted: 1 / spacing wherever the derivation is not singular (and in 1-D a comes out at pi times
    it). ``rms``, ``largest``: of the residual over all offsets of the kernel; ``relative``: its root mean square in units of the kernel's, which
    does not depend on the length of the signal. ``model``: what x is: the offset ``across`` or ``down`` alone (Eq. 4.7, for layouts that have
    subpixels along one axis), the distance (``radial``, Eq. 4.13), or both offsets in a product (``separable``), of which ``a_down`` and
    ``b_down`` belong to the second. ``warning``: why the filter should not be trusted, or nothing.
    """

    a: float
    b: float
    scale: float
    rms: float
    largest: float
    relative: float = 0.0
    model: Model = "across"
    a_down: float | None = None
    b_down: float | None = None
    warning: str = ""

    def reconstruction(self, layout: Layout, zeros: int = 2) -> ReconstructionFilter:
        """The filter for offsets across (``radial``: distances) in pixels, clamped at the sinc's zero of that number, ``zeros``.

        ``down`` has none of its own across: it takes the samples of the subpixel's own column of pixels. Raises ValueError below one zero.
        """
        if self.model == "down":
            return box("box", 0.5)
        return _clamped(self.a, self.b, layout.cells[0], zeros)

    def reconstruction_down(self, layout: Layout, zeros: int = 2) -> ReconstructionFilter | None:
        """The same for offsets down; ``across`` takes the samples of the subpixel's own row of pixels; ``radial`` has none."""
        if self.model == "radial":
            return None
        if self.model == "across":
            return box("box", 0.5)
        a, b = (self.a, self.b) if self.a_down is None or self.b_down is None else (self.a_down, self.b_down)
        return _clamped(a, b, layout.cells[1], zeros)

    def values(self, across: F64, down: F64) -> F64:
        """The unclamped filter at offsets in positions, with its scale, as the kernel that it was fitted to."""
        if self.model == "separable" and self.a_down is not None and self.b_down is not None:
            return self.scale * windowed_sinc(across, self.a, self.b) * windowed_sinc(down, self.a_down, self.b_down)
        x = {"across": across, "down": down}.get(self.model, np.hypot(across, down))
        return self.scale * windowed_sinc(x, self.a, self.b)


def box(name: str, radius: float) -> ReconstructionFilter:
    """A box of any width; ``radius`` in pixels."""
    return ReconstructionFilter(name, radius, lambda x: np.where(np.abs(x) <= radius, 1.0, 0.0))


def _clamped(a: float, b: float, cells: int, zeros: int) -> ReconstructionFilter:
    if zeros < 1:
        raise ValueError(f"the optimal filter is clamped at a zero of its sinc, number 1 or a later one, found {zeros}")
    radius = min(zeros * math.pi / a, math.sqrt(-b * math.log(NEGLIGIBLE)), WIDEST * cells) / cells
    return ReconstructionFilter("optimal", radius, lambda x: np.where(np.abs(x) <= radius, windowed_sinc(x * cells, a, b), 0.0))


def model_of(layout: Layout) -> Model:
    """The shape of a layout's analytic filters: along the one axis on which pixels have subpixels, or the product of both."""
    if layout.one_dimensional:
        return "across"
    return "down" if layout.pattern.shape[1] == 1 else "separable"


def fit(kernels: Kernels, model: Model | None = None) -> tuple[Fit, ...]:
    """The fit of every subpixel's own kernel by non-linear least squares (thesis Table 4.1); ``model``: that of ``model_of`` unless given.

    Raises ValueError where a kernel vanishes or is not finite, and for a model that the layout has no use for.
    """
    model = model or model_of(kernels.layout)
    if model != model_of(kernels.layout) and (model_of(kernels.layout) != "separable" or model != "radial"):
        raise ValueError(
            f"{kernels.layout.name}: expected the model {model_of(kernels.layout)}, or radial for patterns in two dimensions, found {model}"
        )
    if model == "radial" and kernels.layout.cells[0] != kernels.layout.cells[1]:
        raise ValueError(
            f"{kernels.layout.name}: a radial filter is round in pixels, and so needs square positions, found cells {kernels.layout.cells}"
        )
    return tuple(_fit_one(kernels, subpixel, model) for subpixel in range(len(kernels.layout.active)))


def _fit_one(kernels: Kernels, subpixel: int, model: Model) -> Fit:
    layout = kernels.layout
    down, across = kernels.rows_at.astype(np.float64)[:, None], kernels.columns_at.astype(np.float64)[None, :]
    wanted = kernels.own(subpixel)
    if model == "down":  # an image that is constant across needs as much
        wanted, across = wanted.sum(axis=1, keepdims=True), np.zeros((1, 1))
    size, scale = float(np.sqrt(np.mean(wanted**2))), float(wanted[(down == 0) & (across == 0)][0])
    if not np.isfinite(wanted).all() or not scale > 0.0:
        raise ValueError(f"{layout.name}: the kernel of subpixel {subpixel} is not positive at its center, so no filter can be fitted to it")

    def at(values: Sequence[float]) -> Fit:
        """Parameters of the search, a and 1 / b of one axis or of both in units of the spacing, as a fit."""
        a, b = [v * math.pi * scale for v in values[::2]], [1.0 / (v * scale**2) if v > 0 else math.inf for v in values[1::2]]
        return Fit(a[0], b[0], scale, 0.0, 0.0, 0.0, model, *((a[1], b[1]) if model == "separable" else ()))

    def residual(values: Sequence[float]) -> F64:
        return np.asarray(at(values).values(across, down) - wanted, np.float64)

    found = _least_squares(lambda values: residual(values).ravel(), _starts(model, 1.0 / scale))
    best, left = at(found), residual(found)
    relative = float(np.sqrt(np.mean(left**2))) / size
    warning = _warning(kernels, subpixel, found, relative)
    return dataclasses.replace(best, rms=relative * size, largest=float(np.abs(left).max()), relative=relative, warning=warning)


def _starts(model: Model, spacing: float) -> list[list[float]]:
    """Where searches begin: zeros of the sinc one spacing apart along a line; in two dimensions its root, or the whole along one of both axes."""
    root = math.sqrt(spacing)
    if model == "separable":
        return [[root, 0.25 * spacing, root, 0.25 * spacing], [1.0, 0.1, spacing, 0.25 * spacing**2], [spacing, 0.25 * spacing**2, 1.0, 0.1]]
    return [[root, 0.25 * spacing]] if model == "radial" else [[1.0, 0.1]]


def _least_squares(residual: Callable[[Sequence[float]], F64], starts: list[list[float]]) -> list[float]:
    from scipy.optimize import least_squares

    start = min(starts, key=lambda values: float((residual(values) ** 2).sum()))
    bounds = ([LEAST_A, 0.0] * (len(start) // 2), [np.inf] * len(start))
    found = least_squares(residual, start, bounds=bounds, x_scale=start, max_nfev=100)  # type: ignore[arg-type]
    return [float(v) for v in found.x]


def _warning(kernels: Kernels, subpixel: int, found: list[float], relative: float) -> str:
    """Why the fit of a subpixel should not be trusted."""
    reasons = []
    if relative > POOR_FIT:
        reasons.append(f"the windowed sinc misses its kernel by {relative:.0%}")
    if min(found[::2]) <= LEAST_A * 1.01:
        reasons.append("its kernel has no zeros like a sinc's")
    if min(found[1::2]) <= NO_DECAY:
        reasons.append("its kernel does not decay as if windowed by a Gaussian")
    if kernels.singular:
        reasons.append("its kernel comes from a singular system")
    if not reasons:
        return ""
    return f"{kernels.layout.name}, subpixel {subpixel} ({kernels.layout.primaries[kernels.layout.active_primaries[subpixel]]}): {'; '.join(reasons)}"
