"""``pathspace diagnose``: the ready-made questions about how a run went, printed one after another."""

import pathlib
import sys
from collections.abc import Callable, Sequence

import pyarrow as pa

from pipeline.deeper import cut
from pipeline.errors import JobError
from queries.diagnostics import DIAGNOSTICS
from queries.diagnostics.answers import meanings
from queries.run import Run, open_run
from queries.sql import write

ALL: dict[str, tuple[Callable[[Run], pa.Table], str]] = {
    **DIAGNOSTICS,
    "cut": (cut, "the share of energy that max_depth cuts, by tracing walks deeper"),
}
TOP = 10  # rows of each table where several are printed


def list_diagnostics() -> None:
    """Print the names of all diagnostics, and what they show."""
    for name, (_, title) in ALL.items():
        print(f"{name:<12}  {title}")


def print_diagnostics(path: pathlib.Path, names: Sequence[str], format: str, top: int | None, explain: bool) -> None:
    """Ask a run the named diagnostics, or all of them, and print the answers; ``explain`` says what the columns mean.

    Raises JobError for an unknown name or several answers in a format of one, and QueryError.
    """
    chosen = list(dict.fromkeys(names)) or list(ALL)
    for name in chosen:
        if name not in ALL:
            raise JobError(f"there is no diagnostic `{name}`: expected one of {', '.join(ALL)}")
    if format != "table" and len(chosen) != 1:
        raise JobError(f"--format {format} gives one answer: name one of {', '.join(ALL)}")
    if top is None and format == "table":
        top = TOP if len(chosen) > 1 else None
    with open_run(path) as run:
        for name in chosen:
            function, title = ALL[name]
            table = function(run)
            if format == "table":
                print(f"— {name}: {title} —", flush=True)
            write(table.slice(0, top).to_reader(), format, sys.stdout.buffer)
            sys.stdout.buffer.flush()
            if format == "table":
                _print_rest(table, top, explain)


def _print_rest(table: pa.Table, top: int | None, explain: bool) -> None:
    """What was not shown, and what the columns mean."""
    if top is not None and table.num_rows > top:
        print(f"the first {top} of {table.num_rows:,} rows: --top N shows more")
    if explain:
        for column, meaning in meanings(table).items():
            print(f"  {column}: {meaning}")
    print(flush=True)
