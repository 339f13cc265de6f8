"""The run folder: where everything of a run lies, who may write it, and which of its shards are whole.

::

    images/<name>.exr, .png       linear image, and a picture of it
    rankings/<name>.csv, .arrow   classes of paths in a region, ranked
    views/<name>.png, …           pictures of what light does
    report/index.html             the offline report
    inspection/                   the light walks of `inspection`: a run folder of its own
    tables/<table>/<shard>.arrow  recorded tables, a file for each shard
    tables/<catalogue>.arrow      words, objects, events, …
    words/<shard>.arrow           distinct words of each shard
    film/<shard>.npy              each shard's share of the film; film/sum.npy once all are summed
    shards/<shard>.json           written last: rows, bytes and checksum of the shard's files
    manifest.json                 settings, versions, statistics, checksums
    log.txt
"""

import contextlib
import fcntl
import json
import os
import pathlib
from collections.abc import Iterator
from typing import Any

import xxhash

from pipeline.errors import JobError, RunFolderError
from pipeline.files import TEMPORARY, FileRecord, checksum, clear_errors, write_json
from pipeline.shards import Shard

FORMAT = 1
RENDERING, COMPLETE = "rendering", "complete"
_FOLDERS = ("images", "tables", "words", "film", "shards")
_OWN_FILES = {".lock", "log.txt", "manifest.json", "manifest.json" + TEMPORARY}


