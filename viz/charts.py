"""Charts of plain numbers: error against time, rates and times side by side. Lines and bars carry their own names."""

import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, FAINT = "#222222", "#d9d9d9"
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito's: told apart by everybody
DPI = 160
NAME_HEIGHT = 0.045  # of a line of text, as a share of the axes


@dataclass(frozen=True)
class ErrorCurve:
    """One renderer's mean squared errors after so many seconds, at so many samples for each pixel."""

    name: str
    seconds: Sequence[float]
    error: Sequence[float]
    samples: Sequence[int]


@dataclass(frozen=True)
class RateBar:
    """One renderer's samples per second: the median, and the range over rounds."""

    name: str
    rate: float
    low: float
    high: float


@dataclass(frozen=True)
class TimeBar:
    """How long something took, in seconds: the median, and the range over rounds. ``ours``: whether it is what we measure, or what is beside it."""

    name: str
    seconds: float
    low: float
    high: float
    ours: bool


def error_chart(path: pathlib.Path, curves: Sequence[ErrorCurve], title: str) -> None:
    """Mean squared error over seconds, both logarithmic; lines of equal error x time lie behind. Writes a PNG.

    Points whose error is not positive (a corrected error may drown in its own noise) have no place on the axis, and are left out.
    """
    curves = [kept for curve in curves if (kept := positive(curve)).error]
    figure, axes = new_chart((8.4, 5.6), title)
    axes.set_xscale("log")
    axes.set_yscale("log")
    fit_limits(axes, curves)
    equal_products(axes)
    for i, curve in enumerate(curves):
        draw_curve(axes, curve, COLORS[i % len(COLORS)])
    name_curves(axes, curves)
    axes.set_xlabel("wall time (s)")
    axes.set_ylabel("mean squared error (radiance²)")
    plain_seconds(axes)
    save(figure, path)


def positive(curve: ErrorCurve) -> ErrorCurve:
    """The curve's points with positive errors."""
    kept = [i for i, error in enumerate(curve.error) if error > 0]
    seconds, error, samples = ([values[i] for i in kept] for values in (curve.seconds, curve.error, curve.samples))
    return ErrorCurve(curve.name, seconds, error, [int(n) for n in samples])


def new_chart(size: tuple[float, float], title: str) -> tuple[Any, "Axes"]:
    """A figure with one quiet pair of axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set_title(title, loc="left", fontsize=11, color=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def fit_limits(axes: "Axes", curves: Sequence[ErrorCurve]) -> None:
    """Limits around all points."""
    seconds = [s for curve in curves for s in curve.seconds]
    errors = [e for curve in curves for e in curve.error]
    axes.set_xlim(min(seconds, default=1.0) / 1.4, max(seconds, default=1.0) * 1.4)
    axes.set_ylim(min(errors, default=1.0) / 2, max(errors, default=1.0) * 1.7)


def equal_products(axes: "Axes") -> None:
    """Faint lines of constant error x time, a factor of two apart: along one, an unbiased renderer with independent samples comes down."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    product = left * low
    while product < right * high:
        axes.plot([left, right], [product / left, product / right], color=FAINT, linewidth=0.7, zorder=1, scalex=False, scaley=False)
        product *= 2.0
    text = "circles: samples per pixel\ngray: equal error × time, each line half of the next"
    box = {"facecolor": "white", "edgecolor": "none", "pad": 3.0}
    axes.annotate(text, (0.0, 0.0), (8, 8), "axes fraction", "offset points", fontsize=8, color="#6a6a6a", bbox=box, zorder=2)


def draw_curve(axes: "Axes", curve: ErrorCurve, color: str) -> None:
    """A line; every point is a circle with its number of samples inside."""
    axes.plot(curve.seconds, curve.error, "-", color=color, linewidth=1.8, zorder=3)
    axes.plot(curve.seconds, curve.error, "o", color=color, markersize=15, markeredgecolor="white", zorder=4)
    for x, y, samples in zip(curve.seconds, curve.error, curve.samples, strict=True):
        axes.annotate(str(samples), (x, y), color="white", fontsize=6, ha="center", va="center_baseline", zorder=5, annotation_clip=True)


def name_curves(axes: "Axes", curves: Sequence[ErrorCurve]) -> None:
    """The lines' names right of the axes, at the height of their last points but never closer than a line of text."""
    heights = [axes.transAxes.inverted().transform(axes.transData.transform((c.seconds[-1], c.error[-1])))[1] for c in curves]
    least = 1.0
    for i in sorted(range(len(curves)), key=lambda k: -heights[k]):
        height = min(float(heights[i]), least)
        least = height - NAME_HEIGHT
        end, name = (curves[i].seconds[-1], curves[i].error[-1]), curves[i].name
        color = COLORS[i % len(COLORS)]
        arrow = {"arrowstyle": "-", "color": color, "linewidth": 0.7, "shrinkA": 0, "shrinkB": 7}
        text = axes.annotate(name, end, (1.02, height), "data", "axes fraction", arrow, color=color, va="center", fontsize=9, zorder=2)
        text.set_fontweight("bold")


