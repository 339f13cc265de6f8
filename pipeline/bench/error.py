"""Mean squared error against time: who is nearer to the truth after the same wait.

A few pixels where the light's own edge crosses the film can make up nearly all of a mean squared error, so the mean of relative
squared errors, (x - reference)² / (reference² + 0.01), is told beside it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from pipeline.bench.contenders import LABELS, Contender
from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import alternate, spread
from pipeline.progress import LOG, progress

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
PIECE = 128  # samples of one render of the reference: bounds memory and disk
REFERENCE_SEED, ERROR_SEED = 1_000_000, 2_000_000  # added to the job's seed, so that no render shares numbers with another
DARK = 0.01  # added to the squared reference, so that black pixels do not decide
GOAL = "mean squared error below Mitsuba llvm's"


@dataclass(frozen=True)
class Reference:
    """The mean of two independent halves, and how far from the truth it still is: half the halves' distance, squared."""

    image: F64
    squared_error: F64  # of each pixel and channel
    halves: tuple[str, str]
    mean_difference: float  # of the halves' image means, relative

    def error(self, image: F32) -> tuple[float, float]:
        """Mean squared and mean relative squared error of a picture over pixels and channels, less the reference's own."""
        error = (image - self.image) ** 2 - self.squared_error
        return float(error.mean()), float(np.mean(error / (self.image**2 + DARK)))


@dataclass(frozen=True)
class Curve:
    """One contender's errors and times, an entry for each sample count. Errors are means over rounds, times medians (seconds)."""

    samples: list[int]
    error: list[float]
    relative: list[float]
    wall: list[float]
    cpu: list[float]

    def at(self, seconds: float, errors: Sequence[float]) -> float:
        """One of this curve's lists of errors after some seconds on the wall: straight lines in logarithms, carried on past the ends."""
        x, y = np.log(self.wall), np.log(errors)
        i = int(np.clip(np.searchsorted(x, np.log(seconds)), 1, len(x) - 1))
        slope = (y[i] - y[i - 1]) / (x[i] - x[i - 1])
        return float(np.exp(y[i] + slope * (np.log(seconds) - x[i])))


def measure_error(session: Session) -> SectionResult:
    """Converge a reference, render every sample count some times, and compare at equal time."""
    there, missing = session.contenders.available(session.benchmark.error.contenders)
    for name, contender in there.items():
        for samples in session.benchmark.error.samples:
            contender.render(samples, session.settings.seed + ERROR_SEED - 1)
        LOG.info("%s is warm", LABELS[name])
    reference = converge(session)
    curves = draw_curves(session, there, reference)
    figures: dict[str, Any] = {name: asdict(curve) for name, curve in curves.items()}
    figures["reference"] = {
        "halves": reference.halves,
        "samples": session.benchmark.error.reference_samples,
        "squared_error": float(reference.squared_error.mean()),
        "mean_difference": reference.mean_difference,
    }
    return SectionResult(error_rows(curves, missing, session.settings.passes), figures, [error_table(curves), about(reference, session)])


