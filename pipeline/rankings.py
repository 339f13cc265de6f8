"""Rankings that a job asks for, as files: CSV for people and spreadsheets, Arrow for programs."""

import pathlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, BinaryIO, cast

import pyarrow as pa

from pipeline.config import Job, Rank
from pipeline.files import FileRecord, is_whole, new_file
from pipeline.progress import Progress
from pipeline.run_folder import RunFolder
from queries.regions import parse_region
from queries.run import Run, open_run
from queries.sql import write

KINDS = ("csv", "arrow")
FOR_PEOPLE = (  # columns of a table; files and other formats have all of them
    *("rank", "ratio", "lower", "ring_share", "flux", "flux_error", "share", "share_error", "cumulative", "samples", "trusted"),
    *("descriptor", "description", "expression"),
)
TOP = 20  # classes that a table for people shows


def write_rankings(
    folder: RunFolder, job: Job, regions: Mapping[str, Any], known: Mapping[str, Any], threads: int, bar: Progress
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Make every ranking of a job, as ``rankings/<name>.csv`` and ``.arrow``; as each is made, its name, what was asked, and checksums.

    Those that ``known`` says were made before, of the same ``regions`` (``questions.region_terms``), are kept. Raises QueryError.
    """
    with open_run(folder.path, threads=threads) as run:
        for name, asked in job.rank.items():
            question = {"asked": asked.model_dump(mode="json"), "region": regions[asked.region] if asked.region else None}
            if not _is_there(folder, name, question, known.get(name, {})):
                table = ranked(run, asked, threads)
                files = {kind: _write(folder.ranking(name, kind), table, kind).as_json() for kind in KINDS}
                yield name, question | files
            bar.advance(1)


def _is_there(folder: RunFolder, name: str, question: dict[str, Any], known: dict[str, Any]) -> bool:
    """Whether the ranking was made before, of the same question, and its files are whole."""
    same = {key: known.get(key) for key in question} == question
    return same and all(is_whole(folder.ranking(name, kind), known.get(kind, {})) for kind in KINDS)


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
    cut = asked.top is None and format == "table"
    if cut:
        asked = asked.model_copy(update={"top": TOP})
    with open_run(path, regions=dict(parse_region(text) for text in define)) as run:
        table = ranked(run, asked, None)
    shown = table.select([name for name in FOR_PEOPLE if name in table.schema.names]) if format == "table" else table
    write(shown.to_reader(), format, sys.stdout.buffer)
    sys.stdout.buffer.flush()
    if cut and table.num_rows == TOP:
        print(f"the first {TOP} classes: --top N shows more")


def _write(path: pathlib.Path, table: pa.Table, format: str) -> FileRecord:
    path.parent.mkdir(exist_ok=True)
    with new_file(path) as file:
        write(table.to_reader(), format, cast(BinaryIO, file))
        return file.commit(table.num_rows)
