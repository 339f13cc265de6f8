"""Images through all kernels of a display: every subpixel takes every channel of the signal around it (thesis 4.3.2).

Sums over neighbors are products of spectra. The signal is cut into one image for each position of the pattern's period and each channel, so that
only values that some subpixel takes are computed: with P positions and D channels, P D transforms of a P-th of the image, and one back for each
subpixel. Films larger than memory allows are done in bands of rows.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.shards import cores
from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout

Floating = npt.NDArray[np.floating]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
C128 = npt.NDArray[np.complex128]

REST = 1e-4  # the share of a subpixel's kernels, by absolute values, that may lie beyond their reach
BAND = 1 << 20  # positions that are transformed at once


def apply_kernels(
    signal: Floating,
    kernels: Kernels,
    reach: int | None = None,
    *,
    periodic: bool = False,
    only_own: bool = False,
    threads: int | None = None,
) -> Floating:
    """The lattice α_i = Σ_d Σ_o h_{p,d}(o) γ_{i+o,d} of a signal: (rows, columns), 0 at virtual positions, not clipped.

    ``signal``: γ at every position, (rows, columns, 3) of linear RGB, or with W its four channels; what is float64 gives float64, else float32.
    Kernels are cut off ``reach`` positions from their middle (default: ``reach_of``) and what was cut is spread over what is left, so that a
    constant is treated as an infinite constant; beyond its edges the image goes on as at them, and a period may be cut there. ``periodic``:
    the kernels as they are, on an image of whole periods that repeats. ``only_own``: without the band-pass kernels, which lead from other
    primaries; each low-pass kernel then sums to 1. Sums are float64, exact to about 1e-15 of the largest value in the neighborhood.

    Raises QueryError where the signal is not of the layout's shape or not finite.
    """
    layout = kernels.layout
    channels = _channels(signal, layout)
    h, rows_at, columns_at = kernels.h, kernels.rows_at, kernels.columns_at
    if only_own:
        h = _low_pass(kernels)
    if periodic:
        if channels.shape[0] % layout.pattern.shape[0] or channels.shape[1] % layout.pattern.shape[1]:
            raise QueryError(f"{layout.name}: a periodic signal needs whole periods of {_size(layout.pattern)} positions, found {_size(channels)}")
        periods = _Periods(layout, *(size // of for size, of in zip(channels.shape, layout.pattern.shape)))
        return periods.correlate(channels.astype(np.float64), periods.spectra(h, rows_at, columns_at)).astype(channels.dtype)
    h, rows_at, columns_at = _cut(h, rows_at, columns_at, reach_of(kernels) if reach is None else reach)
    return _in_bands(channels, layout, h, rows_at, columns_at, threads)


def reach_of(kernels: Kernels, rest: float = REST) -> int:
    """From how many positions around it a subpixel takes all but ``rest`` of what its kernels weigh, by absolute values."""
    distance = _distance(kernels.rows_at, kernels.columns_at)
    weight = np.abs(kernels.h).sum(axis=1)
    by_distance = np.stack([np.bincount(distance.ravel(), one.ravel()) for one in weight])
    beyond = by_distance[:, ::-1].cumsum(axis=1)[:, ::-1]  # at this distance and beyond
    enough = (beyond <= rest * beyond[:, :1]).all(axis=0)
    return int(np.argmax(enough)) - 1 if enough.any() else int(distance.max())


def _channels(signal: Floating, layout: Layout) -> Floating:
    """The signal in the display's channels, (rows, columns, primaries), as float32 or float64."""
    if signal.ndim != 3 or signal.shape[2] not in (3, len(layout.primaries)) or not signal.size:
        raise QueryError(f"{layout.name}: expected a signal of (rows, columns, 3), found the shape {signal.shape}")
    if not np.isfinite(signal).all():
        raise QueryError(f"{layout.name}: the signal has {np.count_nonzero(~np.isfinite(signal))} values that are not finite numbers")
    signal = signal if signal.dtype == np.float64 else signal.astype(np.float32, copy=False)
    return signal if signal.shape[2] == len(layout.primaries) else layout.signal(signal)


def _low_pass(kernels: Kernels) -> F64:
    """The kernels without those from other primaries; each that is left sums to 1."""
    h = np.zeros_like(kernels.h)
    for p, primary in enumerate(kernels.layout.active_primaries):
        h[p, primary] = kernels.own(p) / kernels.own(p).sum()
    return h


