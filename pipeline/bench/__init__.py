"""The benchmark: speed, size and error of a job, beside Mitsuba 3, in one run. ``main`` is the command ``pathspace bench``."""

import pathlib
from collections.abc import Sequence


def main(config: pathlib.Path, out: pathlib.Path | None = None, settings: Sequence[str] = ()) -> int:
    """Run a benchmark file; the exit code. See ``pipeline.bench.suite.run_bench``."""
    from pipeline.bench.suite import run_bench

    return run_bench(config, out, settings)
