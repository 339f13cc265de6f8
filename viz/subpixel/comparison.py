"""How methods and displays compare, as Fig. 4.12 and Fig. 4.13 of the thesis do, by S-CIELAB in the place of a study with people."""

import pathlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.subpixel.analysis import Analysis
from queries.subpixel.preference import FEWEST_IMAGES
from renderer.filters.subpixel.methods import TITLES
from viz.charts import COLORS, FAINT, INK, new_chart
from viz.report.subpixel import layout_title, method_title
from viz.subpixel.figure import Agreement, Figure
from viz.subpixel.fits import family
from viz.subpixel.look import QUIET, listed, plain_numbers, quiet, save_panels

F64 = npt.NDArray[np.float64]

OPTIMAL = "optimal"
DERIVED = (OPTIMAL, "kernels")
STUDIED = ("pixel_mitchell", "box", "mitchell")  # what the thesis's participants compared the optimal filter with
SIGNIFICANT = 0.01  # the level of the thesis's t-tests
_SIDE = 0.27  # below its line: where a row's single images are


@dataclass(frozen=True)
class PairedTest:
    """A paired t-test over images: the mean of the first's scores minus the second's, and the probability of so large a one by chance."""

    difference: float
    p: float

    @property
    def better(self) -> bool:
        """Whether the first is significantly better: has lower scores."""
        return self.p < SIGNIFICANT and self.difference < 0

    @property
    def worse(self) -> bool:
        """Whether the first is significantly worse."""
        return self.p < SIGNIFICANT and self.difference > 0


def methods_figure(analysis: Analysis, layout: str, folder: pathlib.Path) -> Figure | None:
    """The methods on one display, best first; None where they were not compared."""
    ranked = analysis.methods.get(layout)
    if ranked is None or not ranked.num_rows or analysis.scores is None:
        return None
    title, rows = layout_title(layout), ranked.to_pylist()
    points = scores_of(analysis.scores, "method", "layout", layout)
    file = folder / f"methods_{layout}.png"
    dot_plot(
        file, [(method_title(row["method"]), row, points[row["method"]], row["method"] in DERIVED) for row in rows], f"{title}: methods compared"
    )
    unlimited = scores_of(analysis.scores, "method", "layout", layout, "scielab_unclipped")
    agreement, comparison = compared_methods(points, rows, unlimited)
    images = len(next(iter(points.values())))
    return Figure(
        name=f"methods_{layout}",
        title=f"Methods on {title}",
        file=file,
        alt=f"A dot plot of {len(rows)} methods by mean S-CIELAB difference, from {method_title(rows[0]['method'])} ({rows[0]['scielab']:.2f}) to "
        f"{method_title(rows[-1]['method'])} ({rows[-1]['scielab']:.2f}).",
        caption=f"How far {title} is from the picture at full resolution by each method: S-CIELAB difference (about 1 can just be seen), mean over "
        f"{_how_told(images, 'the optimal filter')} Blue: the derived filters; orange: others.",
        thesis="Fig. 4.12 and section 4.5.4: 22 people preferred the optimal filter significantly (p < 0.01, t-test) to a box and a Mitchell "
        "filter for each subpixel and to a Mitchell filter for each pixel, on six images.",
        agreement=agreement,
        comparison=comparison,
    )


def layouts_figure(analysis: Analysis, folder: pathlib.Path) -> Figure | None:
    """The displays by the optimal filter, best first; None where fewer than two were compared."""
    if analysis.layouts is None or analysis.layouts.num_rows < 2 or analysis.scores is None:
        return None
    rows = analysis.layouts.to_pylist()
    points = scores_of(analysis.scores, "layout", "method", OPTIMAL)
    file = folder / "layouts.png"
    dot_plot(file, [(layout_title(row["layout"]), row, points[row["layout"]], True) for row in rows], "Displays compared, by the optimal filter")
    reference = next((row["layout"] for row in rows if row["verdict"] == "reference"), rows[0]["layout"])
    families = {display.layout.name: family(display.layout) for display in analysis.displays}
    agreement, comparison = compared_layouts(points, families)
    images = len(next(iter(points.values())))
    return Figure(
        name="layouts",
        title="Displays compared",
        file=file,
        alt=f"A dot plot of {len(rows)} displays by mean S-CIELAB difference, from {layout_title(rows[0]['layout'])} ({rows[0]['scielab']:.2f}) to "
        f"{layout_title(rows[-1]['layout'])} ({rows[-1]['scielab']:.2f}).",
        caption="How far each display is from the picture at full resolution by the optimal filter: S-CIELAB difference (about 1 can just be "
        f"seen), mean over {_how_told(images, layout_title(reference))} Displays have equally many pixels, not subpixels.",
        thesis="Fig. 4.13 and section 4.5.4: RGB and RGBW were not significantly different; both were significantly better than RGBG (p < 0.01, "
        "t-test).",
        agreement=agreement,
        comparison=comparison,
    )


