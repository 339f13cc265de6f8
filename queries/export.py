"""Export a run as Parquet, which any DuckDB or Spark reads."""

import os
import pathlib

import duckdb
import pyarrow.parquet

from queries.errors import QueryError
from queries.run import Run
from queries.sql import batches

ROW_GROUP = 500_000  # rows


def export_parquet(run: Run, folder: str | os.PathLike[str]) -> dict[str, int]:
    """Write every view as ``<folder>/<name>.parquet`` (zstd), rows in stored order; the number of rows of each.

    Files that are there already are not replaced: ``QueryError``.
    """
    target = pathlib.Path(folder)
    connection = run.connect()
    names = [name for (name,) in connection.execute("SELECT view_name FROM duckdb_views() WHERE NOT internal AND temporary ORDER BY 1").fetchall()]
    names = [name for name in names if not name.startswith("stored_")]
    there = [name for name in names if (target / f"{name}.parquet").exists()]
    if there:
        raise QueryError(f"`{target / there[0]}.parquet` exists already: choose another folder")
    try:
        target.mkdir(parents=True, exist_ok=True)
        return {name: _export(connection, name, target / f"{name}.parquet") for name in names}
    except OSError as error:
        raise QueryError(f"cannot write Parquet files into `{target}`: {error}") from None
    finally:
        run.disconnect(connection)


def _export(connection: duckdb.DuckDBPyConnection, name: str, file: pathlib.Path) -> int:
    """Write one view, under a temporary name until it is whole."""
    unfinished = file.with_suffix(".parquet.tmp")
    reader = batches(connection, f"SELECT * FROM {name}", ROW_GROUP)
    rows = 0
    try:
        with pyarrow.parquet.ParquetWriter(unfinished, reader.schema, compression="zstd") as writer:
            for batch in reader:
                writer.write_batch(batch, row_group_size=ROW_GROUP)
                rows += batch.num_rows
        unfinished.replace(file)
    finally:
        unfinished.unlink(missing_ok=True)
    return rows
