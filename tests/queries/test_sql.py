"""SQL from analysts: answers in every format, limits, and nothing outside the connection within reach."""

import io
import json
import os
import pathlib
import time
from collections.abc import Callable, Iterator

import polars
import pyarrow as pa
import pytest
from synthetic import SyntheticRun

from queries import Run, open_run, sql
from queries.errors import QueryError, QueryTimeout
from queries.sql import FORMATS, query, stream, write
from queries.sql_calls import replace_calls


@pytest.fixture
def run(path_run: SyntheticRun) -> Iterator[Run]:
    with open_run(path_run.folder) as opened:
        yield opened


def test_a_query_answers_with_an_arrow_table(run: Run, path_run: SyntheticRun) -> None:
    table = query(run, "SELECT camera_depth, count(*) AS n FROM paths GROUP BY 1 ORDER BY 1")
    assert isinstance(table, pa.Table)
    assert sum(table["n"].to_pylist()) == len(path_run.rows)
    assert query(run, "DESCRIBE paths").num_rows == 20
    assert query(run, "EXPLAIN SELECT 1").num_rows == 1


def test_what_a_query_makes_ends_with_it(run: Run, path_run: SyntheticRun) -> None:
    made = query(run, "CREATE TEMP TABLE mine AS SELECT 7 AS a; INSERT INTO mine VALUES (8); SELECT sum(a) AS s FROM mine")
    assert made["s"].to_pylist() == [15]
    with pytest.raises(QueryError, match="mine does not exist"):
        query(run, "SELECT * FROM mine")
    assert query(run, "CREATE OR REPLACE TEMP VIEW paths AS SELECT 1 AS a; SELECT count(*) AS n FROM paths")["n"].to_pylist() == [1]
    query(run, "DROP VIEW words")
    assert query(run, "SELECT count(*) AS n FROM paths")["n"].to_pylist() == [len(path_run.rows)]
    assert query(run, "SELECT count(*) AS n FROM words")["n"][0].as_py() > 0


OUTSIDE = [
    "COPY paths TO '{out}/stolen.csv'",
    "COPY (SELECT 1) TO '{spill}/x.csv'",
    "COPY paths FROM '{out}/x.csv'",
    "EXPORT DATABASE '{out}/db'",
    "IMPORT DATABASE '{out}/db'",
    "ATTACH '{out}/db.duckdb' AS other",
    "ATTACH ':memory:' AS other",
    "DETACH memory",
    "USE memory",
    "SELECT * FROM read_csv('/etc/passwd')",
    "SELECT * FROM read_text('/etc/passwd')",
    "SELECT * FROM read_blob('/etc/passwd')",
    "SELECT * FROM '/etc/passwd'",
    "SELECT * FROM read_parquet('{out}/x.parquet')",
    "SELECT * FROM read_json('{run}/manifest.json')",
    "SELECT * FROM glob('/etc/*')",
    "SELECT * FROM sniff_csv('/etc/passwd')",
    "SELECT * FROM 'https://example.com/x.parquet'",
    "SELECT getenv('HOME')",
    "INSTALL httpfs",
    "LOAD httpfs",
    "LOAD '{out}/x.duckdb_extension'",
    "SET threads = 64",
    "SET enable_external_access = true",
    "SET lock_configuration = false",
    "SET temp_directory = '{out}'",
    "RESET memory_limit",
    "SET VARIABLE a = 1",
    "PRAGMA memory_limit = '1TB'",
    "PRAGMA enable_profiling",
    "PRAGMA profile_output = '{out}/profile.json'",
    "CALL enable_logging(storage = 'file', storage_path = '{out}/log')",
    "CREATE PERSISTENT SECRET s (TYPE http)",
    "CREATE TEMP TABLE a AS SELECT * FROM read_csv('/etc/passwd')",
    "EXPLAIN ANALYZE COPY paths TO '{out}/stolen.csv'",
    "PREPARE p AS COPY paths TO '{out}/stolen.csv'",
    "SELECT * FROM query('COPY paths TO ''{out}/stolen.csv''')",
    "SELECT * FROM query_table('/etc/passwd')",
    "SELECT 1; COPY paths TO '{out}/stolen.csv'",
    "SELECT * FROM path_run",
    "SELECT * FROM run_variable",
    "SELECT * FROM arrow_scan(8, 8, 8)",
    "SELECT * FROM pandas_scan(8)",
    "UPDATE paths SET contribution_r = 0",
    "DELETE FROM stored_paths",
    "INSERT INTO objects SELECT * FROM objects",
    "CHECKPOINT",
    "BEGIN",
    "VACUUM",
    "UPDATE EXTENSIONS",
]


