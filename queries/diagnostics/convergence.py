"""Convergence: the image's mean luminance, and its error, as passes are added one by one (thesis 5.79; welford1962).

Passes of independent numbers are the units of the error: mean and variance over passes are updated by each new one. Sobol' passes are
not independent of each other, so there the error is that between replicates, each of which keeps a running mean of its own.
"""

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.classify import Classifier
from queries.diagnostics.answers import F64, INTEGER, REAL, TEXT, Figure, answer, pixels_of, require_paths
from queries.errors import QueryError
from queries.run import Run
from queries.shards import Piece, map_shards
from queries.statistics import Moments, Units, verdicts
from queries.tally import Tally

LEAST_POINTS = 4  # of a fitted slope

FIGURES = (
    Figure("passes", INTEGER, "samples of each pixel so far"),
    Figure("mean", REAL, "mean luminance of the image so far, of linear sRGB"),
    Figure("variance", REAL, "variance so far of one unit's mean luminance, squared luminance; NULL where it cannot be trusted"),
    Figure("units", INTEGER, "how many independent units there are so far"),
    Figure("unit", TEXT, "what a unit is: a pass, or a replicate of Sobol' passes"),
    Figure("standard_error", REAL, "standard error of the mean, luminance; NULL below two units and where it cannot be trusted"),
    Figure("relative_error", REAL, "standard error over mean; NULL as that is"),
    Figure("slope", REAL, "slope of log error against log passes, fitted to the errors so far: -1/2 for independent samples, steeper for Sobol'"),
    Figure("verdict", TEXT, "why the estimate of variance cannot be trusted so far; NULL where it can"),
)


class RunningMoments:
    """Mean and variance of numbers (each may be an array) that come one by one.

    >>> moments = RunningMoments()
    >>> for x in (1.0, 2.0, 6.0):
    ...     moments.add(x)
    >>> moments.count, float(moments.mean), float(moments.variance)
    (3, 3.0, 7.0)
    """

    def __init__(self) -> None:
        self.count = 0
        self.mean: F64 = np.zeros(())
        self._squares: F64 = np.zeros(())

    def add(self, number: npt.ArrayLike) -> None:
        """Take one more: the mean moves by 1 / count of what it is off (thesis 5.79)."""
        self.count += 1
        x = np.asarray(number, np.float64)
        off = x - self.mean
        self.mean = self.mean + off / self.count
        self._squares = self._squares + off * (x - self.mean)

    @property
    def variance(self) -> F64:
        """Unbiased variance; NaN below two numbers."""
        return self._squares / (self.count - 1) if self.count > 1 else np.full_like(self.mean, np.nan)


def convergence(run: Run, expression: str | None = None, most: int = 256) -> pa.Table:
    """Running mean, variance and error of the image's mean luminance (columns: ``FIGURES``), of the paths that ``expression`` selects or of all.

    At most about ``most`` rows, at rising numbers of passes, the last of them all. Raises ``QueryError``, ``ExpressionError``.
    """
    require_paths(run)
    if most < 1:
        raise QueryError(f"expected at least one row, found most = {most}")
    light, moments = _by_pass(run, expression)
    values = light / (pixels_of(run) * run.settings["keep"])
    sobol = run.settings.get("sampler") == "sobol"
    steps = _replicated(values, int(run.settings["replicates"])) if sobol else _independent(values)
    mean, variance, units, error = steps
    reasons = _reasons(moments, units)
    trusted = np.where([reason == "" for reason in reasons], 1.0, np.nan)
    variance, error = variance * trusted, error * trusted
    passes = np.arange(1, len(values) + 1)
    shown = _shown(len(values), most)
    relative = np.where(mean > 0, error / np.where(mean > 0, mean, 1.0), np.nan)
    return answer(
        FIGURES,
        {
            "passes": passes[shown],
            "mean": mean[shown],
            "variance": variance[shown],
            "units": units[shown],
            "unit": ["replicate" if sobol else "pass"] * len(shown),
            "standard_error": error[shown],
            "relative_error": relative[shown],
            "slope": (_slopes(passes, units, error) * trusted)[shown],
            "verdict": [reasons[i] or None for i in shown],
        },
    )


