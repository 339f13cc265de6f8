"""Files that are either whole or absent: written under a temporary name, checksummed on the way, then renamed."""

import contextlib
import errno
import json
import os
import pathlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, BinaryIO

import xxhash

from pipeline.errors import RunFolderError

TEMPORARY = ".tmp"
_CHUNK = 4 << 20
_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True)
class FileRecord:
    """What is known of a finished file. ``rows`` is 0 for files that are not tables; ``xxh3`` is the 64-bit digest, in hexadecimal."""

    rows: int
    bytes: int
    xxh3: str

    def as_json(self) -> dict[str, Any]:
        """The record as plain values."""
        return asdict(self)


class NewFile:
    """A file that takes its name when it is committed. Writers (Arrow's too) need ``write``, ``tell``, ``flush`` and ``closed`` only."""

    def __init__(self, path: pathlib.Path) -> None:
        self.path = path
        self._temporary = path.with_name(path.name + TEMPORARY)
        self._file: BinaryIO = open(self._temporary, "wb", buffering=0)  # noqa: SIM115 (closed by commit and abandon)
        self._hash = xxhash.xxh3_64()
        self._bytes = 0

    def write(self, data: Any) -> int:
        """Append a buffer; all of it, or an OSError."""
        view = memoryview(data).cast("B")
        self._hash.update(view)
        written = 0
        while written < len(view):
            written += self._file.write(view[written:])
        self._bytes += written
        return written

    def tell(self) -> int:
        """Bytes written so far."""
        return self._bytes

    def flush(self) -> None:
        """Nothing is buffered here."""

    @property
    def closed(self) -> bool:
        """Whether the file was committed or abandoned."""
        return self._file.closed

    def readable(self) -> bool:
        """No."""
        return False

    def writable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """No."""
        return False

    def commit(self, rows: int = 0) -> FileRecord:
        """Close the file and give it its name."""
        self._file.close()
        os.replace(self._temporary, self.path)
        return FileRecord(rows, self._bytes, self._hash.hexdigest())

    def abandon(self) -> None:
        """Close and remove what was written, if it was not committed."""
        if not self._file.closed:
            self._file.close()
            self._temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def new_file(path: pathlib.Path) -> Iterator[NewFile]:
    """A file to write and ``commit``; without the commit nothing is left of it."""
    file = NewFile(path)
    try:
        yield file
    finally:
        file.abandon()


def write_json(path: pathlib.Path, value: Any) -> None:
    """Write a JSON file, whole or not at all."""
    with new_file(path) as file:
        file.write(json.dumps(value, indent=1, ensure_ascii=False).encode() + b"\n")
        file.commit()


def checksum(path: pathlib.Path) -> tuple[int, str]:
    """Size in bytes and xxh3 digest of a file."""
    digest, size, buffer = xxhash.xxh3_64(), 0, memoryview(bytearray(_CHUNK))
    with open(path, "rb", buffering=0) as file:
        while count := file.readinto(buffer):
            digest.update(buffer[:count])
            size += count
    return size, digest.hexdigest()


def is_whole(path: pathlib.Path, known: Mapping[str, Any]) -> bool:
    """Whether a file is there with the size and digest that its record (``FileRecord.as_json``) says."""
    try:
        return checksum(path) == (known["bytes"], known["xxh3"])
    except (KeyError, OSError):
        return False


@contextlib.contextmanager
def clear_errors(doing: str, folder: pathlib.Path) -> Iterator[None]:
    """Turn the system's errors into messages that say what to do. Nothing that is finished is lost by any of them."""
    try:
        yield
    except OSError as error:
        what = error.strerror or str(error)
        if error.errno in _NO_SPACE:
            advice = "what is finished is kept: make room there, then run again with --resume"
            raise RunFolderError(f"no space left while {doing} in `{folder}` ({what}): {advice}") from error
        if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            raise RunFolderError(
                f"`{error.filename or folder}` cannot be written while {doing} ({what}): make it writable, or choose another folder with --out"
            ) from error
        raise RunFolderError(f"failed while {doing} in `{folder}`: {what}") from error
