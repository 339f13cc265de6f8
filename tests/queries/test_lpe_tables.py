"""``lpe('…')`` in SQL: the same rows as trying every path, joined with anything, and nothing else of the text changed."""

import pathlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from placed import PlacedRun, make_placed_run
from words import matches

from queries import Run, open_run
from queries.errors import QueryError, QueryTimeout
from queries.lpe.parser import parse
from queries.sql import query
from queries.sql_calls import replace_calls


@pytest.fixture(scope="module")
def placed(tmp_path_factory: pytest.TempPathFactory) -> PlacedRun:
    return make_placed_run(tmp_path_factory.mktemp("tables") / "run", "path", 5)


@pytest.fixture
def run(placed: PlacedRun) -> Iterator[Run]:
    with open_run(placed.folder) as opened:
        yield opened


def keys(placed: PlacedRun, text: str, table: str = "paths") -> list[tuple[int, int]]:
    tree = parse(text).tree
    return [(row["camera_walk"], row["path"]) for row, word in zip(placed.rows[table], placed.words[table]) if matches(tree, word)]


def rows(run: Run, text: str) -> list[tuple[Any, ...]]:
    return [tuple(row.values()) for row in query(run, text).to_pylist()]


@pytest.mark.parametrize("text", ["C .* L", "C .* X@ball .* .", "C .* X@object:floor .* L", "C .* .@crosses:crate"])
def test_rows_of_an_expression(run: Run, placed: PlacedRun, text: str) -> None:
    expected = keys(placed, text)
    assert 0 < len(expected) < len(placed.rows["paths"])
    assert rows(run, f"SELECT camera_walk, path FROM lpe('{text}') ORDER BY ALL") == expected
    assert rows(run, f"SELECT camera_walk, path FROM LPE( $${text}$$ , 'std' ) AS p ORDER BY ALL") == expected
    blocked = keys(placed, text, "occluded")
    assert blocked
    assert rows(run, f"SELECT camera_walk, path FROM lpe_occluded('{text}') ORDER BY ALL") == blocked


def test_columns_are_those_of_paths(run: Run) -> None:
    described = query(run, "DESCRIBE paths").select(["column_name", "column_type"])
    assert query(run, "DESCRIBE SELECT * FROM lpe('C .* X@ball .* .')").select(["column_name", "column_type"]).equals(described)


def test_dialects(run: Run, placed: PlacedRun) -> None:
    expected = keys(placed, "C D (D|S) L")
    assert rows(run, "SELECT camera_walk, path FROM lpe('CDD|SL', 'osl') ORDER BY ALL") == expected
    assert expected
    with pytest.raises(QueryError, match=r"in lpe\('C D L', 'osl'\): column 2"):
        query(run, "SELECT * FROM lpe('C D L', 'osl')")


def test_joined_with_anything(run: Run, placed: PlacedRun) -> None:
    ball, lit = set(keys(placed, "C .* X@ball .* .")), set(keys(placed, "C .* L"))
    text = """WITH seen AS (SELECT camera_walk, path FROM lpe('C .* X@ball .* .'))
        SELECT count(*), (SELECT count(*) FROM seen), (SELECT count(*) FROM lpe('C .* L'))
        FROM seen JOIN lpe('C .* L') AS lit USING (camera_walk, path) JOIN emitters USING (emitter)"""
    assert rows(run, text) == [(len(ball & lit), len(ball), len(lit))]
    assert ball & lit
    kept = "CREATE TEMP TABLE t AS SELECT path FROM lpe('C .* L'); SELECT count(*) FROM t"
    assert rows(run, kept) == [(len(lit),)]


def test_expressions_that_differ_in_letter_case(run: Run, placed: PlacedRun) -> None:
    text = "SELECT (SELECT count(*) FROM lpe('C .* <.S> .')), (SELECT count(*) FROM lpe('C .* <.s> .'))"
    assert rows(run, text) == [(len(keys(placed, "C .* <.S> .")), len(keys(placed, "C .* <.s> .")))]
    assert keys(placed, "C .* <.S> .") != keys(placed, "C .* <.s> .")


def test_shadows_count_at_weight_1(run: Run, placed: PlacedRun) -> None:
    blocked = zip(placed.rows["occluded"], placed.words["occluded"])
    expected = [row["contribution_r"] / row["mis_weight"] for row, word in blocked if word[-1].type == "L"]
    found = rows(run, "SELECT sum(contribution_r::DOUBLE), max(mis_weight), count(blocker) FROM lpe('shadows; C .* L')")
    assert found == [(pytest.approx(sum(expected)), 1.0, len(expected))]
    for prefix in ("unoccluded", "nothruput"):
        with pytest.raises(QueryError, match=f"{prefix};"):
            query(run, f"SELECT * FROM lpe('{prefix}; C .* L')")


