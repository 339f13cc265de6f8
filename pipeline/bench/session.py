"""What every section of a benchmark works with."""

import pathlib
from dataclasses import dataclass

from pipeline.bench.config import Benchmark, LoadedBenchmark
from pipeline.bench.contenders import Contenders
from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings


@dataclass(frozen=True)
class Session:
    """One benchmark under way. ``scratch`` is emptied at its end; ``logs`` and what lies beside it stay."""

    loaded: LoadedBenchmark
    scene: Scene
    settings: TraceSettings
    contenders: Contenders
    scratch: pathlib.Path
    logs: pathlib.Path

    @property
    def benchmark(self) -> Benchmark:
        """The benchmark's file, checked."""
        return self.loaded.benchmark
