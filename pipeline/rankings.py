"""Rankings that a job asks for, as files: CSV for people and spreadsheets, Arrow for programs."""

import pathlib
import sys
from collections.abc import Sequence
from typing import Any, BinaryIO, cast

import pyarrow as pa

from pipeline.config import Rank
from pipeline.files import FileRecord, new_file
from pipeline.run_folder import RunFolder
from queries.regions import parse_region
from queries.run import Run, open_run
from queries.sql import write

TOP = 20  # classes that a table for people shows


def write_ranking(folder: RunFolder, run: Run, name: str, asked: Rank, threads: int) -> dict[str, Any]:
    """Rank one region of a run and write ``rankings/<name>.csv`` and ``.arrow``; their checksums. Raises QueryError."""
    table = ranked(run, asked, threads)
    kinds = {"csv": "csv", "arrow": "arrow"}
    return {kind: _write(folder.ranking(name, kind), table, format).as_json() for kind, format in kinds.items()}


def ranked(run: Run, asked: Rank, threads: int | None) -> pa.Table:
    """The ranking that a job's section describes."""
    from queries.ranking import rank

    return rank(
        run,
        asked.region,
        by=asked.by,
        with_objects=asked.with_objects,
        merge=asked.merge,
        at=asked.at,
        outer=asked.outer,
        top=asked.top,
        threads=threads,
    )


def print_ranking(path: pathlib.Path, asked: Rank, define: Sequence[str], format: str) -> None:
    """Rank a region of a run, one of the job's or of ``define`` (``NAME=REGION``), and print the classes. Raises QueryError."""
    with open_run(path, regions=dict(parse_region(text) for text in define)) as run:
        table = ranked(run, asked, None)
    if asked.top is None and format == "table":
        shown = table.slice(0, TOP)
    else:
        shown = table
    write(shown.to_reader(), format, sys.stdout.buffer)
    sys.stdout.buffer.flush()
    if shown.num_rows < table.num_rows:
        print(f"the first {shown.num_rows} of {table.num_rows:,} classes: --top N shows more")


def _write(path: pathlib.Path, table: pa.Table, format: str) -> FileRecord:
    path.parent.mkdir(exist_ok=True)
    with new_file(path) as file:
        write(table.to_reader(), format, cast(BinaryIO, file))
        return file.commit(table.num_rows)
