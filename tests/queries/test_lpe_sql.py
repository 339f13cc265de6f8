"""Expressions over runs: what the SQL finds is what trying every path finds, and never nothing."""

import functools
import pathlib

import pytest
from synthetic import SyntheticRun
from words import matches

from queries import Run, open_run
from queries.errors import QueryError
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
    "C.*X@object:floor.*.",
    "C X@!object:floor* .",
    "C.*X@material:white.*.",
    "C.* .@light:lamp",
    "C.* L@light:lamp_light",
    "C.* .@!light:lamp",
    "C.*.@object:lamp",
    "C.*.@material:'a\\\\b'.*.",
    "C.* .@depth:2",
    "C.* D@depth:1..2 .* .",
    "C.* D@!depth:1 .* .",
    "C [X@object:floor X@material:white]+ .",
    "C.* <L>@light:lamp@t:1..2",
]
OF_ONE_METHOD = {
    "path_run": [
        "C.* .@technique:hit",
        "C.* .@s:1",
        "C.*D .@technique:sample@light:lamp",
        "C.* .@!technique:hit",
        "C.* .@t:3..",
        "C.* .@!t:2",
        "C.* .@s:1.. - C.* .@t:3..",
    ],
    "light_run": ["C.* .@s:2", "C.* .@!s:2..", "CD.*.@s:3.."],
    "both_run": [
        "C.* .@technique:connection",
        "C.* .@technique:lens",
        "C.* .@t:2@s:2",
        "C.* .@technique:hit",
        "C.* .@t:2..",
        "C.* .@!t:2",
        "C.*D.*.@t:..2@technique:connection",
    ],
}


@functools.cache
def opened(folder: pathlib.Path) -> Run:
    """The run, opened once for all expressions."""
    return open_run(folder)


def found(run: SyntheticRun, text: str, table: str = "paths") -> list[tuple[int, int]]:
    """The (walk, path) keys that the SQL finds."""
    columns = "coalesce(p.camera_walk, p.light_walk) AS walk, p.path"
    texts = {compile(text).sql(table, columns), compile(text).sql(table, columns, light_words=opened(run.folder).light_words)}
    answers = [sorted(opened(run.folder).connection.execute(sql).fetchall()) for sql in texts]
    assert all(answer == answers[0] for answer in answers)
    return answers[0]


def keys(rows: list[dict[str, int]], chosen: list[int]) -> list[tuple[int, int]]:
    return sorted((rows[i]["camera_walk"], rows[i]["path"]) for i in chosen)


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_sql_finds_what_trying_every_path_finds(any_run: SyntheticRun, text: str) -> None:
    expected = any_run.matched(parse(text).tree)
    assert 0 < len(expected) < len(any_run.rows)
    assert found(any_run, text) == keys(any_run.rows, expected)


@pytest.mark.parametrize(("name", "text"), [(name, text) for name, texts in OF_ONE_METHOD.items() for text in texts])
def test_techniques(request: pytest.FixtureRequest, name: str, text: str) -> None:
    run: SyntheticRun = request.getfixturevalue(name)
    expected = run.matched(parse(text).tree)
    assert 0 < len(expected) < len(run.rows)
    assert found(run, text) == keys(run.rows, expected)


@pytest.mark.parametrize(
    "text", ["LS*E", "L.*DE", "L X@depth:2 X* E", "L@light:lamp X*E", "L.*X@object:floor E", "B.E", "LX+E - L.*D.*E", "L.*<RD'floor'>E"]
)
def test_light_first_reads_words_backward(any_run: SyntheticRun, text: str) -> None:
    expected = any_run.matched(parse(text).tree, backward=True)
    assert 0 < len(expected) < len(any_run.rows)
    assert found(any_run, text) == keys(any_run.rows, expected)


@pytest.mark.parametrize("text", ["C.*L", "CD.*L", "C.*'floor'.*.", "C.*B", "C.*.@blocker:floor", "C.*.@!blocker:floor", "C.*L@blocker:wall@t:2.."])
def test_occluded_connections(path_run: SyntheticRun, text: str) -> None:
    expected = [i for i, word in enumerate(path_run.occluded_words) if matches(parse(text).tree, word)]
    assert 0 < len(expected) < len(path_run.occluded)
    assert path_run.matched(parse("C.*.@blocker:floor").tree) == found(path_run, "C.*.@blocker:floor") == []  # of what is visible, nothing
    assert found(path_run, text, "occluded") == keys(path_run.occluded, expected)


@pytest.mark.parametrize("text", ["CDDDDDDDDDL", "C<VD>L", "C'nowhere'L", "LDL", "C.*.@object:nowhere L", "C@s:0.*L", "CX@light:lamp L"])
def test_expressions_that_match_nothing(any_run: SyntheticRun, text: str) -> None:
    assert any_run.matched(parse(text).tree) == []
    assert found(any_run, text) == []


def test_sql_and_accepts_agree_on_every_word(any_run: SyntheticRun) -> None:
    words = any_run.words[::3]
    for text in EXPRESSIONS:
        expression, tree = compile(text), parse(text).tree
        assert [expression.accepts(word) for word in words] == [matches(tree, word) for word in words]


@pytest.mark.parametrize("text", ["CX@P L", "C.@crosses:P", "CDL - C.*X@P.*L"])
def test_regions_are_not_in_words(text: str) -> None:
    with pytest.raises(QueryError, match=r"lpe\('\.\.\.'\)"):
        compile(text).sql()


def test_an_expression_that_matches_everything(any_run: SyntheticRun) -> None:
    assert found(any_run, "C.*[LOB]") == keys(any_run.rows, list(range(len(any_run.rows))))
