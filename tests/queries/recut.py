"""The same run in another form: cut into other shards and batches, its rows in another order, or with other values."""

import itertools
import json
import pathlib
import shutil
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from queries import open_run

Change = Callable[[pa.Table], pa.Table]


def recut(
    source: pathlib.Path,
    folder: pathlib.Path,
    cuts: list[int] | None = None,
    batches: Mapping[str, int] | None = None,
    change: Mapping[str, Change] | None = None,
    tile: int | None = None,
    **settings: Any,
) -> pathlib.Path:
    """Write a run anew: a shard from each of the walks ``cuts`` on (None: as it was), ``batches`` of so many rows by table, or of the walks of
    a ``tile`` each, tables through ``change``.
    """
    manifest = json.loads((source / "manifest.json").read_text())
    per_shard = manifest["shards"]["walks"]
    starts = cuts if cuts is not None else [per_shard * i for i in range(manifest["shards"]["count"])]
    with open_run(source) as run:
        recorded = {name: run.tables[name].combine_chunks() for name in run.shard_files[0]}
    files: list[dict[str, Any]] = [{} for _ in starts]
    for name, table in recorded.items():
        walk = table[next(key for key in ("walk", "camera_walk", "light_walk") if key in table.schema.names)].to_numpy()
        edges = [*np.searchsorted(walk, starts), len(walk)]
        for shard, (first, end) in enumerate(itertools.pairwise(edges)):
            part = table.slice(first, end - first)
            part = change[name](part) if change and name in change else part
            file = folder / "tables" / name / f"{shard:05d}.arrow"
            file.parent.mkdir(parents=True, exist_ok=True)
            with pa.ipc.new_file(str(file), part.schema) as writer:
                if tile is None:
                    writer.write_table(part.combine_chunks(), max_chunksize=(batches or {}).get(name))
                else:
                    inside = walk[first:end]
                    for low, high in itertools.pairwise(np.searchsorted(inside, np.arange(starts[shard], starts[shard] + per_shard + tile, tile))):
                        cut = part.slice(low, high - low).combine_chunks().to_batches()
                        writer.write_batch(cut[0] if cut else pa.RecordBatch.from_pylist([], part.schema))
            files[shard][f"tables/{name}/{shard:05d}.arrow"] = {"rows": part.num_rows, "bytes": file.stat().st_size, "xxh3": ""}
    (folder / "shards").mkdir()
    for shard, found in enumerate(files):
        (folder / "shards" / f"{shard:05d}.json").write_text(json.dumps({"files": found}))
    for name in manifest["catalogues"]:
        shutil.copy(source / "tables" / f"{name}.arrow", folder / "tables" / f"{name}.arrow")
    rows = {name: sum(known["rows"] for found in files for file, known in found.items() if f"/{name}/" in file) for name in recorded}
    manifest |= {"shards": {"count": len(starts), "walks": per_shard}, "settings": manifest["settings"] | settings, "rows": manifest["rows"] | rows}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


def shuffled(seed: int) -> Change:
    """Rows in any order."""
    return lambda table: table.take(np.random.default_rng(seed).permutation(table.num_rows))


def with_values(name: str, rows: Callable[[int], Any], value: float) -> Change:
    """Some rows of a column (``rows`` of their number: an index) set to a value."""

    def changed(table: pa.Table) -> pa.Table:
        values = table[name].to_numpy().copy()
        values[rows(len(values))] = value
        return table.set_column(table.schema.get_field_index(name), table.schema.field(name), pa.array(values))

    return changed
