"""What a benchmark leaves behind: results.json, results.md, charts; and the table on the screen."""

import datetime
import os
import pathlib
import platform
from collections.abc import Mapping
from typing import Any

from pipeline.bench.contenders import LABELS
from pipeline.bench.error import curves_of
from pipeline.bench.results import SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.bench.timing import spread
from pipeline.files import write_json
from pipeline.identity import settings_as_json, versions

HEADER = ["what", "goal", "measured", "verdict"]
TITLES = {
    "rates": "Rates",
    "size": "Bytes",
    "memory": "Memory",
    "error": "Error against time",
    "start": "Start-up",
    "features": "Absent features",
    "questions": "Questions",
    "pictures": "Pictures",
    "subpixel": "Subpixel filters",
}


def machine() -> dict[str, Any]:
    """What the figures were measured on, and how busy it was (load averages over 1, 5 and 15 minutes)."""
    load = list(os.getloadavg()) if hasattr(os, "getloadavg") else None
    return {"processor": processor(), "cores": os.cpu_count(), "system": platform.platform(), "load_average": load}


def processor() -> str:
    """The processor's name, where the system tells."""
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def write_report(out: pathlib.Path, session: Session, results: Mapping[str, SectionResult], before: dict[str, Any]) -> None:
    """Write all that is known by now; called after every section."""
    about = {
        "benchmark": session.benchmark.model_dump(mode="json"),
        "settings": settings_as_json(session.settings),
        "time": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "machine": before,
        "load_average_after": machine()["load_average"],
        "versions": versions(),
        "mitsuba": session.contenders.about(),
    }
    rows = [{"section": name, **vars(row)} for name, result in results.items() for row in result.rows]
    write_json(out / "results.json", {"about": about, "rows": rows, "sections": {name: result.figures for name, result in results.items()}})
    charts = write_charts(out, session, results)
    (out / "results.md").write_text(markdown(about, session, results, charts), encoding="utf-8")


def markdown(about: Mapping[str, Any], session: Session, results: Mapping[str, SectionResult], charts: Mapping[str, str]) -> str:
    """The whole report as text."""
    settings, host = session.settings, about["machine"]
    parts = [f"# Benchmark {session.benchmark.name}"]
    parts.append(
        f"{settings.width} × {settings.height} pixels, {settings.passes} samples, depth {settings.max_depth}, {session.benchmark.threads} threads; "
        f"job `{session.loaded.job.name}`. {host['processor']}, {host['cores']} cores, load average {host['load_average']} before and "
        f"{about['load_average_after']} after. {about['time']}."
    )
    parts.append(markdown_table(HEADER, [[row.what, row.goal, row.measured, row.verdict] for result in results.values() for row in result.rows]))
    parts.append("Ratios are of median wall times; ranges are of the ratios within each round. Contenders alternate, and are warm.")
    for name, result in results.items():
        parts += [f"## {TITLES[name]}", *result.notes]
        if name in charts:
            parts.append(f"![{TITLES[name]}]({charts[name]})")
    parts += ["## Versions", ", ".join(f"{name} {version}" for name, version in about["versions"].items())]
    parts += [f"{LABELS[name]}: {found}" for name, found in about["mitsuba"].items()]
    return "\n\n".join(parts) + "\n"


def write_charts(out: pathlib.Path, session: Session, results: Mapping[str, SectionResult]) -> dict[str, str]:
    """The charts of the sections that were measured: file names by section."""
    from viz.charts import ErrorCurve, RateBar, TimeBar, error_chart, rate_chart, time_chart

    charts: dict[str, str] = {}
    where = f"{session.benchmark.name}: {session.settings.width} × {session.settings.height} pixels, depth {session.settings.max_depth}"
    if "error" in results:
        curves = curves_of(results["error"].figures, list(LABELS))
        error_chart(out / "error.png", [ErrorCurve(LABELS[n], c.wall, c.error, c.samples) for n, c in curves.items()], f"Error against time, {where}")
        charts["error"] = "error.png"
    if "rates" in results:
        walks, bars = session.settings.walks, []
        for name, figures in results["rates"].figures.items():
            if name in LABELS:
                wall = spread(figures["wall_seconds"])
                bars.append(RateBar(LABELS[name], walks / wall.median, walks / wall.high, walks / wall.low))
        rate_chart(out / "rates.png", bars, f"Rates, {where}, {session.settings.passes} samples")
        charts["rates"] = "rates.png"
    if "questions" in results:
        figures, asked = results["questions"].figures, {question.what for question in session.benchmark.questions.ask}
        walls = {what: spread(seconds) for what, seconds in figures["wall_seconds"].items()}
        times = [TimeBar(what, wall.median, wall.low, wall.high, what in asked) for what, wall in walls.items()]
        time_chart(out / "questions.png", times, f"Questions of {figures['paths'] / 1e6:.1f} million paths")
        charts["questions"] = "questions.png"
    if "subpixel" in results:
        from viz.subpixel.cost import Cost, cost_chart

        figures = results["subpixel"].figures
        found = [Cost(c["layout"], c["method"], spread(c["seconds"]).median, c["scielab"]) for c in figures["costs"]]
        cost_chart(out / "subpixel.png", found, "Cost and accuracy of the methods", f"seconds for {where.split(': ')[1].split(',')[0]}")
        charts["subpixel"] = "subpixel.png"
    return charts


def print_rows(results: Mapping[str, SectionResult]) -> None:
    """The goal table on the screen."""
    from rich.console import Console
    from rich.table import Table

    table = Table(*HEADER)
    styles = {True: "green", False: "bold red", None: "dim"}
    for result in results.values():
        for row in result.rows:
            table.add_row(row.what, row.goal, row.measured, row.verdict, style=styles[row.passed])
    Console().print(table)
