"""One measurement in a fresh process: ``peak`` memory of a run, or the time until a run starts to ``trace``."""

import json
import pathlib
import re
import sys
import time
from typing import Any

from pipeline.estimate import estimate_size
from pipeline.prepare import prepare_job
from pipeline.stages import run_job
from pipeline.stopwatch import peak_rss_bytes
from renderer.accelerators import Accelerators
from renderer.trace import Tracer


def peak(job: str, out: str, threads: str, *overrides: str) -> dict[str, Any]:
    """Run a job; the most memory that was resident at once, in bytes."""
    run_job(pathlib.Path(job), overrides, pathlib.Path(out), threads=int(threads))
    return {"peak_bytes": own_peak_bytes()}


def own_peak_bytes() -> int:
    """The peak of this program alone: ``ru_maxrss`` starts from what the parent held when it forked, ``VmHWM`` does not."""
    try:
        status = pathlib.Path("/proc/self/status").read_text()
    except OSError:
        return peak_rss_bytes()
    found = re.search(r"^VmHWM:\s+(\d+) kB", status, re.MULTILINE)
    return int(found[1]) * 1024 if found else peak_rss_bytes()


def start(job: str, *overrides: str) -> dict[str, Any]:
    """Do all that a run does before it traces; seconds of loading or compiling kernels, and the time (Unix seconds) when it was ready."""
    prepared = prepare_job(pathlib.Path(job), overrides)
    tracer = Tracer(prepared.scene, prepared.settings, Accelerators(prepared.scene))
    seconds = tracer.warm_up()
    estimate_size(tracer, prepared.settings)
    return {"kernel_seconds": seconds, "ready": time.time()}


if __name__ == "__main__":
    _, what, *arguments = sys.argv
    print(json.dumps(peak(*arguments) if what == "peak" else start(*arguments)))
