"""A run that was killed or damaged goes on, and ends with the same bits as one that was not."""

import os
import pathlib
import shutil
import signal
import threading

import pytest
from crash import killed_run
from tiny_job import SHARDS, results, write_job

import pipeline.executor
import pipeline.stages
from pipeline.errors import Interrupted, JobError, RunFolderError
from pipeline.run_folder import RunFolder
from pipeline.stages import run_job

# Where a run dies, and how many of its shards are whole then (None: any number).
DEATHS = {
    "writing the first table": ("pipeline.files:NewFile.write", 40, None),
    "between a shard's tables and its record": ("pipeline.shard_writer:write_film", 4, None),
    "before a shard's record": ("pipeline.run_folder:RunFolder.write_shard", 9, 8),
    "between writing a record and its rename": ("os:replace", 60, None),
    "before the film is summed": ("pipeline.film_sum:sum_films", 1, SHARDS),
    "among the catalogues": ("pipeline.catalogues:write_table", 4, SHARDS),
    "before the first AOV": ("pipeline.stages:Run._write_aovs", 1, SHARDS),
}


@pytest.mark.parametrize("death", DEATHS)
def test_killed_run_resumes_to_the_same_bits(death: str, tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    where, call, whole = DEATHS[death]
    job, out = write_job(tmp_path), tmp_path / "run"
    assert killed_run(job, out, where, call) == -signal.SIGKILL
    assert results(out) != results(tiny_run), "it was finished before it was killed"
    if whole is not None:
        assert len(list((out / "shards").glob("*.json"))) == whole
    run_job(job, out=out, resume=True, threads=1)
    assert results(out) == results(tiny_run)
    assert not list(out.rglob("*.tmp"))


def test_threads_do_not_show(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = run_job(write_job(tmp_path), out=tmp_path / "run", threads=1).path
    assert results(run) == results(tiny_run)


@pytest.mark.parametrize("threads", [1, 3])
def test_interrupt_keeps_what_is_finished(threads: int, tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A KeyboardInterrupt in the main thread, while the workers are busy."""
    job, out = write_job(tmp_path), tmp_path / "run"
    real, seen = RunFolder.write_shard, threading.Event()

    def write_shard(*args: object) -> None:
        real(*args)
        seen.set()

    class Reports(pipeline.executor.queue.SimpleQueue):
        def get(self, *args: object, **kwargs: object) -> object:
            seen.wait(60)
            raise KeyboardInterrupt

    monkeypatch.setattr(RunFolder, "write_shard", write_shard)
    monkeypatch.setattr(pipeline.executor, "Reports", Reports)
    with pytest.raises(Interrupted):
        run_job(job, out=out, threads=threads)
    monkeypatch.undo()
    finished = len(list((out / "shards").glob("*.json")))
    assert 1 <= finished < SHARDS
    assert RunFolder(out).manifest()["status"] == "rendering"
    run_job(job, out=out, resume=True)
    assert results(out) == results(tiny_run)


# --- damage -------------------------------------------------------------------------------------------------------


def truncate(file: pathlib.Path) -> None:
    os.truncate(file, file.stat().st_size // 2)


def alter(file: pathlib.Path) -> None:
    """Change one byte in the middle."""
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)


@pytest.mark.parametrize("harm", [truncate, alter, pathlib.Path.unlink])
@pytest.mark.parametrize("file", ["tables/paths/00005.arrow", "words/00005.arrow", "shards/00005.json"])
def test_damaged_shard_is_named_and_rendered_again(harm, file: str, tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch) -> None:
    out = tmp_path / "run"
    shutil.copytree(tiny_run, out)
    harm(out / file)
    rendered = []
    real = pipeline.executor.write_shard
    monkeypatch.setattr(pipeline.executor, "write_shard", lambda folder, shard, *rest: (rendered.append(shard.index), real(folder, shard, *rest)))
    run_job(write_job(tmp_path), out=out, resume=True)
    assert rendered == [5]
    if harm is not pathlib.Path.unlink or not file.startswith("shards"):
        assert pathlib.PurePath(file).name.split(".")[0] in (out / "log.txt").read_text().split("rendered again")[0]
        assert file in (out / "log.txt").read_text()
    assert results(out) == results(tiny_run)


def test_damaged_film_is_rendered_again(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    out = tmp_path / "run"
    shutil.copytree(tiny_run, out)
    alter(out / "film" / "sum.npy")
    run_job(write_job(tmp_path), out=out, resume=True)
    assert results(out) == results(tiny_run)


def test_resuming_a_complete_run_traces_nothing(tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "run"
    shutil.copytree(tiny_run, out)
    monkeypatch.setattr(pipeline.stages, "Tracer", None)
    run_job(write_job(tmp_path, aovs={"direct": "C D L", "seen": "C L"}), out=out, resume=True)
    after = results(out)
    assert set(after) - set(results(tiny_run)) == {"images/seen.exr", "images/seen.png"}
    unchanged = set(results(tiny_run)) - {"images/layers.exr"}  # which has one more layer now
    assert {name: after[name] for name in unchanged} == {name: results(tiny_run)[name] for name in unchanged}
    assert after["images/layers.exr"] != results(tiny_run)["images/layers.exr"]


def test_another_version_of_the_renderer_does_not_mix_in(tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "run"
    shutil.copytree(tiny_run, out)
    (out / "tables/paths/00001.arrow").unlink()
    monkeypatch.setattr(pipeline.stages, "renderer_version", lambda: "another")
    with pytest.raises(RunFolderError, match="another version"):
        run_job(write_job(tmp_path), out=out, resume=True)


def test_another_kind_of_processor_does_not_mix_in(tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "run"
    shutil.copytree(tiny_run, out)
    (out / "tables/paths/00001.arrow").unlink()
    monkeypatch.setattr(pipeline.stages, "processor", lambda: "another")
    with pytest.raises(RunFolderError, match=r"another kind of processor \(.+, this is another\)"):
        run_job(write_job(tmp_path), out=out, resume=True)


# --- folders that are not this run's ------------------------------------------------------------------------------


def test_finished_run_is_not_overwritten(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    before = results(tiny_run)
    with pytest.raises(JobError, match=r"complete: add --resume .* or choose another folder with --out"):
        run_job(write_job(tmp_path), out=tiny_run)
    assert results(tiny_run) == before


@pytest.mark.parametrize("resume", [False, True])
def test_run_of_another_job_is_refused(resume: bool, tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    with pytest.raises(JobError, match=r"another job \(seed 3 -> 4\)"):
        run_job(write_job(tmp_path, render={"seed": 4}), out=tiny_run, resume=resume)


def test_another_scene_is_another_job(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    with pytest.raises(JobError, match=r"another job \(the scene\)"):
        run_job(write_job(tmp_path), ["scene.lamp.emitter.radiance.value=4"], out=tiny_run, resume=True)


def test_folder_with_other_files_is_refused(tmp_path: pathlib.Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("precious")
    with pytest.raises(JobError, match=r"not a run folder and not empty \(it holds `thesis.tex`\)"):
        run_job(write_job(tmp_path), out=tmp_path / "out")
    assert [f.name for f in (tmp_path / "out").iterdir()] == ["thesis.tex"]


def test_file_in_place_of_the_folder_is_refused(tmp_path: pathlib.Path) -> None:
    (tmp_path / "out").write_text("precious")
    with pytest.raises(JobError, match="expected a run folder, found a file"):
        run_job(write_job(tmp_path), out=tmp_path / "out")


def test_two_runs_at_once(tmp_path: pathlib.Path) -> None:
    job, out = write_job(tmp_path), tmp_path / "run"
    with RunFolder(out).locked(), pytest.raises(RunFolderError, match="another run is writing"):
        run_job(job, out=out)
    assert not (out / "manifest.json").exists()


def test_damaged_manifest_is_named(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    out = tmp_path / "run"
    shutil.copytree(tiny_run, out)
    truncate(out / "manifest.json")
    with pytest.raises(RunFolderError, match=r"manifest.json` cannot be read"):
        run_job(write_job(tmp_path), out=out, resume=True)
