"""How large a run will be, from a small pilot trace of walks spread over all of the job."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import psutil
import pyarrow as pa

from pipeline.errors import JobError
from pipeline.run_folder import RunFolder
from pipeline.shards import shard_count, shard_size
from queries.inspection import FOLDER
from renderer.settings import TraceSettings
from renderer.trace import Tracer

PILOT_WALKS = 4096
_MARGIN = 1.05  # the pilot's own error, and the headers and padding of files


@dataclass(frozen=True)
class SizeEstimate:
    """Bytes on disk, by table, and of the shards' films until they are summed."""

    tables: dict[str, int]
    film: int

    @property
    def bytes(self) -> int:
        """All of it, with a margin for the pilot's error."""
        return int(_MARGIN * sum(self.tables.values())) + self.film

    def text(self) -> str:
        """The figures, for people."""
        parts = [f"{name} {human_bytes(size)}" for name, size in {**self.tables, "film": self.film}.items()]
        return f"{human_bytes(self.bytes)} on disk ({', '.join(parts)})"


def estimate_size(tracer: Tracer, settings: TraceSettings) -> SizeEstimate:
    """Trace a few thousand walks, spread over the film, and scale their rows up."""
    ids = pilot_walks(settings)
    measured = dict.fromkeys((name for name in tracer.schemas() if name != "words"), 0)

    def measure(table: str, batch: pa.RecordBatch) -> None:
        if table in measured:
            measured[table] += batch.nbytes

    tracer.trace(ids, measure, None)
    rows = settings.height
    if settings.method == "path":  # a shard reaches a band of the film, and its filter a little more
        rows = min(rows, shard_size(settings.walks) // settings.width + 10)
    film = shard_count(settings.walks) * film_bytes(settings) * rows // settings.height
    return SizeEstimate({name: round(size * settings.walks / len(ids)) for name, size in measured.items()}, film)


def pilot_walks(settings: TraceSettings) -> npt.NDArray[np.uint64]:
    """Ids of the pilot, ascending: one walk in each of many equal pieces of the film, of any pass."""
    count = min(PILOT_WALKS, settings.walks)
    rng = np.random.default_rng(0)
    pixel = np.floor((np.arange(count) + rng.random(count)) * (settings.walks_per_pass / count)).astype(np.uint64)
    passes = rng.integers(settings.passes, size=count, dtype=np.uint64)
    return np.unique(passes * np.uint64(settings.walks_per_pass) + pixel)


def refuse_too_large(size: SizeEstimate, folder: RunFolder) -> None:
    """Raise JobError, with the figures, where the run cannot fit on its disk."""
    free = folder.free_bytes() + folder.used_bytes()
    if size.bytes > free:
        raise JobError(
            f"the run needs about {size.text()}, and {human_bytes(free)} are free at `{folder.path}`: "
            f"lower {'inspection.samples, ' if FOLDER in size.tables else ''}render.samples or render.resolution, "
            "set record.keep to `none` or a fraction, or choose another disk with --out"
        )


def film_bytes(settings: TraceSettings) -> int:
    """Memory of one film: four float64 sums a pixel."""
    return settings.width * settings.height * 4 * 8


def refuse_too_much_memory(settings: TraceSettings, threads: int) -> None:
    """Raise JobError, with the figures, where the films (one for each thread, and their sum) cannot fit into memory."""
    needed, free = (threads + 1) * film_bytes(settings), psutil.virtual_memory().available
    if needed > free:
        raise JobError(
            f"a film of {settings.width} x {settings.height} pixels needs {human_bytes(needed)} of memory on {threads} threads, "
            f"and {human_bytes(free)} are free: lower render.resolution or --threads"
        )


def human_bytes(size: float) -> str:
    """Bytes with a decimal unit.

    >>> human_bytes(1234567)
    '1.2 MB'
    """
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000:
            return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
        size /= 1000
    return f"{size:.1f} TB"
