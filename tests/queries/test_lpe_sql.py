"""Expressions over runs: what the SQL finds is what trying every path finds, and never nothing."""

import pytest
from synthetic import SyntheticRun
from words import matches

from queries import open_run
from queries.lpe import compile
from queries.lpe.parser import parse

EXPRESSIONS = [
    "C.L",
    "C.*L",
    "C.*B",
    "C.*O | C.B",
    "CD.*L",
    "C.*D.*L",
    "C.*D.*.",
    "C<RD>.*.",
    "C<T.>.*L",
    "C[DS]*L",
    "C[^D]+.",
    "CX{1,2}[LB]",
    "C.*[LOB] - C.*D.*.",
    "C.*S.*[LB] & C.*D.*[LB]",
    "C.*S.*[LB] ^ C.*D.*[LB]",
    "C(D|G)?S*.",
    "C.*'floor'.*L",
    "C!'floor'+L",
    "C.*<R.'white'>.*.",
    "C.*<..'specular'>.*.",
    r"C.*'o\'brien'.*.",
    r"C.*'a\\b'.*.",
    "C.*['floor''wall'].*'lamp_light'",
    "C.*<L..'lamp'>",
    "C.*<O..[^'nobody']>",
    "C[^'floor']*<L..'spot'>",
    "C.*'sky'",
    "C.*<L..[^'spot']>",
    "C.*<L..!'spot'>",
]


def found(run: SyntheticRun, text: str, table: str = "paths") -> list[tuple[int, int]]:
    """The (walk, path) keys that the SQL finds."""
    with open_run(run.folder) as opened:
        columns = "coalesce(p.camera_walk, p.light_walk) AS walk, p.path"
        texts = {compile(text).sql(table, columns), compile(text).sql(table, columns, light_words=opened.light_words)}
        answers = [sorted(opened.connection.execute(sql).fetchall()) for sql in texts]
    assert all(answer == answers[0] for answer in answers)
    return answers[0]


def keys(rows: list[dict[str, int]], chosen: list[int]) -> list[tuple[int, int]]:
    return sorted((rows[i]["camera_walk"], rows[i]["path"]) for i in chosen)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_sql_finds_what_trying_every_path_finds(any_run: SyntheticRun, text: str) -> None:
    expected = any_run.matched(parse(text).tree)
    assert 0 < len(expected) < len(any_run.rows)
    assert found(any_run, text) == keys(any_run.rows, expected)


@pytest.mark.parametrize("text", ["LS*E", "L.*DE", "B.E", "LX+E - L.*D.*E", "L.*<RD'floor'>E"])
def test_light_first_reads_words_backward(any_run: SyntheticRun, text: str) -> None:
    expected = any_run.matched(parse(text).tree, backward=True)
    assert 0 < len(expected) < len(any_run.rows)
    assert found(any_run, text) == keys(any_run.rows, expected)


@pytest.mark.parametrize("text", ["C.*L", "CD.*L", "C.*'floor'.*.", "C.*B"])
def test_occluded_connections(path_run: SyntheticRun, text: str) -> None:
    expected = [i for i, word in enumerate(path_run.occluded_words) if matches(parse(text).tree, word)]
    assert 0 < len(expected) < len(path_run.occluded)
    assert found(path_run, text, "occluded") == keys(path_run.occluded, expected)


@pytest.mark.parametrize("text", ["CDDDDDDDDDL", "C<VD>L", "C'nowhere'L", "LDL"])
def test_expressions_that_match_nothing(any_run: SyntheticRun, text: str) -> None:
    assert any_run.matched(parse(text).tree) == []
    assert found(any_run, text) == []


def test_sql_and_accepts_agree_on_every_word(any_run: SyntheticRun) -> None:
    for text in EXPRESSIONS:
        expression, tree = compile(text), parse(text).tree
        assert [expression.accepts(word) for word in any_run.words] == [matches(tree, word) for word in any_run.words]


def test_an_expression_that_matches_everything(any_run: SyntheticRun) -> None:
    assert found(any_run, "C.*[LOB]") == keys(any_run.rows, list(range(len(any_run.rows))))
