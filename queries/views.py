"""Stored tables as SQL views: small integers widened to signed, so that arithmetic is safe, and columns that a run does not store supplied."""

import duckdb
import pyarrow as pa

from renderer.tables import ARROW_TYPES, RECORDED_TABLES, Table

RECORDED = {table.name: table for table in RECORDED_TABLES}
CATALOGUES = ("events", "techniques", "objects", "emitters", "triangles", "run")

_WIDENED = {pa.uint8(): "INTEGER", pa.uint16(): "INTEGER", pa.uint32(): "BIGINT"}
_PLAIN = {pa.uint64(): "UBIGINT", pa.float32(): "FLOAT"}
_ABSENT = {"mis_weight": "1"}  # a run of one technique alone stores no weights: all are 1


def create_views(connection: duckdb.DuckDBPyConnection, tables: dict[str, pa.Table]) -> None:
    """Make a view of each recorded table and each catalogue, reading the Arrow tables in place."""
    for name, table in tables.items():
        connection.register(f"stored_{name}", table)
        connection.execute(f"CREATE TEMP VIEW {name} AS SELECT {select_list(table, RECORDED.get(name))} FROM stored_{name}")
    for name, recorded in RECORDED.items():
        if name not in tables:
            connection.execute(f"CREATE TEMP VIEW {name} AS SELECT {select_list(None, recorded)} WHERE false")


def select_list(stored: pa.Table | None, recorded: Table | None) -> str:
    """The select list: what is stored, widened, in the schema's order, then other stored columns."""
    types = {} if stored is None else {field.name: field.type for field in stored.schema}
    wanted = {column.name: ARROW_TYPES[column.type] for column in recorded.columns} if recorded else {}
    listed = [_stored(name, types[name]) if name in types else _absent(name, kind) for name, kind in wanted.items()]
    listed += [_stored(name, kind) for name, kind in types.items() if name not in wanted]
    return ", ".join(listed)


def _stored(name: str, kind: pa.DataType) -> str:
    return f'"{name}"::{_WIDENED[kind]} AS "{name}"' if kind in _WIDENED else f'"{name}"'


def _absent(name: str, kind: pa.DataType) -> str:
    return f'{_ABSENT.get(name, "NULL")}::{(_WIDENED | _PLAIN)[kind]} AS "{name}"'
