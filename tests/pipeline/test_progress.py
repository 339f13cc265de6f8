"""Progress without a terminal: plain lines with share, rate and time left, not too many."""

import logging
import sys

import pytest

from pipeline import progress as module
from pipeline.progress import LOG, progress


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(module.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(LOG, "propagate", True)
    return now


def test_plain_lines_without_a_terminal(clock: list[float], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: False, raising=False)
    with caplog.at_level(logging.INFO, "pathspace"), progress("tracing", 1_000_000, "samples") as bar:
        for _ in range(50):
            clock[0] += 1.0
            bar.advance(10_000)
    assert caplog.messages == [
        f"tracing: {share} %, 10,000 samples/s, 0:{(100 - share) // 60:02d}:{(100 - share) % 60:02d} left" for share in range(10, 51, 10)
    ]


def test_line_before_anything_is_done(clock: list[float]) -> None:
    bar = module.Progress("AOVs", 3, "images")
    clock[0] += 2.0
    assert bar.line() == "AOVs: 0 %, 0 images/s, unknown time left"
    bar.advance(1)
    assert bar.line() == "AOVs: 33 %, 0.5 images/s, 0:00:04 left"
