"""Sums of contributions by class and by the estimator's independent units, gathered a piece at a time."""

import numpy as np
import numpy.typing as npt

from queries.kernels.luminance import LUMINANCE
from queries.kernels.tally import tally
from queries.shards import Piece
from queries.statistics import Moments, Units

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]


class Tally:
    """Sums of a run, or of a part of it.

    ``sums``: float64 (classes, units), recorded contributions; ``classes``: what ``compact`` keeps of them, None for all.
    """

    def __init__(self, classes: int, units: Units) -> None:
        self.units = units
        self.classes: npt.NDArray[np.int64] | None = None
        self.sums: F64 = np.zeros((classes, units.count))
        self._moments: F64 = np.zeros((classes, len(Moments._fields)))

    @property
    def moments(self) -> Moments:
        """Sums over walks."""
        return Moments(*self._moments.T)

    def add(self, piece: Piece, classes: I32, table: str = "paths", weights: tuple[float, float, float] = LUMINANCE) -> None:
        """Add the rows of a table: ``classes``, int32 (rows), -1 for rows that are left out; ``weights`` of red, green and blue."""
        r, g, b = (piece.column(table, f"contribution_{channel}") for channel in "rgb")
        tally(piece.owner(table), classes, r, g, b, weights, self.units.rule, self.sums, self._moments)

    def compact(self) -> "Tally":
        """The same without the classes that have no rows: what waits to be merged should be small."""
        self.classes = np.flatnonzero(self._moments[:, 0])
        self.sums, self._moments = self.sums[self.classes], self._moments[self.classes]
        return self

    def merge(self, other: "Tally") -> None:
        """Add another part's sums. Parts are merged in the shards' order: sums then have the same bits each time."""
        at = slice(None) if other.classes is None else other.classes
        self.sums[at] += other.sums
        self._moments[at, :-1] += other._moments[:, :-1]
        self._moments[at, -1] = np.maximum(self._moments[at, -1], other._moments[:, -1])
