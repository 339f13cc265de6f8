"""``pathspace info``: what a run folder holds, as a table for people."""

import pathlib
from collections.abc import Iterator
from typing import Any

from rich.console import Console
from rich.table import Table

from pipeline.errors import JobError
from pipeline.estimate import human_bytes
from pipeline.run_folder import COMPLETE, RunFolder


def print_summary(path: pathlib.Path) -> None:
    """Print the manifest's essentials. Raises JobError where there is no run."""
    manifest = RunFolder(path).manifest() if path.is_dir() else None
    if manifest is None:
        raise JobError(f"`{path}` is not a run folder: expected a folder with a manifest.json, as `pathspace run` writes it")
    table = Table(show_header=False, box=None, title=f"{manifest['name']} ({manifest['status']})", title_justify="left")
    table.add_column(style="bold")
    table.add_column()
    for key, value in summary(manifest):
        table.add_row(key, value)
    Console().print(table)
    if manifest["status"] != COMPLETE:
        Console(stderr=True).print(
            f"not finished: go on with `pathspace run {manifest['job_file']} --out {path} --resume`", soft_wrap=True, markup=False
        )


def summary(manifest: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """The lines of the summary: name and value."""
    settings, stats = manifest["settings"], manifest["stats"]
    yield "job", manifest["job_file"]
    yield "film", f"{settings['width']} x {settings['height']} pixels, {settings['filter']} filter"
    yield (
        "method",
        f"{settings['method']}, {settings['passes']} samples, depth {settings['max_depth']}, {settings['sampler']}, seed {settings['seed']}",
    )
    yield "recorded", f"{settings['keep']:.0%} of the walks" + (f", with {', '.join(settings['columns'])}" if settings["columns"] else "")
    for name, rows in manifest.get("rows", {}).items():
        if rows:
            yield name, f"{rows:,} rows"
    if "bytes" in stats:
        yield "tables", human_bytes(stats["bytes"])
    if "render_seconds" in stats:
        yield "tracing", f"{stats['render_seconds']:.1f} s, {stats['samples_per_second']:,.0f} samples/s on {stats['threads']} threads"
    yield "peak memory", human_bytes(stats.get("peak_rss_bytes", 0))
    yield "stages", ", ".join(f"{name} {seconds:.1f} s" for name, seconds in stats.get("stages", {}).items())
    yield "images", ", ".join(f"{name} ({image['expression']})" if image["expression"] else name for name, image in manifest["images"].items())
    if manifest.get("rankings"):
        yield (
            "rankings",
            ", ".join(
                f"{name} ({known['asked']['region'] or 'whole image'}, by {known['asked']['by']})" for name, known in manifest["rankings"].items()
            ),
        )
    if manifest.get("views"):
        yield "views", ", ".join(f"{name} ({known['tool']})" for name, known in manifest["views"].items())
    yield "versions", ", ".join(f"{name} {version}" for name, version in manifest["versions"].items())
