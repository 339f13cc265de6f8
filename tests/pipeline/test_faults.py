"""Disks that fill up, folders that cannot be written, workers that fail: a clear error, and nothing that was finished is lost."""

import errno
import pathlib
import resource
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from tiny_job import SHARDS, results, write_job

import pipeline.executor
from pipeline.errors import JobError, RunFolderError
from pipeline.estimate import PILOT_WALKS, estimate_size, human_bytes, pilot_walks
from pipeline.files import NewFile, checksum, new_file
from pipeline.prepare import prepare_job
from pipeline.run_folder import RunFolder
from pipeline.stages import run_job, validate_job
from renderer.trace import Tracer


def test_full_disk_keeps_finished_shards(tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job, out = write_job(tmp_path), tmp_path / "run"
    real, left, lock = NewFile.write, [6_000_000], threading.Lock()

    def write(self: NewFile, data: object) -> int:
        with lock:
            left[0] -= len(memoryview(data).cast("B"))
        if left[0] < 0 and self.path.suffix == ".arrow":
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(self, data)

    monkeypatch.setattr(NewFile, "write", write)
    with pytest.raises(RunFolderError, match=r"no space left while writing shard 000\d\d in .*make room there, then run again with --resume"):
        run_job(job, out=out)
    monkeypatch.undo()
    finished = {name: value for name, value in results(out).items() if name.startswith("shards/")}
    assert 1 <= len(finished) < SHARDS
    assert finished.items() <= results(tiny_run).items()
    assert not list(out.rglob("*.tmp")), "what was half written takes no room"
    run_job(job, out=out, resume=True)
    assert results(out) == results(tiny_run)


def test_limit_of_the_system_on_file_sizes(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """The same, by the system's own refusal."""
    job, out = write_job(tmp_path), tmp_path / "run"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, hard))
    try:
        with pytest.raises(RunFolderError, match="no space left while writing shard 0000"):
            run_job(job, out=out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    run_job(job, out=out, resume=True)
    assert results(out) == results(tiny_run)


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS, errno.EPERM])
def test_unwritable_folder(number: int, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def mkdir(self: pathlib.Path, *_: object, **__: object) -> None:
        raise OSError(number, "not allowed", str(self))

    job = write_job(tmp_path)
    monkeypatch.setattr(pathlib.Path, "mkdir", mkdir)
    with pytest.raises(RunFolderError, match="make it writable, or choose another folder with --out"):
        run_job(job, out=tmp_path / "run")


def test_folder_below_a_file(tmp_path: pathlib.Path) -> None:
    with pytest.raises(RunFolderError, match="opening the run folder"):
        run_job(write_job(tmp_path), out=tmp_path / "tiny.yaml" / "run")


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_failing_worker_stops_the_run(threads: int, tiny_run: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job, out = write_job(tmp_path), tmp_path / "run"
    real = pipeline.executor.write_shard

    def write_shard(folder, shard, *rest):
        if shard.index == 3:
            raise FloatingPointError("shard three")
        return real(folder, shard, *rest)

    monkeypatch.setattr(pipeline.executor, "write_shard", write_shard)
    with pytest.raises(FloatingPointError, match="shard three"):
        run_job(job, out=out, threads=threads)
    assert threading.active_count() < 20
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("tracer-")]
    monkeypatch.undo()
    assert 3 - threads < len(list((out / "shards").glob("*.json"))) < SHARDS
    run_job(job, out=out, resume=True)
    assert results(out) == results(tiny_run)


# --- sizes --------------------------------------------------------------------------------------------------------


def test_estimate_is_close(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """Within four standard errors of what was written; the pilot's own walks give the error."""
    prepared = prepare_job(write_job(tmp_path))
    tracer = Tracer(prepared.scene, prepared.settings)
    size = estimate_size(tracer, prepared.settings)
    for table, estimated in size.tables.items():
        written = sum(file.stat().st_size for file in (tiny_run / "tables" / table).glob("*.arrow"))
        rows: list[np.ndarray] = []
        walk = "walk" if table.endswith("vertices") else "camera_walk"
        tracer.trace(
            pilot_walks(prepared.settings), lambda name, batch, t=table, w=walk, r=rows: r.append(np.array(batch[w])) if name == t else None, None
        )
        per_walk = np.bincount(np.unique(np.concatenate(rows), return_inverse=True)[1], minlength=PILOT_WALKS)
        error = per_walk.std() / per_walk.mean() / np.sqrt(PILOT_WALKS)
        assert abs(estimated / written - 1) < 4 * error + 0.02, table  # 2 %: headers of small files


def test_pilot_walks_cover_the_film_and_the_passes(tmp_path: pathlib.Path) -> None:
    settings = prepare_job(write_job(tmp_path, render={"samples": 1 << 20, "resolution": [128, 64]})).settings
    walks = pilot_walks(settings)
    assert len(walks) == PILOT_WALKS
    assert np.array_equal(np.unique(walks % settings.walks_per_pass // 2), np.arange(PILOT_WALKS))
    assert np.corrcoef(walks // settings.walks_per_pass, np.arange(len(walks)))[0, 1] > 0.99, "ascending over all passes"


@pytest.mark.parametrize("resume", [False, True])
def test_job_that_cannot_fit_is_refused_with_the_figures(resume: bool, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = write_job(tmp_path)
    monkeypatch.setattr(RunFolder, "free_bytes", lambda self: 5_000_000)
    for refused in (lambda: validate_job(job, out=tmp_path / "run"), lambda: run_job(job, out=tmp_path / "run", resume=resume)):
        with pytest.raises(JobError, match=r"needs about [\d.]+ MB on disk \(camera_vertices .*\), and 5.0 MB are free at .*lower render.samples"):
            refused()
    assert not (tmp_path / "run" / "manifest.json").exists()
    monkeypatch.undo()
    run_job(job, out=tmp_path / "run")


def test_film_that_cannot_fit_into_memory_is_refused(tmp_path: pathlib.Path) -> None:
    job = write_job(tmp_path, render={"resolution": [65535, 65535], "samples": 1})
    with pytest.raises(JobError, match=r"65535 x 65535 pixels needs [\d.]+ TB of memory on 100 threads"):
        run_job(job, out=tmp_path / "run", threads=100)
    assert not (tmp_path / "run").exists()


def test_job_of_more_walks_than_can_be_numbered(tmp_path: pathlib.Path) -> None:
    with pytest.raises(JobError, match="more than a run can hold"):
        validate_job(write_job(tmp_path, render={"samples": 1 << 31}))


def test_free_space_counts_what_is_there(tmp_path: pathlib.Path, tiny_run: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that needs its last shard only must not be refused for the room that its own shards take."""
    monkeypatch.setattr("os.statvfs", lambda path: SimpleNamespace(f_bavail=1000, f_frsize=4096))
    assert RunFolder(tmp_path / "not" / "yet").free_bytes() == 4_096_000
    assert RunFolder(tiny_run).used_bytes() > 10e6


@pytest.mark.parametrize(("size", "text"), [(0, "0 B"), (999, "999 B"), (1000, "1.0 kB"), (2.5e9, "2.5 GB"), (3e15, "3000.0 TB")])
def test_human_bytes(size: float, text: str) -> None:
    assert human_bytes(size) == text


# --- files --------------------------------------------------------------------------------------------------------


def test_new_file_is_whole_or_absent(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with new_file(path) as file:
        file.write(b"never committed")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    with new_file(path) as file:
        file.write(np.arange(1 << 20, dtype=np.uint16))
        file.write(b"end")
        record = file.commit(rows=7)
    assert (record.bytes, record.xxh3) == checksum(path)
    assert record.bytes == (2 << 20) + 3
    assert record.rows == 7
