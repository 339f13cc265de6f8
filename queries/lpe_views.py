"""``lpe('…')`` as tables of SQL: each expression is classified once and becomes a view of the rows that it matches.

A view is named by the call's own text, so that DuckDB's messages show what the analyst wrote.
"""

from collections.abc import Callable

import duckdb
import pyarrow as pa

from queries.classify import select_all
from queries.errors import ExpressionError, QueryError
from queries.run import Run
from queries.sql_calls import Call, replace_calls
from queries.views import RECORDED, select_list

_AT_WEIGHT_1 = ", ".join(f"coalesce(contribution_{c} / nullif(mis_weight, 0), 0)::FLOAT AS contribution_{c}" for c in "rgb")
_MATCHED = "matched by the expression"
_ROWS_HAVE_NO = ("unoccluded", "nothruput")


def make_views(run: Run, connection: duckdb.DuckDBPyConnection, text: str, check: Callable[[], None] | None = None) -> str:
    """Make a view in ``connection`` for every ``lpe('…')`` of an SQL text; the text that asks these views.

    ``check`` is called now and then while rows are classified, and may raise. Raises QueryError for bad expressions.
    """
    names: dict[Call, str] = {}

    def view(call: Call, source: str) -> str:
        if call not in names:
            # Names that differ in letter case alone are one to SQL
            clashes = sum(1 for name in names.values() if name.lower().startswith(source.lower()))
            names[call] = f"{source} #{clashes + 1}" if clashes else source
            try:
                _make_view(run, connection, call, names[call], check)
            except ExpressionError as error:
                raise QueryError(f"in {source}: {error}") from None
        return quoted(names[call])

    return replace_calls(text, view)


def _make_view(run: Run, connection: duckdb.DuckDBPyConnection, call: Call, name: str, check: Callable[[], None] | None) -> None:
    expression = run.compile(call.text, call.dialect)
    without_rows = [prefix for prefix in expression.prefixes if prefix in _ROWS_HAVE_NO]
    if without_rows:
        raise QueryError(
            f"`{without_rows[0]};` changes what paths count in an image, and {call.function}() lists them as they are: "
            "take it to `pathspace lpe` or an AOV, or leave it out"
        )
    shadows = "shadows" in expression.prefixes
    table = "occluded" if shadows else call.table
    chosen = select_all(run, expression, table, check=check)
    stored = run.tables[table]
    marked = stored.append_column(_MATCHED, pa.chunked_array([pa.array(rows) for rows in chosen], pa.bool_()))
    connection.register(f"stored {name}", marked)
    wanted = select_list(stored, RECORDED[table])
    # Blocked connections stand at their weight among techniques; a shadow is what is missing in all
    replaced = f"* REPLACE ({_AT_WEIGHT_1}, 1::FLOAT AS mis_weight)" if shadows else "*"
    where = quoted(_MATCHED)
    connection.execute(f"CREATE TEMP VIEW {quoted(name)} AS SELECT {replaced} FROM (SELECT {wanted} FROM {quoted(f'stored {name}')} WHERE {where})")


def quoted(name: str) -> str:
    """An SQL identifier."""
    return '"' + name.replace('"', '""') + '"'
