"""Samples per second of every contender, and what recording costs."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pipeline.bench.contenders import LABELS, Contender
from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import Spread, Timing, alternate, ratio, spread
from pipeline.progress import LOG

Times = Mapping[str, Sequence[float]]  # seconds of each round, by contender
LEAST = (  # who, against whom, at least how many times its rate
    ("independent", "mitsuba_llvm", 1.3),
    ("independent", "mitsuba_scalar", 2.5),
    ("sobol", "mitsuba_llvm", 1.3),
    ("sobol", "mitsuba_scalar", 2.5),
    ("recorded", "mitsuba_llvm", 1.0),
    ("recorded_sobol", "mitsuba_llvm", 1.0),
)
RECORDING = (("recorded", "independent"), ("recorded_sobol", "sobol"))
MOST_RECORDING = 1.4
WARM_UPS = 2  # Mitsuba compiles on its first render, and settles its memory on the second


def measure_rates(session: Session) -> SectionResult:
    """Warm everybody up, then time rounds in alternating order."""
    samples, seed = session.settings.passes, session.settings.seed
    there, missing = session.contenders.available(session.benchmark.contenders)
    for name, contender in there.items():
        for i in range(WARM_UPS):
            contender.render(samples, seed + 1000 + i)
        LOG.info("%s is warm", LABELS[name])
    timings = alternate({name: timed_render(contender, samples, seed) for name, contender in there.items()}, session.benchmark.rounds)
    walls = {name: [timing.wall for timing in found] for name, found in timings.items()}
    cpus = {name: [timing.cpu for timing in found] for name, found in timings.items()}
    return SectionResult(
        rows=[*rate_rows(walls, cpus, missing), *recording_rows(walls, cpus)],
        figures={name: figures(found, session.settings.walks) for name, found in timings.items()} | {"missing": missing},
        notes=[rate_table(timings, missing, session.settings.walks)],
    )


def timed_render(contender: Contender, samples: int, seed: int) -> Callable[[int], Timing]:
    """A function that renders a round, with a seed of that round."""
    return lambda number: contender.render(samples, seed + number)


def rate_rows(walls: Times, cpus: Times, missing: Mapping[str, str]) -> list[Row]:
    """Our rates over Mitsuba's: ratios of median wall times; those of CPU times are told, and judge nothing."""
    rows = []
    for ours, theirs, least in LEAST:
        what = "every path recorded to disk" if ours.startswith("recorded") else "nothing recorded"
        title = f"samples per second, {what} ({LABELS[ours]})"
        goal = f"≥ {least:.1f} × {LABELS[theirs]}"
        if ours in walls and theirs in walls:
            found = ratio(walls[theirs], walls[ours])
            rows.append(Row(title, goal, both(found, ratio(cpus[theirs], cpus[ours])), found.median >= least))
        elif ours in walls:
            rows.append(Row(title, goal, missing.get(theirs, "not measured")))
    return rows


def recording_rows(walls: Times, cpus: Times) -> list[Row]:
    """Recorded time over unrecorded."""
    rows = []
    for recorded, plain in RECORDING:
        if recorded in walls and plain in walls:
            found = ratio(walls[recorded], walls[plain])
            measured = both(found, ratio(cpus[recorded], cpus[plain]))
            goal = f"recorded time ≤ {MOST_RECORDING} × unrecorded"
            rows.append(Row(f"recording cost ({LABELS[plain]})", goal, measured, found.median <= MOST_RECORDING))
    return rows


def both(wall: Spread, cpu: Spread) -> str:
    """A ratio of wall times, and that of CPU times."""
    return f"{wall.text(unit=' ×')}; CPU time {cpu.median:.2f} ×"


def figures(timings: Sequence[Timing], walks: int) -> dict[str, Any]:
    """A contender's times (seconds) and rate as plain values."""
    wall, cpu = [t.wall for t in timings], [t.cpu for t in timings]
    return {"wall_seconds": wall, "cpu_seconds": cpu, "samples_per_second": walks / spread(wall).median}


def rate_table(timings: Mapping[str, Sequence[Timing]], missing: Mapping[str, str], walks: int) -> str:
    """Everybody's times."""
    rows = []
    for name, found in timings.items():
        wall, cpu = spread([t.wall for t in found]), spread([t.cpu for t in found])
        rates = [f"{walks / seconds.median / 1e6:.2f} M" for seconds in (wall, cpu)]
        rows.append([LABELS[name], wall.text(unit=" s"), cpu.text(unit=" s"), *rates])
    rows += [[LABELS[name], reason, "", "", ""] for name, reason in missing.items()]
    return markdown_table(["contender", "wall time, median (range)", "CPU time, median (range)", "samples / s", "samples / CPU s"], rows)
