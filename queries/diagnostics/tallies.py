"""Energy and its error of numbered groups of paths: what the diagnostics by class, depth and technique have in common."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.diagnostics.answers import F64, pixels_of
from queries.run import Run
from queries.shards import Piece, map_shards
from queries.statistics import Moments, Units, effective_samples, verdicts
from queries.tally import Tally

I32 = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Energies:
    """Of each group (float64, groups): mean luminance of the image, its standard error (NaN where it is not known), and moments of walks.

    ``reasons``: why a group's variance cannot be trusted, "" where it can; then ``trusted_error`` is NaN.
    ``units``: how many independent units the errors rest on.
    """

    energy: F64
    error: F64
    moments: Moments
    reasons: list[str]
    units: int

    @property
    def trusted_error(self) -> F64:
        """The standard error where it can be trusted, else NaN."""
        return np.where([reason == "" for reason in self.reasons], self.error, np.nan)

    @property
    def effective(self) -> F64:
        """How many walks of equal value would have as much relative variance (kish1965)."""
        return effective_samples(self.moments)


def energies(run: Run, groups: int, number: Callable[[Piece], I32]) -> Energies:
    """Go through the paths once. ``number``: the group of each row of ``paths``, 0 … groups - 1, or -1 for none."""
    units = Units.of_run(run)

    def work(pieces: Iterator[Piece]) -> Tally:
        tally = Tally(groups, units)
        for piece in pieces:
            tally.add(piece, number(piece))
        return tally.compact()

    whole = Tally(groups, units)
    for part in map_shards(run.shard_files, work, run.threads):
        whole.merge(part)
    estimate = units.total(whole.sums)
    pixels = pixels_of(run)
    reasons = [units.reason or reason for reason in verdicts(whole.moments)]
    return Energies(estimate.value / pixels, estimate.error / pixels, whole.moments, reasons, units.count)


def shares(energy: F64) -> F64:
    """Each energy's share of their sum; NaN where that is zero."""
    total = energy.sum()
    return energy / total if total > 0 else np.full_like(energy, np.nan)
