"""Images resolved from tables: contributions of paths, filtered as the film does, summed by pixel.

The film positions of all walks are recorded, so any reconstruction filter may be used, without rendering again: ``filter`` names one of
``renderer.filters.FILTERS``, None is the run's own. Any number of images come of one pass over the tables. Each shard's rows are summed by
themselves and the sums added in the shards' order, so the same bits come out on any number of threads.
"""

import functools
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.classify import Classifier
from queries.film import FilteredFilm, divisor, film_of, is_banded
from queries.kernels.splat import splat_box, splat_filter
from queries.lpe import Expression
from queries.run import MEMORY_LIMIT, Run, open_run
from queries.shards import Piece, cores, map_shards
from queries.values import Term, terms_of

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Rows = tuple[int, F64, list[int]]  # the first film row of some, their sums: float64 (images, rows, width, 3), and how many paths each image counts
_MEMORY = 1 << 29  # bytes of sums that a pass may hold: with more and larger images, tables are gone through again


@dataclass(frozen=True)
class Selected:
    """What an expression selects: ``image``, float32 (height, width, 3), linear; ``rows``: how many paths (or blocked connections) it counts."""

    image: F32
    rows: int


def images(
    run: Run | str | os.PathLike[str], expressions: Mapping[str, Expression | str], threads: int | None = None, filter: str | None = None
) -> dict[str, F32]:
    """The images of the paths that expressions match, by name: float32 (height, width, 3), linear.

    Expressions given as text are compiled with the run's names. Images of expressions that partition the paths sum to ``image``; prefixes change
    what a path counts (``queries.values``). Raises ``ExpressionError`` for a bad expression, ``QueryError`` where the run lacks what one needs.
    """
    return {name: found.image for name, found in select(run, expressions, threads, filter).items()}


def select(
    run: Run | str | os.PathLike[str], expressions: Mapping[str, Expression | str | None], threads: int | None = None, filter: str | None = None
) -> dict[str, Selected]:
    """The same with numbers of paths; None stands for all paths."""
    with Opened(run, threads) as opened:
        compiled = {name: opened.compile(given) if isinstance(given, str) else given for name, given in expressions.items()}
        return dict(zip(compiled, _resolve(opened, list(compiled.values()), threads, filter)))


def aov_image(
    run: Run | str | os.PathLike[str],
    expression: Expression | str,
    threads: int | None = None,
    memory_limit: str = MEMORY_LIMIT,
    filter: str | None = None,
) -> F32:
    """The image of the paths that one expression matches; see ``images``."""
    with Opened(run, threads, memory_limit) as opened:
        return _resolve(opened, [opened.compile(expression) if isinstance(expression, str) else expression], threads, filter)[0].image


def image(run: Run | str | os.PathLike[str], threads: int | None = None, memory_limit: str = MEMORY_LIMIT, filter: str | None = None) -> F32:
    """The image of all recorded paths; see ``images``."""
    with Opened(run, threads, memory_limit) as opened:
        return _resolve(opened, [None], threads, filter)[0].image


class Opened:
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
class Layer:
    """One image: the rows that it counts, and what they count."""

    classifier: Classifier | None
    terms: tuple[Term, ...]

    @classmethod
    def of(cls, run: Run, expression: Expression | None) -> "Layer":
        """What an expression selects in a run; None: all paths."""
        return cls(Classifier(run, expression) if expression else None, terms_of(run, expression))

    @property
    def tables(self) -> set[str]:
        """The tables that it reads."""
        return {table for term in self.terms for table in term.tables} | set(self.classifier.tables if self.classifier else ())

    def chosen(self, piece: Piece, term: Term) -> npt.NDArray[np.bool_]:
        """The rows of a term's table that count: bool (rows)."""
        rows = self.classifier.select(piece, term.table) if self.classifier else np.ones(piece.rows(term.table), np.bool_)
        return term.select(piece, rows)


def _resolve(run: Run, expressions: list[Expression | None], threads: int | None, filter: str | None) -> list[Selected]:
    run.require_paths("no image can be made of them")
    layers = [Layer.of(run, given) for given in expressions]
    film = film_of(run, filter)
    threads = threads or run.threads or cores()
    below = divisor(run, film, threads)
    found: list[Selected] = []
    at_once = _layers_at_once(run, film, threads)
    for first in range(0, len(layers), at_once):
        sums, rows = _sum(run, film, layers[first : first + at_once], threads)
        found += [Selected((layer / below).astype(np.float32), count) for layer, count in zip(sums, rows)]
    return found


def _layers_at_once(run: Run, film: FilteredFilm, threads: int) -> int:
    """How many images one pass may sum: all of them, unless the film is very large."""
    whole = film.width * film.height
    band = run.manifest["shards"]["walks"] + 2 * (1 + film.reach) * film.width if is_banded(run, film) else whole
    return max(1, _MEMORY // (24 * (whole + (threads + 2) * min(band, whole))))


def _sum(run: Run, film: FilteredFilm, layers: list[Layer], threads: int) -> tuple[F64, list[int]]:
    """Sums of contributions by pixel, float64 (images, height, width, 3), and how many paths each image counts."""
    total, counts = np.zeros((len(layers), film.height, film.width, 3)), [0] * len(layers)
    files = run.files(*set[str]().union(*(layer.tables for layer in layers)))
    for first, rows, counted in map_shards(files, functools.partial(_sum_shard, film, layers, is_banded(run, film)), threads):
        total[:, first : first + rows.shape[1]] += rows
        counts = [count + more for count, more in zip(counts, counted)]
    return total, counts


def _sum_shard(film: FilteredFilm, layers: list[Layer], banded: bool, found: Iterator[Piece]) -> Rows:
    """What one shard adds; ``banded``: it reaches but a band of the film."""
    there = list(found)
    first, last = _band(film, layers, there) if banded else (0, film.height)
    sums = np.zeros((len(layers), last - first, film.width, 3))
    weights, counts = film.scratch, [0] * len(layers)
    while there:
        piece = there.pop(0)
        for i, layer in enumerate(layers):
            counts[i] += sum(_splat(film, layer, term, piece, first, weights, sums[i]) for term in layer.terms)
        piece.forget()
    return first, sums, counts


def _band(film: FilteredFilm, layers: list[Layer], found: list[Piece]) -> tuple[int, int]:
    """The film's rows that some paths may reach: the first, and the one past the last."""
    tables = sorted({term.table for layer in layers for term in layer.terms})
    return film.band([_column(piece, table, "raster_y") for piece in found for table in tables])


def _splat(film: FilteredFilm, layer: Layer, term: Term, piece: Piece, first: int, weights: F64, sums: F64) -> int:
    """Add the matched rows of one piece and table; how many they are."""
    if not piece.rows(term.table):
        return 0
    chosen = layer.chosen(piece, term)
    r, g, b = term.values(piece)
    x, y = _column(piece, term.table, "raster_x"), _column(piece, term.table, "raster_y")
    if film.filter.name == "box":
        splat_box(chosen, x, y, r, g, b, first, sums)
    else:
        splat_filter(chosen, x, y, r, g, b, first, film.table, np.float64(film.filter.radius), weights, sums)
    return int(np.count_nonzero(chosen))


def _column(piece: Piece, table: str, name: str) -> F32:
    return piece.column(table, name) if piece.rows(table) else np.zeros(0, np.float32)
