"""The process that renders a job's scene with Mitsuba 3's path tracer, on request."""

import copy
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.bench.timing import timed
from pipeline.bench.worker import serve
from pipeline.prepare import prepare_job
from renderer.scene.to_mitsuba import mitsuba_dict
from renderer.settings import UNBOUNDED_DEPTH, TraceSettings

SENSORS = ("perspective", "thinlens")


def described(description: dict[str, Any], settings: TraceSettings) -> dict[str, Any]:
    """The scene with the job's film, depths and an independent sampler, and Mitsuba's `path`."""
    changed = {key: value for key, value in copy.deepcopy(description).items() if key != "integrator"}
    depth = -1 if settings.max_depth >= UNBOUNDED_DEPTH else settings.max_depth
    changed["integrator"] = {"type": "path", "max_depth": depth, "rr_depth": settings.rr_depth}
    for sensor in changed.values():
        if isinstance(sensor, dict) and sensor.get("type") in SENSORS:
            for key in [key for key, value in sensor.items() if isinstance(value, dict) and key != "to_world"]:
                del sensor[key]
            film = {"width": settings.width, "height": settings.height, "pixel_format": "rgb", "rfilter": {"type": settings.filter}}
            sensor["film"] = {"type": "hdrfilm", **film}
            sensor["sampler"] = {"type": "independent"}
    return changed


def renderer(variant: str, threads: int, job: Path, overrides: list[str]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Load the scene in a variant; a function that answers ``{samples, seed, image}`` with ``{wall, cpu}``.

    ``image`` is where to write the picture (.npy), or None. The time ends when the pixels lie in a numpy array.
    """
    import drjit as dr
    import mitsuba as mi

    mi.set_variant(variant)
    if dr.thread_count() != threads:
        dr.set_thread_count(threads)
    prepared = prepare_job(job, overrides)
    scene = mi.load_dict(mitsuba_dict(described(prepared.scene.description, prepared.settings)))

    def render(request: Mapping[str, Any]) -> dict[str, Any]:
        if "samples" not in request:
            return {"version": mi.__version__, "threads": dr.thread_count(), "llvm": os.environ.get("DRJIT_LIBLLVM_PATH")}
        with timed() as watch:
            image = np.array(mi.render(scene, spp=request["samples"], seed=request["seed"]))
        if request.get("image"):
            np.save(request["image"], image)
        return {"wall": watch.timing.wall, "cpu": watch.timing.cpu}

    return render


if __name__ == "__main__":
    _, name, count, path, *changes = sys.argv
    serve(lambda: renderer(name, int(count), Path(path), changes))
