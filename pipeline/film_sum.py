"""The film of a run is the sum of its shards' films, always in shard order: floating-point sums depend on the order."""

import pathlib

import numpy as np
import numpy.typing as npt

from pipeline.errors import RunFolderError
from pipeline.files import FileRecord, checksum, new_file
from pipeline.run_folder import RunFolder
from pipeline.shards import Shard
from renderer.film import Film

F64 = npt.NDArray[np.float64]


def lit_rows(sums: F64) -> tuple[int, int]:
    """First row and row past the last that anything was added to; (0, 0) for a black film of no weight."""
    lit = np.flatnonzero(sums.any(axis=(1, 2)))
    return (int(lit[0]), int(lit[-1]) + 1) if len(lit) else (0, 0)


def save_array(path: pathlib.Path, values: F64) -> FileRecord:
    """Write a numpy file, whole or not at all."""
    with new_file(path) as file:
        np.lib.format.write_array(file, values)
        return file.commit()


def write_film(path: pathlib.Path, film: Film) -> tuple[int, FileRecord]:
    """Write the rows of a film that were added to, float64 (rows, width, 4); returns the first of them, and what was written.

    A shard of camera walks reaches a band of the film: the rest would be most of the file.
    """
    first, last = lit_rows(film.sums)
    return first, save_array(path, film.sums[first:last])


def sum_films(folder: RunFolder, shards: tuple[Shard, ...], film: Film) -> FileRecord:
    """Sum all shards' films into ``film`` in order, and keep the sum. Memory: one shard's film at a time."""
    film.clear()
    for shard in shards:
        record = folder.read_shard(shard)
        if record is None:
            raise RunFolderError(f"shard {shard.name} vanished from `{folder.path}` while it was summed: run again with --resume")
        first = record["counts"]["film_first_row"]
        rows = np.load(folder.film(shard))
        film.sums[first : first + len(rows)] += rows
    return save_array(folder.film_sum, film.sums)


def load_film(folder: RunFolder, film: Film, expected: FileRecord | None) -> bool:
    """Load the kept sum into ``film``, where it is there and whole."""
    if expected is None:
        return False
    try:
        if checksum(folder.film_sum) != (expected.bytes, expected.xxh3):
            return False
        sums = np.load(folder.film_sum)
    except (OSError, ValueError):
        return False
    if sums.shape != film.sums.shape:
        return False
    film.sums[:] = sums
    return True


def drop_films(folder: RunFolder, shards: tuple[Shard, ...]) -> None:
    """Remove the shards' films, once their sum is kept and the manifest says so."""
    for shard in shards:
        folder.film(shard).unlink(missing_ok=True)
