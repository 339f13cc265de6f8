"""How long a film takes to resolve for a display's subpixels, beside its box image, and what each method buys for its time."""

import itertools
from collections.abc import Callable
from typing import Any

from pipeline.bench.questions import recorded
from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import Timing, alternate, ratio, spread
from pipeline.bench.worker import Worker

BOX, DERIVE, SCORES = "box image of the run", "derivation and fits of all layouts", "scores"


def measure_subpixel(session: Session) -> SectionResult:
    """Resolve a recorded run by every method on every display in rounds, beside its box image; then judge the methods on the test images."""
    asked = session.benchmark.subpixel
    with recorded(session, session.settings.passes) as folder:
        arguments = [str(folder.path), str(session.benchmark.threads), *asked.layouts]
        with Worker("pipeline.bench.subpixel_worker", arguments, session.logs / "subpixel.log") as worker:
            work: dict[str, dict[str, str]] = {BOX: {}, DERIVE: {}} | {
                _name(layout, method): {"layout": layout, "method": method} for layout in asked.layouts for method in asked.methods
            }
            contenders = {name: _ask(worker, what=name, **details) for name, details in work.items()}
            for ask in contenders.values():
                ask(0)  # warm: kernels are loaded, pages are mapped
            walls = {who: [timing.wall for timing in found] for who, found in alternate(contenders, session.benchmark.rounds).items()}
            scores: dict[str, dict[str, float]] = worker.ask(what=SCORES, methods=asked.methods)["scores"]
    first = _name(asked.layouts[0], "optimal")
    film = f"{session.settings.width} × {session.settings.height}, {session.settings.passes} samples"
    rows = []
    if first in walls:
        cost = ratio(walls[first], walls[BOX])
        measured = f"{cost.text('.2f', ' ×')}: {spread(walls[first]).median:.2f} s beside {spread(walls[BOX]).median:.2f} s"
        what, goal = f"optimal filter for {asked.layouts[0]}, {film}", f"≤ {asked.most_ratio:g} × its box image"
        rows.append(Row(what, goal, measured, cost.median <= asked.most_ratio))
    derivation = spread(walls[DERIVE])
    most = asked.most_derivation_seconds
    rows.append(Row("deriving and fitting the filters of all layouts", f"≤ {most:g} s", derivation.text(".2f", " s"), derivation.median <= most))
    cells, costs = [], []
    for layout, method in itertools.product(asked.layouts, asked.methods):
        taken, score = walls[_name(layout, method)], scores[layout][method]
        cells.append([layout, method, spread(taken).text(".2f", " s"), f"{ratio(taken, walls[BOX]).median:.2f} ×", f"{score:.2f}"])
        costs.append({"layout": layout, "method": method, "seconds": taken, "scielab": score})
    table = markdown_table(["display", "method", "wall time, median (range)", "of the box image", "mean S-CIELAB difference"], cells)
    note = (
        f"{film}; {folder.paths:,} paths; the box image takes {spread(walls[BOX]).text('.2f', ' s')}. Times are whole resolves of the run, for every "
        "subpixel of the display; S-CIELAB is the mean over the project's own test images."
    )
    figures = {"wall_seconds": walls, "costs": costs, "paths": folder.paths}
    return SectionResult(rows, figures, [table, note])


def _name(layout: str, method: str) -> str:
    return f"{layout}: {method}"


def _ask(worker: Worker, **request: Any) -> Callable[[int], Timing]:
    def timing(_round: int) -> Timing:
        reply: dict[str, Any] = worker.ask(**request)
        return Timing(reply["wall"], reply["cpu"])

    return timing
