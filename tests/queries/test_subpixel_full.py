"""All kernels of a display applied to signals: against direct sums, exact reproduction, edges, constants, and what band-pass kernels add."""

import functools

import numpy as np
import pytest

from queries.errors import QueryError
from queries.subpixel import description, full
from queries.subpixel.full import apply_kernels, reach_of
from renderer.filters.subpixel.derive import Kernels, derive
from renderer.filters.subpixel.layout import Layout

SHIPPED = tuple(description.shipped_layouts())
LAYOUTS = (*SHIPPED, "sparse")


@functools.cache
def kernels_of(name: str) -> Kernels:
    """The kernels of a shipped layout, or of a two-dimensional one with virtual positions whose period is two pixels wide."""
    if name != "sparse":
        return derive(description.layout(name))
    return derive(description.LayoutDescription(pattern=["R . G .", ". B . G"], cells=(2, 2)).layout("sparse"), size=(24, 24))


def direct(signal: np.ndarray, h: np.ndarray, rows_at: np.ndarray, columns_at: np.ndarray, layout: Layout, periodic: bool) -> np.ndarray:
    """The sums as they are written: of every offset and channel, for one subpixel after the other."""
    rows, columns = signal.shape[:2]
    lattice = np.zeros((rows, columns))
    for p, (row, column) in enumerate(layout.active):
        for i in range(row, rows, layout.pattern.shape[0]):
            for j in range(column, columns, layout.pattern.shape[1]):
                at_row, at_column = i + rows_at, j + columns_at
                at_row = at_row % rows if periodic else at_row.clip(0, rows - 1)
                at_column = at_column % columns if periodic else at_column.clip(0, columns - 1)
                lattice[i, j] = (h[p] * np.moveaxis(signal[at_row[:, None], at_column], 2, 0)).sum()
    return lattice


def random_signal(layout: Layout, rows: int, columns: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).random((rows, columns, len(layout.primaries)))


@pytest.mark.parametrize("name", LAYOUTS)
def test_periodic_sums_are_direct_sums(name: str) -> None:
    kernels = kernels_of(name)
    layout, (rows, columns) = kernels.layout, kernels.layout.pattern.shape
    signal = random_signal(layout, 3 * rows, 4 * columns)  # smaller than the kernels, which then overlap themselves
    want = direct(signal, kernels.h, kernels.rows_at, kernels.columns_at, layout, periodic=True)
    assert np.abs(apply_kernels(signal, kernels, periodic=True) - want).max() < 1e-12


@pytest.mark.parametrize("name", LAYOUTS)
def test_what_a_display_can_show_is_reproduced_exactly(name: str) -> None:
    kernels = kernels_of(name)
    assert not kernels.singular
    layout, (pattern_rows, pattern_columns) = kernels.layout, kernels.layout.pattern.shape
    rows, columns = (2 if layout.one_dimensional else 1) * kernels.h.shape[2], kernels.h.shape[3]
    drive, signal = np.zeros((rows, columns)), np.zeros((rows, columns, len(layout.primaries)))
    rng = np.random.default_rng(2)
    for (row, column), primary, spacing in zip(layout.active, layout.active_primaries, layout.spacing):
        values = rng.random(drive[row::pattern_rows, column::pattern_columns].shape)
        drive[row::pattern_rows, column::pattern_columns] = values
        signal[row::pattern_rows, column::pattern_columns, primary] = spacing * values
    assert np.abs(apply_kernels(signal, kernels, periodic=True) - drive).max() < 1e-10
    found = apply_kernels(signal.astype(np.float32), kernels, periodic=True)
    assert found.dtype == np.float32
    assert np.abs(found - drive).max() < 1e-5

    # Cut off, with the image's edges repeated, the same holds away from the edges, where zeros of the kernels stayed zeros
    if layout.one_dimensional:
        reach = 40
        inside = slice(reach + pattern_columns, -reach - pattern_columns)
        error = np.abs(apply_kernels(signal, kernels, reach) - drive)[:, inside]
        assert error.max() < 0.01  # what was cut was shared out to the middle of the kernels


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("reach", [0, 3, 11])
def test_edges_repeat_and_periods_may_be_cut(name: str, reach: int, monkeypatch: pytest.MonkeyPatch) -> None:
    kernels = kernels_of(name)
    layout, (rows, columns) = kernels.layout, kernels.layout.pattern.shape
    signal = random_signal(layout, 5 if rows == 1 else 13 * rows + 1, 3 * columns + 2)
    cut = full._cut(kernels.h, kernels.rows_at, kernels.columns_at, reach)
    want = direct(signal, *cut, layout, periodic=False)
    assert np.abs(apply_kernels(signal, kernels, reach) - want).max() < 1e-12
    monkeypatch.setattr(full, "BAND", 64)  # many bands
    for threads in (1, 3):
        assert np.abs(apply_kernels(signal, kernels, reach, threads=threads) - want).max() < 1e-12


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_constant_is_an_infinite_constant(name: str) -> None:
    kernels = kernels_of(name)
    layout, (rows, columns) = kernels.layout, kernels.layout.pattern.shape
    color = np.array([0.2, 0.5, 0.9])
    signal = np.broadcast_to(color, (2 * rows + 1, 3 * columns + 1, 3)).copy()
    want = kernels.h.sum(axis=(2, 3)) @ layout.signal(color)
    for reach in (None, 2, 1000):
        lattice = apply_kernels(signal, kernels, reach)
        for p, (row, column) in enumerate(layout.active):
            assert np.abs(lattice[row::rows, column::columns] - want[p]).max() < 1e-12
        assert np.count_nonzero(lattice) == sum(lattice[row::rows, column::columns].size for row, column in layout.active)
    own = apply_kernels(signal, kernels, only_own=True)
    for p, (row, column) in enumerate(layout.active):
        assert np.abs(own[row::rows, column::columns] - layout.signal(color)[layout.active_primaries[p]]).max() < 1e-12


