"""Mean squared error against time: who is nearer to the truth after the same wait."""

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
GOAL = "mean squared error below Mitsuba llvm's"


@dataclass(frozen=True)
class Reference:
    """The mean of two independent halves, and how far from the truth it still is: half the halves' distance, squared."""

    image: F64
    squared_error: float
    halves: tuple[str, str]
    mean_difference: float  # of the halves' image means, relative

    def error(self, image: F32) -> float:
        """Mean squared error of a picture over pixels and channels, less the reference's own."""
        return float(np.mean((image - self.image) ** 2)) - self.squared_error


@dataclass(frozen=True)
class Curve:
    """One contender's errors and times, an entry for each sample count. Errors are means over rounds, times medians (seconds)."""

    samples: list[int]
    error: list[float]
    wall: list[float]
    cpu: list[float]

    def at(self, seconds: float) -> float:
        """The error after some seconds on the wall: a straight line in logarithms between neighbors, or on from the last two."""
        x, y = np.log(self.wall), np.log(self.error)
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
        "squared_error": reference.squared_error,
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
    return Reference((a + b) / 2, float(np.mean((a - b) ** 2)) / 4, (LABELS[names[0]], LABELS[names[1]]), float(a.mean() / b.mean() - 1))


def draw_curves(session: Session, contenders: Mapping[str, Contender], reference: Reference) -> dict[str, Curve]:
    """Errors and times at every sample count; contenders alternate within each."""
    settings = session.benchmark.error
    curves = {name: Curve([], [], [], []) for name in contenders}
    with progress("error", len(settings.samples) * settings.rounds, "rounds") as bar:
        for samples in settings.samples:
            errors: dict[str, list[float]] = {name: [] for name in contenders}

            def render(name: str, number: int, samples: int = samples, errors: dict[str, list[float]] = errors):  # type: ignore[no-untyped-def]
                image, timing = contenders[name].picture(samples, session.settings.seed + ERROR_SEED + number)
                errors[name].append(reference.error(image))
                return timing

            timings = alternate({name: lambda number, name=name: render(name, number) for name in contenders}, settings.rounds)  # type: ignore[misc]
            for name, curve in curves.items():
                curve.samples.append(samples)
                curve.error.append(float(np.mean(errors[name])))
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
        found = curve.at(theirs.wall[i]) / theirs.error[i]
        measured = f"{found:.2f} × Mitsuba llvm's after {theirs.wall[i]:.2f} s (its {theirs.samples[i]} samples)"
        rows.append(Row(what, f"{GOAL} at equal wall time", measured, found < 1.0))
    return rows


def error_table(curves: Mapping[str, Curve]) -> str:
    """All errors and times."""
    rows: list[list[str]] = []
    for name, curve in curves.items():
        for samples, error, wall, cpu in zip(curve.samples, curve.error, curve.wall, curve.cpu, strict=True):
            rows.append([LABELS[name], str(samples), f"{error:.3e}", f"{wall:.3f}", f"{cpu:.3f}", f"{error * wall:.3e}", f"{error * cpu:.3e}"])
    header = ["contender", "samples", "mean squared error", "wall s", "CPU s", "error × wall s", "error × CPU s"]
    return markdown_table(header, rows)


def about(reference: Reference, session: Session) -> str:
    """How the reference was made."""
    return (
        f"Reference: the mean of {session.benchmark.error.reference_samples} samples by {reference.halves[0]} and as many by {reference.halves[1]}, "
        f"with other seeds; its own squared error, {reference.squared_error:.1e}, a quarter of the halves' mean squared difference, is taken off "
        f"every figure. The halves' image means differ by {reference.mean_difference:+.1e}, relative."
    )


def curves_of(figures: Mapping[str, Any], names: Sequence[str]) -> dict[str, Curve]:
    """The curves back from a section's figures."""
    return {name: Curve(**figures[name]) for name in names if name in figures}
