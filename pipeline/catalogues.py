"""The small tables beside the recorded ones: what the keys mean, and what pictures need of the scene."""

import json
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.errors import RunFolderError
from pipeline.files import FileRecord, new_file
from pipeline.identity import camera
from pipeline.run_folder import RunFolder
from pipeline.shards import Shard
from renderer.integrators.record import WordCollision, WordColumns, distinct_words
from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings
from renderer.tables import EVENTS, TECHNIQUES, WORDS

_CORNERS = [f"{axis}{corner}" for corner in range(3) for axis in "xyz"]


def write_table(folder: RunFolder, name: str, table: pa.Table) -> FileRecord:
    """Write one catalogue as an Arrow IPC file."""
    with new_file(folder.catalogue(name)) as file:
        with pa.ipc.new_file(file, table.schema) as writer:
            writer.write_table(table)
        return file.commit(table.num_rows)


def write_catalogues(folder: RunFolder, scene: Scene, run: pa.Table, words: pa.Table) -> dict[str, FileRecord]:
    """Write every catalogue; ``run`` is the one row that describes the run, ``words`` the merged words. Returns what was written, by name."""
    tables = {
        "events": events(),
        "techniques": techniques(),
        "objects": objects(scene),
        "emitters": emitters(scene),
        "triangles": triangles(scene),
        "quadrics": quadrics(scene),
        "words": words,
        "run": run,
    }
    return {name: write_table(folder, name, table) for name, table in tables.items()}


def events() -> pa.Table:
    """``renderer.tables.EVENTS`` as a table."""
    rows = [{"key": e.key, "type": e.type, "scattering": e.scattering, "lobe": e.lobe} for e in EVENTS]
    return pa.Table.from_pylist(rows, pa.schema([("key", pa.uint8()), ("type", pa.string()), ("scattering", pa.string()), ("lobe", pa.string())]))


def techniques() -> pa.Table:
    """``renderer.tables.TECHNIQUES`` as a table."""
    return pa.table({"key": pa.array(range(len(TECHNIQUES)), pa.uint8()), "name": list(TECHNIQUES)})


def objects(scene: Scene) -> pa.Table:
    """One row for each shape: name, plugin, material, bounds (world units), area (squared world units)."""
    bounds = np.array([o.bounds for o in scene.objects], np.float32).reshape(-1, 6)
    columns: dict[str, Any] = {
        "object": pa.array(range(len(scene.objects)), pa.uint16()),
        "name": pa.array([o.name for o in scene.objects], pa.string()),
        "shape": pa.array([o.shape for o in scene.objects], pa.string()),
        "material": pa.array([o.material for o in scene.objects], pa.string()),
    }
    columns |= {name: pa.array(bounds[:, i]) for i, name in enumerate(("min_x", "min_y", "min_z", "max_x", "max_y", "max_z"))}
    return pa.table(columns | {"area": pa.array([o.area for o in scene.objects], pa.float32())})


def emitters(scene: Scene) -> pa.Table:
    """One row for each emitter; ``object`` is NULL where light comes from no shape."""
    rows = [
        {"emitter": i, "name": e.name, "kind": e.kind, "object": e.object if e.object >= 0 else None, "infinite": e.infinite, "symbol": e.symbol}
        for i, e in enumerate(scene.emitters)
    ]
    types = {"emitter": pa.uint16(), "name": pa.string(), "kind": pa.string(), "object": pa.uint16(), "infinite": pa.bool_(), "symbol": pa.string()}
    return pa.Table.from_pylist(rows, pa.schema(list(types.items())))


def triangles(scene: Scene) -> pa.Table:
    """One row for each triangle, in the order of ``primitive``: its object and its corners, world units."""
    corners = scene.vertices[scene.triangles].reshape(-1, 9)
    owner = scene.arrays.geometry.object[: len(corners)]
    columns = {"primitive": pa.array(np.arange(len(corners), dtype=np.uint32)), "object": pa.array(owner.astype(np.uint16))}
    return pa.table(columns | {name: pa.array(np.ascontiguousarray(corners[:, i], dtype=np.float32)) for i, name in enumerate(_CORNERS)})


def quadrics(scene: Scene) -> pa.Table:
    """One row for each exact sphere, disk or cylinder: kind (0, 1, 2) and the 3 x 4 matrix, by row, that places its unit shape."""
    geometry, first = scene.arrays.geometry, len(scene.triangles)
    owner = geometry.object[first:]
    matrices = np.empty((0, 12)) if geometry.quadrics is None else geometry.quadrics.to_world.reshape(-1, 12)
    kinds = np.empty(0, np.int32) if geometry.quadrics is None else geometry.quadrics.kind
    count = len(matrices)
    columns: dict[str, Any] = {
        "primitive": pa.array(np.arange(first, first + count, dtype=np.uint32)),
        "object": pa.array(owner[:count].astype(np.uint16)),
        "kind": pa.array(kinds.astype(np.uint8)),
        "to_world": pa.FixedSizeListArray.from_arrays(pa.array(matrices.reshape(-1).astype(np.float64)), 12),
    }
    return pa.table(columns)


# --- words --------------------------------------------------------------------------------------------------------


def merged_words(folder: RunFolder, shards: tuple[Shard, ...]) -> pa.Table:
    """The distinct words of all shards, sorted. Raises RunFolderError where two prefixes share a hash."""
    schema = WORDS.schema(tuple(WORDS.by_name))
    merged: WordColumns = [np.empty(0, field.type.to_pandas_dtype()) for field in schema]
    for shard in shards:
        table = pa.ipc.open_file(pa.memory_map(str(folder.table("words", shard)))).read_all()
        try:
            merged = distinct_words([np.concatenate([column, table[name].to_numpy()]) for column, name in zip(merged, schema.names, strict=True)])
        except WordCollision as error:
            raise RunFolderError(str(error)) from None
    return pa.table([pa.array(column) for column in merged], schema=schema)


# --- the run ------------------------------------------------------------------------------------------------------

COUNTED = ("camera_vertices", "light_vertices", "paths", "occluded", "unlit")  # tables whose rows the shards count


def run_row(name: str, settings: TraceSettings, scene: Scene, versions: dict[str, str], rows: dict[str, int]) -> pa.Table:
    """The catalogue ``run``: one row with every setting, the camera, versions, and the number of rows of each table."""
    values: list[tuple[str, pa.DataType, Any]] = [
        ("name", pa.string(), name),
        ("method", pa.string(), settings.method),
        ("width", pa.uint32(), settings.width),
        ("height", pa.uint32(), settings.height),
        ("passes", pa.uint32(), settings.passes),
        ("max_depth", pa.uint8(), settings.max_depth),
        ("rr_depth", pa.uint16(), settings.rr_depth),
        ("seed", pa.uint64(), settings.seed),
        ("sampler", pa.string(), settings.sampler),
        ("replicates", pa.uint32(), settings.replicates),
        ("filter", pa.string(), settings.filter),
        ("keep", pa.float64(), settings.keep),
        ("columns", pa.list_(pa.string()), sorted(settings.columns)),
        ("occluded", pa.bool_(), settings.occluded),
        ("walks", pa.uint64(), settings.walks),
        ("camera", pa.string(), json.dumps(camera(scene))),
        ("scene", pa.string(), json.dumps(scene.description, default=str)),
        ("versions", pa.string(), json.dumps(versions)),
    ]
    values += [(f"{table}_rows", pa.uint64(), rows.get(table, 0)) for table in (*COUNTED, "words")]
    return pa.table([pa.array([value], kind) for _, kind, value in values], names=[column for column, _, _ in values])
