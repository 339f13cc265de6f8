"""What features cost a scene that lacks them: the same trace by three builds of the kernels.

- ``specialized``: the program as it is, all features available; kernels are specialized on what the scene uses.
- ``diffuse alone``: every other BSDF, emitter and shape is taken out of the sources before the kernels are compiled.
- ``everything``: all features are compiled into the kernels, as if the scene used them. It shows what specialization saves.
"""

from contextlib import ExitStack

from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import Timing, alternate, ratio, spread
from pipeline.bench.worker import Worker, WorkerError
from pipeline.progress import LOG

BUILDS = ("specialized", "alone", "everything")
LABELS = {
    "specialized": "specialized on the scene (the program)",
    "alone": "diffuse alone in the sources",
    "everything": "every feature in the kernels",
}
LEAST = 0.97
TITLE, GOAL = "a diffuse scene, all features available, against a build with diffuse alone", "rate ≥ 0.97 ×"
SAME = 1e-4  # relative difference of image means between builds: rounding, and nothing else


def measure_features(session: Session) -> SectionResult:
    """Time the three builds, each in a process of its own and, where its sources differ, with a kernel cache of its own."""
    arrays = session.scene.arrays
    emitters = arrays.emitters
    others = (*arrays.families, emitters.curved, emitters.delta, emitters.sky, arrays.geometry.quadrics, arrays.textures)
    if any(piece is not None for piece in others) or session.settings.method != "path":
        return SectionResult([Row(TITLE, GOAL, "not measured: the job is not a path-traced diffuse scene lit by rectangles")])
    samples, rounds = session.benchmark.features.samples, session.benchmark.features.rounds
    arguments = [
        str(session.benchmark.threads),
        str(session.loaded.job),
        *session.loaded.overrides,
        f"render.samples={samples}",
        "render.sampler=independent",
    ]
    with ExitStack() as stack:
        workers: dict[str, Worker] = {}
        for build in BUILDS:
            cache = {"PATHSPACE_CACHE": str(session.scratch / "alone"), "NUMBA_CACHE_DIR": None} if build == "alone" else {}
            worker = Worker("pipeline.bench.features_worker", [build, *arguments], session.logs / f"features-{build}.log", **cache)
            workers[build] = stack.enter_context(worker)
        LOG.info("compiling kernels of three builds …")
        means = {build: worker.ask()["mean"] for build, worker in workers.items()}
        if max(means.values()) - min(means.values()) > SAME * max(means.values()):
            raise WorkerError(f"the builds do not render the same picture (means {means}): their times cannot be compared")
        timings = alternate({build: lambda _number, worker=worker: timing(worker) for build, worker in workers.items()}, rounds)  # type: ignore[misc]
    walls = {build: [found.wall for found in founds] for build, founds in timings.items()}
    cpus = {build: [found.cpu for found in founds] for build, founds in timings.items()}
    found = ratio(walls["alone"], walls["specialized"])
    row = Row(TITLE, GOAL, found.text(".3f", " ×"), found.median >= LEAST)
    lines = []
    for build in BUILDS:
        relative = [ratio(times["alone"], times[build]).text(".3f", " ×") for times in (walls, cpus)]
        lines.append([LABELS[build], spread(walls[build]).text(".3f", " s"), *relative])
    table = markdown_table(["build of the kernels", "wall time, median (range)", "rate / diffuse alone", "rate / diffuse alone, by CPU time"], lines)
    return SectionResult([row], {"wall_seconds": walls, "cpu_seconds": cpus}, [table])


def timing(worker: Worker) -> Timing:
    """One trace by a build."""
    reply = worker.ask()
    return Timing(reply["wall"], reply["cpu"])