def _cut(h: F64, rows_at: I64, columns_at: I64, reach: int) -> tuple[F64, I64, I64]:
    """Kernels that end ``reach`` positions from their middle, with the same sums.

    What is cut is shared out in proportion to what is left, so that zeros stay zeros. Of an even number of offsets the first, which stands for
    both ends of a periodic signal, is always cut.
    """
    if reach < 0:
        raise QueryError(f"expected a reach of 0 positions or more, found {reach}")
    sums = h.sum(axis=(2, 3), keepdims=True)
    for axis, at in ((2, rows_at), (3, columns_at)):
        h = np.compress(np.abs(at) <= min(reach, (len(at) - 1) // 2), h, axis=axis)
    rows_at, columns_at = (at[np.abs(at) <= min(reach, (len(at) - 1) // 2)] for at in (rows_at, columns_at))
    size = np.abs(h)
    whole = size.sum(axis=(2, 3), keepdims=True)
    lost = sums - h.sum(axis=(2, 3), keepdims=True)
    return h + lost * np.divide(size, whole, out=np.zeros_like(size), where=whole > 0), rows_at, columns_at


def _distance(rows_at: I64, columns_at: I64) -> I64:
    """How far from the middle offsets are, along the axis where they are farther."""
    return np.maximum(np.abs(rows_at)[:, None], np.abs(columns_at))


def _size(array: npt.NDArray[np.generic]) -> str:
    return f"{array.shape[1]} x {array.shape[0]}"


# --- bands of rows ------------------------------------------------------------------------------------------------


def _in_bands(channels: Floating, layout: Layout, h: F64, rows_at: I64, columns_at: I64, threads: int | None) -> Floating:
    """The lattice, band after band: blocks of one size, which reach beyond their band, and beyond the image repeat its edge."""
    from scipy.fft import next_fast_len

    rows, columns = channels.shape[:2]
    pattern_rows, pattern_columns = layout.pattern.shape
    above = pattern_rows * -(-int(-rows_at[0]) // pattern_rows)  # whole periods, so that blocks begin with one
    before = pattern_columns * -(-int(-columns_at[0]) // pattern_columns)
    across = next_fast_len(-(-(before + columns + int(columns_at[-1])) // pattern_columns), real=True)
    halo = above + int(rows_at[-1])

    # Bands of whole periods
    most = max(BAND // (across * pattern_columns), 2 * halo, pattern_rows)
    down = -(-(halo + min(rows, most)) // pattern_rows)
    down = next_fast_len(down) if len(rows_at) > 1 else down
    band = (down * pattern_rows - halo) // pattern_rows * pattern_rows
    periods = _Periods(layout, down, across)
    spectra = periods.spectra(h, rows_at, columns_at)
    from_columns = np.clip(np.arange(across * pattern_columns) - before, 0, columns - 1)
    lattice = np.zeros((rows, columns), channels.dtype)

    def fill(first: int) -> None:
        from_rows = np.clip(np.arange(down * pattern_rows) + first - above, 0, rows - 1)
        block = channels[from_rows][:, from_columns].astype(np.float64)
        into = lattice[first : first + band]
        into[:] = periods.correlate(block, spectra)[above : above + len(into), before : before + columns]

    with ThreadPoolExecutor(threads or cores()) as pool:
        list(pool.map(fill, range(0, rows, band)))
    return lattice


@dataclass(frozen=True)
class _Periods:
    """A block of ``down`` x ``across`` periods of a layout, that repeats: sums over neighbors by its spectra."""

    layout: Layout
    down: int
    across: int

    def spectra(self, h: F64, rows_at: I64, columns_at: I64) -> C128:
        """The spectra of kernels, (subpixels, positions and channels, periods down or 1, frequencies)."""
        pattern_rows, pattern_columns = self.layout.pattern.shape
        down = 1 if len(rows_at) == 1 else self.down
        found = []
        for p, (row, column) in enumerate(self.layout.active):
            at_row, at_column = (row + rows_at) % (down * pattern_rows), (column + columns_at) % (self.across * pattern_columns)
            kernel = np.zeros((down * pattern_rows, self.across * pattern_columns, h.shape[1]))
            np.add.at(kernel, (at_row[:, None], at_column), np.moveaxis(h[p], 0, 2))  # longer than the block, it overlaps itself
            found.append(np.conj(self._transform(kernel, down, down > 1)))
        return np.stack(found)

    def correlate(self, block: F64, spectra: C128) -> F64:
        """The lattice of a block, (rows, columns)."""
        from scipy.fft import irfft, irfft2

        alike = spectra.shape[2] == 1  # rows do not influence each other
        signal = self._transform(block, self.down, not alike)
        lattice = np.zeros(block.shape[:2])
        pattern_rows, pattern_columns = self.layout.pattern.shape
        for (row, column), own in zip(self.layout.active, spectra):
            product = np.einsum("crf,crf->rf", np.broadcast_to(own, signal.shape), signal)
            values = irfft(product, self.across) if alike else irfft2(product, (self.down, self.across))
            lattice[row::pattern_rows, column::pattern_columns] = values
        return lattice

    def _transform(self, values: F64, down: int, both: bool) -> C128:
        """Spectra over periods, (positions and channels, periods down, frequencies), of (rows, columns, channels); ``both``: down as well."""
        from scipy.fft import rfft, rfft2

        pattern_rows, pattern_columns = self.layout.pattern.shape
        apart = values.reshape(down, pattern_rows, self.across, pattern_columns, -1).transpose(1, 3, 4, 0, 2)
        apart = np.ascontiguousarray(apart).reshape(-1, down, self.across)
        return np.asarray(rfft2(apart) if both else rfft(apart), np.complex128)
