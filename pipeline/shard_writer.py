"""One shard, from walks to files: tables stream to disk tile by tile, the film's share follows, the record comes last."""

import pathlib
import threading
from contextlib import ExitStack
from dataclasses import dataclass, field

import pyarrow as pa

from pipeline.errors import Interrupted
from pipeline.files import FileRecord, NewFile, new_file
from pipeline.film_sum import write_film
from pipeline.run_folder import RunFolder
from pipeline.shards import Shard
from renderer.film import Film
from renderer.trace import Tracer


@dataclass
class ShardTables:
    """The open files of one shard. ``write`` is what the tracer calls; ``stop`` makes it raise Interrupted."""

    folder: RunFolder
    shard: Shard
    stop: threading.Event
    files: dict[str, NewFile] = field(default_factory=dict)
    writers: dict[str, pa.RecordBatchFileWriter] = field(default_factory=dict)
    rows: dict[str, int] = field(default_factory=dict)

    def open(self, schemas: dict[str, pa.Schema], stack: ExitStack) -> None:
        """Open a file for every table, so that a table without rows has its columns too."""
        for table, schema in schemas.items():
            path = self.folder.table(table, self.shard)
            path.parent.mkdir(exist_ok=True)
            self.files[table] = stack.enter_context(new_file(path))
            self.writers[table] = pa.ipc.new_file(self.files[table], schema)
            self.rows[table] = 0

    def write(self, table: str, batch: pa.RecordBatch) -> None:
        """Append a batch, which may alias memory that is about to change. Batches without rows too: those of all tables hold the same walks."""
        if self.stop.is_set():
            raise Interrupted("interrupted")
        self.writers[table].write_batch(batch)
        self.rows[table] += batch.num_rows

    def commit(self) -> dict[pathlib.Path, FileRecord]:
        """Finish every file and give it its name."""
        for writer in self.writers.values():
            writer.close()
        return {self.folder.table(table, self.shard): file.commit(self.rows[table]) for table, file in self.files.items()}


def write_shard(folder: RunFolder, shard: Shard, tracer: Tracer, film: Film, stop: threading.Event) -> dict[str, int]:
    """Trace one shard and write all of it. Returns its counts of walks, vertices, paths and rows of each table."""
    folder.drop_shard(shard)
    film.clear()
    tables = ShardTables(folder, shard, stop)
    with ExitStack() as stack:
        tables.open(tracer.schemas(), stack)
        counts = tracer.trace((shard.first, shard.count), tables.write if tables.writers else None, film)
        files = tables.commit()
    first_row, files[folder.film(shard)] = write_film(folder.film(shard), film)
    known = {"walks": counts.walks, "vertices": counts.vertices, "paths": counts.paths, "film_first_row": first_row}
    known |= {f"{table}_rows": rows for table, rows in tables.rows.items()}
    folder.write_shard(shard, known, files)
    return known
