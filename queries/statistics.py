"""Standard errors over an estimator's independent units, and when to distrust them.

Rows of paths are no independent samples: paths of one walk share its vertices, and Sobol' walks of one pixel fill its square together.
A unit is a set of walks whose sum is independent of, and as good an estimate as, that of any other unit of its size:

- ``sobol``: replicates, passes of one scrambling (pass modulo replicates);
- ``independent``, 8 passes or more: passes (pass modulo 64, where there are more), each of which has one walk for every pixel;
- ``independent``, fewer passes: 64 groups of walks, dealt from each block of 64 consecutive ones in an order of its own. They take all
  walks of a block for identically distributed, so the differences between its pixels count as noise: an upper bound.

All errors come from leaving out one unit at a time (the jackknife for units of unequal sizes, busing1999), so that ratios and other
functions of several sums need no formulas of their own, and sums that share walks need no covariances.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from queries.errors import QueryError
from queries.kernels.tally import UnitRule, units_of
from queries.run import Run

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

MOST_UNITS = 64  # of passes or walks: more would make errors hardly more precise, and sums larger
FEWEST_PASSES = 8  # that serve as units: with fewer, errors would be too uncertain
LARGEST_SHARE = 0.1  # of a class's sum of squares that one walk may carry
FEWEST_SQUARES = 20.0  # effective samples that the sum of squares must rest on


class Estimate(NamedTuple):
    """Estimates: ``value`` and standard ``error``, float64 of one shape; errors are NaN where they cannot be known. ``dof`` of the errors."""

    value: F64
    error: F64
    dof: int

    def lower(self, level: float = 0.95) -> F64:
        """One-sided lower confidence bounds, by Student's t; NaN where the error is."""
        if self.dof < 1:
            return np.full_like(self.value, np.nan)
        return np.asarray(self.value - stats.t.ppf(level, self.dof) * self.error, np.float64)


