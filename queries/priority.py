"""Samples of bounded size, drawn in one pass over weighted rows, from which any subset's sum can be estimated without bias.

Each row has a uniform number u in (0, 1], a hash of the seed and of what names the row, and so does not depend on the order in which rows
are met. Its priority is q = w/u; the rows of highest priority are the sample (duffield2007). With threshold tau, the highest priority that is
not in the sample, max(w, tau) estimates each sampled row's w, and 0 that of the others: the estimates are unbiased and uncorrelated.
With equal weights this is a uniform sample without replacement, as a reservoir gives (vitter1985, efraimidis2006).
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.kernels.luminance import BLUE, GREEN, RED
from queries.kernels.priority import high_priorities

Array = npt.NDArray[np.generic]
Chosen = npt.NDArray[np.bool_]
F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
U64 = npt.NDArray[np.uint64]


@dataclass(frozen=True)
class Candidates:
    """Rows that a sample may be made of: ``priority``, float64 (n); ``owner``, ``path``: their names; ``shard``, ``row``: where they stand."""

    priority: F64
    owner: U64
    path: I64
    shard: I64
    row: I64

    def __len__(self) -> int:
        """How many rows there are."""
        return len(self.priority)

    def take(self, rows: Array) -> "Candidates":
        """Some of them, by their numbers or as a mask."""
        return Candidates(self.priority[rows], self.owner[rows], self.path[rows], self.shard[rows], self.row[rows])

    def best(self, most: int) -> "Candidates":
        """The ``most`` of highest priority, in any order. Of equal ones, those of the first walks, and then of the first paths."""
        if len(self) <= most:
            return self
        least = np.partition(self.priority, len(self) - most)[len(self) - most]
        found = self.take(self.priority >= least)
        return found if len(found) == most else found.take(np.lexsort((found.path, found.owner, -found.priority))[:most])


def joined(parts: Iterable[Candidates]) -> Candidates:
    """All candidates of some parts."""
    given = list(parts)
    if not given:
        return Candidates(np.zeros(0), np.zeros(0, np.uint64), *(np.zeros(0, np.int64) for _ in range(3)))
    priority, owner, path, shard, row = (
        np.concatenate([getattr(part, name) for part in given]) for name in ("priority", "owner", "path", "shard", "row")
    )
    return Candidates(priority, owner, path, shard, row)


class Draw:
    """The rows of highest priority among those that were offered, ``most`` of them. ``seed``: any integer."""

    def __init__(self, most: int, seed: int, least: float = 0.0) -> None:
        self._most, self._seed, self.least = most, np.uint64(seed % 2**64), least
        self._kept: list[Candidates] = []
        self._count = 0

    def offer(self, weight: F64, owner: npt.NDArray[np.unsignedinteger], path: npt.NDArray[np.uint16], shard: int, first: int) -> None:
        """Offer rows, of which those of weight 0 are never drawn. ``first``: the first one's number in the shard."""
        rows, priority = np.empty(len(weight), np.int64), np.empty(len(weight))
        rows = rows[: high_priorities(owner, path, weight, self._seed, self.least, rows, priority)]
        names = owner[rows].astype(np.uint64), path[rows].astype(np.int64)
        self.add(Candidates(priority[: len(rows)].copy(), *names, np.full(len(rows), shard), first + rows))

    def add(self, more: Candidates) -> None:
        """Take candidates in: those of another draw with the same seed, or a part of them."""
        self._kept.append(more)
        self._count += len(more)
        if self._count >= 2 * self._most:
            # What is below the least of the best can be passed over from now on
            self.least = max(self.least, float(self.best().priority.min()))

    def best(self) -> Candidates:
        """The rows drawn so far."""
        best = joined(self._kept).best(self._most)
        self._kept, self._count = [best], len(best)
        return best


def by_luminance(contribution: F32) -> F64:
    """The luminance of contributions, float32 (n, 3); 0 where it is not finite or below 0."""
    r, g, b = (contribution[:, channel].astype(np.float64) for channel in range(3))
    weight = r * RED + g * GREEN + b * BLUE
    weight[~(np.isfinite(weight) & (weight > 0))] = 0.0
    return weight
