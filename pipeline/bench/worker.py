"""A helper process that answers requests, so that what it loads and how it computes cannot disturb the other contenders.

Requests and replies are JSON objects, a line each, over the worker's standard input and output; what libraries print goes
to its log.
"""

import json
import os
import pathlib
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Any, Self

from pipeline.errors import PipelineError

ROOT = pathlib.Path(__file__).resolve().parents[2]


class WorkerError(PipelineError):
    """A worker that failed or died; the message has its own words."""


def environment(**changes: str | None) -> dict[str, str]:
    """Our environment for a Python child that finds our packages, with changes (None: removed)."""
    known = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])), **changes}
    return {key: value for key, value in known.items() if value is not None}


class Worker:
    """A running helper: ``python -m <module> <arguments>``. Its standard error goes to ``log``."""

    def __init__(self, module: str, arguments: Sequence[str], log: pathlib.Path, **changes: str | None) -> None:
        self.module, self.log = module, log
        with open(log, "ab") as errors:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env=environment(**changes),
            )

    def ask(self, **request: Any) -> dict[str, Any]:
        """The reply to a request. Raises WorkerError."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise WorkerError(f"the helper {self.module} ended with status {self._process.wait()}: see `{self.log}`")
        reply: dict[str, Any] = json.loads(line)
        if "error" in reply:
            raise WorkerError(f"the helper {self.module} failed: {reply['error']}")
        return reply

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """End the helper."""
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def serve(make: Callable[[], Callable[[Mapping[str, Any]], dict[str, Any]]]) -> None:
    """The helper's side: make the answering function, then answer every line. A failure is a reply too."""
    channel = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print must not mix with replies
    answer: Callable[[Mapping[str, Any]], dict[str, Any]] | None = None
    for line in sys.stdin:
        try:
            if answer is None:
                answer = make()
            reply = answer(json.loads(line))
        except Exception as error:  # the parent says it to people
            reply = {"error": f"{type(error).__name__}: {error}"}
        channel.write(json.dumps(reply) + "\n")
        channel.flush()


def run_once(module: str, arguments: Sequence[str], **changes: str | None) -> dict[str, Any]:
    """Run ``python -m <module> <arguments>`` to its end; the JSON object on its last line. Raises WorkerError."""
    done = subprocess.run([sys.executable, "-m", module, *arguments], capture_output=True, text=True, env=environment(**changes), check=False)
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        raise WorkerError(f"{module} ended with status {done.returncode}: {done.stderr.strip()[-2000:]}")
    reply: dict[str, Any] = json.loads(lines[-1])
    return reply
