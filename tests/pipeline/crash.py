"""Runs that are killed: a process that runs the tiny job and dies by SIGKILL at the n-th call of a function."""

import importlib
import multiprocessing
import os
import pathlib
import signal
from typing import Any

PRELOADED = ["pipeline.stages", "queries.images"]


def killed_run(job: pathlib.Path, out: pathlib.Path, where: str, call: int) -> int:
    """Run ``job`` into ``out`` and die just before the given call (1, 2, …) of ``module:Class.function``; the exit code."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    process = context.Process(target=_run, args=(job, out, where, call))
    process.start()
    process.join(120)
    assert process.exitcode is not None, "the run hangs"
    return process.exitcode


def _run(job: pathlib.Path, out: pathlib.Path, where: str, call: int) -> None:
    module, _, path = where.partition(":")
    *owners, name = path.split(".")
    owner: Any = importlib.import_module(module)
    for part in owners:
        owner = getattr(owner, part)
    real = getattr(owner, name)
    calls = 0

    def dying(*args: Any, **kwargs: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == call:
            os.kill(os.getpid(), signal.SIGKILL)
        return real(*args, **kwargs)

    setattr(owner, name, dying)
    from pipeline.stages import run_job

    run_job(job, out=out, threads=2)
