"""The command line as people meet it: exit codes, what is printed where, and how soon."""

import io
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from tiny_job import results, write_job
from typer.testing import CliRunner

import pipeline.stages
import queries.images
from pipeline.cli import app
from pipeline.images import read_exr


def pathspace(*arguments: object) -> "CliRunner.Result":
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_run_prints_where_things_are(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("run", write_job(tmp_path), "--out", tmp_path / "run", "--threads", 1)
    assert result.exit_code == 0, result.output
    assert str(tmp_path / "run/images/beauty.exr") in result.stdout
    assert str(tmp_path / "run/tables") in result.stdout
    assert "traced 262144 walks" in result.stderr
    assert results(tmp_path / "run") == results(tiny_run)


def test_manifest_says_what_was_done(tiny_run: pathlib.Path) -> None:
    manifest = json.loads((tiny_run / "manifest.json").read_bytes())
    stats = manifest["stats"]
    assert manifest["status"] == "complete"
    assert manifest["seed"] == 3
    assert stats["rendered_walks"] == 64 * 64 * 64
    assert stats["samples_per_second"] == pytest.approx(64 * 64 * 64 / stats["render_seconds"])
    tables = {table: list((tiny_run / "tables" / table).glob("*.arrow")) for table in ("camera_vertices", "paths", "occluded", "unlit")}
    assert stats["bytes"] == sum(file.stat().st_size for files in tables.values() for file in files)
    rows = {table: sum(pa.ipc.open_file(file).read_all().num_rows for file in files) for table, files in tables.items()}
    assert stats["vertices"] == rows["camera_vertices"] > 64 * 64 * 64
    assert stats["paths"] == rows["paths"] > 0
    assert manifest["rows"]["occluded"] == rows["occluded"] > 0
    assert stats["peak_rss_bytes"] > 50e6
    assert {"scene", "kernels", "estimate", "render", "images", "catalogues", "aovs"} <= set(stats["stages"])
    assert set(manifest["images"]) == {"beauty", "direct", "layers"}
    assert manifest["settings"]["passes"] == 64


def test_info(tiny_run: pathlib.Path) -> None:
    result = pathspace("info", tiny_run)
    assert result.exit_code == 0
    for part in ("tiny (complete)", "64 x 64 pixels, tent filter", "seed 3", "direct (C D L)"):
        assert part in " ".join(result.stdout.split())


def test_validate_estimates_the_size(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("validate", write_job(tmp_path))
    assert result.exit_code == 0, result.output
    assert "64 x 64 pixels, 64 samples, method path; about" in " ".join(result.stdout.split())
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("format", ["table", "csv", "json", "arrow"])
def test_sql_formats(format: str, tiny_run: pathlib.Path) -> None:
    result = pathspace("sql", tiny_run, "SELECT count(*) AS n, 'a' AS text FROM camera_vertices WHERE depth = 1", "--format", format)
    assert result.exit_code == 0, result.output
    walks = 64 * 64 * 64
    if format == "csv":
        assert result.stdout == f"n,text\n{walks},a\n"
    elif format == "json":
        assert json.loads(result.stdout) == [{"n": walks, "text": "a"}]
    elif format == "arrow":
        assert pa.ipc.open_stream(io.BytesIO(result.stdout_bytes)).read_all().to_pylist() == [{"n": walks, "text": "a"}]
    else:
        assert str(walks) in result.stdout.replace(",", "")


def test_lpe_writes_an_image(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("lpe", tiny_run, "C D L", "--out", tmp_path / "direct.exr")
    assert result.exit_code == 0, result.output
    assert "% of the image" in result.stdout
    np.testing.assert_allclose(read_exr(tmp_path / "direct.exr"), read_exr(tiny_run / "images/direct.exr"), rtol=1e-6)
    assert read_exr(tmp_path / "direct.exr").max() > 0


NEAR = ("--define", "near={sphere: {center: [0, 0.4, 0], radius: 1}}")


def test_lpe_by_another_filter(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    for name in ("box", "mitchell"):
        assert pathspace("lpe", tiny_run, "C D L", "--filter", name, "--out", tmp_path / f"{name}.exr").exit_code == 0
    box, mitchell = (read_exr(tmp_path / f"{name}.exr") for name in ("box", "mitchell"))
    assert np.abs(np.diff(mitchell, axis=0)).mean() < np.abs(np.diff(box, axis=0)).mean()
    assert mitchell.mean() == pytest.approx(box.mean(), rel=0.02)


def test_lpe_in_another_dialect_and_of_a_defined_region(tiny_run: pathlib.Path) -> None:
    expected = pathspace("lpe", tiny_run, "C D L")
    osl = pathspace("lpe", tiny_run, "CDL", "--dialect", "osl")
    assert osl.exit_code == 0, osl.output
    assert osl.stdout.splitlines()[1:] == expected.stdout.splitlines()[1:]
    near = pathspace("lpe", tiny_run, "C X@near L", *NEAR)
    assert near.exit_code == 0, near.output
    count = pathspace("sql", tiny_run, "SELECT count(*) FROM lpe('C X@near L')", "--format", "csv", *NEAR)
    assert count.exit_code == 0, count.output
    assert int(count.stdout.splitlines()[1]) > 0
    assert f"{int(count.stdout.splitlines()[1]):,} of" in near.stdout


def test_rank_of_a_defined_region(tiny_run: pathlib.Path) -> None:
    result = pathspace("rank", tiny_run, "--region", "near", "--by", "discrimination", "--format", "json", *NEAR)
    assert result.exit_code == 0, result.output
    classes = json.loads(result.stdout)
    assert len(classes) > 1
    one = pathspace("rank", tiny_run, "--region", "near", "--top", 1, "--format", "json", *NEAR)
    assert len(json.loads(one.stdout)) == 1


def test_diagnose(tiny_run: pathlib.Path) -> None:
    result = pathspace("diagnose", tiny_run, "depths")
    assert result.exit_code == 0, result.output
    assert "depths" in result.stdout


def test_export(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    result = pathspace("export", tiny_run, "--parquet", tmp_path / "parquet")
    assert result.exit_code == 0, result.output
    paths = json.loads((tiny_run / "manifest.json").read_bytes())["stats"]["paths"]
    assert pyarrow.parquet.read_metadata(tmp_path / "parquet/paths.parquet").num_rows == paths


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["sql", "RUN", "SELECT nothing FROM paths"], "nothing"),
        (["sql", "RUN", "COPY paths TO 'x.csv'"], "read-only"),
        (["sql", "nowhere", "SELECT 1"], "nowhere"),
        (["info", "nowhere"], "not a run folder"),
        (["lpe", "RUN", "C (L"], "column"),
        (["lpe", "RUN", "C X@near L", "--define", "near"], "near"),
        (["lpe", "RUN", "C X@near L", "--define", "near={sphere: {center: [0, 0, .nan], radius: 1}}"], "center"),
        (["lpe", "RUN", "C X@near L", "--define", "near={object: nothing}"], "no object"),
        (["sql", "RUN", "SELECT * FROM lpe('C (L')"], "column"),
        (["rank", "RUN", "--region", "nowhere"], "nowhere"),
        (["rank", "RUN", "--by", "discrimination"], "region"),
        (["diagnose", "RUN", "nothing"], "nothing"),
        (["lpe", "RUN", "C L", "--out", "a.jpeg"], "ends in .exr or .png"),
        (["export", "nowhere", "--parquet", "x"], "nowhere"),
        (["run", "nowhere.yaml"], "no such job file"),
        (["run"], "Missing argument"),
        (["sql", "RUN", "SELECT 1", "--time-limit", "0"], "--time-limit"),
        (["paint"], "No such command"),
        (["run", "job.yaml", "--threads", "0"], "--threads"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_bad_input_exits_with_2(arguments: list[str], says: str, tiny_run: pathlib.Path) -> None:
    result = pathspace(*(tiny_run if argument == "RUN" else argument for argument in arguments))
    assert result.exit_code == 2
    assert says in result.stderr
    assert "Traceback" not in result.output
    assert not result.stdout


def test_time_limit_of_a_query(tiny_run: pathlib.Path) -> None:
    endless = "SELECT sum(a.i * b.i) FROM range(100000000) a(i), range(100000000) b(i)"
    result = pathspace("sql", tiny_run, endless, "--time-limit", "1")
    assert result.exit_code == 2
    assert "stopped after 1 seconds: ask for less, or raise the time limit (--time-limit)" in result.stderr
    assert pathspace("sql", tiny_run, "SELECT 1", "--time-limit", "100").exit_code == 0


def test_images_that_do_not_fit_take_several_passes(tiny_run: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = pathspace("lpe", tiny_run, "C D L")
    passes: list[int] = []
    real = queries.images.map_shards
    monkeypatch.setattr(queries.images, "map_shards", lambda files, *arguments: (passes.append(len(files)), real(files, *arguments))[1])
    assert pathspace("lpe", tiny_run, "C D L").stdout == whole.stdout
    assert passes == [16]
    monkeypatch.setattr(queries.images, "_MEMORY", 1)
    assert pathspace("lpe", tiny_run, "C D L").stdout == whole.stdout
    assert passes == [16, 16, 16]


def test_faults_exit_with_1(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(pipeline.stages, "prepare_job", broken)
    result = pathspace("validate", write_job(tmp_path))
    assert result.exit_code == 1
    assert "ZeroDivisionError: division by zero (test_cli.py:" in result.stderr
    assert "Traceback" not in result.output


def test_interrupt_exits_with_130(tmp_path: pathlib.Path) -> None:
    """Ctrl-C in a process of its own, while it renders far too much; no terminal, so plain lines."""
    job = write_job(tmp_path, render={"samples": 4096})
    log = (tmp_path / "stderr").open("w")
    process = subprocess.Popen([sys.executable, "-m", "pipeline.cli", "run", str(job), "--out", str(tmp_path / "run")], stderr=log, stdout=log)
    for _ in range(1200):
        if list((tmp_path / "run/shards").glob("*.json")) or process.poll() is not None:
            break
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    said = (tmp_path / "stderr").read_text()
    assert "pathspace: interrupted: finished shards are kept, and --resume goes on from them" in said
    assert "Traceback" not in said
    assert json.loads((tmp_path / "run/manifest.json").read_bytes())["status"] == "rendering"


def test_help_is_quick() -> None:
    """Half a second, by the processor's clock, which other work on the machine does not stop; the best of three."""
    code = "import os, sys; sys.argv = ['pathspace', '--help']\nfrom pipeline.cli import main\ntry: main()\nexcept SystemExit: pass\n"
    code += "assert not {'numpy', 'numba', 'pyarrow', 'duckdb', 'pydantic'} & set(sys.modules), 'heavy imports'\nprint(sum(os.times()[:2]))"
    seconds = []
    for _ in range(3):
        out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, "COLUMNS": "100"}).stdout
        assert "Commands" in out
        seconds.append(float(out.splitlines()[-1]))
    assert min(seconds) < 0.5
