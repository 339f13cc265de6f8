"""Which method shows pictures best, and on which display: in the place of the thesis's user studies (4.5.4), which a batch job cannot run.

Scores are means over images, and images differ. Intervals come from resampling the images (bootstrap), with the same resamples for all that are
compared, so that differences are paired. With few images a percentile interval is too narrow; its percentiles are moved out by what Student's t
asks for (hesterberg2015, the expanded percentile interval). Simulated with 6 to 8 images, it holds the true mean in 93 to 95 % of all cases where
scores are normal, and in 86 to 88 % where they are as skewed as lognormal ones of log-deviation 0.8; the plain interval does in 87 to 89 % and
78 to 82 %. Differences are not adjusted for how many are looked at.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyarrow as pa
from scipy import stats

from queries.diagnostics.answers import INTEGER, REAL, TEXT, Figure, answer
from queries.errors import QueryError

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

LEVEL = 0.95
RESAMPLES = 10_000
SEED = 0x5C1E1AB
ROUNDING = 1e-9  # of scores: differences below it are none
FEWEST_IMAGES = 6  # resamples lie between the least and the greatest image: of fewer, these two hold the middle in less than 95 % of all cases

COUNT = Figure(
    "images",
    INTEGER,
    f"how many images are behind it; intervals and verdicts are for images like these, and none come from fewer than {FEWEST_IMAGES}",
)
SCORE = (
    Figure("scielab", REAL, "S-CIELAB difference to the picture at full resolution, mean over the images"),
    Figure("low", REAL, "lower end of its 95 % interval, by resampling the images"),
    Figure("high", REAL, "upper end of its 95 % interval"),
)
INTERVAL = (
    Figure("difference_low", REAL, "lower end of the difference's 95 % interval, image by image"),
    Figure("difference_high", REAL, "upper end of the difference's 95 % interval"),
    Figure("verdict", TEXT, "`better` or `worse` where the whole interval is on one side of 0, else `not told apart`"),
)
STABILITY = Figure("stability", REAL, "share of resamples of the images in which it has this rank")


def methods_ranked(scores: pa.Table, layout: str, against: str = "optimal") -> pa.Table:
    """The methods on one display, best first; equal ones share a rank. Differences are to the method ``against``: negative is better than it.

    Raises QueryError where scores have no such layout or method, or where an image lacks a method's.
    """
    columns = (
        Figure("rank", INTEGER, "1 is the least S-CIELAB difference; equal ones share a rank"),
        Figure("method", TEXT, "how the picture is filtered"),
        *SCORE,
        Figure("difference", REAL, f"S-CIELAB difference minus that of `{against}`, mean over the images: negative is better than it"),
        *INTERVAL,
        Figure("wins", REAL, f"share of the images on which it is better than `{against}`"),
        STABILITY,
        COUNT,
    )
    return _ranked(_pivot(scores, "method", {"layout": layout}), "method", against, columns)


def layouts_ranked(scores: pa.Table, method: str = "optimal", against: str | None = None) -> pa.Table:
    """The displays, by one method, best first (thesis, Fig. 4.13), as ``methods_ranked``; ``against``: ``rgb_stripe`` where it is there."""
    values = _pivot(scores, "layout", {"method": method})
    reference = against or ("rgb_stripe" if "rgb_stripe" in values.names else values.names[0])
    columns = (
        Figure("rank", INTEGER, "1 is the least S-CIELAB difference; equal ones share a rank"),
        Figure("layout", TEXT, f"the display, by the method `{method}`"),
        *SCORE,
        Figure("difference", REAL, f"S-CIELAB difference minus that of `{reference}`, mean over the images: negative is better than it"),
        *INTERVAL,
        Figure("wins", REAL, f"share of the images on which it is better than `{reference}`"),
        STABILITY,
        COUNT,
    )
    return _ranked(values, "layout", reference, columns)


def interval(values: F64) -> tuple[F64, F64]:
    """The expanded percentile interval of the mean of each row of ``values`` (rows, images); NaN with fewer images than ``FEWEST_IMAGES``."""
    n = values.shape[1]
    if n < FEWEST_IMAGES or not len(values):
        return np.full(len(values), np.nan), np.full(len(values), np.nan)
    tail = stats.norm.cdf(np.sqrt(n / (n - 1)) * stats.t.ppf(0.5 * (1.0 - LEVEL), n - 1))
    low, high = np.quantile(values @ _shares(n).T, [tail, 1.0 - tail], axis=1)
    return low, high


@dataclass(frozen=True, eq=False)
class _Values:
    """S-CIELAB of what is compared: ``names`` in alphabetical order, ``values`` float64 (names, images)."""

    names: list[str]
    values: F64

    @property
    def count(self) -> int:
        return len(self.values[0])

    def of(self, name: str) -> F64:
        return np.asarray(self.values[self.names.index(name)])


def _ranked(found: _Values, kind: str, against: str, columns: Sequence[Figure]) -> pa.Table:
    """One row for each name, by rank."""
    if against not in found.names:
        raise QueryError(f"nothing to compare with: there is no score of the {kind} `{against}`, only of {', '.join(found.names)}")
    mean = found.values.mean(axis=1)
    rank = _ranks(mean[:, None])[:, 0]
    resampled = _ranks(found.values @ _shares(found.count).T)
    difference = found.values - found.of(against)
    (low, high), (difference_low, difference_high) = interval(found.values), interval(difference)
    verdicts = [
        "reference" if name == against else _verdict(difference_low[i], difference_high[i], found.count) for i, name in enumerate(found.names)
    ]
    figures: Mapping[str, Sequence[object] | npt.NDArray[np.generic]] = {
        "rank": rank,
        kind: found.names,
        "scielab": mean,
        "low": low,
        "high": high,
        "difference": difference.mean(axis=1),
        "difference_low": difference_low,
        "difference_high": difference_high,
        "verdict": verdicts,
        "wins": (difference < -ROUNDING).mean(axis=1),
        "stability": (resampled == rank[:, None]).mean(axis=1),
        "images": np.full(len(rank), found.count),
    }
    order = np.argsort(rank, kind="stable")
    return answer(columns, {name: np.asarray(values)[order].tolist() for name, values in figures.items()})


def _pivot(scores: pa.Table, kind: str, fixed: Mapping[str, str]) -> _Values:
    """The scores of all names of a kind, image by image, where the other column is fixed."""
    rows = [row for row in scores.select(["layout", "image", "method", "scielab"]).to_pylist() if all(row[k] == v for k, v in fixed.items())]
    if not rows:
        raise QueryError(f"there are no scores of the {' and '.join(f'{k} `{v}`' for k, v in fixed.items())}")
    names, images = sorted({row[kind] for row in rows}), sorted({row["image"] for row in rows})
    by = {(row[kind], row["image"]): row["scielab"] for row in rows}
    if len(by) != len(rows):
        raise QueryError(f"an image has two scores of one {kind}: give each image a name of its own")
    missing = [(name, image) for name in names for image in images if by.get((name, image)) is None]
    if missing:
        raise QueryError(f"image `{missing[0][1]}` has no score of the {kind} `{missing[0][0]}`: means over unequal images cannot be compared")
    return _Values(names, np.array([[by[name, image] for image in images] for name in names], np.float64))


def _shares(images: int) -> F64:
    """In which shares the images are in each resample, float64 (RESAMPLES, images); always the same."""
    drawn = np.random.default_rng(SEED).integers(images, size=(RESAMPLES, images))
    counts = np.bincount((drawn + images * np.arange(RESAMPLES)[:, None]).ravel(), minlength=RESAMPLES * images)
    return counts.reshape(RESAMPLES, images) / images


def _ranks(means: F64) -> I64:
    """The rank of each row of (names, columns) within its column: 1 and how many are less, by more than rounding."""
    return np.asarray(1 + (means[None] < means[:, None] - ROUNDING).sum(axis=1))


def _verdict(low: float, high: float, images: int) -> str:
    if images < FEWEST_IMAGES:
        return "too few images"
    return "better" if high < -ROUNDING else "worse" if low > ROUNDING else "not told apart"
