"""Images resolved from tables: contributions of paths, filtered as the film does, summed by pixel.

Any number of images come of one pass over the tables. Each shard's rows are summed by themselves and the sums added in the shards' order,
so the same bits come out on any number of threads.
"""

import functools
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.classify import Classifier
from queries.errors import RunError
from queries.kernels.splat import splat_box, splat_filter
from queries.lpe import Expression
from queries.run import MEMORY_LIMIT, Run, open_run
from queries.shards import Piece, cores, map_shards
from queries.values import Term, terms_of
from renderer.filters import ReconstructionFilter, reconstruction_filter

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Rows = tuple[int, F64, list[int]]  # the first film row of some, their sums: float64 (images, rows, width, 3), and how many paths each image counts
_MEMORY = 1 << 29  # bytes of sums that a pass may hold: with more and larger images, tables are gone through again


@dataclass(frozen=True)
class Selected:
    """What an expression selects: ``image``, float32 (height, width, 3), linear; ``rows``: how many paths (or blocked connections) it counts."""

    image: F32
    rows: int


def images(run: Run | str | os.PathLike[str], expressions: Mapping[str, Expression | str], threads: int | None = None) -> dict[str, F32]:
    """The images of the paths that expressions match, by name: float32 (height, width, 3), linear.

    Expressions given as text are compiled with the run's names. Images of expressions that partition the paths sum to ``image``; prefixes change
    what a path counts (``queries.values``). Raises ``ExpressionError`` for a bad expression, ``QueryError`` where the run lacks what one needs.
    """
    return {name: found.image for name, found in select(run, expressions, threads).items()}


def select(run: Run | str | os.PathLike[str], expressions: Mapping[str, Expression | str | None], threads: int | None = None) -> dict[str, Selected]:
    """The same with numbers of paths; None stands for all paths."""
    with _opened(run, threads) as opened:
        compiled = {name: opened.compile(given) if isinstance(given, str) else given for name, given in expressions.items()}
        return dict(zip(compiled, _resolve(opened, list(compiled.values()), threads)))


def aov_image(run: Run | str | os.PathLike[str], expression: Expression | str, threads: int | None = None, memory_limit: str = MEMORY_LIMIT) -> F32:
    """The image of the paths that one expression matches; see ``images``."""
    with _opened(run, threads, memory_limit) as opened:
        return _resolve(opened, [opened.compile(expression) if isinstance(expression, str) else expression], threads)[0].image


def image(run: Run | str | os.PathLike[str], threads: int | None = None, memory_limit: str = MEMORY_LIMIT) -> F32:
    """The image of all recorded paths; see ``images``."""
    with _opened(run, threads, memory_limit) as opened:
        return _resolve(opened, [None], threads)[0].image


class _opened:
    """A run that is opened, or open already, for a ``with`` block; the former is closed again."""

    def __init__(self, run: Run | str | os.PathLike[str], threads: int | None, memory_limit: str = MEMORY_LIMIT) -> None:
        self.mine = not isinstance(run, Run)
        self.run = run if isinstance(run, Run) else open_run(run, memory_limit, threads)

    def __enter__(self) -> Run:
        return self.run

    def __exit__(self, *error: object) -> None:
        if self.mine:
            self.run.close()


# --- the pass -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Layer:
    """One image: the rows that it counts, and what they count."""

    classifier: Classifier | None
    terms: tuple[Term, ...]

    @property
    def tables(self) -> set[str]:
        """The tables that it reads."""
        return {table for term in self.terms for table in term.tables} | set(self.classifier.tables if self.classifier else ())


@dataclass(frozen=True)
class _Film:
    """Where contributions fall."""

    width: int
    height: int
    filter: ReconstructionFilter
    table: F64

    @property
    def reach(self) -> int:
        """How many rows of pixels beyond its own a path may reach."""
        return 0 if self.filter.name == "box" else int(np.ceil(self.filter.radius))


def _resolve(run: Run, expressions: list[Expression | None], threads: int | None) -> list[Selected]:
    settings = run.settings
    run.require_paths("no image can be made of them")
    layers = [_Layer(Classifier(run, given) if given else None, terms_of(run, given)) for given in expressions]
    filter = reconstruction_filter(settings["filter"])
    film = _Film(settings["width"], settings["height"], filter, filter.table().astype(np.float64))
    threads = threads or run.threads or cores()
    divisor = _divisor(run) * settings["keep"]
    found: list[Selected] = []
    at_once = _layers_at_once(run, film, threads)
    for first in range(0, len(layers), at_once):
        sums, rows = _sum(run, film, layers[first : first + at_once], threads)
        found += [Selected((layer / divisor).astype(np.float32), count) for layer, count in zip(sums, rows)]
    return found