def scores_of(scores: pa.Table, of: str, fixed: str, value: str, score: str = "scielab") -> dict[str, F64]:
    """A score of each image, in the images' alphabetical order, by method or layout (``of``), where the other (``fixed``) has a value."""
    found: dict[str, dict[str, float]] = {}
    for row in scores.select([of, fixed, "image", score]).to_pylist():
        if row[fixed] == value:
            found.setdefault(row[of], {})[row["image"]] = row[score]
    return {name: np.array([by_image[image] for image in sorted(by_image)]) for name, by_image in found.items()}


def paired(first: F64, second: F64) -> PairedTest:
    """The t-test of two methods' or displays' scores of the same images; what does not differ at all has p = 1."""
    from scipy import stats

    change = first - second
    if len(change) < 2 or np.ptp(change) <= 1e-12:
        return PairedTest(float(change.mean()), 1.0 if len(change) < 2 or abs(change.mean()) <= 1e-12 else 0.0)
    return PairedTest(float(change.mean()), float(stats.ttest_1samp(change, 0.0).pvalue))


def compared_methods(points: Mapping[str, F64], rows: Sequence[Mapping[str, Any]], unlimited: Mapping[str, F64]) -> tuple[Agreement, str]:
    """Whether the optimal filter is significantly better than those of the thesis's study, in words; ``unlimited``: scores without clipping."""
    there = [name for name in STUDIED if name in points]
    if OPTIMAL not in points or not there:
        return "not comparable", "The methods of the thesis's study were not all compared here."
    count = len(points[OPTIMAL])
    tests = {name: paired(points[OPTIMAL], points[name]) for name in there}
    better = [name for name in there if tests[name].better]
    text = f"S-CIELAB of the optimal filter minus that of {_listed_tests(tests)}."
    worse = [name for name in there if tests[name].worse]
    same = [name for name in there if name not in better and name not in worse]
    groups = (("significantly better than", better), ("not told apart from", same), ("significantly worse than", worse))
    text += " It is " + "; ".join(f"{how} {listed([TITLES.get(name, name) for name in names])}" for how, names in groups if names) + "."
    first = [
        row["method"] for row in rows if row["method"] != OPTIMAL and row["scielab"] < next(r["scielab"] for r in rows if r["method"] == OPTIMAL)
    ]
    text += f" By the mean it ranks behind {listed([TITLES.get(n, n) for n in first])}." if first else " By the mean it ranks first of all."
    if count < FEWEST_IMAGES:
        return "not comparable", f"{text} {_few(count)}"
    missed = {name: paired(unlimited[OPTIMAL], unlimited[name]) for name in there if name not in better}
    if missed:
        blame = "clipping alone keeps it from that" if all(test.better for test in missed.values()) else "clipping alone is not why"
        text += f" Where nothing is clipped: {_listed_tests(missed)}; {blame}."
    return ("agrees" if len(better) == len(STUDIED) else "differs"), f"{text} A test over images, not people."