def plain_seconds(axes: "Axes") -> None:
    """Seconds as plain decimals, at 1, 2 and 5 of each decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def rate_chart(path: pathlib.Path, bars: Sequence[RateBar], title: str) -> None:
    """Millions of samples per second as horizontal bars, with the range over rounds. Writes a PNG."""
    figure, axes = new_chart((8.4, 0.9 + 0.5 * len(bars)), title)
    for i, bar in enumerate(bars):
        rate, low, high = bar.rate / 1e6, bar.low / 1e6, bar.high / 1e6
        axes.barh(i, rate, color=COLORS[0] if bar.name.startswith("ours") else COLORS[1], height=0.62)
        axes.errorbar(rate, i, xerr=[[rate - low], [high - rate]], color=INK, linewidth=1.2, capsize=3)
        axes.annotate(f"{rate:.2f}", (max(high, rate), i), (6, 0), textcoords="offset points", va="center", color=INK)
    axes.set_yticks(range(len(bars)), [bar.name for bar in bars])
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("million samples per second of wall time (median and range)")
    axes.margins(x=0.1)
    save(figure, path)


def time_chart(path: pathlib.Path, bars: Sequence[TimeBar], title: str) -> None:
    """Seconds as points on a logarithmic axis, one line for each thing that was timed, with the range over rounds. Writes a PNG."""
    figure, axes = new_chart((8.4, 1.1 + 0.4 * len(bars)), title)
    axes.set_xscale("log")
    for i, bar in enumerate(bars):
        color = COLORS[0] if bar.ours else COLORS[1]
        axes.axhline(i, color=FAINT, linewidth=0.7, zorder=1)
        axes.errorbar(
            bar.seconds, i, xerr=[[bar.seconds - bar.low], [bar.high - bar.seconds]], color=color, fmt="o", markersize=9, capsize=3, zorder=3
        )
        box = {"facecolor": "white", "edgecolor": "none", "pad": 2.0}
        axes.annotate(f"{bar.seconds:.2g} s", (bar.high, i), (9, 0), textcoords="offset points", va="center_baseline", color=INK, bbox=box, zorder=2)
    axes.set_yticks(range(len(bars)), [bar.name for bar in bars])
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("wall time (s), median and range")
    axes.margins(x=0.12, y=0.12)
    plain_seconds(axes)
    save(figure, path)


def save(figure: Any, path: pathlib.Path) -> None:
    """Write the figure as a PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)


@dataclass(frozen=True)
class ConvergenceCurve:
    """Relative standard errors after so many samples of each pixel. ``slope``: fitted to the logarithms of both, None where it is not known."""

    samples: Sequence[int]
    error: Sequence[float]
    slope: float | None


def convergence_chart(path: pathlib.Path, curve: ConvergenceCurve, title: str) -> None:
    """Relative error over samples, both logarithmic, beside the line that independent samples follow. Writes a PNG."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    figure, axes = new_chart((8.4, 4.2), title)
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    middle = len(curve.samples) // 2
    start = curve.error[middle] * (curve.samples[middle] / curve.samples[0]) ** 0.5
    ends = (curve.samples[0], curve.samples[-1])
    axes.plot(ends, (start, start * (ends[0] / ends[1]) ** 0.5), "--", color="#8a8a8a", linewidth=1.0, zorder=2, label="slope −1/2, as independent")
    fitted = "" if curve.slope is None else f", fitted slope {curve.slope:.2f}".replace("-", "−")
    axes.plot(curve.samples, curve.error, "-o", color=COLORS[0], linewidth=1.8, markersize=4, zorder=3, label=f"this run{fitted}")
    axes.legend(frameon=False, fontsize=9, labelcolor=INK)
    axes.grid(True, color=FAINT, linewidth=0.6, zorder=1)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("samples of each pixel")
    axes.set_ylabel("relative standard error")
    save(figure, path)


def seconds_chart(path: pathlib.Path, stages: Mapping[str, float], title: str) -> None:
    """Seconds of each stage as horizontal bars, in the order in which they ran. Writes a PNG."""
    figure, axes = new_chart((8.4, 0.9 + 0.36 * len(stages)), title)
    for i, taken in enumerate(stages.values()):
        axes.barh(i, taken, color=COLORS[0], height=0.62)
        axes.annotate(f"{taken:.2f} s", (taken, i), (6, 0), textcoords="offset points", va="center", color=INK, fontsize=9)
    axes.set_yticks(range(len(stages)), list(stages))
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("wall time (s)")
    axes.margins(x=0.12)
    save(figure, path)
