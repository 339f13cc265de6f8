"""The orders in which classes are ranked (thesis 9.4.2), and the figures that each is based on.

- contribution: flux in the region, descending.
- discrimination: how special a class is to the region: the lower confidence bound (95 %, one-sided) of its share of the flux inside over
  its share of the flux in the surrounding ring, descending. Classes of too few walks inside come last, those of a single one last of all. Few
  walks in the ring say little of its flux there, and none say nothing of its error: below 30 walks, an upper bound stands for that flux, namely
  Poisson's for the number of walks (3 for none: the rule of three) times the mean flux of the class's walks.
- ratio: the class's flux in the region over that in the outer region (region and ring), descending.
- literal: outer over inner, descending, as the thesis's text has it; this puts the least special class first.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import stats

from queries.ranking.histograms import Histogram
from queries.statistics import Estimate, Units

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
ORDERS = ("contribution", "discrimination", "ratio", "literal")
LEVEL = 0.95  # of one-sided bounds
RING_SUPPORT = 30.0  # walks in the ring from which its flux is taken as found


class Comparison(NamedTuple):
    """What a class is like inside, compared with outside. ``ratio``: the figure that an order is named for; ``lower``: its bound, NaN where unknown.

    ``outer``: flux in region and ring; ``ring_share``: of the flux in the ring; ``supported``: bool, walks inside suffice for a ranking.
    """

    outer: Estimate
    ring_share: Estimate
    ratio: Estimate
    lower: F64
    supported: npt.NDArray[np.bool_]


def compare(by: str, units: Units, inside: Histogram, ring: Histogram, totals: tuple[F64, F64], minimum_support: int) -> Comparison:
    """Compare classes inside with the ring. ``totals``: sums of all classes (1, units), inside and in the ring."""
    outer = inside.sums + ring.sums
    whole_inside, whole_ring = (np.broadcast_to(total, outer.shape) for total in totals)
    ring_share = units.ratio(ring.sums, whole_ring)
    everything = np.ones(len(outer), np.bool_)
    unknown = np.full(len(outer), np.nan)
    if by == "discrimination":
        supported = inside.moments.walks >= minimum_support
        ratio = units.jackknife(_ratio_of_shares, inside.sums, whole_inside, ring.sums, whole_ring)
        cautious = units.jackknife(_log_ratio_of_shares, inside.sums, whole_inside, bounded_ring(units, inside, ring), whole_ring)
        return Comparison(units.total(outer), ring_share, ratio, np.exp(cautious.lower(LEVEL)), supported)
    ratio = units.ratio(inside.sums, outer) if by == "ratio" else units.ratio(outer, inside.sums)
    return Comparison(units.total(outer), ring_share, ratio, unknown, everything)


def bounded_ring(units: Units, inside: Histogram, ring: Histogram) -> F64:
    """The ring's sums (classes, units), where few walks are there an upper bound of them, evenly over the units."""
    walks = ring.moments.walks
    mean = (inside.moments.x + ring.moments.x) / np.maximum(inside.moments.walks + walks, 1.0)
    most = stats.chi2.ppf(LEVEL, 2.0 * (walks + 1.0)) / 2.0  # the Poisson mean under which so few, or fewer, have a chance of 1 - LEVEL
    bound = np.maximum(most * mean, ring.moments.x)
    return np.where((walks < RING_SUPPORT)[:, None], bound[:, None] * units.sizes, ring.sums)


def order_key(by: str, units: Units, flux: Estimate, comparison: Comparison | None) -> F64:
    """What classes of one tier are sorted by, descending: float64 (classes); -inf where it is not known."""
    if comparison is None:
        return flux.value
    key = comparison.ratio.value
    if by == "discrimination":
        # Without standard errors there are no bounds, and the plain ratio has to do
        key = comparison.ratio.value if units.reason else comparison.lower
        key = np.where(np.isnan(key) & bool(units.reason), np.inf, key)  # nothing in the ring: infinitely special, for all that is known
    return np.where(np.isnan(key), -np.inf, key)


def tiers(inside: Histogram, comparison: Comparison | None) -> I64:
    """What classes are sorted by before all else, ascending: int64 (classes). 0: supported; 1: not; 2: not, and seen once."""
    if comparison is None:
        return np.zeros(len(inside.sums), np.int64)
    return np.where(comparison.supported, 0, np.where(inside.moments.walks > 1, 1, 2))


def _ratio_of_shares(inside: F64, whole_inside: F64, ring: F64, whole_ring: F64) -> F64:
    numerator, denominator = inside * whole_ring, whole_inside * ring
    return np.where(denominator != 0, numerator / denominator, np.nan)


def _log_ratio_of_shares(inside: F64, whole_inside: F64, ring: F64, whole_ring: F64) -> F64:
    return np.log(_ratio_of_shares(inside, whole_inside, ring, whole_ring))
