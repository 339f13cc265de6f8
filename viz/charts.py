"""Charts of plain numbers: error against time, and rates side by side. Lines and bars carry their own names."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, FAINT = "#222222", "#d9d9d9"
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito's: told apart by everybody
DPI = 160


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


def error_chart(path: pathlib.Path, curves: Sequence[ErrorCurve], title: str) -> None:
    """Mean squared error over seconds, both logarithmic; lines of equal error x time lie behind. Writes a PNG."""
    figure, axes = new_chart((8.4, 5.6), title)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for i, curve in enumerate(curves):
        axes.plot(curve.seconds, curve.error, "-o", color=COLORS[i % len(COLORS)], markersize=4.5, linewidth=1.8, zorder=3)
    leave_room(axes, curves)
    equal_products(axes)
    for i, curve in enumerate(curves):
        label_curve(axes, curve, COLORS[i % len(COLORS)], above=i % 2 == 1)
    axes.set_xlabel("wall time (s)")
    axes.set_ylabel("mean squared error (linear radiance²)")
    plain_seconds(axes)
    save(figure, path)


def new_chart(size: tuple[float, float], title: str) -> tuple[Any, "Axes"]:
    """A figure with one quiet pair of axes."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    axes.set_title(title, loc="left", fontsize=11, color=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def leave_room(axes: "Axes", curves: Sequence[ErrorCurve]) -> None:
    """Limits with space at the right for the lines' names."""
    seconds = [s for curve in curves for s in curve.seconds]
    errors = [e for curve in curves for e in curve.error if e > 0]
    axes.set_xlim(min(seconds) / 1.5, max(seconds) * 4.5)
    axes.set_ylim(min(errors) / 2, max(errors) * 2)


def equal_products(axes: "Axes") -> None:
    """Faint lines along which error x time is constant, a factor of two apart: how an unbiased renderer of independent samples falls."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    product = left * low
    while product < right * high:
        axes.plot([left, right], [product / left, product / right], color=FAINT, linewidth=0.7, zorder=1, scalex=False, scaley=False)
        product *= 2.0
    axes.annotate(
        "gray: equal error × time, a factor of 2 apart", (0.0, 0.0), (6, 6), "axes fraction", "offset points", fontsize=8, color="#7a7a7a",
    )  # fmt: skip


def label_curve(axes: "Axes", curve: ErrorCurve, color: str, above: bool) -> None:
    """The line's name at its end, and the samples of its first, middle and last point."""
    axes.annotate(curve.name, (curve.seconds[-1], curve.error[-1]), (9, 0), textcoords="offset points", color=color, va="center", fontweight="bold")
    x, y = (5, 5) if above else (-5, -5)
    place = {"ha": "left", "va": "bottom"} if above else {"ha": "right", "va": "top"}
    for i in sorted({0, len(curve.samples) // 2, len(curve.samples) - 1}):
        point = (curve.seconds[i], curve.error[i])
        axes.annotate(f"{curve.samples[i]} spp", point, (x, y), textcoords="offset points", fontsize=8, color=color, **place)


def plain_seconds(axes: "Axes") -> None:
    """Seconds as plain decimals."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def rate_chart(path: pathlib.Path, bars: Sequence[RateBar], title: str) -> None:
    """Millions of samples per second as horizontal bars, with the range over rounds. Writes a PNG."""
    figure, axes = new_chart((8.4, 0.9 + 0.5 * len(bars)), title)
    for i, bar in enumerate(bars):
        rate, low, high = bar.rate / 1e6, bar.low / 1e6, bar.high / 1e6
        axes.barh(i, rate, color=COLORS[0] if bar.name.startswith("ours") else COLORS[1], height=0.62)
        axes.plot([low, high], [i, i], color=INK, linewidth=1.4)
        axes.annotate(f"{rate:.2f}", (max(high, rate), i), (6, 0), textcoords="offset points", va="center", color=INK)
    axes.set_yticks(range(len(bars)), [bar.name for bar in bars])
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("million samples per second of wall time (median; the line is the range)")
    axes.margins(x=0.1)
    save(figure, path)


def save(figure: Any, path: pathlib.Path) -> None:
    """Write the figure as a PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)
