"""The error that the optimal kernels make least (thesis, Eq. 4.4), of any picture on a display."""

import numpy as np
import numpy.typing as npt
from scipy import fft

from queries.errors import QueryError
from renderer.filters.subpixel.layout import INACTIVE, Layout
from renderer.filters.subpixel.sensitivity import Sensitivity
from renderer.filters.subpixel.viewing import Viewing

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
C128 = npt.NDArray[np.complex128]


def weighted_error(lattice: F32, signal: F32, layout: Layout, viewing: Viewing, sensitivity: Sensitivity) -> float:
    """The root of Σ W |ê|² in units of that of the signal itself: 0 where no difference can be seen, 1 for a black display.

    ``lattice``: float32 (rows, columns), the drive of every position; ``signal``: float32 (rows, columns, 3), linear RGB at every position. The
    error at position k is E(k) = s_k m_q α_k - Σ_d m_d γ_{k,d} (Eq. 4.1); its spectrum is taken along rows where rows of pixels are alike, and
    along both axes elsewhere, with the picture repeated beyond its edges. A period may be cut at the right and the lower edge.
    For a black signal it is 0 where the lattice is black, infinite elsewhere.
    Raises QueryError where sizes do not fit, or values are not finite.
    """
    if lattice.ndim != 2 or signal.shape != (*lattice.shape, 3) or not lattice.size:
        raise QueryError(f"expected a color of 3 for each position of {lattice.shape}, found a signal of {signal.shape}")
    if not (np.isfinite(lattice).all() and np.isfinite(signal).all()):
        raise QueryError("a lattice or a signal has values that are not finite, so no error can be told: replace them first")
    wanted = np.asarray(layout.signal(signal.astype(np.float64)) @ layout.opponent.T)  # Σ m_d γ_d, (rows, columns, 3)
    error = lattice.astype(np.float64)[..., None] * drive(layout, lattice.shape) - wanted

    # Both energies, with the same weights
    weights = _weights(lattice.shape, layout, viewing, sensitivity)
    found, whole = _energy(error, weights, layout), _energy(wanted, weights, layout)
    if whole == 0.0:
        return 0.0 if found == 0.0 else float("inf")
    return float(np.sqrt(found / whole))


def drive(layout: Layout, shape: tuple[int, ...]) -> F64:
    """s_k m_q of every position of a lattice, float64 (rows, columns, 3): Y', C1, C2 of full drive; 0 where there is no subpixel."""
    period = np.zeros((*layout.pattern.shape, 3))
    period[layout.pattern != INACTIVE] = (layout.spacing * layout.opponent[:, layout.active_primaries]).T
    rows, columns = np.arange(shape[0]) % period.shape[0], np.arange(shape[1]) % period.shape[1]
    return np.asarray(period[rows[:, None], columns])


def _weights(shape: tuple[int, ...], layout: Layout, viewing: Viewing, sensitivity: Sensitivity) -> F64:
    """W_c of each bin of the spectrum of real values, float64 (3, rows or 1, bins), doubled where a bin stands for two frequencies."""
    rows, columns = shape
    width, height = layout.cells
    bins = np.arange(columns // 2 + 1)
    across = bins * (width / (columns * viewing.degrees_per_pixel))
    down = np.minimum(np.arange(rows), rows - np.arange(rows)) * (height / (rows * viewing.degrees_per_pixel))
    frequency = np.asarray(across[None] if layout.one_dimensional else np.hypot(down[:, None], across), np.float64)
    return sensitivity.weights(frequency) * np.where((bins == 0) | (2 * bins == columns), 1.0, 2.0)


def _energy(values: F64, weights: F64, layout: Layout) -> float:
    """Σ_c Σ_n W_c(f_n) |v̂_c(n)|² of values (rows, columns, 3)."""
    channels = np.moveaxis(values, 2, 0)
    spectrum: C128 = fft.rfft(channels, axis=2) if layout.one_dimensional else fft.rfft2(channels, axes=(1, 2))
    return float((weights * (spectrum.real**2 + spectrum.imag**2)).sum())
