"""How long work reports itself: a bar on a terminal, plain log lines elsewhere, and always the run's log file."""

import contextlib
import logging
import pathlib
import sys
import time
from collections.abc import Iterator
from typing import Any

LOG = logging.getLogger("pathspace")
_SECONDS_BETWEEN_LINES = 10.0


class Progress:
    """One stage's progress. ``advance`` may be called from any one thread at a time."""

    def __init__(self, title: str, total: int, unit: str) -> None:
        self.title, self.total, self.unit = title, total, unit
        self.done = 0
        self.start = time.perf_counter()

    def advance(self, amount: int) -> None:
        """Say that ``amount`` more units are done."""
        self.done += amount

    def line(self) -> str:
        """Share done, rate and time left, as text."""
        elapsed = max(time.perf_counter() - self.start, 1e-9)
        rate = self.done / elapsed
        left = (self.total - self.done) / rate if rate > 0 else float("inf")
        share = 100.0 * self.done / self.total if self.total else 100.0
        return f"{self.title}: {share:.0f} %, {_rate(rate, self.unit)}, {_duration(left)} left"


class _LogProgress(Progress):
    """Plain lines, some seconds apart."""

    def __init__(self, title: str, total: int, unit: str) -> None:
        super().__init__(title, total, unit)
        self._last = self.start

    def advance(self, amount: int) -> None:
        super().advance(amount)
        now = time.perf_counter()
        if now - self._last >= _SECONDS_BETWEEN_LINES:
            self._last = now
            LOG.info(self.line())


class _BarProgress(Progress):
    """A rich progress bar."""

    def __init__(self, title: str, total: int, unit: str, bar: Any) -> None:
        super().__init__(title, total, unit)
        self._bar = bar
        self._task = bar.add_task(title, total=total, rate="")

    def advance(self, amount: int) -> None:
        super().advance(amount)
        rate = self.done / max(time.perf_counter() - self.start, 1e-9)
        self._bar.update(self._task, completed=self.done, rate=_rate(rate, self.unit))


@contextlib.contextmanager
def progress(title: str, total: int, unit: str) -> Iterator[Progress]:
    """Progress of ``total`` units of work: a bar where stderr is a terminal, log lines elsewhere."""
    if not sys.stderr.isatty():
        yield _LogProgress(title, total, unit)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        yield _BarProgress(title, total, unit, bar)


@contextlib.contextmanager
def log_file(path: pathlib.Path) -> Iterator[None]:
    """Append what is logged to a file too."""
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    LOG.addHandler(handler)
    LOG.setLevel(logging.DEBUG)
    try:
        yield
    finally:
        LOG.removeHandler(handler)
        handler.close()


def log_to_stderr(quiet: bool = False) -> None:
    """Show what is logged on stderr; ``quiet`` keeps warnings only."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(message)s"))
    handler.setLevel(logging.WARNING if quiet else logging.INFO)
    LOG.handlers[:] = [handler]
    LOG.setLevel(logging.DEBUG)
    LOG.propagate = False


def _rate(rate: float, unit: str) -> str:
    return f"{rate:,.0f} {unit}/s" if rate >= 10 else f"{rate:.2g} {unit}/s"


def _duration(seconds: float) -> str:
    if seconds == float("inf"):
        return "unknown time"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