def _layers_at_once(run: Run, film: _Film, threads: int) -> int:
    """How many images one pass may sum: all of them, unless the film is very large."""
    whole = film.width * film.height
    band = run.manifest["shards"]["walks"] + 2 * (1 + film.reach) * film.width if _is_banded(run, film) else whole
    return max(1, _MEMORY // (24 * (whole + (threads + 2) * min(band, whole))))


def _is_banded(run: Run, film: _Film) -> bool:
    """Whether a shard reaches but a band of the film: camera walks start in the order of the pixels."""
    return run.settings["method"] == "path" and bool(run.manifest["shards"]["walks"] < film.width * film.height)


def _sum(run: Run, film: _Film, layers: list[_Layer], threads: int) -> tuple[F64, list[int]]:
    """Sums of contributions by pixel, float64 (images, height, width, 3), and how many paths each image counts."""
    total, counts = np.zeros((len(layers), film.height, film.width, 3)), [0] * len(layers)
    files = run.files(*set[str]().union(*(layer.tables for layer in layers)))
    for first, rows, counted in map_shards(files, functools.partial(_sum_shard, film, layers, _is_banded(run, film)), threads):
        total[:, first : first + rows.shape[1]] += rows
        counts = [count + more for count, more in zip(counts, counted)]
    return total, counts


def _sum_shard(film: _Film, layers: list[_Layer], banded: bool, found: Iterator[Piece]) -> Rows:
    """What one shard adds; ``banded``: it reaches but a band of the film."""
    there = list(found)
    first, last = _band(film, layers, there) if banded else (0, film.height)
    sums = np.zeros((len(layers), last - first, film.width, 3))
    weights, counts = np.zeros(int(2 * film.filter.radius) + 1), [0] * len(layers)
    while there:
        piece = there.pop(0)
        for i, layer in enumerate(layers):
            counts[i] += sum(_splat(film, layer, term, piece, first, weights, sums[i]) for term in layer.terms)
        piece.forget()
    return first, sums, counts


def _band(film: _Film, layers: list[_Layer], found: list[Piece]) -> tuple[int, int]:
    """The film's rows that some paths may reach: the first, and the one past the last."""
    tables = sorted({term.table for layer in layers for term in layer.terms})
    heights = [(float(y.min()), float(y.max())) for piece in found for table in tables if len(y := _column(piece, table, "raster_y"))]
    if not heights:
        return 0, 0
    first = np.clip(min(low for low, _ in heights) - film.reach, 0, film.height)
    last = np.clip(max(high for _, high in heights) + film.reach + 1, first, film.height)
    return int(first), int(last)


def _splat(film: _Film, layer: _Layer, term: Term, piece: Piece, first: int, weights: F64, sums: F64) -> int:
    """Add the matched rows of one piece and table; how many they are."""
    if not piece.rows(term.table):
        return 0
    chosen = layer.classifier.select(piece, term.table) if layer.classifier else np.ones(piece.rows(term.table), np.bool_)
    chosen = term.select(piece, chosen)
    r, g, b = term.values(piece)
    x, y = _column(piece, term.table, "raster_x"), _column(piece, term.table, "raster_y")
    if film.filter.name == "box":
        splat_box(chosen, x, y, r, g, b, first, sums)
    else:
        splat_filter(chosen, x, y, r, g, b, first, film.table, np.float64(film.filter.radius), weights, sums)
    return int(np.count_nonzero(chosen))


def _column(piece: Piece, table: str, name: str) -> F32:
    return piece.column(table, name) if piece.rows(table) else np.zeros(0, np.float32)


def _divisor(run: Run) -> F64:
    """What divides the sums: the passes; else the weights of all camera walks, which the film kept, or the filter's integral for light walks."""
    filter, passes = reconstruction_filter(run.settings["filter"]), run.settings["passes"]
    if filter.name == "box":
        return np.array(float(passes))
    if run.settings["method"] != "path":
        return np.array(passes * filter.integral**2)
    file = run.path / "film" / "sum.npy"
    try:
        film = np.load(file, mmap_mode="r", allow_pickle=False)
        weights = np.array(film[: run.settings["height"], : run.settings["width"], 3:], np.float64)
    except (OSError, ValueError, IndexError) as error:
        raise RunError(f"`{file}`, which holds the weights of the run's filter, cannot be read ({error}): run the job again with --resume") from None
    return np.where(weights != 0, weights, 1.0)