@pytest.mark.parametrize("name", SHIPPED)
def test_reach_converges(name: str) -> None:
    kernels = kernels_of(name)
    layout = kernels.layout
    signal = np.full((kernels.h.shape[2] if not layout.one_dimensional else 1, 2 * kernels.h.shape[3], 3), 0.5)
    middle = slice(signal.shape[1] // 2 - 20, signal.shape[1] // 2 + 20)
    rows = slice(None) if layout.one_dimensional else slice(4, -4)
    signal[rows, middle] = np.random.default_rng(3).random(signal[rows, middle].shape)
    whole = apply_kernels(signal, kernels, 10_000)
    reaches = [r for r in (4, 8, 16, 32, 64, 128, 256) if r < max(kernels.h.shape[2:]) // 2]
    errors = [float(np.abs(apply_kernels(signal, kernels, reach) - whole).max()) for reach in reaches]
    assert errors[-1] < 0.1 * errors[0]
    assert errors[-1] == min(errors)
    assert np.abs(apply_kernels(signal, kernels) - whole).max() < 2e-4

    # By its definition: no more than the rest lies beyond, but one position less would leave more
    for rest in (1e-1, 1e-2):
        reach, distance = reach_of(kernels, rest), np.maximum(np.abs(kernels.rows_at)[:, None], np.abs(kernels.columns_at))
        beyond = [(np.abs(kernels.h) * (distance > r)).sum(axis=(1, 2, 3)) / np.abs(kernels.h).sum(axis=(1, 2, 3)) for r in (reach, reach - 1)]
        assert beyond[0].max() <= rest < beyond[1].max()


def test_band_pass_kernels_matter_at_high_frequencies_alone() -> None:
    kernels = kernels_of("rgb_stripe")
    at = np.arange(kernels.h.shape[3])
    most = {}
    for name, channels in (("red", [0]), ("gray", [0, 1, 2])):
        for period in (60, 6, 3):  # positions; 6 are the pixel's Nyquist frequency
            signal = np.zeros((1, len(at), 3))
            signal[0][:, channels] = 0.5 + 0.5 * np.sin(2 * np.pi * at / period)[:, None]
            whole, own = (apply_kernels(signal, kernels, periodic=True, only_own=only) for only in (False, True))
            most[name, period] = float(np.abs(whole - own).max())
    assert most["red", 6] > 0.04
    assert most["gray", 6] > 0.2
    assert max(most[name, period] for name in ("red", "gray") for period in (60, 3)) < 1e-4

    # Where red subpixels show a red grating by themselves, others add nothing, as high as its frequency is
    red = np.zeros((1, len(at), 3))
    red[..., 0] = 0.5 + 0.5 * np.cos(2 * np.pi * at / 6)
    whole, own = (apply_kernels(red, kernels, periodic=True, only_own=only) for only in (False, True))
    assert np.abs(whole - own).max() < 1e-4

    # Without band-pass kernels, what is not a subpixel's own primary does not reach it
    assert np.abs(own[:, 1::3]).max() < 1e-12
    assert np.abs(own[:, 2::3]).max() < 1e-12
    assert own[:, 0::3].max() > 0.4


def test_a_mirrored_display_shows_the_mirrored_image() -> None:
    signal = np.random.default_rng(4).random((3, 60, 3)).astype(np.float32)
    rgb = apply_kernels(signal, kernels_of("rgb_stripe"))
    bgr = apply_kernels(np.ascontiguousarray(signal[:, ::-1]), kernels_of("bgr_stripe"))
    assert np.abs(bgr[:, ::-1] - rgb).max() < 1e-6
    assert np.abs(apply_kernels(signal, kernels_of("bgr_stripe")) - rgb).max() > 0.1


def test_bad_signals_are_refused() -> None:
    kernels, signal = kernels_of("rgb_stripe"), np.full((2, 9, 3), 0.5, np.float32)
    with pytest.raises(QueryError, match=r"expected a signal of \(rows, columns, 3\), found the shape \(2, 9\)"):
        apply_kernels(signal[..., 0], kernels)
    with pytest.raises(QueryError, match="whole periods of 3 x 1 positions, found 8 x 2"):
        apply_kernels(signal[:, :8], kernels, periodic=True)
    with pytest.raises(QueryError, match="reach of 0 positions or more, found -1"):
        apply_kernels(signal, kernels, -1)
    for bad in (np.nan, np.inf):
        broken = signal.copy()
        broken[1, 2, 0] = bad
        with pytest.raises(QueryError, match="1 values that are not finite"):
            apply_kernels(broken, kernels)


def test_huge_and_negative_values_pass() -> None:
    kernels, signal = kernels_of("rgb_stripe"), np.full((2, 30, 3), -1.0, np.float32)
    assert np.allclose(apply_kernels(signal, kernels), -1.0, atol=2e-5)
    signal[0, 15] = 1e30
    found = apply_kernels(signal, kernels)
    assert np.isfinite(found).all()
    assert found[0].max() > 1e29
