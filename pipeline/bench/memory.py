"""Peak memory of recorded runs of different length, each in a process of its own."""

import shutil

from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.worker import run_once
from pipeline.estimate import estimate_size, human_bytes
from pipeline.progress import LOG
from renderer.trace import Tracer

MOST_GROWTH, MOST_BYTES = 1.1, 1.5e9
_MARGIN = 1.2  # of free disk over what a run needs


def measure_memory(session: Session) -> SectionResult:
    """Run at each sample count; their peaks, and the growth from the first to the last."""
    counts = session.benchmark.memory.samples
    needed = estimate_size(Tracer(session.scene, session.settings), session.settings).bytes / session.settings.passes * max(counts)
    free = shutil.disk_usage(session.scratch).free
    title, goal = f"peak memory at {' and '.join(map(str, counts))} samples, recorded", "within 10 %, below 1.5 GB"
    if needed * _MARGIN > free:
        return SectionResult([Row(title, goal, f"not measured: {human_bytes(needed)} needed, {human_bytes(free)} free on disk")])
    peaks = {count: peak(session, count) for count in counts}
    growth = max(peaks.values()) / min(peaks.values())
    measured = f"{' and '.join(f'{value / 1e6:.0f} MB' for value in peaks.values())} (× {growth:.2f})"
    table = markdown_table(["samples", "peak resident memory"], [[str(count), f"{value / 1e6:.0f} MB"] for count, value in peaks.items()])
    row = Row(title, goal, measured, growth <= MOST_GROWTH and max(peaks.values()) < MOST_BYTES)
    return SectionResult([row], {"peak_bytes": {str(count): value for count, value in peaks.items()}}, [table])


def peak(session: Session, samples: int) -> int:
    """Peak resident bytes of a recorded run, from its start to its image."""
    LOG.info("memory at %d samples …", samples)
    overrides = [*session.loaded.overrides, "record.keep=all", f"render.samples={samples}"]
    out = session.scratch / "memory"
    try:
        reply = run_once("pipeline.bench.probe", ["peak", str(session.loaded.job), str(out), str(session.benchmark.threads), *overrides])
    finally:
        shutil.rmtree(out, ignore_errors=True)
    return int(reply["peak_bytes"])
