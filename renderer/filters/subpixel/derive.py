"""Optimal subpixel kernels: the least-squares problem of thesis 4.3, solved one residue of frequencies at a time.

The error of a display that shows α instead of the image signal γ is E(k) = s_k m_q(k) α_k - Σ_d m_d γ_{k,d} (Eq. 4.1, with the spacing s_k in the
place of 3), and its cost is Σ_c Σ_n W_c(f_n) |ê_c(n)|² (Eq. 4.4). A pattern of period P couples only the P frequencies of one residue,
r + j N/P, so the system of N unknowns falls apart into N/P systems of as many unknowns as a period has subpixels. In two dimensions the same
holds along both axes. The minimum for an impulse at each position of a period, in each channel of the signal, is a kernel.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.sensitivity import Sensitivity, exponential
from renderer.filters.subpixel.viewing import Viewing

F64 = npt.NDArray[np.float64]
C128 = npt.NDArray[np.complex128]

RANK_TOLERANCE = 1e-7  # singular values below this share of a residue's largest are zero: the square root of what A^-1 in float64 can tell apart
ILL_CONDITIONED = 1e5  # of a residue's system: its solution loses five digits
LARGE_GAIN = 12.0  # of kernels: the shipped displays have 2.5 to 6.1
LARGE_DRIVE = 1.05  # of white: what is above 1 is clipped
LARGE_TINT = 0.02  # of white: the shipped displays have 0.01 or less
PIXELS_1D, PIXELS_2D = 100, 24  # how many pixels the signal is long, about: 300 positions of an RGB stripe, as in the thesis
MOST_VALUES = 8_000_000  # of all kernels: large patterns in two dimensions have shorter signals


@dataclass(frozen=True, eq=False)
class Kernels:
    """All kernels of a layout: α_i = Σ_d Σ_o h_{p,d}(o) γ_{i+o,d}, where p is the subpixel of ``layout.active`` at position i.

    ``h``: float64 (subpixels, primaries, rows, columns), for the offsets ``rows_at`` (rows) and ``columns_at`` (columns), in positions, ascending;
    1-D layouts have one row. ``condition``: the largest ratio of singular values of a residue's system (of its part of A it is the square),
    without those that count as zero. ``deficient``: how many residues' systems are singular, of ``residues``; their solutions are the smallest ones
    (truncated pseudo-inverse). ``open``: the lowest and the highest frequency, cycles per degree, that such residues begin at; ``unseen``: how
    many of them have no weight at all. ``step``: cycles per degree between neighboring frequencies, along rows and columns.

    What sums are. A constant image is none that the display can show exactly: its lit positions repeat with the pattern, so they have frequencies
    above 0 as well. The sums of the kernels trade an error there against one at 0, in the ratio of their weights. Where the pattern repeats in
    every pixel that ratio is small (stripes at the default viewing: sums are 1 and 0 to 1e-5). The red of RGBG repeats in every other, the ratio
    is 1e-3, sums are 0.996 for red and blue, and gray comes out 0.9 % short of red. That is the recipe's optimum, not an error of its
    solution. With W, one color has many mixtures: rows do not sum to 1 and 0, but the light of a gray image is gray:
    for RGBW it comes to a quarter from R, G and B and drives W to 1.3 of the gray, which clips where the gray is above 0.77.
    """

    layout: Layout
    viewing: Viewing
    sensitivity: Sensitivity
    h: F64
    rows_at: npt.NDArray[np.int64]
    columns_at: npt.NDArray[np.int64]
    condition: float
    deficient: int
    residues: int
    step: tuple[float, float]
    open: tuple[float, float] | None = None
    unseen: int = 0

    @property
    def singular(self) -> bool:
        """Whether some frequencies leave the solution open."""
        return self.deficient > 0

    def own(self, subpixel: int) -> F64:
        """The kernel that leads from a subpixel's own primary to it, float64 (rows, columns): the low-pass one."""
        return np.asarray(self.h[subpixel, self.layout.active_primaries[subpixel]])

    @property
    def gain(self) -> float:
        """The largest value that a signal between -1 and 1 can give a subpixel: Σ |h| over all primaries and offsets."""
        return float(np.abs(self.h).sum(axis=(1, 2, 3)).max())

    @property
    def white(self) -> F64:
        """The color that a white image, and in proportion every gray one, is shown with: linear R, G, B."""
        primaries = self.layout.active_primaries
        return np.asarray(self.layout.light().T @ (np.bincount(primaries, self.white_drive) / np.bincount(primaries)), np.float64)

    @property
    def white_drive(self) -> F64:
        """What a white image drives each subpixel of ``layout.active`` to."""
        return np.asarray(self.h.sum(axis=(2, 3)) @ self.layout.signal(np.ones(3)), np.float64)

    def warnings(self) -> tuple[str, ...]:
        """What is to be said about the solution: which frequencies leave it open, why, and what was done. Nothing where it is the only one."""
        name, found = self.layout.name, []
        if self.open is not None:
            found.append(f"{name}: {self._singular_in_words(*self.open)}")
        elif self.condition > ILL_CONDITIONED:
            found.append(f"{name}: the system is nearly singular (condition {self.condition:.1e}): the kernels keep fewer digits than usual.")
        if self.gain > LARGE_GAIN:
            found.append(
                f"{name}: the kernels drive subpixels to as much as {self.gain:.0f} times the signal, and displays clip that: the sensitivity "
                f"`{self.sensitivity.name}` counts some errors so little that they grow large for the sake of others."
            )
        if self.white_drive.max() > LARGE_DRIVE:
            primary = self.layout.primaries[self.layout.active_primaries[self.white_drive.argmax()]]
            found.append(f"{name}: white drives {primary} to {self.white_drive.max():.2f}, of which displays clip what is above 1: white is dimmed.")
        if np.abs(self.white - 1.0).max() > LARGE_TINT:
            red, green, blue = self.white
            found.append(
                f"{name}: white is shown as {red:.2f}, {green:.2f}, {blue:.2f}: the sensitivity `{self.sensitivity.name}` counts the display's own "
                f"pattern, which it has at this viewing, so much that the kernels weaken it."
            )
        return tuple(found)

    def _singular_in_words(self, low: float, high: float) -> str:
        where = f"at {low:.3g} cycles per degree" if math.isclose(low, high, abs_tol=1e-9) else f"from {low:.3g} to {high:.3g} cycles per degree"
        why = (
            f"the sensitivity `{self.sensitivity.name}` weighs none of their errors"
            if self.deficient == self.unseen
            else f"too few of their errors have weight in the sensitivity `{self.sensitivity.name}` to settle {len(self.layout.active)} subpixels"
        )
        done = "Of all equally good kernels those of the least drive were taken (truncated pseudo-inverse)"
        lost = "an image that the display can show need not be reproduced exactly"
        return f"the system is singular for {self.deficient} of {self.residues} residues of frequencies, {where}: {why}. {done}: {lost}."