class RunFolder:
    """Paths and state of one run folder. Nothing is created before ``create``."""

    def __init__(self, path: pathlib.Path) -> None:
        self.path = path

    @property
    def manifest_path(self) -> pathlib.Path:
        """Where the manifest lies."""
        return self.path / "manifest.json"

    def table(self, table: str, shard: Shard) -> pathlib.Path:
        """The file of one shard of a recorded table (the words of a shard are not a table of their own)."""
        return self.path / ("words" if table == "words" else f"tables/{table}") / f"{shard.name}.arrow"

    def catalogue(self, name: str) -> pathlib.Path:
        """The file of a catalogue."""
        return self.path / "tables" / f"{name}.arrow"

    def film(self, shard: Shard) -> pathlib.Path:
        """The file of one shard's share of the film."""
        return self.path / "film" / f"{shard.name}.npy"

    @property
    def film_sum(self) -> pathlib.Path:
        """The file of the whole film."""
        return self.path / "film" / "sum.npy"

    def image(self, name: str, kind: str) -> pathlib.Path:
        """The file of an image; ``kind`` is ``exr`` or ``png``."""
        return self.path / "images" / f"{name}.{kind}"

    def ranking(self, name: str, kind: str) -> pathlib.Path:
        """The file of a ranking; ``kind`` is ``csv`` or ``arrow``."""
        return self.path / "rankings" / f"{name}.{kind}"

    @property
    def views(self) -> pathlib.Path:
        """The folder of the views."""
        return self.path / "views"

    @property
    def report(self) -> pathlib.Path:
        """The first page of the report."""
        return self.path / "report" / "index.html"

    # --- creating and locking -------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Make the folder, and hold it against any other run until the block ends (or the process dies)."""
        with clear_errors("opening the run folder", self.path):
            if self.path.exists() and not self.path.is_dir():
                raise JobError(f"expected a run folder, found a file: `{self.path}`. Choose another folder with --out")
            self.path.mkdir(parents=True, exist_ok=True)
            self._refuse_other_contents()
            lock = open(self.path / ".lock", "w")  # noqa: SIM115 (closed below)
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise RunFolderError(f"another run is writing into `{self.path}` now: wait for it, or choose another folder with --out") from None
            yield

    def _refuse_other_contents(self) -> None:
        """A folder with other people's files is no place for a run."""
        if not self.manifest_path.exists():
            foreign = sorted(entry.name for entry in self.path.iterdir() if entry.name not in _OWN_FILES)
            if foreign:
                raise JobError(f"`{self.path}` is not a run folder and not empty (it holds `{foreign[0]}`): choose another folder with --out")

    def prepare(self) -> None:
        """Make the folders inside, and remove what an earlier run left half written. Call it with the lock held."""
        for name in _FOLDERS:
            (self.path / name).mkdir(exist_ok=True)
        for left in self.path.rglob(f"*{TEMPORARY}"):
            left.unlink(missing_ok=True)

    # --- manifest -------------------------------------------------------------------------------------------------

    def manifest(self) -> dict[str, Any] | None:
        """The manifest, or None where there is none. Raises RunFolderError where it cannot be read."""
        try:
            value = json.loads(self.manifest_path.read_bytes())
        except FileNotFoundError:
            return None
        except (ValueError, OSError) as error:
            raise RunFolderError(f"`{self.manifest_path}` cannot be read ({error}): remove the run folder, or choose another with --out") from None
        if not isinstance(value, dict) or value.get("format") != FORMAT:
            raise RunFolderError(f"`{self.manifest_path}` is not a manifest of format {FORMAT}: choose another run folder with --out")
        return value

    def write_manifest(self, manifest: dict[str, Any]) -> None:
        """Replace the manifest."""
        write_json(self.manifest_path, {"format": FORMAT, **manifest})

    def free_bytes(self) -> int:
        """Bytes that can be written where the folder is, or will be."""
        place = self.path.absolute()
        while not place.exists():
            place = place.parent
        status = os.statvfs(place)
        return status.f_bavail * status.f_frsize

    def used_bytes(self) -> int:
        """Bytes of the recorded files that are there already."""
        return sum(f.stat().st_size for name in ("tables", "words", "film") for f in (self.path / name).rglob("*") if f.is_file())

    # --- shards ---------------------------------------------------------------------------------------------------

    def _shard_record(self, shard: Shard) -> pathlib.Path:
        return self.path / "shards" / f"{shard.name}.json"

    def finished_shards(self) -> int:
        """How many shards say that they are finished, unchecked."""
        return sum(1 for _ in (self.path / "shards").glob("*.json"))

    def write_shard(self, shard: Shard, counts: dict[str, int], files: dict[pathlib.Path, FileRecord]) -> None:
        """Say that a shard is finished: the last file to be written of it."""
        named = {path.relative_to(self.path).as_posix(): record.as_json() for path, record in sorted(files.items())}
        body = {"shard": shard.index, "first": shard.first, "count": shard.count, "counts": counts, "files": named}
        write_json(self._shard_record(shard), {**body, "xxh3": _digest(body)})

    def drop_shard(self, shard: Shard) -> None:
        """Forget that a shard is finished."""
        self._shard_record(shard).unlink(missing_ok=True)

    def read_shard(self, shard: Shard) -> dict[str, Any] | None:
        """What ``write_shard`` wrote, or None where the shard is not finished or its record is damaged."""
        try:
            record = json.loads(self._shard_record(shard).read_bytes())
            digest = record.pop("xxh3")
            whole = digest == _digest(record) and (record["first"], record["count"]) == (shard.first, shard.count)
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None
        return record if whole else None

    def damage(self, shard: Shard, film_needed: bool) -> str | None:
        """Why a shard must be rendered (again): None where it is whole, "" where it was never finished, else what is wrong."""
        if not self._shard_record(shard).exists():
            return ""
        record = self.read_shard(shard)
        if record is None:
            return f"shards/{shard.name}.json is damaged"
        for name, expected in record["files"].items():
            path = self.path / name
            if path.parent.name == "film" and not film_needed:
                continue
            try:
                size, digest = checksum(path)
            except OSError as error:
                return f"{name} is missing" if isinstance(error, FileNotFoundError) else f"{name} cannot be read ({error.strerror})"
            if size != expected["bytes"]:
                return f"{name} is truncated or grown: expected {expected['bytes']} bytes, found {size}"
            if digest != expected["xxh3"]:
                return f"{name} was altered: expected checksum {expected['xxh3']}, found {digest}"
        return None


def _digest(value: dict[str, Any]) -> str:
    return str(xxhash.xxh3_64_hexdigest(json.dumps(value, sort_keys=True).encode()))
