"""Bytes on disk of each recorded row, from the files of a whole run."""

import pathlib
import shutil

from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.run_folder import RunFolder
from pipeline.stages import run_job

MOST = (("camera_vertices", "a vertex", 32.0), ("paths", "a path", 56.0))


def measure_size(session: Session) -> SectionResult:
    """Run the job as `pathspace run` does, recording all, and look at its files."""
    try:
        folder = run_job(session.loaded.job, [*session.loaded.overrides, "record.keep=all"], session.scratch / "size", threads=session.benchmark.threads)
        sizes = table_sizes(folder)
        stats = (folder.manifest() or {})["stats"]
    finally:
        shutil.rmtree(session.scratch / "size", ignore_errors=True)
    rows = []
    for table, each, most in MOST:
        found, count = sizes[table]
        rows.append(Row(f"bytes {each}, on disk, uncompressed", f"≤ {most:.0f}", f"{found / count:.2f}", found / count <= most))
    walks = session.settings.walks
    lines = [[table, f"{count:,}", f"{count / walks:.2f}", f"{found / 1e6:.1f}", f"{found / count:.2f}"] for table, (found, count) in sizes.items()]
    note = markdown_table(["table", "rows", "rows / sample", "MB", "bytes / row"], lines)
    seconds = f"The run's own manifest: {stats['render_seconds']:.2f} s of tracing and recording, {stats['samples_per_second']:,.0f} samples / s."
    figures = {table: {"bytes": found, "rows": count} for table, (found, count) in sizes.items()}
    return SectionResult(rows, {"tables": figures, "manifest_stats": stats}, [note, seconds])


def table_sizes(folder: RunFolder) -> dict[str, tuple[int, int]]:
    """Bytes and rows of every recorded table that has rows, file headers included."""
    rows = (folder.manifest() or {})["rows"]
    return {table: (folder_bytes(folder.path / "tables" / table), count) for table, count in rows.items() if count and table != "words"}


def folder_bytes(path: pathlib.Path) -> int:
    """Bytes of the files in a folder."""
    return sum(file.stat().st_size for file in path.iterdir())
