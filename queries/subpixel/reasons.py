"""Why the optimal filter loses where it loses: from the figures of the comparison, in sentences.

Its loss to the best method has parts that can be measured: what clipping costs it beyond what it costs the winner; what the analytic, clamped filter
costs beyond all solved kernels; and that it minimizes another measure than the one that judges. Each is told where the figures show it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import pyarrow as pa

from renderer.filters.subpixel.methods import TITLES

Row = Mapping[str, float]
OPTIMAL, KERNELS = "optimal", "kernels"
SMALL = 0.1  # parts of a loss below this share of it are not told


@dataclass(frozen=True)
class Reason:
    """What is said, in sentences, of a ``layout`` and an ``image``."""

    layout: str
    image: str
    text: str


def reasons(scores: pa.Table) -> tuple[Reason, ...]:
    """One for each layout and image on which another method has a smaller S-CIELAB difference than ``optimal``.

    ``scores``: the table of ``queries.subpixel.evaluate.judge``; in the order of its rows.
    """
    found: dict[tuple[str, str], dict[str, Row]] = {}
    for row in scores.to_pylist():
        found.setdefault((row["layout"], row["image"]), {})[row["method"]] = row
    return tuple(
        Reason(layout, image, _loss(methods))
        for (layout, image), methods in found.items()
        if OPTIMAL in methods and min(row["scielab"] for row in methods.values()) < methods[OPTIMAL]["scielab"]
    )


def _loss(methods: Mapping[str, Row]) -> str:
    """Who wins, by how much, and why."""
    optimal = methods[OPTIMAL]
    winner = min(methods, key=lambda name: methods[name]["scielab"])
    best = methods[winner]
    share = 1.0 - best["scielab"] / optimal["scielab"]
    parts = [_parts(optimal, best), _clipping(optimal, best), _simplified(methods, winner), _measures(methods, winner)]
    return " ".join(
        [
            f"{TITLES[winner][:1].upper()}{TITLES[winner][1:]} beats {TITLES[OPTIMAL]} by {_percent(share)} "
            f"(S-CIELAB {_number(best['scielab'])} against {_number(optimal['scielab'])}).",
            *(part for part in parts if part),
        ]
    )


def _parts(optimal: Row, best: Row) -> str:
    """Whether lightness or color loses."""
    names = {"lightness": "lightness (blur, ringing", "chroma": "color (fringes"}
    more = {part: optimal[part] - best[part] for part in names}
    told = [part for part in sorted(names, key=lambda part: -more[part]) if _number(optimal[part]) != _number(best[part])]
    told = [part for part in told if abs(more[part]) > SMALL * max(map(abs, more.values()))]
    figures = {part: f"{names[part]}: {_number(optimal[part])} against {_number(best[part])})" for part in told}
    lost, kept = ([figures[part] for part in told if (more[part] > 0.0) is loses] for loses in (True, False))
    won = f"{'; it' if lost else 'It'} wins in {' and in '.join(kept)}" if kept else ""
    return f"It loses in {' and in '.join(lost)}{won}." if lost else f"{won}, but not where both meet." if won else ""


def _clipping(optimal: Row, best: Row) -> str:
    """What clipping has to do with it."""
    gap = optimal["scielab"] - best["scielab"]
    unclipped = optimal["scielab_unclipped"] - best["scielab_unclipped"]
    if abs(gap - unclipped) <= SMALL * gap or max(optimal["clipped"], best["clipped"]) == 0.0:
        return ""
    told = f"{_number(optimal['scielab_unclipped'])} against {_number(best['scielab_unclipped'])}"
    clipping = f"clipping ({_percent(optimal['clipped'])} of its subpixels, {_percent(best['clipped'])} of the other's)"
    if unclipped < 0.0:
        return f"The cause is {clipping}: on a display without limits it would win, {told}."
    if unclipped < gap:
        return f"Of the loss {_percent(1.0 - unclipped / gap)} comes from {clipping}: on a display without limits it would be {told}."
    return f"Without {clipping} it would lose by more, {told}."


def _simplified(methods: Mapping[str, Row], winner: str) -> str:
    """What the analytic filter costs beyond the solved kernels."""
    if KERNELS not in methods:
        return ""
    optimal, kernels, best = (methods[name]["scielab"] for name in (OPTIMAL, KERNELS, winner))
    gap, won = optimal - best, optimal - kernels
    if winner == KERNELS:
        return "What it omits costs it that: the kernels between colors, and the tails beyond its clamp."
    if won > SMALL * gap:
        return f"The kernels between colors and the tails that it omits would win back {_percent(won / gap)} of the loss."
    if won < -SMALL * gap:
        return f"All solved kernels would lose by more ({_number(kernels)}), so what the analytic filter omits is not the cause."
    return ""


def _measures(methods: Mapping[str, Row], winner: str) -> str:
    """Whether the error that the filter was made for says otherwise."""
    error = {name: methods[name]["weighted_error"] for name in (OPTIMAL, winner, KERNELS) if name in methods}
    if any(value is None for value in error.values()):
        return ""
    figures = f"{_number(error[OPTIMAL])} against {_number(error[winner])}"
    if error[OPTIMAL] < error[winner]:
        return f"By the error that it was derived to make least (Eq. 4.4) it is ahead, {figures}: the two measures disagree."
    if winner != KERNELS and KERNELS in error and error[KERNELS] < error[winner] <= error[OPTIMAL]:
        return (
            f"By the error of Eq. 4.4 it is behind too, {figures}, but the kernels that it approximates are ahead, {_number(error[KERNELS])}: "
            "the approximation, not the derivation, costs it that."
        )
    return ""


def _number(value: float) -> str:
    return f"{value:#.3g}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 0.0995 else f"{100.0 * share:.0f} %"