def compared_layouts(points: Mapping[str, F64], families: Mapping[str, str]) -> tuple[Agreement, str]:
    """Whether RGB and RGBW are alike and RGBG is worse than both, in words."""
    found = {kind: next((name for name in points if families.get(name) == kind), None) for kind in ("RGB", "RGBW", "RGBG")}
    names = {kind: name for kind, name in found.items() if name is not None}
    if len(names) < 3:
        missing = listed([kind for kind in found if kind not in names])
        return "not comparable", f"The thesis compares RGB, RGBW and RGBG; {missing} {'is' if len(names) == 2 else 'are'} not among these displays."
    alike = paired(points[names["RGB"]], points[names["RGBW"]])
    rgb, rgbw = (paired(points[names[kind]], points[names["RGBG"]]) for kind in ("RGB", "RGBW"))
    text = (
        f"S-CIELAB of RGB minus that of RGBW: {_test(alike)}; of RGB minus RGBG: {_test(rgb)}; of RGBW minus RGBG: {_test(rgbw)}. "
        f"RGB and RGBW are {'' if alike.p < SIGNIFICANT else 'not '}told apart; RGBG is "
        + (
            "significantly worse than both."
            if rgb.better and rgbw.better
            else f"significantly worse than {'RGB' if rgb.better else 'RGBW'} alone."
            if rgb.better or rgbw.better
            else "significantly worse than neither."
        )
    )
    if len(points[names["RGB"]]) < FEWEST_IMAGES:
        return "not comparable", f"{text} {_few(len(points[names['RGB']]))}"
    return ("agrees" if alike.p >= SIGNIFICANT and rgb.better and rgbw.better else "differs"), text


def dot_plot(file: pathlib.Path, rows: Sequence[tuple[str, Mapping[str, Any], F64, bool]], title: str) -> None:
    """Means with their intervals as dots and lines, one row for each name, best on top, and the single images below. Writes a PNG.

    Rows: name, a ranking's row (``scielab``, ``low``, ``high``, ``verdict``), the images' scores, whether it is a derived filter.
    """
    figure, axes = new_chart((8.4, 1.15 + 0.5 * len(rows)), title)
    axes.set_xscale("log")
    for i, (_, row, points, derived) in enumerate(rows):
        color = COLORS[0] if derived else COLORS[1]
        axes.axhline(i, color=FAINT, linewidth=0.7, zorder=1)
        axes.plot(
            np.maximum(points, 1e-4), np.full(len(points), i + _SIDE), "o", color=color, markersize=3.4, alpha=0.55, markeredgewidth=0, zorder=2
        )
        known = row["low"] is not None and row["high"] is not None  # of too few images no interval is told
        if known:
            axes.plot([row["low"], row["high"]], [i, i], "-", color=color, linewidth=2.2, solid_capstyle="butt", zorder=3)
        axes.plot([row["scielab"]], [i], "o", color=color, markersize=9, markeredgecolor="white", zorder=4)
        text = f"{row['scielab']:.2f}  [{row['low']:.2f}, {row['high']:.2f}]" if known else f"{row['scielab']:.2f}"
        axes.annotate(text, (1.01, i), xycoords=("axes fraction", "data"), va="center_baseline", fontsize=9, color=INK)
        verdict = "" if row["verdict"] in ("reference", "too few images") else row["verdict"]
        axes.annotate(verdict, (1.01, i + 0.34), xycoords=("axes fraction", "data"), va="center_baseline", fontsize=7.5, color=QUIET)
    axes.set_yticks(range(len(rows)), [name for name, *_ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    quiet(axes)
    axes.tick_params(axis="y", length=0, labelsize=9.5)
    axes.spines["left"].set_visible(False)
    interval = ", 95 % interval" if all(row["low"] is not None for _, row, *_ in rows) else ""
    axes.set_xlabel(f"mean S-CIELAB difference to full resolution (log axis){interval}; small: single images", fontsize=9)
    plain_numbers(axes.xaxis, (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
    save_panels(figure, file)


def _how_told(images: int, reference: str) -> str:
    """What the dots and numbers of a chart over so many images are, as the end of a sentence and more."""
    if images < FEWEST_IMAGES:
        return f"{images} image{'s' * (images != 1)}, too few for intervals; small dots: single images."
    return (
        f"{images} images, with its 95 % interval from resampling the images; small dots: single images. Right: both, and how it differs from "
        f"{reference} image by image, where the 95 % interval of that difference leaves out 0."
    )


def _listed_tests(tests: Mapping[str, PairedTest]) -> str:
    return "; ".join(f"{TITLES.get(name, name)}: {_test(test)}" for name, test in tests.items())


def _few(count: int) -> str:
    return f"{count} {'image is' if count == 1 else 'images are'} too few to tell: {FEWEST_IMAGES} are needed."


def _test(test: PairedTest) -> str:
    p = "p < 0.0001" if test.p < 1e-4 else f"p = {test.p:.2g}"
    return f"{test.difference:+.2f} ({p})".replace("-", "−")
