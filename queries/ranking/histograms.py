"""Flux-weighted histograms over classes of paths (thesis 9.4.2), of a region and of the ring around it."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.ranking.places import INSIDE, RING, Places
from queries.run import Run
from queries.shards import Piece, map_shards
from queries.statistics import Moments, Units
from queries.tally import Tally

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]


class Histogram(NamedTuple):
    """``sums``: float64 (classes, units), luminance of recorded contributions; ``moments``: over walks, by class."""

    sums: F64
    moments: Moments

    def of(self, classes: npt.NDArray[np.int64]) -> "Histogram":
        """Some classes of it."""
        return Histogram(self.sums[classes], Moments(*(part[classes] for part in self.moments)))

    @property
    def total(self) -> F64:
        """Sums of all classes: float64 (1, units)."""
        return np.asarray(self.sums.sum(axis=0, keepdims=True))


def histograms(
    run: Run, count: int, number: Callable[[Piece], I32], units: Units, places: Places | None, threads: int | None
) -> tuple[Histogram, Histogram]:
    """The histogram of the paths inside a region and that of those in its ring; without places, all paths are inside.

    ``number`` gives each path's class, 0 … ``count`` - 1. The same bits on any number of threads.
    """

    def work(pieces: Iterator[Piece]) -> Tally:
        tally = Tally(2 * count, units)
        for piece in pieces:
            tally.add(piece, _groups(piece, count, number, places))
        return tally.compact()

    whole = Tally(2 * count, units)
    for part in map_shards(run.shard_files, work, threads):
        whole.merge(part)
    all_classes = Histogram(whole.sums, whole.moments)
    return all_classes.of(np.arange(count)), all_classes.of(np.arange(count, 2 * count))


def _groups(piece: Piece, count: int, number: Callable[[Piece], I32], places: Places | None) -> I32:
    """Classes of paths inside, then those of paths in the ring; -1 for paths elsewhere. int32 (rows)."""
    if places is None:
        return number(piece)
    place = places.of(piece)
    if not place.any():
        return np.full(len(place), -1, np.int32)
    classes = number(piece)
    return np.where(place == INSIDE, classes, np.where(place == RING, classes + np.int32(count), np.int32(-1))).astype(np.int32)