def test_text_that_only_looks_like_a_call(run: Run) -> None:
    text = """SELECT 'lpe(''C L'')' AS a, $$ from lpe('C L') $$ AS b, "lpe" AS c, E'\\'lpe(''x'')' AS d -- lpe('C L')
        FROM (SELECT 1 AS lpe) /* lpe('C /* L') */ lpe('C L') */"""
    assert rows(run, text) == [("lpe('C L')", " from lpe('C L') ", 1, "'lpe('x')")]
    assert rows(run, "SELECT lpe FROM (SELECT 2 AS lpe)") == [(2,)]


BROKEN = [
    "SELECT * FROM lpe('C D (L')", "SELECT * FROM lpe('')", "SELECT * FROM lpe()", "SELECT * FROM lpe(paths)", "SELECT * FROM lpe('C L', 'std', 'x')",
    "SELECT * FROM lpe('C L' || 'x')", "SELECT * FROM lpe(E'C L')", "SELECT * FROM lpe('C L'", "SELECT * FROM lpe('C L",
    "SELECT * FROM lpe('C L', 'pov')",
    "SELECT * FROM lpe('C X@nowhere L')", "SELECT * FROM lpe('C X@object:flor L')", "SELECT lpe('C L')", "SELECT * FROM main.lpe('C L')",
    "SELECT * FROM lpe($a$C L$b$)", "SELECT * FROM /* lpe('C L')", "DROP VIEW paths; SELECT * FROM lpe('C L') WHERE nothing",
    "INSERT INTO lpe('C L') VALUES (1)",
    "COPY lpe('C L') TO '{out}/x.csv'", "COPY (SELECT * FROM lpe('C L')) TO '{out}/x.csv'", "SELECT * FROM lpe('C L''; COPY paths TO ''{out}/x.csv')",
    "UPDATE lpe('C L') SET path = 1", "EXPORT DATABASE lpe('C L')",
]  # fmt: skip


@pytest.mark.parametrize("text", BROKEN)
def test_broken_and_malicious_text(
    run: Run, placed: PlacedRun, tmp_path: pathlib.Path, fingerprint: Callable[[pathlib.Path], dict[str, str]], text: str
) -> None:
    before = fingerprint(placed.folder)
    with pytest.raises(QueryError):
        query(run, text.replace("{out}", str(tmp_path)))
    assert fingerprint(placed.folder) == before
    assert list(tmp_path.iterdir()) == []
    assert rows(run, "SELECT count(*) FROM lpe('C .*')") == [(len(placed.rows["paths"]),)]


def test_odd_labels_are_names_of_views_too(run: Run, placed: PlacedRun) -> None:
    for label in ('a"b; DROP VIEW paths; --', "\"; ATTACH '/tmp/a.db' AS other; --"):
        written = label.replace("'", "\\'").replace("'", "''")
        found = rows(run, f"SELECT count(*) FROM lpe('C .* !''{written}'' .')")
        assert found == [(len(keys(placed, "C .* !'nobody' .")),)]
        assert found[0][0] > 0


def test_errors_show_the_analyst_s_own_text(run: Run) -> None:
    with pytest.raises(QueryError, match=r"FROM \"lpe\('C L'\)\" WHERE"):
        query(run, "SELECT * FROM lpe('C L') WHERE SELECT")
    with pytest.raises(QueryError, match=r"in lpe\('C Q L'\): column 3"):
        query(run, "SELECT * FROM lpe('C Q L')")


def test_the_time_limit_holds_for_classifying(run: Run) -> None:
    with pytest.raises(QueryTimeout):
        query(run, "SELECT count(*) FROM " + ", ".join(f"lpe('C .* X@ball{{{i}}} .* .')" for i in range(1, 40)), time_limit=0.01)


def test_a_run_asks_itself(run: Run, placed: PlacedRun) -> None:
    assert run.sql("SELECT count(*) AS n FROM lpe('C .*')")["n"].to_pylist() == [len(placed.rows["paths"])]


def test_replace_calls_leaves_the_rest_as_it_is() -> None:
    text = "select\t'a' , \"b\" from lpe ( 'C''L' ) where x='lpe(''y'')' -- lpe('z')\n and lpe_x('q') and a.lpe('r')"
    assert replace_calls(text, lambda call, source: f"<{call.text}|{source}>") == text.replace("lpe ( 'C''L' )", "<C'L|lpe ( 'C''L' )>", 1)
