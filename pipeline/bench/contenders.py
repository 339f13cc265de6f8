"""Who renders: ours through the real executor, recorded or not, and Mitsuba 3 in a process of its own."""

import importlib.util
import pathlib
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from pipeline.bench.llvm import VARIABLE, find_llvm
from pipeline.bench.timing import Timing, timed
from pipeline.bench.worker import Worker, WorkerError
from pipeline.executor import render_shards
from pipeline.film_sum import sum_films
from pipeline.progress import LOG, Progress
from pipeline.run_folder import RunFolder
from pipeline.shards import plan_shards
from renderer.accelerators import Accelerators
from renderer.film import Film
from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings
from renderer.trace import Tracer

F32 = npt.NDArray[np.float32]
OURS = {"independent": "ours, independent", "sobol": "ours, Sobol", "recorded": "ours, recorded", "recorded_sobol": "ours, Sobol, recorded"}
MITSUBA = {"mitsuba_llvm": "Mitsuba llvm", "mitsuba_scalar": "Mitsuba scalar"}
LABELS = OURS | MITSUBA
"""How people read the contenders' names."""


class NotAvailable(Exception):
    """A contender that this machine lacks, with the reason."""


class Contender(Protocol):
    """Somebody who renders the job's scene."""

    def render(self, samples: int, seed: int) -> Timing:
        """Render and forget the picture."""
        ...

    def picture(self, samples: int, seed: int) -> tuple[F32, Timing]:
        """Render; the picture is float32 (height, width, 3), linear, and making it ready is not in the time where it is a copy of a film."""
        ...


class Ours:
    """Our tracer through the executor that `pathspace run` uses, into a run folder that is removed afterwards.

    The time is the manifest's ``render_seconds``: tracing and recording, without start-up and compilation.
    """

    def __init__(self, scene: Scene, settings: TraceSettings, threads: int, scratch: pathlib.Path) -> None:
        self.scene, self.settings, self.threads, self.scratch = scene, settings, threads, scratch
        self.accelerators = Accelerators(scene)
        Tracer(scene, settings, self.accelerators).warm_up()

    def render(self, samples: int, seed: int) -> Timing:
        """Render and forget the picture."""
        return self._rendered(replace(self.settings, passes=samples, seed=seed), None)

    def picture(self, samples: int, seed: int) -> tuple[F32, Timing]:
        """Render; the film's sum is read from the run folder."""
        film = Film(self.settings.width, self.settings.height, self.settings.filter)
        timing = self._rendered(replace(self.settings, passes=samples, seed=seed), film)
        return film.image(self.settings.method, samples), timing

    def _rendered(self, settings: TraceSettings, film: Film | None) -> Timing:
        """One render into a new folder, timed; ``film`` receives the shards' sum."""
        folder = RunFolder(self.scratch / "render")
        shards = plan_shards(settings.walks)
        first = Tracer(self.scene, settings, self.accelerators)
        first.warm_up()
        tracers: list[Callable[[], Tracer]] = [lambda: first]
        tracers += [lambda: Tracer(self.scene, settings, self.accelerators)] * (min(self.threads, len(shards)) - 1)
        try:
            with folder.locked():
                folder.prepare()
                with timed() as watch:
                    render_shards(folder, shards, settings, tracers, Progress("tracing", settings.walks, "samples"))
                if film is not None:
                    sum_films(folder, shards, film)
        finally:
            shutil.rmtree(folder.path, ignore_errors=True)
        return watch.timing


class Mitsuba:
    """Mitsuba's `path` in a process of its own, which holds the scene and compiled kernels between requests."""

    def __init__(self, worker: Worker, scratch: pathlib.Path) -> None:
        self.worker, self.scratch = worker, scratch
        self.about = worker.ask()

    def render(self, samples: int, seed: int) -> Timing:
        """Render and forget the picture."""
        reply = self.worker.ask(samples=samples, seed=seed, image=None)
        return Timing(reply["wall"], reply["cpu"])

    def picture(self, samples: int, seed: int) -> tuple[F32, Timing]:
        """Render; the picture comes through a file."""
        file = self.scratch / "picture.npy"
        reply = self.worker.ask(samples=samples, seed=seed, image=str(file))
        return np.load(file).astype(np.float32), Timing(reply["wall"], reply["cpu"])


class Contenders:
    """The contenders of one benchmark, each made when it is first asked for. Close it to end their processes."""

    def __init__(
        self,
        scene: Scene,
        settings: TraceSettings,
        threads: int,
        job: pathlib.Path,
        overrides: Sequence[str],
        scratch: pathlib.Path,
        logs: pathlib.Path,
    ) -> None:
        self.scene, self.settings, self.threads, self.job, self.overrides = scene, settings, threads, job, overrides
        self.scratch, self.logs = scratch, logs
        self._made: dict[str, Contender | str] = {}
        self._workers: list[Worker] = []

    def get(self, name: str) -> Contender:
        """The contender of that name. Raises NotAvailable with the reason."""
        if name not in self._made:
            try:
                self._made[name] = self._mitsuba(name) if name in MITSUBA else self._ours(name)
            except NotAvailable as error:
                LOG.warning("%s: %s", LABELS[name], error)
                self._made[name] = str(error)
        made = self._made[name]
        if isinstance(made, str):
            raise NotAvailable(made)
        return made

    def available(self, names: Sequence[str]) -> tuple[dict[str, Contender], dict[str, str]]:
        """Those of the named contenders that are there, and why the others are not."""
        there: dict[str, Contender] = {}
        missing: dict[str, str] = {}
        for name in names:
            try:
                there[name] = self.get(name)
            except NotAvailable as error:
                missing[name] = str(error)
        return there, missing

    def about(self) -> dict[str, Any]:
        """What is known of the Mitsubas that were made: version, threads, LLVM library, or why they are missing."""
        found = {name: made.about if isinstance(made, Mitsuba) else made for name, made in self._made.items() if name in MITSUBA}
        return found

    def close(self) -> None:
        """End the helper processes."""
        for worker in self._workers:
            worker.close()

    def _ours(self, name: str) -> Ours:
        sampler = "sobol" if name.endswith("sobol") else "independent"
        keep = 1.0 if name.startswith("recorded") else 0.0
        return Ours(self.scene, replace(self.settings, sampler=sampler, keep=keep), self.threads, self.scratch)

    def _mitsuba(self, name: str) -> Mitsuba:
        if importlib.util.find_spec("mitsuba") is None:
            raise NotAvailable("not installed")
        changes: dict[str, str | None] = {}
        if name == "mitsuba_llvm":
            library = find_llvm()
            if library is None:
                raise NotAvailable("no usable LLVM found")
            changes[VARIABLE] = library
        variant = {"mitsuba_llvm": "llvm_ad_rgb", "mitsuba_scalar": "scalar_rgb"}[name]
        arguments = [variant, str(self.threads), str(self.job), *self.overrides]
        worker = Worker("pipeline.bench.mitsuba_worker", arguments, self.logs / f"{name}.log", **changes)
        self._workers.append(worker)
        try:
            return Mitsuba(worker, self.scratch)
        except WorkerError as error:
            raise NotAvailable(str(error)) from None