def pass_means(run: Run, expression: str | None = None) -> F64:
    """Mean luminance of each pass's image, float64 (passes); the mean of them is the image's."""
    return np.asarray(_by_pass(run, expression)[0] / (pixels_of(run) * run.settings["keep"]))


def _by_pass(run: Run, expression: str | None) -> tuple[F64, Moments]:
    """The recorded light of each pass, float64 (passes), and the moments of its walks."""
    units, passes, pixels = Units.of_run(run), int(run.settings["passes"]), pixels_of(run)
    select = _selector(run, expression)

    def work(pieces: Iterator[Piece]) -> Tally:
        tally = Tally(passes, units)
        for piece in pieces:
            tally.add(piece, np.where(select(piece), piece.owner() // pixels, -1).astype(np.int32))
        return tally.compact()

    whole = Tally(passes, units)
    for part in map_shards(run.shard_files, work, run.threads):
        whole.merge(part)
    return np.asarray(whole.sums.sum(axis=1)), whole.moments


def _reasons(moments: Moments, units: npt.NDArray[np.int64]) -> list[str]:
    """Why the variance cannot be trusted after each pass; "" where it can."""
    so_far = Moments(*map(np.cumsum, moments))._replace(largest=np.maximum.accumulate(moments.largest))
    return [
        reason if count > 1 else "one unit only, which tells nothing of differences"
        for reason, count in zip(verdicts(so_far), units.tolist(), strict=True)
    ]


def _selector(run: Run, expression: str | None) -> Callable[[Piece], npt.NDArray[np.bool_]]:
    """What says which rows of a piece count."""
    if expression is None:
        return lambda piece: np.ones(piece.rows("paths"), np.bool_)
    return Classifier(run, run.compile(expression)).select


Steps = tuple[F64, F64, npt.NDArray[np.int64], F64]


def _independent(values: F64) -> Steps:
    """After each pass: mean, variance of a pass, number of passes, standard error."""
    moments = RunningMoments()
    mean, variance = np.empty(len(values)), np.empty(len(values))
    for i, x in enumerate(values):
        moments.add(x)
        mean[i], variance[i] = moments.mean, moments.variance
    units = np.arange(1, len(values) + 1)
    return mean, variance, units, np.sqrt(variance / units)


def _replicated(values: F64, replicates: int) -> Steps:
    """After each pass: mean, variance of a replicate's running mean, number of replicates begun, standard error.

    Passes go to replicates in turn. Where the last round is incomplete, replicates of more passes weigh more.
    """
    counts, means = np.zeros(replicates), np.zeros(replicates)
    mean, variance, error = np.empty(len(values)), np.full(len(values), np.nan), np.full(len(values), np.nan)
    units = np.minimum(np.arange(1, len(values) + 1), replicates)
    for i, x in enumerate(values):
        replicate = i % replicates
        counts[replicate] += 1
        means[replicate] += (x - means[replicate]) / counts[replicate]
        share = counts / (i + 1)
        mean[i] = share @ means
        if units[i] > 1:
            variance[i] = means[: units[i]].var(ddof=1)
            error[i] = np.sqrt(variance[i] * (share @ share))
    return mean, variance, units, error


def _slopes(passes: npt.NDArray[np.int64], units: npt.NDArray[np.int64], error: F64) -> F64:
    """The slope of log error against log passes over all points up to each, by least squares; NaN for fewer than ``LEAST_POINTS``.

    Points weigh as the variance of the logarithm of an error of so many units wants: units - 1.
    """
    usable = np.isfinite(error) & (error > 0)
    x, y, weight = np.log(passes), np.log(np.where(usable, error, 1.0)), np.where(usable, units - 1.0, 0.0)
    n, sx, sy, sxx, sxy = (np.cumsum(weight * term) for term in (np.ones(len(x)), x, y, x * x, x * y))
    with np.errstate(divide="ignore", invalid="ignore"):
        slope: F64 = np.where(np.cumsum(usable) >= LEAST_POINTS, (n * sxy - sx * sy) / (n * sxx - sx * sx), np.nan)
    return slope


def _shown(count: int, most: int) -> npt.NDArray[np.int64]:
    """Rows to show: all, or some whose numbers rise geometrically, to the last."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.round(np.geomspace(1, count, most)).astype(np.int64)) - 1
