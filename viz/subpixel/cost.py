"""What methods cost and what they bring: seconds of filtering against S-CIELAB."""

import math
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from queries.subpixel.analysis import Analysis
from viz.charts import COLORS, FAINT
from viz.numbers import number
from viz.report.subpixel import layout_title, method_title
from viz.subpixel.comparison import DERIVED
from viz.subpixel.figure import Agreement, Figure
from viz.subpixel.fits import family
from viz.subpixel.look import label_panels, new_panels, panel_title, plain_numbers, save_panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STATED_RATIO = 2.29 / 0.53  # thesis 4.5.2: milliseconds of the optimal filter and of a box for each pixel, full HD, 8 samples, GPU
_LINE = 0.075  # of the axes' height, between names


@dataclass(frozen=True)
class Cost:
    """A method on one display: median seconds and mean S-CIELAB of the images."""

    layout: str
    method: str
    seconds: float
    scielab: float


def cost_figure(analysis: Analysis, folder: pathlib.Path) -> Figure | None:
    """A panel for each display, a marker for each method; None where no method was timed."""
    found = costs(analysis.scores) if analysis.scores is not None else []
    if not found:
        return None
    file = cost_chart(folder / "cost.png", found, "Cost and accuracy of the methods", "seconds for each picture")
    layouts = {cost.layout for cost in found}
    agreement, comparison = compared(found, next((d.layout.name for d in analysis.displays if family(d.layout) == "RGB"), ""))
    fastest = min(found, key=lambda cost: cost.seconds)
    return Figure(
        name="cost",
        title="Cost and accuracy",
        file=file,
        alt=f"{len(layouts)} charts of mean S-CIELAB difference over seconds, one for each display, with a marker for each method; the fastest is "
        f"{method_title(fastest.method)} on {layout_title(fastest.layout)} with {number(fastest.seconds)} s.",
        caption="Median time of filtering one of the compared pictures (wall time, log axis, without deriving the filters) and mean S-CIELAB "
        "difference to full resolution, for each method. Lower left is better, and vertical axes differ; the gray line joins the methods that no "
        "other beats in both. Blue: the derived filters; orange: others.",
        thesis=f"Section 4.5.2: resolving 1920 x 1080 pixels of 8 samples on a GPU takes 2.29 ms by the optimal filter and 0.53 ms by a box for each "
        f"pixel, {STATED_RATIO:.1f} times as long; section 4.6: the additional cost is small compared to the benefit.",
        agreement=agreement,
        comparison=comparison,
    )


