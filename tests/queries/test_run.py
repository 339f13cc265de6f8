"""Opening a run: views, absent columns, and every way in which a folder can be no run."""

import json
import pathlib
from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pytest
from synthetic import SyntheticRun, make_run

from queries import Run, open_run
from queries.errors import QueryError, RunError
from queries.sql import query
from renderer.tables import LIGHT_VERTICES, OCCLUDED, PATHS

VIEWS = {"camera_vertices", "light_vertices", "paths", "occluded", "words", "objects", "events", "emitters", "techniques", "triangles", "run"}


def test_views_hold_the_rows(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        assert isinstance(run, Run)
        for view in VIEWS:
            assert run.connection.execute(f"SELECT count(*) >= 0 FROM {view}").fetchone() == (True,)
        count = run.connection.execute("SELECT count(*), sum(contribution_g::DOUBLE), min(camera_walk), max(path) FROM paths").fetchone()
        vertices = run.connection.execute("SELECT count(*) FROM camera_vertices").fetchone()
    walks = [row["camera_walk"] for row in path_run.rows]
    greens = sum(row["contribution_g"] for row in path_run.rows)
    assert count == (len(path_run.rows), pytest.approx(greens), min(walks), max(row["path"] for row in path_run.rows))
    assert vertices == (path_run.vertices,)


def test_rows_keep_their_stored_order(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        rows = run.connection.execute("SELECT camera_walk, path FROM paths").fetchall()
    assert rows == [(row["camera_walk"], row["path"]) for row in path_run.rows]


def test_small_integers_are_widened_to_signed(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        types = {name: kind for name, kind, *_ in run.connection.execute("DESCRIBE paths").fetchall()}
        assert run.connection.execute("SELECT min(technique - 200), min(0 - emitter), min(camera_walk - 4000000000) FROM paths").fetchone()
    assert (types["technique"], types["path"], types["camera_walk"], types["camera_word"], types["raster_x"]) == (
        "INTEGER",
        "INTEGER",
        "BIGINT",
        "UBIGINT",
        "FLOAT",
    )
    assert list(types) == [column.name for column in PATHS.columns]


def test_absent_columns_are_null(path_run: SyntheticRun, light_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        assert run.connection.execute("SELECT count(light_walk), count(light_word), count(camera_word) FROM paths").fetchone() == (
            0,
            0,
            len(path_run.rows),
        )
        kinds = {name: kind for name, kind, *_ in run.connection.execute("DESCRIBE paths").fetchall()}
        assert (kinds["light_walk"], kinds["light_word"], kinds["light_depth"]) == ("BIGINT", "UBIGINT", "INTEGER")
        assert run.connection.execute("SELECT count(*), count(primitive) FROM camera_vertices").fetchone() == (path_run.vertices, 0)
    with open_run(light_run.folder) as run:
        counts = run.connection.execute("SELECT count(camera_word), count(light_word), sum(mis_weight) FROM paths").fetchone()
        assert counts == (0, len(light_run.rows), len(light_run.rows))  # one technique alone: every weight is 1


def test_absent_tables_are_empty(path_run: SyntheticRun, light_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        described = run.connection.execute("DESCRIBE light_vertices").fetchall()
        assert [row[0] for row in described] == [column.name for column in LIGHT_VERTICES.columns]
        assert run.connection.execute("SELECT count(*) FROM light_vertices").fetchone() == (0,)
        assert run.connection.execute("SELECT count(*), count(blocker) FROM occluded").fetchone() == (len(path_run.occluded),) * 2
        assert len(path_run.occluded) > 0
    with open_run(light_run.folder) as run:
        assert [row[0] for row in run.connection.execute("DESCRIBE occluded").fetchall()] == [column.name for column in OCCLUDED.columns]


def test_a_run_that_recorded_nothing_opens(tmp_path: pathlib.Path) -> None:
    with open_run(make_run(tmp_path / "run", keep=0.0).folder) as run:
        assert run.connection.execute("SELECT count(*) FROM paths").fetchone() == (0,)
        assert run.connection.execute("SELECT count(*) FROM objects").fetchone() != (0,)


def test_wide_walk_ids(tmp_path: pathlib.Path) -> None:
    """A job of more than 2^32 walks stores its ids in 64 bits."""
    folder = make_run(tmp_path / "run", shards=1).folder
    file = folder / "tables/paths/00000.arrow"
    table = pa.ipc.open_file(str(file)).read_all()
    ids = pa.array(np.arange(table.num_rows, dtype=np.uint64) + np.uint64(2**33))
    table = table.set_column(0, "camera_walk", ids)
    with pa.ipc.new_file(str(file), table.schema) as writer:
        writer.write_table(table)
    rewrite(folder / "shards/00000.json", lambda record: record["files"]["tables/paths/00000.arrow"].update(bytes=file.stat().st_size))
    with open_run(folder) as run:
        assert run.connection.execute("SELECT min(camera_walk), typeof(min(camera_walk)) FROM paths").fetchone() == (2**33, "UBIGINT")


def test_the_spill_folder_is_removed(path_run: SyntheticRun) -> None:
    run = open_run(path_run.folder)
    spill = pathlib.Path(run.connection.execute("SELECT current_setting('temp_directory')").fetchone()[0])  # type: ignore[index]
    assert spill.is_dir()
    run.close()
    assert not spill.exists()


def test_a_closed_connection_leaves_nothing(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder) as run:
        own = pathlib.Path(run.connection.execute("SELECT current_setting('temp_directory')").fetchone()[0])  # type: ignore[index]
        for _ in range(3):
            query(run, "SELECT count(*) FROM paths")
        with pytest.raises(QueryError):
            query(run, "SELECT nothing")
        assert list(own.parent.iterdir()) == [own]
        assert run.connection.execute("SELECT count(*) FROM paths").fetchone() == (len(path_run.rows),)


def test_queries_larger_than_memory_spill(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder, memory_limit="40MB", threads=1) as run:
        found = run.connection.execute("SELECT count(*), max(i) FROM (SELECT i FROM range(3000000) t(i) ORDER BY hash(i))").fetchone()
        assert found == (3_000_000, 2_999_999)


def rewrite(file: pathlib.Path, change: Callable[[dict], object]) -> None:  # type: ignore[type-arg]
    value = json.loads(file.read_text())
    change(value)
    file.write_text(json.dumps(value))


def truncate(file: pathlib.Path, size: int) -> None:
    file.write_bytes(file.read_bytes()[:size])


def damage(file: pathlib.Path) -> None:
    """The right size, the wrong bytes."""
    file.write_bytes(b"\xff" * file.stat().st_size)


BROKEN = {
    "nothing there": (lambda f: f.rename(f.parent / "elsewhere"), "found nothing"),
    "no manifest": (lambda f: (f / "manifest.json").unlink(), "no manifest.json"),
    "manifest is junk": (lambda f: (f / "manifest.json").write_bytes(b"\x00\xff{"), "cannot be read"),
    "manifest is a list": (lambda f: (f / "manifest.json").write_text("[]"), "no manifest of a run"),
    "manifest of something else": (lambda f: (f / "manifest.json").write_text('{"name": "x"}'), "no manifest of a run"),
    "unfinished": (lambda f: rewrite(f / "manifest.json", lambda m: m.update(status="rendering")), "unfinished"),
    "no shards named": (lambda f: rewrite(f / "manifest.json", lambda m: m.pop("shards")), "cannot be read"),
    "shards of a wrong kind": (lambda f: rewrite(f / "manifest.json", lambda m: m.update(shards=7)), "cannot be read"),
    "shard record missing": (lambda f: (f / "shards/00001.json").unlink(), "lacks shards/00001.json"),
    "shard record junk": (lambda f: (f / "shards/00001.json").write_text("{]"), "cannot be read"),
    "shard missing": (lambda f: (f / "tables/paths/00001.arrow").unlink(), "00001.arrow` is missing"),
    "shard truncated": (lambda f: truncate(f / "tables/paths/00002.arrow", 500), "00002.arrow` is truncated"),
    "shard empty": (lambda f: truncate(f / "tables/paths/00002.arrow", 0), "00002.arrow` is truncated"),
    "shard junk": (lambda f: damage(f / "tables/paths/00000.arrow"), "00000.arrow` is damaged"),
    "words missing": (lambda f: (f / "tables/words.arrow").unlink(), "words.arrow` is missing"),
    "catalogue junk": (lambda f: damage(f / "tables/objects.arrow"), "objects.arrow` is damaged"),
    "catalogue unnamed": (lambda f: rewrite(f / "manifest.json", lambda m: m["catalogues"].pop("emitters")), "no catalogue `emitters`"),
    "rows missing": (lambda f: rewrite(f / "manifest.json", lambda m: m["rows"].update(paths=10**9)), "1,000,000,000"),
}


@pytest.mark.parametrize(("breaking", "message"), BROKEN.values(), ids=BROKEN.keys())
def test_broken_runs_are_named(tmp_path: pathlib.Path, breaking: Callable[[pathlib.Path], object], message: str) -> None:
    folder = make_run(tmp_path / "run").folder
    open_run(folder).close()
    breaking(folder)
    with pytest.raises(RunError, match=message):
        open_run(folder)


def test_a_file_is_no_run(tmp_path: pathlib.Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(RunError, match="found a file"):
        open_run(tmp_path / "file")


def test_some_shards_or_none(path_run: SyntheticRun) -> None:
    with open_run(path_run.folder, shards=range(1)) as first, open_run(path_run.folder, shards=range(0)) as none:
        assert 0 < first.tables["paths"].num_rows < len(path_run.rows)
        assert none.shard_files == []
        assert none.sql("SELECT count(*) AS n FROM paths")["n"].to_pylist() == [0]
    with pytest.raises(RunError, match="lacks shards/00099"):
        open_run(path_run.folder, shards=range(99, 100))