def converge(session: Session) -> Reference:
    """The reference: ours, and Mitsuba's own where there is one, in equal parts."""
    firsts, _ = session.contenders.available(["sobol"])
    seconds, _ = session.contenders.available(["mitsuba_llvm"])
    names = ("sobol", next(iter(seconds), "sobol"))
    pieces = max(1, session.benchmark.error.reference_samples // PIECE)
    samples = min(PIECE, session.benchmark.error.reference_samples)
    halves = []
    with progress("reference", 2 * pieces * samples, "samples a pixel") as bar:
        for half, contender in enumerate((firsts["sobol"], (seconds or firsts)[names[1]])):
            total: F64 | None = None
            for piece in range(pieces):
                image = contender.picture(samples, session.settings.seed + REFERENCE_SEED * (1 + 4 * half) + piece)[0].astype(np.float64)
                total = image if total is None else total + image
                bar.advance(samples)
            assert total is not None
            halves.append(total / pieces)
    a, b = halves
    return Reference((a + b) / 2, (a - b) ** 2 / 4, (LABELS[names[0]], LABELS[names[1]]), float(a.mean() / b.mean() - 1))


def draw_curves(session: Session, contenders: Mapping[str, Contender], reference: Reference) -> dict[str, Curve]:
    """Errors and times at every sample count; contenders alternate within each."""
    settings = session.benchmark.error
    curves = {name: Curve([], [], [], [], []) for name in contenders}
    with progress("error", len(settings.samples) * settings.rounds, "rounds") as bar:
        for samples in settings.samples:
            errors: dict[str, list[tuple[float, float]]] = {name: [] for name in contenders}

            def render(name: str, number: int, samples: int = samples, errors: dict[str, list[tuple[float, float]]] = errors):  # type: ignore[no-untyped-def]
                image, timing = contenders[name].picture(samples, session.settings.seed + ERROR_SEED + number)
                errors[name].append(reference.error(image))
                return timing

            timings = alternate({name: lambda number, name=name: render(name, number) for name in contenders}, settings.rounds)  # type: ignore[misc]
            for name, curve in curves.items():
                curve.samples.append(samples)
                squared, relative = np.mean(errors[name], axis=0)
                curve.error.append(float(squared))
                curve.relative.append(float(relative))
                curve.wall.append(spread([t.wall for t in timings[name]]).median)
                curve.cpu.append(spread([t.cpu for t in timings[name]]).median)
            bar.advance(settings.rounds)
    return curves


def error_rows(curves: Mapping[str, Curve], missing: Mapping[str, str], samples: int) -> list[Row]:
    """Each of ours against Mitsuba llvm, after the time that Mitsuba takes for the job's samples (or the nearest that was rendered)."""
    rows = []
    theirs = curves.get("mitsuba_llvm")
    for name, curve in curves.items():
        if name.startswith("mitsuba"):
            continue
        what = f"error × time ({LABELS[name]})"
        if theirs is None:
            rows.append(Row(what, GOAL, missing.get("mitsuba_llvm", "not measured")))
            continue
        i = min(range(len(theirs.samples)), key=lambda k: abs(theirs.samples[k] - samples))
        found = curve.at(theirs.wall[i], curve.error) / theirs.error[i]
        relative = curve.at(theirs.wall[i], curve.relative) / theirs.relative[i]
        after = f"after {theirs.wall[i]:.2f} s (its {theirs.samples[i]} samples)"
        measured = f"{found:.2f} × Mitsuba llvm's {after}; relative squared error {relative:.2f} ×"
        rows.append(Row(what, f"{GOAL} at equal wall time", measured, found < 1.0))
    return rows


def error_table(curves: Mapping[str, Curve]) -> str:
    """All errors and times."""
    rows: list[list[str]] = []
    for name, curve in curves.items():
        for samples, error, relative, wall, cpu in zip(curve.samples, curve.error, curve.relative, curve.wall, curve.cpu, strict=True):
            rows.append(
                [
                    LABELS[name],
                    str(samples),
                    f"{error:.3e}",
                    f"{relative:.3e}",
                    f"{wall:.3f}",
                    f"{cpu:.3f}",
                    f"{error * wall:.3e}",
                    f"{error * cpu:.3e}",
                ]
            )
    header = ["contender", "samples", "mean squared error", "relative", "wall s", "CPU s", "error × wall s", "error × CPU s"]
    return markdown_table(header, rows)


def about(reference: Reference, session: Session) -> str:
    """How the reference was made."""
    samples, (ours, theirs) = session.benchmark.error.reference_samples, reference.halves
    return (
        f"Reference: the mean of {samples} samples by {ours} and as many by {theirs}, with other seeds; its own squared error, "
        f"{reference.squared_error.mean():.1e}, a quarter of the halves' mean squared difference, is taken off every figure. "
        f"The halves' image means differ by {reference.mean_difference:+.1e}, relative. "
        "Relative squared error: (x - reference)² / (reference² + 0.01). A mean squared error can lie almost wholly in the few pixels "
        "on the edge of a light, where sampling the film well is all that counts; the relative one weighs pixels more evenly."
    )


def curves_of(figures: Mapping[str, Any], names: Sequence[str]) -> dict[str, Curve]:
    """The curves back from a section's figures."""
    return {name: Curve(**figures[name]) for name in names if name in figures}