@pytest.mark.parametrize("text", OUTSIDE)
def test_nothing_outside_is_within_reach(
    run: Run, path_run: SyntheticRun, tmp_path: pathlib.Path, fingerprint: Callable[[pathlib.Path], dict[str, str]], text: str
) -> None:
    run_variable = pa.table({"a": [1]})
    before = fingerprint(path_run.folder)
    spill = query(run, "SELECT current_setting('temp_directory') AS t")["t"][0].as_py()
    with pytest.raises(QueryError):
        query(run, text.format(out=tmp_path, spill=spill, run=path_run.folder))
    assert run_variable.num_rows == 1
    assert list(tmp_path.iterdir()) == []
    assert fingerprint(path_run.folder) == before
    assert query(run, "SELECT count(*) AS n FROM paths")["n"].to_pylist() == [len(path_run.rows)]


REFUSED_EVERYWHERE = ("COPY paths TO", "ATTACH '{out}", "SELECT * FROM read", "SET threads", "SET enable", "INSTALL", "EXPORT")


@pytest.mark.parametrize("text", [text for text in OUTSIDE if text.startswith(REFUSED_EVERYWHERE)])
def test_the_run_s_own_connection_is_as_closed(run: Run, path_run: SyntheticRun, tmp_path: pathlib.Path, text: str) -> None:
    with pytest.raises(Exception, match=r"disabled|locked|does not exist|Cannot"):
        run.connection.execute(text.format(out=tmp_path, run=path_run.folder))
    assert list(tmp_path.iterdir()) == []


BAD = ["", "   ", ";", "-- nothing", "SELEC 1", "SELECT nothing FROM paths", "SELECT * FROM nowhere", "SELECT 'x'::INTEGER", "\0", "SELECT \ud800"]


@pytest.mark.parametrize("text", BAD)
def test_bad_sql_is_a_clear_error(run: Run, text: str) -> None:
    with pytest.raises(QueryError):
        query(run, text)


def test_a_query_ends_at_its_time_limit(run: Run) -> None:
    start = time.monotonic()
    with pytest.raises(QueryTimeout, match=r"after 0\.2 seconds"):
        query(run, "SELECT sum(a.i * b.i) FROM range(100000000) a(i), range(100000000) b(i)", time_limit=0.2)
    with pytest.raises(QueryTimeout), stream(run, "SELECT * FROM range(1000000000000)", time_limit=0.2) as reader:
        for _ in reader:
            pass
    assert time.monotonic() - start < 20
    assert query(run, "SELECT 1 AS a", time_limit=30)["a"].to_pylist() == [1]


@pytest.mark.parametrize("slow", ["classification", "planning"])
def test_the_limit_holds_where_it_passes_between_statements(run: Run, monkeypatch: pytest.MonkeyPatch, slow: str) -> None:
    """What no check sees: time that runs out before DuckDB begins, so that there is nothing to interrupt yet."""
    target, name = ("queries.sql.make_views", "make_views") if slow == "classification" else ("queries.sql.batches", "batches")
    original = getattr(sql, name)

    def late(*given: object) -> object:
        time.sleep(0.3)
        return original(*given)

    monkeypatch.setattr(target, late)
    start = time.monotonic()
    with pytest.raises(QueryTimeout):
        query(run, "SELECT sum(a.i * b.i) FROM range(100000000) a(i), range(100000) b(i)", time_limit=0.1)
    assert time.monotonic() - start < 20


