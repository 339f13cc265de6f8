"""Timing contenders fairly on a machine that is never quite at rest: rounds in alternating order, medians, ratios within rounds."""

import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Timing:
    """Seconds of one measurement: on the wall, and of all threads on the processor."""

    wall: float
    cpu: float


@dataclass
class Stopwatch:
    """What ``timed`` fills in."""

    timing: Timing = field(default=Timing(0.0, 0.0))


@contextmanager
def timed() -> Iterator[Stopwatch]:
    """Time a block of this process."""
    watch = Stopwatch()
    wall, cpu = time.perf_counter(), time.process_time()
    yield watch
    watch.timing = Timing(time.perf_counter() - wall, time.process_time() - cpu)


@dataclass(frozen=True)
class Spread:
    """A median and the range it comes from."""

    median: float
    low: float
    high: float

    def text(self, form: str = ".2f", unit: str = "") -> str:
        """The figures, for people."""
        return f"{self.median:{form}}{unit} ({self.low:{form}}–{self.high:{form}})"


def spread(values: Sequence[float]) -> Spread:
    """Median, least and greatest of some values."""
    return Spread(statistics.median(values), min(values), max(values))


def ratio(above: Sequence[float], below: Sequence[float]) -> Spread:
    """The ratio of the medians; the range is that of the ratios within each round, where both had the same weather.

    >>> ratio([2.0, 4.0, 3.0], [1.0, 4.0, 2.0])
    Spread(median=1.5, low=1.0, high=2.0)
    """
    paired = [a / b for a, b in zip(above, below, strict=True)]
    return Spread(statistics.median(above) / statistics.median(below), min(paired), max(paired))


def alternate(contenders: Mapping[str, Callable[[int], Timing]], rounds: int) -> dict[str, list[Timing]]:
    """Time each contender once in every round; every other round goes backwards. A contender is told the round's number."""
    timings: dict[str, list[Timing]] = {name: [] for name in contenders}
    names = list(contenders)
    for number in range(rounds):
        for name in names if number % 2 == 0 else reversed(names):
            timings[name].append(contenders[name](number))
    return timings
