"""The process that bundles and draws paths of a recorded run, on request, and says how long each took."""

import math
import pathlib
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from pipeline.bench.pictures import BUNDLE, DRAW, PYTHON, STRAIGHT
from pipeline.bench.probe import own_peak_bytes
from pipeline.bench.timing import timed
from pipeline.bench.worker import serve
from queries.path_sample import PathSample, sample_paths
from queries.run import open_run
from queries.selection import Selection
from viz.bundles import BundledPaths, bundled, vertex_codes
from viz.bundles.layers import CurveLayer
from viz.cameras import job_pose
from viz.look import Look
from viz.stage import Stage

AMOUNT = 0.85
EVERY = 100  # of the segments, one is bundled by plain Python


def artist(path: pathlib.Path, paths: int, points: int, size: tuple[int, int]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Open a run and choose paths; a function that bundles or draws them, ``{what}``, and gives ``{wall, cpu}``."""
    run = open_run(path)
    with timed() as choosing:
        sample = sample_paths(run, Selection(), paths, "uniform")
    codes = vertex_codes(sample, ("event", "object"), np.zeros(len(run.tables["objects"]), np.int64))
    curves = bundled(sample, codes, AMOUNT, points)
    _check(sample, curves, points, run.geometry.extent)

    def draw() -> None:
        with Stage(run, Look(), size) as stage:
            count = len(curves.segments)
            CurveLayer(stage, curves.curves, np.full((count, 3), 0.7, np.float32), np.ones(count, np.float32), 1.0)
            stage.picture(job_pose(run))

    work: dict[str, Callable[[], object]] = {
        BUNDLE: lambda: bundled(sample, codes, AMOUNT, points),
        PYTHON: lambda: _bundled_in_python(sample, curves, points),
        DRAW: draw,
        STRAIGHT: lambda: _drawn_straight(sample, curves, size),
    }

    def answer(request: Mapping[str, Any]) -> dict[str, Any]:
        if request["what"] == "sample":
            known = {"paths": len(sample), "found": sample.found, "segments": len(curves.segments), "every": EVERY}
            return known | {"wall": choosing.timing.wall}
        if request["what"] == "peak":
            return {"peak_bytes": own_peak_bytes()}
        with timed() as watch:
            work[request["what"]]()
        scale = EVERY if request["what"] == PYTHON else 1
        return {"wall": watch.timing.wall * scale, "cpu": watch.timing.cpu * scale}

    return answer


def _check(sample: PathSample, paths: BundledPaths, points: int, extent: float) -> None:
    """Both must make the same curves, or it is not the same work. Raises ValueError."""
    theirs = np.array(_bundled_in_python(sample, paths, points))
    apart = float(np.abs(theirs - paths.curves[::EVERY]).max())
    if apart > 1e-5 * extent:
        raise ValueError(f"curves bundled in Python are {apart:g} world units apart from ours, in a scene of {extent:g}")


def _bundled_in_python(sample: PathSample, paths: BundledPaths, points: int) -> list[list[tuple[float, ...]]]:
    """What one would write from the thesis: Eqs. 8.1 and 8.2 for one point after the other, the bundles' axes given."""
    curves = []
    for i in range(0, len(paths.segments), EVERY):
        row, bundle = paths.segments.begin[i], paths.segments.bundle[i]
        x0, x1 = sample.points[row].tolist(), sample.points[row + 1].tolist()
        c0, c1 = paths.axes.begin[bundle].tolist(), paths.axes.end[bundle].tolist()
        axis = [b - a for a, b in zip(c0, c1)]
        square = sum(d * d for d in axis) or 1.0
        targets = []
        for x in (x0, x1):
            along = sum((p - c) * d for p, c, d in zip(x, c0, axis)) / square
            targets.append([c + along * d for c, d in zip(c0, axis)])
        curve = []
        for k in range(points):
            u = k / (points - 1)
            t = AMOUNT * (0.5 + 0.5 * math.cos(2 * math.pi * u - math.pi))
            straight = [(1 - u) * a + u * b for a, b in zip(x0, x1)]
            target = [(1 - u) * a + u * b for a, b in zip(*targets)]
            curve.append(tuple((1 - t) * a + t * b for a, b in zip(straight, target)))
        curves.append(curve)
    return curves


def _drawn_straight(sample: PathSample, paths: BundledPaths, size: tuple[int, int]) -> None:
    """The same segments with no curves, no shading and no scene: the least that pyvista does with them."""
    import pyvista

    begin = paths.segments.begin
    ends = np.stack([sample.points[begin], sample.points[begin + 1]], axis=1).reshape(-1, 3).astype(np.float64)
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
    plotter.add_mesh(pyvista.line_segments_from_points(ends), color="white", lighting=False)
    plotter.screenshot(return_img=True)
    plotter.close()


if __name__ == "__main__":
    _, folder, count, curve_points, width, height = sys.argv
    serve(lambda: artist(pathlib.Path(folder), int(count), int(curve_points), (int(width), int(height))))
