"""Ask a run in SQL: one query, one throw-away connection, a time limit."""

import contextlib
import csv
import io
import json
import math
import threading
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

import duckdb
import pyarrow as pa

from queries.errors import QueryError, QueryTimeout
from queries.lpe_views import make_views
from queries.run import Run

TIME_LIMIT = 60.0  # seconds
_LONGEST = 100_000  # characters: DuckDB's planner cannot be stopped, and is slow where a text lists tens of thousands of things
_AGAIN = 0.05  # seconds between attempts to stop a query: DuckDB forgets one that comes between two statements
_ALLOWED = {"SELECT", "EXPLAIN", "CREATE", "INSERT", "UPDATE", "DELETE", "DROP", "ALTER"}
_BATCH = 100_000  # rows
_WIDEST, _WIDEST_LAST = 60, 10_000  # characters of a cell in text tables, and of one in the last column


@contextlib.contextmanager
def stream(run: Run, text: str, time_limit: float | None = TIME_LIMIT) -> Iterator[pa.RecordBatchReader]:
    """The answer to a query as record batches, for answers that need not fit into memory.

    Several statements may be given, separated by semicolons; the last one answers. They may make tables and views, which
    end with the query. ``lpe('…')`` is a table of the paths that an expression matches, with the columns of ``paths``;
    ``lpe_occluded('…')`` one of blocked connections; a second argument names the expression's dialect.
    Raises ``QueryError`` for bad SQL and for statements that reach outside, ``QueryTimeout`` after ``time_limit`` seconds.
    """
    connection = run.connect()
    timed_out, done = threading.Event(), threading.Event()

    def stop_when_late() -> None:
        if not done.wait(time_limit):
            timed_out.set()
            connection.interrupt()
            while not done.wait(_AGAIN):
                connection.interrupt()

    def check() -> None:
        if timed_out.is_set():
            raise QueryTimeout(late)

    late = "" if time_limit is None else f"the query was stopped after {time_limit:g} seconds: ask for less, or raise the time limit (--time-limit)"
    timer = threading.Thread(target=stop_when_late, daemon=True) if time_limit is not None else None
    try:
        if timer:
            timer.start()
        yield _answer(run, connection, text, check)
    except (duckdb.Error, pa.ArrowException, OSError) as error:
        if timed_out.is_set():
            raise QueryTimeout(late) from None
        raise QueryError(str(error)) from None
    finally:
        done.set()
        if timer:
            timer.join()
        run.disconnect(connection)


def query(run: Run, text: str, time_limit: float | None = TIME_LIMIT) -> pa.Table:
    """The answer to a query as an Arrow table. See ``stream``."""
    with stream(run, text, time_limit) as reader:
        return reader.read_all()


def batches(connection: duckdb.DuckDBPyConnection, query: str | duckdb.Statement, rows: int = _BATCH) -> pa.RecordBatchReader:
    """The answer to one statement in batches of so many rows, computed as they are read."""
    return connection.sql(query).to_arrow_reader(rows)


def _answer(run: Run, connection: duckdb.DuckDBPyConnection, text: str, check: Callable[[], None]) -> pa.RecordBatchReader:
    """Run all statements; the answer to the last."""
    if any(0xD800 <= ord(character) < 0xE000 for character in text):
        raise QueryError("expected SQL as Unicode text, found half of a surrogate pair")
    if len(text) > _LONGEST:
        raise QueryError(f"expected SQL of at most {_LONGEST:,} characters, found {len(text):,}")
    statements = connection.extract_statements(make_views(run, connection, text, check))
    if not statements:
        raise QueryError("expected an SQL statement, found none")
    for statement in statements:
        try:
            kind = statement.type.name
        except ValueError:
            kind = "unknown"
        if kind not in _ALLOWED:
            raise QueryError(f"a run is read-only: expected SELECT (or a temporary CREATE, INSERT, …), found a statement of kind {kind}")
    for statement in statements[:-1]:
        check()
        answer = connection.sql(statement)
        # An answer that was begun must be read to its end before the next statement
        for _ in answer.to_arrow_reader(_BATCH) if answer is not None else ():
            check()
    check()
    return batches(connection, statements[-1])


