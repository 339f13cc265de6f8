"""How long bundling a large sample of paths takes, and drawing it, beside the same paths as straight lines and beside plain Python."""

from collections.abc import Callable
from typing import Any

from pipeline.bench.questions import recorded
from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import Timing, alternate, ratio, spread
from pipeline.bench.worker import Worker

BUNDLE, DRAW, STRAIGHT, PYTHON = "bundling", "drawing", "drawing straight lines with pyvista alone", "bundling one segment at a time in Python"


def measure_pictures(session: Session) -> SectionResult:
    """Choose paths of a recorded run, then bundle and draw them in rounds, each beside a peer."""
    asked = session.benchmark.pictures
    with recorded(session, session.settings.passes) as folder:
        arguments = [str(folder.path), str(asked.paths), str(asked.points), *map(str, asked.size)]
        with Worker("pipeline.bench.pictures_worker", arguments, session.logs / "pictures.log") as worker:
            sample = worker.ask(what="sample")
            contenders = {what: _ask(worker, what) for what in (BUNDLE, PYTHON, DRAW, STRAIGHT)}
            for ask in contenders.values():
                ask(0)  # warm: libraries are loaded
            walls = {who: [timing.wall for timing in found] for who, found in alternate(contenders, session.benchmark.rounds).items()}
            peak = worker.ask(what="peak")["peak_bytes"]
    paths, segments = sample["paths"], sample["segments"]
    size = " × ".join(map(str, asked.size))
    rows = [
        _row(f"bundling {paths:,} paths", walls, BUNDLE, PYTHON, asked.most_bundling_seconds),
        _row(f"drawing them at {size}", walls, DRAW, STRAIGHT, asked.most_drawing_seconds),
    ]
    table = markdown_table(["what", "wall time, median (range)"], [[what, spread(found).text(".2f", " s")] for what, found in walls.items()])
    note = (
        f"{paths:,} of {sample['found']:,} paths, chosen in {sample['wall']:.2f} s, {segments:,} segments of {asked.points} points each. Bundling is "
        f"assignment, axes and curves; drawing is shading, the scene, software OpenGL and the picture's pixels. Plain Python bundles every "
        f"{sample['every']:,}th segment, and its time is multiplied by that. Peak memory {peak / 1e9:.1f} GB."
    )
    return SectionResult(rows, {"wall_seconds": walls, "peak_bytes": peak, **sample}, [table, note])


def _ask(worker: Worker, what: str) -> Callable[[int], Timing]:
    def timing(_round: int) -> Timing:
        reply: dict[str, Any] = worker.ask(what=what)
        return Timing(reply["wall"], reply["cpu"])

    return timing


def _row(what: str, walls: dict[str, list[float]], ours: str, peer: str, goal: float) -> Row:
    found = spread(walls[ours])
    measured = f"{found.text('.2f', ' s')}; {ratio(walls[ours], walls[peer]).median:.3g} × {peer}"
    return Row(what, f"≤ {goal:g} s", measured, found.median <= goal)
