"""The process that resolves a recorded run for displays, on request, and says how long it took."""

import pathlib
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipeline.bench.subpixel import BOX, DERIVE, SCORES
from pipeline.bench.timing import timed
from pipeline.bench.worker import serve
from queries.images import image
from queries.run import open_run
from queries.subpixel.analyze import F32, TARGET_SIZE, Derived, RunSource
from queries.subpixel.description import SubpixelDescription, layout, shipped_layouts
from queries.subpixel.display import fine_grid
from queries.subpixel.evaluate import judge
from queries.subpixel.targets import target
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.windowed_sinc import fit


def projector(path: pathlib.Path, threads: int, names: Sequence[str]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Open a run; a function that resolves it, ``{what, layout, method}``, and gives ``{wall, cpu}``, or the scores of all methods."""
    source = RunSource(open_run(path, threads=threads), threads=threads)
    displays = {name: derived(name) for name in names}

    def answer(request: Mapping[str, Any]) -> dict[str, Any]:
        if request["what"] == SCORES:
            return {"scores": scores(displays, request["methods"])}
        with timed() as watch:
            if request["what"] == BOX:
                image(source.run, threads=threads)
            elif request["what"] == DERIVE:
                for name in shipped_layouts():
                    derived(name)
            else:
                source.lattice(request["method"], displays[request["layout"]], SubpixelDescription().zeros)
        return {"wall": watch.timing.wall, "cpu": watch.timing.cpu}

    return answer


def derived(name: str) -> Derived:
    """The filters of a shipped layout, for the default viewer."""
    kernels = derive(layout(name))
    return Derived(kernels.layout, kernels, fit(kernels))


def scores(displays: Mapping[str, Derived], methods: Sequence[str]) -> dict[str, dict[str, float]]:
    """Mean S-CIELAB differences over the project's test images, by layout and method."""
    asked = SubpixelDescription()
    layouts = {name: one.layout for name, one in displays.items()}
    fine = fine_grid(layouts.values())
    pictures: dict[str, F32] = {name: target(name, *TARGET_SIZE, fine) for name in asked.targets}
    kernels, fits = {name: one.kernels for name, one in displays.items()}, {name: one.fits for name, one in displays.items()}
    judged = judge(pictures, layouts, kernels, fits, asked.viewing, asked.sensitivity.sensitivity(), asked.zeros, fine, methods)
    means = judged.group_by(["layout", "method"]).aggregate([("scielab", "mean")]).to_pylist()
    found: dict[str, dict[str, float]] = {}
    for row in means:
        found.setdefault(row["layout"], {})[row["method"]] = row["scielab_mean"]
    return found


if __name__ == "__main__":
    _, folder, count, *layouts = sys.argv
    serve(lambda: projector(pathlib.Path(folder), int(count), layouts))