# --- formats ------------------------------------------------------------------------------------------------------


def write(reader: pa.RecordBatchReader, kind: str, out: BinaryIO) -> int:
    """Write an answer as ``table``, ``csv``, ``json`` (an array of objects) or ``arrow`` (an IPC stream); the number of rows."""
    if kind not in _WRITERS:
        raise QueryError(f"expected one of the formats {', '.join(_WRITERS)}, found `{kind}`")
    return _WRITERS[kind](reader, out)


def _rows(batch: pa.RecordBatch) -> list[tuple[Any, ...]]:
    """Rows of Python values; columns may share a name."""
    return list(zip(*(column.to_pylist() for column in batch.columns)))


def _write_arrow(reader: pa.RecordBatchReader, out: BinaryIO) -> int:
    count = 0
    with pa.ipc.new_stream(out, reader.schema) as writer:
        for batch in reader:
            writer.write_batch(batch)
            count += batch.num_rows
    return count


def _write_csv(reader: pa.RecordBatchReader, out: BinaryIO) -> int:
    count = 0
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(reader.schema.names)
    for batch in reader:
        writer.writerows(_rows(batch))
        count += batch.num_rows
        out.write(text.getvalue().encode())
        text.seek(0)
        text.truncate()
    out.write(text.getvalue().encode())
    return count


def _write_json(reader: pa.RecordBatchReader, out: BinaryIO) -> int:
    count = 0
    out.write(b"[")
    for batch in reader:
        for row in _rows(batch):
            value = {name: _json(cell) for name, cell in zip(reader.schema.names, row)}
            out.write((",\n" if count else "\n").encode() + json.dumps(value, ensure_ascii=False, default=str).encode())
            count += 1
    out.write(b"\n]\n")
    return count


def _json(value: Any) -> Any:
    """A value as JSON can say it: numbers that are not finite are null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): _json(inner) for key, inner in value.items()}
    return [_json(inner) for inner in value] if isinstance(value, list) else value


def _write_table(reader: pa.RecordBatchReader, out: BinaryIO, most: int = 200) -> int:
    """Aligned columns, for people: the first ``most`` rows, and how many there are."""
    shown: list[list[str]] = []
    count = 0
    for batch in reader:
        if len(shown) < most:
            shown += [[_cell(value) for value in row] for row in _rows(batch.slice(0, most - len(shown)))]
        count += batch.num_rows
    # The last column is there to be copied: an expression, say. Nothing is to its right
    shown = [[*(_cut(cell, _WIDEST) for cell in row[:-1]), *(_cut(cell, _WIDEST_LAST) for cell in row[-1:])] for row in shown]
    numeric = [pa.types.is_integer(kind) or pa.types.is_floating(kind) for kind in reader.schema.types]
    widths = [max(len(name), *(len(row[i]) for row in shown), 0) for i, name in enumerate(reader.schema.names)]
    rule = ["─" * min(width, _WIDEST) for width in widths]
    for row in [list(reader.schema.names), rule, *shown]:
        cells = [cell.rjust(width) if right else cell.ljust(width) for cell, width, right in zip(row, widths, numeric)]
        out.write(("  ".join(cells).rstrip() + "\n").encode())
    out.write(f"{count:,} row{'s' * (count != 1)}{f', {most} shown' if count > most else ''}\n".encode())
    return count


def _cell(value: Any) -> str:
    if value is None:
        return "NULL"
    return f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).split("\n"))


def _cut(text: str, widest: int) -> str:
    return text if len(text) <= widest else text[: widest - 1] + "…"


_WRITERS: dict[str, Callable[[pa.RecordBatchReader, BinaryIO], int]] = {
    "table": _write_table,
    "csv": _write_csv,
    "json": _write_json,
    "arrow": _write_arrow,
}
FORMATS = tuple(_WRITERS)
