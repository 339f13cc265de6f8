"""The weighted error of Eq. 4.4: against its definition term by term, and least for the kernels that are derived to make it so."""

import itertools

import numpy as np
import numpy.typing as npt
import pytest

from queries.errors import QueryError
from queries.subpixel.description import LayoutDescription
from queries.subpixel.description import layout as layout_of
from queries.subpixel.weighted_error import drive, weighted_error
from renderer.filters.subpixel.derive import Kernels, derive
from renderer.filters.subpixel.layout import INACTIVE, Layout
from renderer.filters.subpixel.sensitivity import Sensitivity, exponential, gaussian
from renderer.filters.subpixel.viewing import Viewing

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
VIEWING = Viewing()
SENSITIVITIES = {"exponential": exponential(), "gaussian": gaussian((6.0, 3.0, 2.0))}
SIZES = {"rgb_stripe": (2, 36), "bgr_stripe": (1, 30), "rgbg": (1, 48), "rgbw": (8, 12)}


def noise(shape: tuple[int, int], seed: int = 1) -> F32:
    return np.random.default_rng(seed).random((*shape, 3)).astype(np.float32)


def definition(lattice: F32, signal: F32, layout: Layout, sensitivity: Sensitivity) -> float:
    """Eq. 4.4 by sums over positions and frequencies."""
    rows, columns = lattice.shape
    gamma = layout.signal(signal.astype(np.float64))
    error, whole = np.zeros((2, rows, columns, 3))
    for i, j in np.ndindex(rows, columns):
        q = layout.pattern[i % layout.pattern.shape[0], j % layout.pattern.shape[1]]
        whole[i, j] = layout.opponent @ gamma[i, j]
        error[i, j] = -whole[i, j]
        if q != INACTIVE:
            error[i, j] += layout.pattern.size / (layout.pattern == q).sum() * layout.opponent[:, q] * lattice[i, j]

    def energy(values: F64) -> float:
        total = 0.0
        for v, u in itertools.product(range(1 if layout.one_dimensional else rows), range(columns)):
            f_x = min(u, columns - u) * layout.cells[0] / (columns * VIEWING.degrees_per_pixel)
            f_y = min(v, rows - v) * layout.cells[1] / (rows * VIEWING.degrees_per_pixel)
            weight = sensitivity.weights(np.array(np.hypot(f_x, f_y)))
            wave = np.exp(-2j * np.pi * u * np.arange(columns) / columns)
            spectrum = np.einsum("ijc,j->ic", values, wave)  # one row of pixels each
            if not layout.one_dimensional:
                spectrum = (np.exp(-2j * np.pi * v * np.arange(rows) / rows) @ spectrum)[None]
            total += float((weight * np.abs(spectrum) ** 2).sum())
        return total

    return float(np.sqrt(energy(error) / energy(whole)))