def derive(layout: Layout, viewing: Viewing | None = None, sensitivity: Sensitivity | None = None, size: tuple[int, int] | None = None) -> Kernels:
    """Solve for all kernels of a layout (thesis 4.3.2, 4.3.5). ``size``: positions of the periodic signal, (rows, columns).

    Raises ValueError where ``size`` is no multiple of the pattern's period, or has more than one row for a layout in one dimension.
    """
    viewing, sensitivity = viewing or Viewing(), sensitivity or exponential()
    rows, columns = size or default_size(layout)
    pattern_rows, pattern_columns = layout.pattern.shape
    if rows % pattern_rows or columns % pattern_columns or rows < 1 or columns < 1 or (layout.one_dimensional and rows != 1):
        raise ValueError(f"{layout.name}: expected whole periods of {pattern_columns} x {pattern_rows} positions, found {columns} x {rows}")

    # Frequencies of every residue: bins (residues, P) along both axes, their cycles per degree, and the weights of the three channels
    row_bins = np.arange(rows // pattern_rows)[:, None] + np.arange(pattern_rows) * (rows // pattern_rows)
    column_bins = np.arange(columns // pattern_columns)[:, None] + np.arange(pattern_columns) * (columns // pattern_columns)
    step = _steps(layout, viewing, rows, columns)
    f_row, f_column = np.minimum(row_bins, rows - row_bins) * step[0], np.minimum(column_bins, columns - column_bins) * step[1]
    f = np.hypot(f_row[:, None, :, None], f_column[None, :, None, :])  # (Ry, Rx, Py, Px)
    root = np.sqrt(sensitivity.weights(f))  # (3, Ry, Rx, Py, Px)

    # Phase of each position of a period at each frequency: (Ry, Rx, Py, Px, positions)
    at = np.argwhere(np.ones_like(layout.pattern))
    phase_row = np.exp(-2j * np.pi * row_bins[:, :, None] * at[:, 0] / rows)
    phase_column = np.exp(-2j * np.pi * column_bins[:, :, None] * at[:, 1] / columns)
    phase = phase_row[:, None, :, None, :] * phase_column[None, :, None, :, :]

    # min |G a - H|: rows are (channel, frequency), unknowns are subpixels, right sides are impulses (channel of the signal, position)
    residues = f.shape[0] * f.shape[1]
    shown = layout.spacing * layout.opponent[:, layout.active_primaries]  # s m_q, (3, subpixels)
    active = layout.active[:, 0] * pattern_columns + layout.active[:, 1]
    weighed = np.moveaxis(root, 0, 2)[..., None] * phase[:, :, None]  # (Ry, Rx, 3, Py, Px, positions)
    g = weighed[..., active] * shown[:, None, None, :]
    wanted = weighed[..., None, :] * layout.opponent[:, None, None, :, None]  # (…, primaries, positions)
    a, condition, rank = _solve(g.reshape(residues, -1, len(active)), wanted.reshape(residues, g[0, 0].size // len(active), -1))
    begins = f.min(axis=(2, 3)).ravel()[rank < len(active)]
    singular = (float(begins.min()), float(begins.max())) if len(begins) else None

    # a holds the spectra over periods: back to positions, then from (subpixel <- impulse) to offsets
    a = a.reshape(f.shape[0], f.shape[1], len(active), len(layout.primaries), len(at))
    response = np.fft.ifft2(a, axes=(0, 1)).real  # (periods down, periods across, subpixels, primaries, impulses)
    h, rows_at, columns_at = _by_offset(response, layout, rows, columns)
    unseen = int((rank == 0).sum())
    return Kernels(layout, viewing, sensitivity, h, rows_at, columns_at, condition, len(begins), residues, step, singular, unseen)


def default_size(layout: Layout) -> tuple[int, int]:
    """How many positions, (rows, columns), the signal of a derivation has unless it is given."""
    rows, columns = layout.pattern.shape
    most = math.sqrt(MOST_VALUES / (layout.cells[0] * layout.cells[1] * len(layout.active) * len(layout.primaries)))
    pixels = PIXELS_1D if layout.one_dimensional else min(PIXELS_2D, most)
    across = columns * max(1, round(pixels * layout.cells[0] / columns))
    return 1 if layout.one_dimensional else rows * max(1, round(pixels * layout.cells[1] / rows)), across


def _steps(layout: Layout, viewing: Viewing, rows: int, columns: int) -> tuple[float, float]:
    """Cycles per degree between neighboring bins, along rows and columns."""
    width, height = layout.cells
    return height / (rows * viewing.degrees_per_pixel), width / (columns * viewing.degrees_per_pixel)


def _solve(g: C128, wanted: C128) -> tuple[C128, float, npt.NDArray[np.int64]]:
    """Least squares for each residue; the largest condition number, and the rank of each residue's system.

    Ranks are relative to each residue's own largest singular value: residues do not depend on each other, and however little the errors of one
    count against those of another, its solution is the same.
    """
    u, s, vh = np.linalg.svd(g, full_matrices=False)
    kept = s > RANK_TOLERANCE * s[:, :1]
    inverse = np.where(kept, 1.0 / np.where(kept, s, 1.0), 0.0)
    a = np.conj(np.swapaxes(vh, 1, 2)) @ (inverse[:, :, None] * (np.conj(np.swapaxes(u, 1, 2)) @ wanted))
    rank = kept.sum(axis=1)
    smallest = np.take_along_axis(s, np.maximum(rank - 1, 0)[:, None], axis=1)[:, 0]
    return a, float((s[:, 0] / np.where(rank > 0, smallest, 1.0)).max()), rank


def _by_offset(response: F64, layout: Layout, rows: int, columns: int) -> tuple[F64, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """h_{p,d}(o) of the responses of all subpixels to impulses at the positions of one period."""
    pattern_rows, pattern_columns = layout.pattern.shape
    down, across, subpixels, primaries, _ = response.shape

    # Period y, impulse k: the impulse is k - y P behind the first period, which, with y counted backward, is where it stands in the signal
    backward = response[-np.arange(down) % down][:, -np.arange(across) % across]
    backward = backward.reshape(down, across, subpixels, primaries, pattern_rows, pattern_columns)
    h = np.ascontiguousarray(backward.transpose(2, 3, 0, 4, 1, 5)).reshape(subpixels, primaries, rows, columns)

    # From there to offsets from the subpixel, the lowest first
    low_row, low_column = -(rows // 2), -(columns // 2)
    for p, (row, column) in enumerate(layout.active):
        h[p] = np.roll(h[p], (-row - low_row, -column - low_column), axis=(1, 2))
    return h, low_row + np.arange(rows), low_column + np.arange(columns)
