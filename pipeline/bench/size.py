"""Bytes on disk of each recorded row, from the files of a whole run."""

import pathlib
import shutil

import pyarrow as pa

from pipeline.bench.results import Row, SectionResult, markdown_table
from pipeline.bench.session import Session
from pipeline.run_folder import RunFolder
from pipeline.stages import run_job

MOST = (("camera_vertices", "a vertex", 32.0), ("paths", "a path", 56.0))


def measure_size(session: Session) -> SectionResult:
    """Run the job as `pathspace run` does, recording all, and look at its files."""
    try:
        overrides = [*session.loaded.overrides, "record.keep=all"]
        folder = run_job(session.loaded.job, overrides, session.scratch / "size", threads=session.benchmark.threads)
        sizes = table_sizes(folder)
        widths = {table: row_bytes(folder.path / "tables" / table) for table in sizes}
        stats = (folder.manifest() or {})["stats"]
    finally:
        shutil.rmtree(session.scratch / "size", ignore_errors=True)
    rows = []
    for table, each, most in MOST:
        found, count = sizes[table]
        measured = f"{widths[table]:g}; {found / count:.2f} with Arrow's headers in the files"
        rows.append(Row(f"bytes {each}, uncompressed", f"≤ {most:.0f}", measured, widths[table] <= most))
    walks = session.settings.walks
    lines = [[table, f"{count:,}", f"{count / walks:.2f}", f"{found / 1e6:.1f}", f"{found / count:.2f}"] for table, (found, count) in sizes.items()]
    note = markdown_table(["table", "rows", "rows / sample", "MB", "bytes / row"], lines)
    seconds = f"The run's own manifest: {stats['render_seconds']:.2f} s of tracing and recording, {stats['samples_per_second']:,.0f} samples / s."
    figures = {table: {"bytes": found, "rows": count, "row_bytes": widths[table]} for table, (found, count) in sizes.items()}
    return SectionResult(rows, {"tables": figures, "manifest_stats": stats}, [note, seconds])


def table_sizes(folder: RunFolder) -> dict[str, tuple[int, int]]:
    """Bytes and rows of every recorded table that has rows, file headers included."""
    rows = (folder.manifest() or {})["rows"]
    return {table: (folder_bytes(folder.path / "tables" / table), count) for table, count in rows.items() if count and table != "words"}


def row_bytes(path: pathlib.Path) -> float:
    """Bytes of one row in all columns of a table, as its first file has them."""
    with pa.memory_map(str(min(path.iterdir()))) as source:
        return float(sum(field.type.bit_width for field in pa.ipc.open_file(source).schema)) / 8


def folder_bytes(path: pathlib.Path) -> int:
    """Bytes of the files in a folder."""
    return sum(file.stat().st_size for file in path.iterdir())