def test_answers_before_the_last_are_dropped(run: Run) -> None:
    assert query(run, "SELECT 1; SELECT * FROM range(300000); EXPLAIN SELECT 2; SELECT 3 AS a")["a"].to_pylist() == [3]
    with pytest.raises(QueryTimeout):
        query(run, "SELECT * FROM range(1000000000000); SELECT 3 AS a", time_limit=0.2)


def test_long_texts_end_soon(run: Run) -> None:
    start = time.monotonic()
    with pytest.raises(QueryError, match="at most 100,000 characters"):
        query(run, "SELECT 1" + " UNION ALL SELECT 1" * 20_000)
    assert replace_calls("/**/" * 500_000 + "lpe('C L')", lambda call, _: call.text).endswith("*/C L")
    assert time.monotonic() - start < 10


def test_a_query_too_large_for_memory_and_disk_is_an_error(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder, memory_limit="32MB", threads=1) as run, pytest.raises(QueryError, match=r"[Mm]emory"):
        query(run, "SELECT list(i) FROM range(100000000) t(i)")


# --- formats ------------------------------------------------------------------------------------------------------

ODD = "SELECT * FROM (VALUES (1, 'a,\"b\"', 0.5::DOUBLE, NULL), (2, 'ü\nx', 'nan'::DOUBLE, [1, 2])) t(i, s, f, l) ORDER BY i"


def written(run: Run, text: str, kind: str) -> bytes:
    out = io.BytesIO()
    with stream(run, text) as reader:
        write(reader, kind, out)
    return out.getvalue()


def test_csv(run: Run) -> None:
    assert written(run, ODD, "csv").decode() == 'i,s,f,l\n1,"a,""b""",0.5,\n2,"ü\nx",nan,"[1, 2]"\n'


def test_json(run: Run) -> None:
    assert json.loads(written(run, ODD, "json")) == [{"i": 1, "s": 'a,"b"', "f": 0.5, "l": None}, {"i": 2, "s": "ü\nx", "f": None, "l": [1, 2]}]
    assert json.loads(written(run, "SELECT 1 WHERE false", "json")) == []


def test_arrow(run: Run) -> None:
    assert pa.ipc.open_stream(written(run, ODD, "arrow")).read_all()["s"].to_pylist() == ['a,"b"', "ü\nx"]


def test_table(run: Run) -> None:
    assert written(run, "SELECT 7 AS i, 'floor' AS name UNION ALL SELECT 1000, NULL ORDER BY i", "table").decode().splitlines() == [
        "   i  name",
        "────  ─────",
        "   7  floor",
        "1000  NULL",
        "2 rows",
    ]
    assert written(run, "SELECT * FROM range(1000)", "table").decode().endswith("1,000 rows, 200 shown\n")
    assert written(run, "SELECT 1 AS a WHERE false", "table").decode().splitlines()[-1] == "0 rows"


def test_unknown_format(run: Run) -> None:
    assert FORMATS == ("table", "csv", "json", "arrow")
    with pytest.raises(QueryError, match="expected one of the formats"):
        written(run, "SELECT 1", "xml")


def test_plain_readers_read_the_same_files(path_run: SyntheticRun) -> None:
    files = sorted((path_run.folder / "tables" / "paths").iterdir())
    frame = polars.concat([polars.read_ipc(file) for file in files])
    assert frame.height == len(path_run.rows)
    assert frame["contribution_r"].sum() == pytest.approx(sum(row["contribution_r"] for row in path_run.rows))
    assert os.fspath(files[0]).endswith("00000.arrow")
