"""A subpixel filter as tables for kernels: which subpixels a sample reaches from where it lies in its pixel, and with what weights."""

import dataclasses
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from queries.kernels.subpixel import splat_radial, splat_separable, splat_walks
from queries.subpixel.samples import Walks
from renderer.filters import ReconstructionFilter
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import Layout

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Floats = npt.NDArray[np.floating]
I64 = npt.NDArray[np.int64]
Kind = TypeVar("Kind", bound=np.generic)

PHASES = 512  # of a pixel, at least: linear in between, weights of the optimal filter are off by less than 1e-5 of the largest
DISTANCES = 4096  # entries of a table by the distance's square
_BESIDE = 1e-9  # pixels: weights are taken so far inside of a phase, so that a box that ends at one is exact
_PLACES, _ABOVE = 24, 1.05  # places in a pixel along each axis where weights are looked at, and what is added for those between
MOST_IN_FLOAT32 = 16.0  # samples of a pixel that are added up in float32, to within about 1e-6 of the sum of their magnitudes
_VECTOR = 4  # subpixels in reach are rounded up to this


@dataclass(frozen=True, eq=False)
class Reach:
    """The subpixels that samples of each pixel of a period reach along a row; see ``queries.kernels.subpixel``.

    ``first``: int64 (pattern rows, pixels), ``subpixel``: int64 (pattern rows, pixels, reach), an index into ``layout.active``, or -1, and
    ``center``: float64 of that shape, pixels from the sample's pixel's left.
    """

    first: I64
    subpixel: I64
    center: F64


