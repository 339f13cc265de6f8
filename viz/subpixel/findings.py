"""What an analysis found, in sentences: the best method of each display, and where a simpler one beats the optimal filter."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from queries.subpixel.analysis import Analysis
from renderer.filters.subpixel.methods import TITLES
from viz.report.subpixel import image_title, interval, layout_title, method_title
from viz.subpixel.look import listed

OPTIMAL = ("optimal", "kernels")  # the derived methods; the others are simpler
_NAMED = 3  # losses of a display that are told one by one, the largest first
# What a verdict on one against the analytic optimal filter says of the first of the two
_TOLD = dict.fromkeys(("better", "worse"), "; the first is better beyond chance") | {"not told apart": "; these images do not tell the two apart"}
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


@dataclass(frozen=True)
class Loss:
    """An image on which a simpler method is closer to the reference than the analytic optimal filter. Scores are mean S-CIELAB differences."""

    layout: str
    image: str
    method: str
    scielab: float
    optimal: float


def best(analysis: Analysis) -> dict[str, str]:
    """The method that ranks first, by layout; none where methods were not compared."""
    return {name: ranked["method"][0].as_py() for name, ranked in analysis.methods.items()}


def losses(analysis: Analysis) -> list[Loss]:
    """Where a simpler method wins, in the order of the scores."""
    if analysis.scores is None:
        return []
    scores: dict[tuple[str, str], dict[str, float]] = {}
    for row in analysis.scores.select(["layout", "image", "method", "scielab"]).to_pylist():
        scores.setdefault((row["layout"], row["image"]), {})[row["method"]] = row["scielab"]
    found = []
    for (layout, image), by_method in scores.items():
        simple = {method: score for method, score in by_method.items() if method not in OPTIMAL}
        if "optimal" in by_method and simple:
            method = min(simple, key=lambda name: simple[name])
            if simple[method] < by_method["optimal"]:
                found.append(Loss(layout, image, method, simple[method], by_method["optimal"]))
    return found


def result(analysis: Analysis) -> list[str]:
    """The result, a paragraph of sentences for each display."""
    if not analysis.methods:
        displays = listed([layout_title(display.layout.name) for display in analysis.displays])
        return [f"Optimal filters were derived for {displays}, and applied. The methods were not compared."]
    lost = losses(analysis)
    return [_of_layout(analysis, name, [loss for loss in lost if loss.layout == name]) for name in analysis.methods]


def summary(analysis: Analysis) -> str:
    """The same as text, a line for each display."""
    return "\n".join(result(analysis))


def _of_layout(analysis: Analysis, layout: str, lost: list[Loss]) -> str:
    """What was found of one display: the best method, how the optimal filter stands to it, and where that loses."""
    ranked = analysis.methods[layout].to_pylist()
    first, images = ranked[0], ranked[0]["images"]
    score = _scored(first)
    text = f"{method_title(first['method'])} comes closest to the reference on {layout_title(layout)}: mean S-CIELAB difference {score}"
    text += f" over {images} images." if images > 1 else "."
    place = next((i for i, row in enumerate(ranked) if row["method"] == "optimal"), None)
    if place is None:
        return text
    if place:
        nth = _ORDINALS[place] if place < len(_ORDINALS) else f"number {place + 1}"
        text += f" The analytic optimal filter is {nth}, with {_scored(ranked[place])}{_TOLD.get(first['verdict'], '')}."
    elif len(ranked) > 1:
        text += f" Next is {_called(ranked[1]['method'])}, with {_scored(ranked[1])}{_TOLD.get(ranked[1]['verdict'], '')}."
    if not lost:
        return f"{text} No simpler method beats the optimal filter on any image."
    count = f"{len(lost)} of {images} images" if images > 1 else "the image"
    worst = sorted(lost, key=lambda loss: loss.scielab / max(loss.optimal, 1e-12))
    named = [f"{image_title(loss.image)} ({_called(loss.method)}: {_told_apart(loss.scielab, loss.optimal)})" for loss in worst[:_NAMED]]
    named += [f"{len(worst) - _NAMED} more"] if len(worst) > _NAMED else []
    return f"{text} A simpler method beats {'it' if place else 'the analytic optimal filter'} on {count}: {listed(named)}."


def _scored(row: Mapping[str, Any]) -> str:
    """A score and its interval, in words."""
    low, high = row["low"], row["high"]
    text = interval(row["scielab"], None, None)
    return text if low is None or high is None else f"{text} (95\u00a0% interval {interval(low, None, None)} to {interval(high, None, None)})"


def _told_apart(value: float, other: float) -> str:
    """Two numbers with as many digits as it takes to see that they differ, four at most."""
    digits = next((n for n in (2, 3) if f"{value:.{n}f}" != f"{other:.{n}f}"), 4)
    return f"{value:.{digits}f} against {other:.{digits}f}"


def _called(method: str) -> str:
    return TITLES.get(method, method)