def cost_chart(file: pathlib.Path, found: Sequence[Cost], title: str, unit: str) -> pathlib.Path:
    """S-CIELAB over seconds, of which ``unit`` says what they are for: a panel for each display, a marker for each method. Writes a PNG."""
    layouts = list(dict.fromkeys(cost.layout for cost in found))
    columns = min(2, len(layouts))
    rows = -(-len(layouts) // columns)
    figure, panels = new_panels(rows, columns, 0.8 + 2.5 * rows, title, sharex=True)
    seconds = [cost.seconds for cost in found]
    panels[0, 0].set_xlim(min(seconds) / 1.5, max(seconds) * 1.5)
    for layout, axes in zip(layouts, panels.ravel(), strict=False):
        _draw_panel(axes, layout, [cost for cost in found if cost.layout == layout])
    label_panels(panels, len(layouts), unit, "mean S-CIELAB difference")
    return save_panels(figure, file)


def costs(scores: pa.Table) -> list[Cost]:
    """Each method on each display over the images: the median time, which other work on the machine moves little, and the mean difference."""
    gathered: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for row in scores.select(["layout", "method", "seconds", "scielab"]).to_pylist():
        seconds = row["seconds"]
        gathered.setdefault((row["layout"], row["method"]), []).append((math.nan if seconds is None else seconds, row["scielab"]))
    found = []
    for (layout, method), pairs in gathered.items():
        timed = [seconds for seconds, _ in pairs if seconds > 0]
        if timed:
            found.append(Cost(layout, method, float(np.median(timed)), float(np.mean([score for _, score in pairs]))))
    return found


def compared(found: Sequence[Cost], stripe: str) -> tuple[Agreement, str]:
    """The optimal filter's time in units of the box's on an RGB stripe, beside the thesis's, in words."""
    by = {cost.method: cost for cost in found if cost.layout == stripe}
    if not {"optimal", "pixel_box"} <= set(by):
        return "not comparable", "The optimal filter and the box for each pixel were not both timed on an RGB stripe."
    optimal, box = by["optimal"], by["pixel_box"]
    ratio = optimal.seconds / box.seconds
    change = optimal.scielab / box.scielab - 1
    text = (
        f"On {layout_title(stripe)} the optimal filter takes {number(optimal.seconds)} s and the box for each pixel {number(box.seconds)} s: "
        f"{number(ratio)} times as long (the thesis: {STATED_RATIO:.1f}), for an S-CIELAB difference of {optimal.scielab:.2f} in the place of "
        f"{box.scielab:.2f} ({_signed(change)}). "
    )
    if "kernels" in by:
        text += f"All kernels take {number(by['kernels'].seconds)} s. "
    text += (
        f"Agreement: at most {STATED_RATIO:.1f} times as long, though here small images, not samples, are filtered, on a CPU, and what every method "
        "takes for each image narrows the ratio."
    )
    return ("agrees" if ratio <= STATED_RATIO else "differs"), text


def _signed(share: float) -> str:
    return f"{100 * share:+.0f} %".replace("-", "−")


def _draw_panel(axes: "Axes", layout: str, found: Sequence[Cost]) -> None:
    """The methods on one display."""
    axes.set_xscale("log")
    panel_title(axes, layout_title(layout))
    best: list[Cost] = []
    for cost in sorted(found, key=lambda one: (one.seconds, one.scielab)):
        if not best or cost.scielab < best[-1].scielab:
            best.append(cost)
    axes.plot([c.seconds for c in best], [c.scielab for c in best], "-", color=FAINT, linewidth=1.6, zorder=1)
    for cost in found:
        axes.plot(
            [cost.seconds], [cost.scielab], "o", color=COLORS[0 if cost.method in DERIVED else 1], markersize=7.5, markeredgecolor="white", zorder=4
        )
    scores = [cost.scielab for cost in found]
    room = 0.2 * max(max(scores) - min(scores), 0.2 * max(scores))
    axes.set_ylim(max(0.0, min(scores) - room), max(scores) + room)
    plain_numbers(axes.xaxis)

    # Names right of the panel, at their points' heights where there is room, with lines to the points
    order = sorted(found, key=lambda cost: -cost.scielab)
    heights = [float(axes.transAxes.inverted().transform(axes.transData.transform((cost.seconds, cost.scielab)))[1]) for cost in order]
    for cost, height in zip(order, spread(heights, _LINE), strict=True):
        color = COLORS[0 if cost.method in DERIVED else 1]
        arrow = {"arrowstyle": "-", "color": color, "linewidth": 0.6, "alpha": 0.6, "shrinkA": 0, "shrinkB": 4, "relpos": (0.0, 0.5)}
        point = (cost.seconds, cost.scielab)
        axes.annotate(
            method_title(cost.method), point, (1.03, height), "data", "axes fraction", arrow, color=color, va="center", fontsize=8, zorder=2
        )


def spread(heights: Sequence[float], apart: float) -> list[float]:
    """Heights, descending, moved as little as it takes (in the squares) to be ``apart`` from each other, by pooling those that violate it.

    >>> [round(height, 3) for height in spread([0.9, 0.5, 0.5], 0.1)]
    [0.9, 0.55, 0.45]
    """
    pools: list[tuple[float, int]] = []  # mean of heights that are lifted by their place in the order, and how many
    for i, height in enumerate(heights):
        mean, count = height + i * apart, 1
        while pools and pools[-1][0] < mean:
            before, of = pools.pop()
            mean, count = (before * of + mean * count) / (of + count), of + count
        pools.append((mean, count))
    lifted = [mean for mean, count in pools for _ in range(count)]
    return [height - i * apart for i, height in enumerate(lifted)]
