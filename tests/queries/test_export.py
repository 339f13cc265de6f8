"""Parquet that others read: the same rows in the same order, nothing overwritten."""

import pathlib

import duckdb
import pyarrow.parquet
import pytest
from synthetic import SyntheticRun

from queries import open_run
from queries.errors import QueryError
from queries.export import export_parquet


def test_parquet_holds_every_view(any_run: SyntheticRun, tmp_path: pathlib.Path) -> None:
    with open_run(any_run.folder) as run:
        rows = export_parquet(run, tmp_path / "out")
        expected = run.connection.execute("SELECT * FROM paths").fetchall()
    assert rows["paths"] == len(any_run.rows) == len(expected) > 0
    assert {file.name for file in (tmp_path / "out").iterdir()} == {f"{name}.parquet" for name in rows}
    assert {"camera_vertices", "light_vertices", "occluded", "words", "events", "objects", "emitters", "techniques", "triangles", "run"} < set(rows)
    for name, count in rows.items():
        assert duckdb.execute(f"SELECT count(*) FROM '{tmp_path}/out/{name}.parquet'").fetchone() == (count,)
    assert duckdb.execute(f"SELECT * FROM '{tmp_path}/out/paths.parquet'").fetchall() == expected
    assert pyarrow.parquet.ParquetFile(tmp_path / "out/paths.parquet").metadata.row_group(0).column(0).compression == "ZSTD"


def test_nothing_is_overwritten(path_run: SyntheticRun, tmp_path: pathlib.Path) -> None:
    (tmp_path / "words.parquet").write_text("mine")
    with open_run(path_run.folder) as run, pytest.raises(QueryError, match="exists already"):
        export_parquet(run, tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["words.parquet"]


def test_a_folder_that_cannot_be_written(path_run: SyntheticRun, tmp_path: pathlib.Path) -> None:
    (tmp_path / "file").touch()
    with open_run(path_run.folder) as run, pytest.raises(QueryError, match="cannot write"):
        export_parquet(run, tmp_path / "file" / "out")
