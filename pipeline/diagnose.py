"""``pathspace diagnose``: the ready-made questions about how a run went, printed one after another."""

import inspect
import pathlib
import sys
from collections.abc import Callable, Sequence

import pyarrow as pa

from pipeline.deeper import cut
from pipeline.errors import JobError
from queries.diagnostics import DIAGNOSTICS
from queries.diagnostics.answers import meanings
from queries.errors import QueryError
from queries.run import Run, open_run
from queries.sql import write
from renderer.errors import SceneError

ALL: dict[str, tuple[Callable[..., pa.Table], str]] = {
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

    Where several are asked, one that cannot be answered says why and does not stop the others. Raises JobError for an unknown name or several
    answers in a format of one, and QueryError or JobError where nothing can be answered.
    """
    chosen = list(dict.fromkeys(names)) or list(ALL)
    for name in chosen:
        if name not in ALL:
            raise JobError(f"there is no diagnostic `{name}`: expected one of {', '.join(ALL)}")
    if format != "table" and len(chosen) != 1:
        raise JobError(f"--format {format} gives one answer: name one of {', '.join(ALL)}")
    if top is None and format == "table":
        top = TOP if len(chosen) > 1 else None
    failures: list[ValueError] = []
    with open_run(path) as run:
        for name in chosen:
            if format == "table":
                print(f"— {name}: {ALL[name][1]} —", flush=True)
            try:
                table = _ask(run, name, top)
            except (QueryError, JobError, SceneError) as error:
                if len(chosen) == 1:
                    raise
                failures.append(error)
                print(f"no answer: {error}\n", flush=True)
                continue
            write(table.slice(0, top).to_reader(), format, sys.stdout.buffer)
            sys.stdout.buffer.flush()
            if format == "table":
                _print_rest(table, top, explain)
    if len(failures) == len(chosen):
        raise failures[0]


def _ask(run: Run, name: str, top: int | None) -> pa.Table:
    """The answer to one diagnostic: with ``top``, no more of it than tells whether there is more."""
    function = ALL[name][0]
    if top is None or "most" not in inspect.signature(function).parameters or name == "cut":
        return function(run)
    # Convergence spreads its rows to the last pass; the others list the first of what there is
    return function(run, most=top if name == "convergence" else top + 1)


def _print_rest(table: pa.Table, top: int | None, explain: bool) -> None:
    """What was not shown, and what the columns mean."""
    if top is not None and table.num_rows > top:
        print(f"the first {top} rows: --top N shows more")
    if explain:
        for column, meaning in meanings(table).items():
            print(f"  {column}: {meaning}")
    print(flush=True)
