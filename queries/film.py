"""The film as queries fill it: which pixels a contribution reaches, and what the sums of a pixel are divided by.

The run's own filter has its sums of weights on disk. For any other, they are summed anew from the film positions of all camera walks: those of
``paths``, and those of ``unlit``, which carried nothing. A run that recorded a share of its walks, or light walks, has no such positions: there,
weights are what is expected of samples that are even over the film.
"""

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError, RunError
from queries.kernels.splat import splat_weights, walk_starts
from queries.run import Run
from queries.shards import Piece, map_shards
from renderer.filters import ReconstructionFilter, reconstruction_filter
from renderer.filters.reconstruction import FILTERS

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
_POINTS = 256  # of Simpson's rule in each half of a pixel


@dataclass(frozen=True)
class FilteredFilm:
    """Where contributions fall. ``table``: the filter's weights, as the renderer's film has them."""

    width: int
    height: int
    filter: ReconstructionFilter
    table: F64

    @property
    def reach(self) -> int:
        """How many rows of pixels beyond its own a path may reach."""
        return 0 if self.filter.name == "box" else int(np.ceil(self.filter.radius))

    @property
    def scratch(self) -> F64:
        """Room for the weights of one sample across."""
        return np.zeros(int(2 * self.filter.radius) + 1)

    def band(self, heights: list[F32]) -> tuple[int, int]:
        """The film's rows that samples at these heights may reach: the first, and the one past the last."""
        spans = [(float(y.min()), float(y.max())) for y in heights if len(y)]
        if not spans:
            return 0, 0
        first = np.clip(min(low for low, _ in spans) - self.reach, 0, self.height)
        last = np.clip(max(high for _, high in spans) + self.reach + 1, first, self.height)
        return int(first), int(last)


def film_of(run: Run, filter: str | None = None) -> FilteredFilm:
    """The run's film with a reconstruction filter: its own, or another one. Raises QueryError for an unknown name."""
    name = filter or run.settings["filter"]
    if name not in FILTERS:
        raise QueryError(f"there is no reconstruction filter `{name}`: known are {', '.join(FILTERS)}")
    found = reconstruction_filter(name)
    return FilteredFilm(run.settings["width"], run.settings["height"], found, found.table().astype(np.float64))


def is_banded(run: Run, film: FilteredFilm) -> bool:
    """Whether a shard reaches but a band of the film: camera walks start in the order of the pixels."""
    return run.settings["method"] == "path" and bool(run.manifest["shards"]["walks"] < film.width * film.height)


def divisor(run: Run, film: FilteredFilm, threads: int) -> F64:
    """What the recorded paths' sums are divided by, for each pixel or for all: float64 (height, width, 1) or ()."""
    passes, keep = run.settings["passes"], run.settings["keep"]
    if film.filter.name == "box":
        return np.array(float(passes) * keep)
    if run.settings["method"] != "path":
        return np.array(passes * film.filter.integral**2 * keep)
    if film.filter.name == run.settings["filter"]:
        weights = _kept_weights(run) * keep
    elif keep < 1.0:
        weights = np.multiply.outer(covered(film.filter, film.height), covered(film.filter, film.width))[..., None] * (passes * keep)
    else:
        weights = camera_weights(run, film, threads)[..., None]
    return np.where(weights != 0, weights, 1.0)


def _kept_weights(run: Run) -> F64:
    """The weights of all camera walks, as the film summed them: float64 (height, width, 1)."""
    file = run.path / "film" / "sum.npy"
    try:
        film = np.load(file, mmap_mode="r", allow_pickle=False)
        return np.array(film[: run.settings["height"], : run.settings["width"], 3:], np.float64)
    except (OSError, ValueError, IndexError) as error:
        raise RunError(f"`{file}`, which holds the weights of the run's filter, cannot be read ({error}): run the job again with --resume") from None


def camera_weights(run: Run, film: FilteredFilm, threads: int) -> F64:
    """The sums of all recorded camera walks' weights, float64 (height, width). Raises QueryError for a run without the table ``unlit``."""
    run.require_unlit("filtered anew")
    total = np.zeros((film.height, film.width))
    for first, rows in map_shards(run.files("paths", "unlit"), functools.partial(_weigh_shard, film, is_banded(run, film)), threads):
        total[first : first + len(rows)] += rows
    return total


def _weigh_shard(film: FilteredFilm, banded: bool, found: Iterator[Piece]) -> tuple[int, F64]:
    """The first film row that a shard reaches, and what it adds from there on."""
    there = list(found)
    tables = [(piece, table) for piece in there for table in ("paths", "unlit") if piece.rows(table)]
    first, last = film.band([piece.column(table, "raster_y") for piece, table in tables]) if banded else (0, film.height)
    sums, scratch, radius = np.zeros((last - first, film.width)), film.scratch, np.float64(film.filter.radius)
    for piece, table in tables:
        chosen = np.ones(piece.rows(table), np.bool_)
        walk_starts(piece.column(table, "camera_walk"), chosen)
        splat_weights(chosen, piece.column(table, "raster_x"), piece.column(table, "raster_y"), first, film.table, radius, scratch, sums)
    return first, sums


def covered(filter: ReconstructionFilter, size: int) -> F64:
    """The integral of a filter over a row of ``size`` pixels, centered at each of them: less than the whole at both ends. float64 (size)."""
    reach = int(np.ceil(filter.radius))
    x = np.linspace(0.0, 1.0, 2 * _POINTS + 1)
    simpson = np.ones(2 * _POINTS + 1)
    simpson[1:-1:2], simpson[2:-1:2] = 4.0, 2.0
    halves = np.arange(-2 * reach - 1, 2 * reach + 1) / 2  # filters have their knots at whole and half pixels
    offset = halves[:, None] + x / 2
    weights = np.where(np.abs(offset) <= filter.radius, filter.weight(offset), 0.0) @ simpson / (12.0 * _POINTS)
    pixels = weights[::2] + weights[1::2]
    return np.convolve(np.ones(size), pixels)[reach : reach + size]