@dataclass(frozen=True, eq=False)
class WeightTables:
    """What samples add to a display of ``width`` x ``height`` pixels: ``allocate`` makes sums, ``splat`` adds samples to them.

    ``splat_walks`` adds rows of ``paths``, walk by walk, where the filter takes but the samples of a subpixel's own row; else None.
    """

    filter: SubpixelFilter
    width: int
    height: int
    pad: int
    period: I64
    columns: int
    signed: bool
    rows_reached: int
    splat: Callable[..., None]
    splat_walks: Callable[..., None] | None

    @property
    def layout(self) -> Layout:
        """The display."""
        return self.filter.layout

    @property
    def rows(self) -> int:
        """Rows of positions."""
        return self.height * self.layout.cells[1]

    @property
    def channels(self) -> int:
        """Sums of a position: one channel and the weights', or where a primary mixes channels, three."""
        return 2 if len(self.layout.primaries) == 3 else 4

    def band(self, low: float, high: float) -> tuple[int, int]:
        """The rows of positions that samples between two heights of the film, in pixels, reach: the first, and the one past the last."""
        if not low <= high:
            return 0, 0
        period, pixels = len(self.period), len(self.period) // self.layout.cells[1]
        first = np.clip(int(low) // pixels * period - self.rows_reached, 0, self.rows)
        last = np.clip((int(high) // pixels + 1) * period + self.rows_reached, first, self.rows)
        return int(first), int(last)

    def precision(self, samples: float) -> type[np.floating]:
        """In what sums of so many samples of each pixel are kept."""
        return np.float32 if self.splat_walks and samples <= MOST_IN_FLOAT32 else np.float64

    def allocate(self, rows: int, kind: type[np.floating] = np.float64) -> Floats:
        """Sums of so many rows of positions; of ``kind`` float32 only where there is ``splat_walks``."""
        return np.zeros((self.channels, rows, self.columns), kind)

    def magnitudes(self) -> "WeightTables":
        """The tables of the weights' magnitudes."""
        across = tuple(_magnitude(one) for one in self.filter.across)
        down = None if self.filter.down is None else tuple(_magnitude(one) for one in self.filter.down)
        return weight_tables(dataclasses.replace(self.filter, across=across, down=down), self.width, self.height)

    def most(self) -> F64:
        """More than the sum of the weights' magnitudes can be with one sample in each pixel, by the pattern's row: float64 (rows, columns of sums).

        -inf beside the display.
        """
        found, largest = np.full((len(self.period), self.columns), -np.inf), _largest(self.filter)
        for which, (row, k, column) in enumerate(self._places()):
            count = len(range(column, self.width * self.layout.cells[0], self.layout.pattern.shape[1]))
            found[row, self.pad + k :: self.period[row]][:count] = largest[which]
        return found

    def to_lattice(self, values: npt.NDArray[Kind]) -> npt.NDArray[Kind]:
        """Values of subpixels, (rows, columns) of sums, to positions: (rows, columns) of the same kind; 0 where there is no subpixel."""
        pattern_rows, pattern_columns = self.layout.pattern.shape
        lattice = np.zeros((self.rows, self.width * self.layout.cells[0]), values.dtype)
        for row, k, column in self._places():
            place = lattice[row::pattern_rows, column::pattern_columns]
            place[:] = values[row::pattern_rows, self.pad + k :: self.period[row]][:, : place.shape[1]]
        return lattice

    def _places(self) -> Iterator[tuple[int, int, int]]:
        """Of each subpixel of a period: its row, which one it is there, and its column."""
        for row, column in self.layout.active.tolist():
            yield row, int(np.count_nonzero(self.layout.pattern[row, :column] >= 0)), column


def weight_tables(filter: SubpixelFilter, width: int, height: int) -> WeightTables:
    """The tables of a filter for a film of ``width`` x ``height`` pixels."""
    layout = filter.layout
    reach, (first_down, center_down) = _reach(filter), _reach_down(filter)
    period = np.bincount(layout.active[:, 0], minlength=len(layout.pattern)).astype(np.int64)
    pad = int(max(-reach.first.min(), (reach.first + reach.subpixel.shape[2]).max(), 0)) + 1
    columns = 2 * pad + int(period.max()) * -(-width * layout.cells[0] // layout.pattern.shape[1])
    make = _radial if filter.down is None else _rows if _own_row(filter) else _separable
    added = make(filter, reach, first_down, center_down)
    splat = functools.partial(_splat, added, (width, height), pad, period)
    by_walk = functools.partial(_splat_walks, added, (width, height), pad, period) if added.kernel is splat_walks else None
    return WeightTables(filter, width, height, pad, period, columns, added.signed, center_down.shape[1], splat, by_walk)


@dataclass(frozen=True, eq=False)
class _Added:
    """A kernel, its tables, the scratch that it needs, and whether some weights are negative."""

    kernel: Callable[..., None]
    tables: tuple[npt.NDArray[Any], ...]
    scratch: tuple[F64, ...]
    signed: bool

    @functools.cached_property
    def in_float32(self) -> tuple[npt.NDArray[Any], ...]:
        """The tables, with real numbers in float32."""
        return tuple(one.astype(np.float32) if one.dtype == np.float64 else one for one in self.tables)


def _splat(added: _Added, size: tuple[int, int], pad: int, period: I64, x: Floats, y: Floats, rgb: F32, first_row: int, sums: Floats) -> None:
    """Add samples, at ``x`` and ``y`` in pixels and of colors (samples, 3), to sums of the rows of positions from ``first_row`` on."""
    if added.kernel is splat_walks:
        n = len(x)
        _splat_walks(added, size, pad, period, Walks(np.arange(n, dtype=np.uint32), np.ones(n, np.bool_), x, y, *rgb.T), first_row, sums)
        return
    scratch = [np.empty_like(one) for one in added.scratch]
    samples = (_read_only(one) for one in (x, y, rgb))
    added.kernel(*samples, *size, first_row, pad, period, *added.tables, *scratch, sums)


def _splat_walks(added: _Added, size: tuple[int, int], pad: int, period: I64, walks: Walks, first_row: int, sums: Floats) -> None:
    """The same for walks."""
    rows: tuple[Any, ...] = tuple(_read_only(one) for one in walks)
    tables = added.in_float32 if sums.dtype == np.float32 else added.tables
    added.kernel(*rows, *size, first_row, pad, period, *tables, sums)


def _read_only(values: npt.NDArray[Kind]) -> npt.NDArray[Kind]:
    """The same values as stored columns are: kernels are compiled for them once."""
    if values.flags.c_contiguous and not values.flags.writeable:
        return values
    found = np.ascontiguousarray(values).view()
    found.flags.writeable = False
    return found


def _rows(filter: SubpixelFilter, reach: Reach, first_down: I64, center_down: F64) -> _Added:
    """Weights across alone."""
    across = _across_table(filter, reach)
    return _Added(splat_walks, (across[0], reach.first[0], _shows(filter, reach)[0]), (), bool((across[..., 0, :] < 0).any()))


def _separable(filter: SubpixelFilter, reach: Reach, first_down: I64, center_down: F64) -> _Added:
    """Weights across times weights down."""
    assert filter.down is not None
    across, different = _across_table(filter, reach), list(dict.fromkeys(filter.down))
    down_of = np.array([different.index(one) for one in filter.down])[np.maximum(reach.subpixel, 0)]
    down = np.stack([_phase_table(center_down, filter.layout.cells[1], functools.partial(_inside, one)) for one in different])
    scratch = (np.zeros(across.shape[-1]), np.zeros((len(different), center_down.shape[1])), np.zeros(across.shape[-1]))
    signed = bool((across[..., 0, :] < 0).any() or (down[..., 0, :] < 0).any())
    return _Added(splat_separable, (across, reach.first, _shows(filter, reach), down, first_down, down_of), scratch, signed)


def _radial(filter: SubpixelFilter, reach: Reach, first_down: I64, center_down: F64) -> _Added:
    """Weights of the distance."""
    squared_radius = np.array([one.radius**2 for one in filter.across])
    distance = np.sqrt(np.linspace(0.0, 1.0, DISTANCES + 1)) * (1.0 - _BESIDE)
    table = np.array([_inside(one, distance * one.radius) for one in filter.across])
    tables = (reach.first, _shows(filter, reach), reach.subpixel, reach.center, first_down, center_down, table, squared_radius)
    return _Added(splat_radial, tables, (np.zeros(reach.subpixel.shape[2]),), bool((table < 0).any()))


def _shows(filter: SubpixelFilter, reach: Reach) -> F64:
    """1 for the channel that each subpixel in reach shows, (pattern rows, pixels, 3, reach); of no meaning where primaries mix channels."""
    primary = np.where(reach.subpixel >= 0, filter.layout.active_primaries[reach.subpixel], -1)
    return np.ascontiguousarray(primary[:, :, None, :] == np.arange(3)[:, None], np.float64)


def _magnitude(filter: ReconstructionFilter) -> ReconstructionFilter:
    """The magnitude of a filter."""
    return dataclasses.replace(filter, weight=lambda x: np.abs(filter.weight(x)))


def _largest(filter: SubpixelFilter) -> F64:
    """For each subpixel, the sum over pixels of the largest magnitude of a weight within, and a little more: float64 (subpixels)."""
    reach = [int(np.ceil(radius)) + 1 for radius in filter.radius]
    place = [np.arange(-n * _PLACES, (n + 1) * _PLACES + 1) / _PLACES for n in reach]
    found = []
    for which, (x, y) in enumerate(filter.centers() % 1.0):
        across, down = place[0] - x, place[1] - y
        if filter.down is None:
            weights = _inside(filter.across[which], np.hypot(down[:, None], across))
        else:
            weights = np.multiply.outer(_inside(filter.down[which], down), _inside(filter.across[which], across))
        inner = np.abs(weights)
        for axis in (0, 1):  # both ends of a pixel belong to it
            pixels = (inner.shape[axis] - 1) // _PLACES
            spans = [inner.take(range(n * _PLACES, (n + 1) * _PLACES + 1), axis).max(axis) for n in range(pixels)]
            inner = np.stack(spans, axis)
        found.append(_ABOVE * inner.sum())
    return np.array(found)


def _own_row(filter: SubpixelFilter) -> bool:
    """Whether every subpixel takes just the samples of its own row of pixels, and one channel of them."""
    layout = filter.layout
    at = np.linspace(-0.499, 0.499, 9)
    boxes = filter.down is not None and all(one.radius == 0.5 and np.ptp(one.weight(at)) == 0.0 for one in filter.down)
    return boxes and len(layout.primaries) == 3 and layout.one_dimensional and layout.cells[1] == 1 and (filter.at_pixel or layout.origin[1] == 0.5)


def _inside(filter: ReconstructionFilter, offset: F64) -> F64:
    """A filter's weights, zero from its radius on."""
    return np.where(np.abs(offset) < filter.radius, filter.weight(offset), 0.0)


def _reach(filter: SubpixelFilter) -> Reach:
    """The subpixels in reach of a sample, for each of the pattern's rows and pixels of a period."""
    layout, centers = filter.layout, filter.centers()[:, 0]
    pattern_rows, pixels = len(layout.pattern), layout.pattern.shape[1] // layout.cells[0]
    periods = int(np.ceil(filter.radius[0] / pixels)) + 2
    found: dict[tuple[int, int], tuple[I64, I64, F64]] = {}
    for row in range(pattern_rows):
        active = np.flatnonzero(layout.active[:, 0] == row)
        which = np.tile(active, 2 * periods + 1)
        radius = np.array([filter.across[one].radius for one in which])
        place = np.repeat(np.arange(-periods, periods + 1), len(active)) * pixels + centers[which]
        for pixel in range(pixels):
            center = place - pixel
            near = np.flatnonzero((center > -radius) & (center < 1 + radius))
            span = np.arange(near[0], near[-1] + 1) if len(near) else np.zeros(0, np.int64)
            found[row, pixel] = span - periods * len(active), which[span], center[span]
    reach = -(-max(len(span) for span, _, _ in found.values()) // _VECTOR) * _VECTOR
    first, subpixel, center = (
        np.zeros((pattern_rows, pixels), np.int64),
        np.full((pattern_rows, pixels, reach), -1),
        np.zeros((pattern_rows, pixels, reach)),
    )
    for (row, pixel), (span, which, at) in found.items():
        first[row, pixel] = span[0] if len(span) else 0
        subpixel[row, pixel, : len(span)], center[row, pixel, : len(span)] = which, at
    return Reach(first, subpixel, center)


def _reach_down(filter: SubpixelFilter) -> tuple[I64, F64]:
    """Rows of positions in reach of each pixel of a period: the first, counted from the period's, and all their centers (pixels, reach)."""
    layout, radius = filter.layout, filter.radius[1]
    pattern_rows = len(layout.pattern)
    pixels = pattern_rows // layout.cells[1]
    rows = np.arange(-(int(np.ceil(radius)) + 2) * layout.cells[1], (pixels + int(np.ceil(radius)) + 2) * layout.cells[1])
    center = (rows + layout.origin[1]) / layout.cells[1]
    center = np.floor(center) + 0.5 if filter.at_pixel else center
    near = [np.flatnonzero((center - pixel > -radius) & (center - pixel < 1 + radius)) for pixel in range(pixels)]
    reach = max(len(found) for found in near)
    first = np.array([found[0] for found in near])
    return rows[first], np.stack([center[start : start + reach] - pixel for pixel, start in enumerate(first)])


def _across_table(filter: SubpixelFilter, reach: Reach) -> F64:
    """Weights of the subpixels in reach, (pattern rows, pixels, phases, 2, reach)."""

    def weigh(offset: F64) -> F64:
        weights = np.zeros(offset.shape)
        for which, one in enumerate(filter.across):
            mine = np.broadcast_to((reach.subpixel == which)[:, :, None, :], offset.shape)
            weights[mine] = _inside(one, offset[mine])
        return weights

    return _phase_table(reach.center, filter.layout.cells[0], weigh)


def _phase_table(center: F64, cells: int, weigh: Callable[[F64], F64]) -> F64:
    """Weights at the start of each phase and how they change to its end, (…, phases, 2, reach), for centers (…, reach)."""
    phases = -(-PHASES // (2 * cells)) * 2 * cells  # edges of subpixels and their middles fall between phases
    start = np.arange(phases) / phases
    low, high = (weigh(at[:, None] - center[..., None, :]) for at in (start + _BESIDE, start + 1 / phases - _BESIDE))
    return np.ascontiguousarray(np.stack([low, high - low], axis=-2))
