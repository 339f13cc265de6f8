"""How long a run takes before it traces: on a fresh machine, where kernels are compiled, and later."""

import shutil
import statistics
import time

from pipeline.bench.results import Row, SectionResult
from pipeline.bench.session import Session
from pipeline.bench.worker import run_once
from pipeline.progress import LOG

MOST_COMPILATION, MOST_START = 60.0, 3.0  # seconds
LATER_RUNS = 3


def measure_start(session: Session) -> SectionResult:
    """Start the job in new processes: once with an empty kernel cache, then with what that left."""
    cache = session.scratch / "kernels"
    LOG.info("a first run, with an empty cache of kernels …")
    try:
        cache.mkdir()
        first = seconds_to_trace(session, str(cache))
        later = [seconds_to_trace(session, str(cache)) for _ in range(LATER_RUNS)]
    finally:
        shutil.rmtree(cache, ignore_errors=True)
    usual = statistics.median(total for total, _ in later)
    compilation = first[0] - usual
    rows = [
        Row("first run: kernel compilation in all", f"≤ {MOST_COMPILATION:.0f} s", f"{compilation:.1f} s", compilation <= MOST_COMPILATION),
        Row("later runs: from the command to tracing", f"≤ {MOST_START:.0f} s", f"{usual:.2f} s", usual <= MOST_START),
    ]
    note = (
        f"First run: tracing starts after {first[0]:.1f} s, {first[1]:.1f} s of it compiling kernels; later runs (median of {LATER_RUNS}): "
        f"after {usual:.2f} s, {statistics.median(kernels for _, kernels in later):.2f} s of it loading kernels. "
        "Measured from the start of the Python process, its imports, the scene and the size estimate included."
    )
    return SectionResult(rows, {"first_seconds": first, "later_seconds": later, "compilation_seconds": compilation}, [note])


def seconds_to_trace(session: Session, cache: str) -> tuple[float, float]:
    """Seconds from starting a process until it would trace, and those of its kernels."""
    begun = time.time()
    overrides = [*session.loaded.overrides, "record.keep=all"]
    reply = run_once("pipeline.bench.probe", ["start", str(session.loaded.job), *overrides], PATHSPACE_CACHE=cache, NUMBA_CACHE_DIR=None)
    return reply["ready"] - begun, reply["kernel_seconds"]
