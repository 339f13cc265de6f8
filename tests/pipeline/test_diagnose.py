"""All diagnostics at once: one that cannot be answered does not stop the others, and what is shown is what a person needs."""

import csv
import io
import json
import pathlib

import pyarrow as pa
import pytest
from tiny_job import SCENE

from pipeline.diagnose import ALL, print_diagnostics
from pipeline.errors import JobError
from pipeline.stages import run_job
from queries import open_run
from queries.errors import QueryError
from queries.sql import write


def render(folder: pathlib.Path, samples: int, record: str = "{}") -> pathlib.Path:
    folder.mkdir(exist_ok=True)
    settings = f"{{method: path, resolution: [12, 12], samples: {samples}, max_depth: 4, sampler: independent}}"
    (folder / "job.yaml").write_text(f"name: tiny\nscene: {json.dumps(SCENE)}\nrender: {settings}\nrecord: {record}\n")
    return run_job(folder / "job.yaml", out=folder / "run", threads=1).path


@pytest.fixture(scope="module")
def few(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Too few walks per pixel to tell fireflies."""
    return render(tmp_path_factory.mktemp("few"), 4)


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return render(tmp_path_factory.mktemp("many"), 40)


def test_one_failure_does_not_stop_the_others(few: pathlib.Path, capfd: pytest.CaptureFixture[str]) -> None:
    print_diagnostics(few, (), "table", None, False)
    shown = capfd.readouterr().out
    sections = {part.split(":")[0]: part for part in shown.split("— ")[1:] if part.split(":")[0] in ALL}
    assert set(sections) == set(ALL)
    assert "no answer: outliers need 8 recorded walks" in sections["fireflies"]
    assert [name for name, part in sections.items() if "no answer" in part] == ["fireflies"]
    assert all("row" in part for name, part in sections.items() if name != "fireflies")


def test_a_failure_of_all_that_is_asked_is_one(few: pathlib.Path, tmp_path: pathlib.Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(QueryError, match="outliers need"):
        print_diagnostics(few, ["fireflies"], "table", None, False)
    with pytest.raises(QueryError, match="recorded no paths"):
        print_diagnostics(render(tmp_path, 4, "{keep: none}"), (), "table", None, False)
    with pytest.raises(JobError, match="no diagnostic `noise`"):
        print_diagnostics(few, ["noise"], "table", None, False)
    with pytest.raises(JobError, match="gives one answer"):
        print_diagnostics(few, (), "csv", None, False)
    capfd.readouterr()


def test_convergence_is_shown_to_the_last_pass(many: pathlib.Path, capfd: pytest.CaptureFixture[str]) -> None:
    print_diagnostics(many, ["convergence", "effective"], "table", 5, False)
    shown = capfd.readouterr().out.split("— effective")[0].splitlines()
    passes = [int(line.split()[0]) for line in shown if line.split() and line.split()[0].isdigit() and len(line.split()) > 3]
    assert 3 <= len(passes) <= 5
    assert passes[-1] == 40


def test_formats_for_programs_are_complete(many: pathlib.Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name, (function, _) in ALL.items():
        with open_run(many) as run:
            expected = function(run)
        print_diagnostics(many, [name], "csv", None, False)
        rows = list(csv.reader(io.StringIO(capfd.readouterr().out)))
        assert rows[0] == expected.column_names
        assert len(rows) == expected.num_rows + 1
        print_diagnostics(many, [name], "json", None, False)
        found = json.loads(capfd.readouterr().out)
        assert [list(row) for row in found] == [expected.column_names] * expected.num_rows


def test_expressions_are_shown_whole(many: pathlib.Path, capfd: pytest.CaptureFixture[str]) -> None:
    print_diagnostics(many, ["classes", "effective"], "table", 3, True)
    shown = capfd.readouterr().out
    with open_run(many) as run:
        expressions = ALL["classes"][0](run)["expression"].to_pylist()
    assert len(expressions) > 3
    assert all(f"  {text}\n" in shown for text in expressions[:3])
    assert "the first 3 rows: --top N shows more" in shown
    assert "  standard_error: standard error of `energy`" in shown


def test_the_last_column_of_a_table_is_whole_and_others_are_cut() -> None:
    table = pa.table({"description": ["a" * 100], "expression": ["b" * 5_000]})
    out = io.BytesIO()
    write(table.to_reader(), "table", out)
    names, rule, row, _ = out.getvalue().decode().splitlines()
    assert row.split("  ") == ["a" * 59 + "…", "b" * 5_000]
    assert len(rule) == 60 + 2 + 60
    assert names.split() == table.column_names
