"""The process that traces a job with one build of the kernels, on request. See ``pipeline.bench.features``."""

import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.bench.diffuse_alone import take_out_the_rest
from pipeline.bench.timing import timed
from pipeline.bench.worker import serve
from pipeline.prepare import prepare_job
from pipeline.shards import plan_shards
from renderer.accelerators import Accelerators
from renderer.bsdfs.base import Families
from renderer.film import Film
from renderer.scene.arrays import SceneArrays
from renderer.trace import Tracer

TABLE_ENTRIES = 64  # of a rough plastic's transmittance


def with_everything(arrays: SceneArrays) -> SceneArrays:
    """The scene with the tags of all BSDFs and emitters set, so that kernels keep them, and the table that rough plastics read."""
    emitters = arrays.emitters._replace(curved=True, delta=True, sky=True)
    materials = arrays.materials._replace(tables=np.ones((1, TABLE_ENTRIES), np.float32))
    return arrays._replace(families=Families(True, True, True), emitters=emitters, materials=materials)


def tracer(build: str, threads: int, job: Path, overrides: list[str]) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Load the job for a build, and compile; a function that traces it all, unrecorded, and answers ``{wall, cpu, mean}``."""
    if build == "alone":
        take_out_the_rest()
    prepared = prepare_job(job, overrides)
    scene, settings = prepared.scene, prepared.settings
    if build == "everything":
        scene = replace(scene, arrays=with_everything(scene.arrays))
    accelerators = Accelerators(scene)
    tracers = [Tracer(scene, settings, accelerators) for _ in range(threads)]
    for one in tracers:
        one.warm_up()
    films = [Film(settings.width, settings.height, settings.filter) for _ in tracers]
    shards = plan_shards(settings.walks)

    def work(i: int) -> None:
        films[i].clear()
        for shard in shards[i::threads]:
            tracers[i].trace((shard.first, shard.count), None, films[i])

    def trace(_request: Mapping[str, Any]) -> dict[str, Any]:
        with timed() as watch:
            workers = [threading.Thread(target=work, args=(i,)) for i in range(threads)]
            for worker in workers:
                worker.start()
            for worker in workers:
                worker.join()
        mean = sum(float(film.sums[..., :3].sum()) for film in films) / (3 * settings.walks)
        return {"wall": watch.timing.wall, "cpu": watch.timing.cpu, "mean": mean}

    return trace


if __name__ == "__main__":
    _, name, count, path, *changes = sys.argv
    serve(lambda: tracer(name, int(count), Path(path), changes))