@dataclass(frozen=True)
class Units:
    """The independent units of a run.

    ``kind``: "replicates", "passes" or "walks"; ``sizes``: float64 (units), their shares of all walks; ``scale``: what sums of recorded
    contributions are multiplied by to become sums over the image's pixels; ``reason``: why no standard error can be known, "" where it can.
    """

    kind: str
    rule: UnitRule
    sizes: F64
    scale: float
    reason: str = ""

    @classmethod
    def of_run(cls, run: Run) -> "Units":
        """The units of a whole run. Raises QueryError for a run of which only some shards are open, or that recorded nothing."""
        settings, shards = run.settings, run.manifest["shards"]["count"]
        if settings["keep"] <= 0:
            raise QueryError(f"`{run.path}` recorded no paths (record.keep is none), so nothing can be told of them: record some, as in `keep: 0.1`")
        if len(run.shard_files) != shards:
            raise QueryError(f"expected a whole run, found {len(run.shard_files)} of {shards} shards open: open `{run.path}` without `shards`")
        passes, per_pass = settings["passes"], settings["width"] * settings["height"]
        scale = 1.0 / (settings["keep"] * passes)
        if settings.get("sampler", "independent") == "sobol":
            replicates = settings.get("replicates", 1)
            count = min(passes, replicates)
            lacking = "one replicate only: set `replicates` to 2 or more, and `samples` to as many or more" if count < 2 else ""
            return cls("replicates", UnitRule(per_pass, replicates, 0), _dealt(passes, count), scale, lacking)
        if passes >= FEWEST_PASSES:
            count = min(passes, MOST_UNITS)
            return cls("passes", UnitRule(per_pass, count, 0), _dealt(passes, count), scale)
        walks = passes * per_pass
        count = min(walks, MOST_UNITS)
        rule = UnitRule(1, count, 1)
        tail = np.bincount(units_of(np.arange(walks - walks % count, walks, dtype=np.uint64), rule), minlength=count)
        return cls("walks", rule, (walks // count + tail) / walks, scale, "one walk only" if walks < 2 else "")

    @property
    def count(self) -> int:
        """Number of units."""
        return len(self.sizes)

    @property
    def dof(self) -> int:
        """Degrees of freedom of standard errors."""
        return self.count - 1

    def of_walks(self, walk: npt.NDArray[np.unsignedinteger]) -> I32:
        """The unit of each walk: int32."""
        return units_of(walk, self.rule)

    def total(self, sums: F64) -> Estimate:
        """Sums (…, units) of recorded contributions as sums over the image's pixels: estimates of shape (…)."""
        return self.jackknife(lambda total: total * self.scale, sums)

    def ratio(self, numerator: F64, denominator: F64) -> Estimate:
        """The ratio of two sums (…, units), NaN where the denominator is 0."""
        return self.jackknife(_quotient, numerator, denominator)

    def log_ratio(self, numerator: F64, denominator: F64) -> Estimate:
        """The logarithm of that ratio; its error is NaN where a single unit makes it infinite."""
        return self.jackknife(lambda a, b: np.log(_quotient(a, b)), numerator, denominator)

    def jackknife(self, function: Callable[..., F64], *sums: F64) -> Estimate:
        """A function of sums over all units: ``sums`` (…, units) each, ``function`` of their totals, elementwise, so of any leading shape."""
        totals = [part.sum(axis=-1) for part in sums]
        with np.errstate(divide="ignore", invalid="ignore"):
            value = function(*totals)
            if self.reason or self.count < 2:
                return Estimate(value, np.full_like(value, np.nan), 0)
            # Totals as they would be without each unit, scaled up to the whole
            without = function(*((total[..., None] - part) / (1.0 - self.sizes) for total, part in zip(totals, sums)))
            rest = 1.0 - self.sizes
            center = self.count * value - (rest * without).sum(axis=-1)
            pseudo = (value[..., None] - rest * without) / self.sizes
            squares = (pseudo - center[..., None]) ** 2 * (self.sizes / rest)
            error = np.sqrt(squares.mean(axis=-1))
        return Estimate(value, np.where(np.isfinite(error), error, np.nan), self.dof)


def _dealt(passes: int, count: int) -> F64:
    """The shares of passes that are dealt to units in turn."""
    return ((passes - np.arange(count) + count - 1) // count) / passes


def _quotient(numerator: F64, denominator: F64) -> F64:
    return np.where(denominator != 0, numerator / denominator, np.nan)


# --- whether variance can be trusted -------------------------------------------------------------------------------


class Moments(NamedTuple):
    """Sums over the walks of each class, float64 (classes). x is what one walk's rows of the class add up to.

    ``rows``, ``walks``: how many; ``x``, ``x2``, ``x4``: sums of x, its square and its fourth power; ``largest``: the largest x.
    """

    rows: F64
    walks: F64
    x: F64
    x2: F64
    x4: F64
    largest: F64


def effective_samples(moments: Moments) -> F64:
    """How many walks of equal x would have the same relative variance (kish1965): (sum x)² / sum x²; 0 where there is nothing."""
    return _over(moments.x**2, moments.x2)


def effective_squares(moments: Moments) -> F64:
    """The same of squares, which estimates of variance are sums of: their own relative error is 1 / sqrt of this."""
    return _over(moments.x2**2, moments.x4)


def verdicts(moments: Moments) -> list[str]:
    """Why the variance of a class's sum cannot be trusted; "" where it can.

    Where few walks carry the sum of squares, the estimate of variance has seen too few of the values that make it up: it has large
    errors itself, mostly downward. Distrusted: fewer effective squares than 20 (the variance has a relative error above 22 %), or one
    walk with more than 10 % of the sum of squares. Of samples with a finite fourth moment, both go away with their number; of tails
    without a variance (Pareto's index below 2), neither does.
    """
    share = _over(moments.largest**2, moments.x2)
    squares = effective_squares(moments)
    return [_verdict(*figures) for figures in zip(moments.walks.tolist(), share.tolist(), squares.tolist())]


def _verdict(walks: float, share: float, squares: float) -> str:
    if walks == 0:
        return "no walks"
    if share > LARGEST_SHARE:
        return f"one walk of {walks:,.0f} carries {share:.0%} of the squares"
    if squares < FEWEST_SQUARES:
        return f"{walks:,.0f} walks count as {squares:.0f} for the variance"
    return ""


def _over(numerator: F64, denominator: F64) -> F64:
    return np.where(denominator > 0, numerator / np.where(denominator > 0, denominator, 1.0), 0.0)
