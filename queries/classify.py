"""Which paths of a run an expression matches, piece by piece.

An expression that asks for events and objects alone is decided by words, of which there are few (``queries.by_words``); one that asks for
places is folded over the vertices of every path (``queries.by_vertices``).
"""

import functools
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from queries.by_vertices import VertexMatcher
from queries.by_words import WordMatcher
from queries.errors import QueryError
from queries.lpe import Expression
from queries.run import Run
from queries.shards import Piece, map_shards
from queries.symbols import Symbols

Chosen = npt.NDArray[np.bool_]


class Classifier:
    """An expression made ready for the paths of one run. Threads may share it."""

    def __init__(self, run: Run, expression: Expression) -> None:
        self.expression = expression
        symbols = Symbols(run, expression)
        self._matcher: VertexMatcher | WordMatcher = (VertexMatcher if symbols.places else WordMatcher)(run, expression, symbols)

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that pieces must have, beside that of the paths."""
        return self._matcher.tables

    def select(self, piece: Piece, table: str = "paths") -> Chosen:
        """Whether the expression matches each row of ``table`` (paths or occluded): bool (rows), not to be changed."""
        if not piece.rows(table):
            return np.zeros(0, np.bool_)
        return self._matcher.select(piece, table)


def select_all(
    run: Run, expression: Expression, table: str = "paths", threads: int | None = None, check: Callable[[], None] | None = None
) -> list[Chosen]:
    """``Classifier.select`` for the whole run: one array for each shard, in order. Memory: a byte for each row.

    ``check`` is called before each piece, by any thread, and may raise.
    """
    if table not in run.tables:
        raise QueryError(f"`{run.path}` recorded no `{table}`: record them, as in `record: {{keep: all, occluded: true}}`")
    classifier = Classifier(run, expression)
    work = functools.partial(_select_shard, classifier, table, check)
    return list(map_shards(run.files(table, *classifier.tables), work, threads or run.threads))


def _select_shard(classifier: Classifier, table: str, check: Callable[[], None] | None, found: Iterator[Piece]) -> Chosen:
    parts = [np.zeros(0, np.bool_)]
    for piece in found:
        if check:
            check()
        parts.append(classifier.select(piece, table))
        piece.forget()
    return np.concatenate(parts)