def solution(kernels: Kernels, signal: F32) -> F32:
    """All kernels on a signal that repeats, as the equation says: a sum over offsets and primaries at each subpixel."""
    layout = kernels.layout
    gamma = layout.signal(signal.astype(np.float64))
    rows, columns, _ = gamma.shape
    lattice = np.zeros((rows, columns))
    for (i, j), q in np.ndenumerate(np.tile(layout.pattern, (rows // layout.pattern.shape[0], columns // layout.pattern.shape[1]))):
        if q == INACTIVE:
            continue
        p = next(k for k, (r, c) in enumerate(layout.active) if (i - r) % layout.pattern.shape[0] == 0 and (j - c) % layout.pattern.shape[1] == 0)
        window = gamma[(i + kernels.rows_at[:, None]) % rows, (j + kernels.columns_at) % columns]
        lattice[i, j] = np.einsum("drc,rcd->", kernels.h[p], window)
    return lattice.astype(np.float32)


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("shape", [(4, 24), (3, 19), (5, 7)])
def test_error_is_that_of_the_definition(name: str, shape: tuple[int, int]) -> None:
    """At whole periods, and where they are cut."""
    layout, rng = layout_of(name), np.random.default_rng(2)
    lattice = rng.normal(0.5, 0.5, shape).astype(np.float32)
    for sensitivity in SENSITIVITIES.values():
        found = weighted_error(lattice, noise(shape), layout, VIEWING, sensitivity)
        assert found == pytest.approx(definition(lattice, noise(shape), layout, sensitivity), rel=1e-10)


def test_frequencies_of_positions_that_are_not_square() -> None:
    """Two across a pixel and one down; two rows of pixels are a period."""
    layout = LayoutDescription(pattern=["R G B W", "B W R G"], cells=(2, 1)).layout("wide")
    lattice = np.random.default_rng(5).normal(0.5, 0.5, (6, 8)).astype(np.float32)
    expected = definition(lattice, noise((6, 8)), layout, exponential())
    assert weighted_error(lattice, noise((6, 8)), layout, VIEWING, exponential()) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("sensitivity", SENSITIVITIES)
def test_solved_kernels_make_it_least(name: str, sensitivity: str) -> None:
    """No other picture does better: none of many random ones, nor any change of a single subpixel, in either direction."""
    layout, shape, rng = layout_of(name), SIZES[name], np.random.default_rng(3)
    size = (1 if layout.one_dimensional else shape[0], shape[1])
    kernels = derive(layout, VIEWING, SENSITIVITIES[sensitivity], size)
    signal = noise(shape)
    if layout.one_dimensional:
        best = np.concatenate([solution(kernels, row[None]) for row in signal])
    else:
        best = solution(kernels, signal)

    def error(lattice: F32) -> float:
        return weighted_error(lattice, signal, layout, VIEWING, SENSITIVITIES[sensitivity])

    least = error(best)
    lit = drive(layout, shape).any(axis=2)
    own = np.zeros(shape, np.float32)
    gamma = layout.signal(signal)
    for (i, j), q in np.ndenumerate(np.tile(layout.pattern, (shape[0] // layout.pattern.shape[0], shape[1] // layout.pattern.shape[1]))):
        own[i, j] = gamma[i, j, q] if q != INACTIVE else 0.0
    assert least < error(own)
    assert least < error(np.roll(best, layout.pattern.shape[1], axis=1))
    for scale in (1e-3, 1e-2, 0.1, 1.0):
        for _ in range(5):
            assert error(best + np.where(lit, scale * rng.standard_normal(shape), 0.0).astype(np.float32)) > least

    # The gradient is 0: both directions cost the same
    places = np.argwhere(lit)
    for i, j in places[rng.permutation(len(places))[:12]]:
        step = np.zeros(shape, np.float32)
        step[i, j] = 0.05
        up, down = error(best + step), error(best - step)
        assert min(up, down) > least
        assert up**2 - down**2 == pytest.approx(0.0, abs=2e-5 * (up**2 - least**2) + 1e-8)


def test_what_the_display_can_show_has_no_error_and_black_has_all() -> None:
    layout = layout_of("rgb_stripe")
    lattice = np.random.default_rng(4).random((2, 30)).astype(np.float32)
    signal = np.zeros((2, 30, 3), np.float32)
    np.put_along_axis(signal, np.broadcast_to(np.arange(30) % 3, (2, 30))[..., None], 3 * lattice[..., None], axis=2)
    assert weighted_error(lattice, signal, layout, VIEWING, exponential()) < 1e-7
    assert weighted_error(0 * lattice, signal, layout, VIEWING, exponential()) == pytest.approx(1.0, rel=1e-12)
    assert weighted_error(2 * lattice, 2 * signal, layout, VIEWING, exponential()) < 1e-7
    assert weighted_error(0 * lattice, 0 * signal, layout, VIEWING, exponential()) == 0.0
    assert weighted_error(lattice, 0 * signal, layout, VIEWING, exponential()) == np.inf


def test_white_shows_where_the_sensitivity_ends() -> None:
    """White on a stripe errs at the frequency of its pixels and above alone: unseen by an eye that sees none of them."""
    layout, shape = layout_of("rgb_stripe"), (1, 60)
    ones, white = np.ones(shape, np.float32), np.ones((*shape, 3), np.float32)
    pixel = 1.0 / VIEWING.degrees_per_pixel
    for constant in (2.0, 10.0, 40.0):
        stripes = np.abs(np.fft.fft((3 * layout.opponent).T, axis=0)[1]) ** 2 / (9.0 * np.abs(layout.opponent.sum(axis=1) ** 2).sum())
        expected = np.sqrt(2.0 * np.exp(-pixel / constant) * stripes.sum())
        assert weighted_error(ones, white, layout, VIEWING, exponential(constant)) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("lattice", "signal", "message"),
    [
        (np.zeros((2, 6), np.float32), np.zeros((2, 5, 3), np.float32), "each position"),
        (np.zeros((2, 6), np.float32), np.zeros((2, 6), np.float32), "each position"),
        (np.full((2, 6), np.nan, np.float32), np.zeros((2, 6, 3), np.float32), "not finite"),
        (np.zeros((2, 6), np.float32), np.full((2, 6, 3), np.inf, np.float32), "not finite"),
    ],
)
def test_what_does_not_fit_is_refused(lattice: F32, signal: F32, message: str) -> None:
    with pytest.raises(QueryError, match=message):
        weighted_error(lattice, signal, layout_of("rgb_stripe"), VIEWING, exponential())
