"""The least-squares problem of subpixel filters as it is written down: dense matrices over all positions. An oracle, slow, for small signals."""

import numpy as np
import numpy.typing as npt

from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.sensitivity import Sensitivity
from renderer.filters.subpixel.viewing import Viewing

F64 = npt.NDArray[np.float64]


def dense_solution(layout: Layout, viewing: Viewing, sensitivity: Sensitivity, rows: int, columns: int) -> tuple[F64, npt.NDArray[np.int64]]:
    """C_d = A^-1 B_d of the whole signal, (active positions, primaries, positions), and the active positions, row * columns + column."""
    at = np.argwhere(np.ones((rows, columns)))  # i -> row, column
    q = layout.pattern[at[:, 0] % layout.pattern.shape[0], at[:, 1] % layout.pattern.shape[1]]
    spacing = np.array([layout.period / (layout.pattern == d).sum() for d in range(len(layout.primaries))])

    # w_c(j) = Σ_n W_c(f_n) cos(2π n j / N), of both axes
    f_row = np.array([min(n, rows - n) for n in range(rows)]) * layout.cells[1] / (rows * viewing.degrees_per_pixel)
    f_column = np.array([min(n, columns - n) for n in range(columns)]) * layout.cells[0] / (columns * viewing.degrees_per_pixel)
    weights = sensitivity.weights(np.hypot(f_row[:, None], f_column[None, :]))
    w = np.zeros((3, rows, columns))
    for j in range(rows):
        for k in range(columns):
            turn = np.cos(2 * np.pi * (np.arange(rows)[:, None] * j / rows + np.arange(columns)[None, :] * k / columns))
            w[:, j, k] = (weights * turn).sum(axis=(1, 2))

    # A_ik = s_i s_k Σ_c m_ci m_ck w_c(k - i) and (B_d)_ik = s_i Σ_c m_ci m_cd w_c(k - i), rows and columns of empty positions left out
    w = w[:, (at[None, :, 0] - at[:, None, 0]) % rows, (at[None, :, 1] - at[:, None, 1]) % columns]  # (3, i, k)
    active = np.flatnonzero(q >= 0)
    m, s = layout.opponent[:, q[active]], spacing[q[active]]
    a = s[:, None] * s * np.einsum("ci,ck,cik->ik", m, m, w[:, active[:, None], active])
    b = s[:, None, None] * np.einsum("ci,cd,cik->idk", m, layout.opponent, w[:, active])
    return np.linalg.solve(a, b.reshape(len(active), -1)).reshape(b.shape), active


def apply_kernels(kernels: Kernels, signal: F64) -> F64:
    """α at every position of a periodic signal, (rows, columns, primaries), as many as the kernels have; 0 at empty positions."""
    alpha = np.zeros(signal.shape[:2])
    pattern_rows, pattern_columns = kernels.layout.pattern.shape
    for p, (row, column) in enumerate(kernels.layout.active):
        i, j = np.arange(row, signal.shape[0], pattern_rows), np.arange(column, signal.shape[1], pattern_columns)
        for down, kernel_row in zip(kernels.rows_at, np.moveaxis(kernels.h[p], 1, 0), strict=True):
            near = signal[(i + down) % signal.shape[0]][:, (j[:, None] + kernels.columns_at) % signal.shape[1]]  # (i, j, offset, primary)
            alpha[i[:, None], j] += np.einsum("ijod,do->ij", near, kernel_row)
    return alpha
