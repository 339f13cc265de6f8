"""How tests render: replicated images with both programs, and recorded tables in memory."""

import concurrent.futures
import dataclasses
from collections.abc import Collection
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from renderer.accelerators import Accelerators
from renderer.bsdfs.base import Families
from renderer.emitters.base import Environment
from renderer.film import Film
from renderer.scene.arrays import Scene, SceneArrays
from renderer.settings import UNBOUNDED_DEPTH, TraceSettings
from renderer.shapes.base import Quadrics
from renderer.textures.base import Textures
from renderer.trace import TILE, Tracer

F64 = npt.NDArray[np.float64]
THREADS = 2
Tables = dict[str, pa.Table]


def settings_of(scene: Scene, samples: int, method: str = "path", seed: int = 1, **changes: Any) -> TraceSettings:
    """Settings for a scene at its film's size, with its own depths."""
    d = scene.defaults
    settings = TraceSettings(method, d.width, d.height, samples, UNBOUNDED_DEPTH if d.max_depth < 0 else d.max_depth, d.rr_depth, seed)
    return dataclasses.replace(settings, **changes)


def replicate_images(scene: Scene, settings: TraceSettings, replicates: int) -> F64:
    """Images (replicates, h, w, 3) of as many disjoint ranges of the settings' walks."""
    assert settings.passes % replicates == 0
    accelerators = Accelerators(scene)
    passes = settings.passes // replicates
    count = passes * settings.walks_per_pass

    def images(first: int) -> list[tuple[int, F64]]:
        tracer = Tracer(scene, settings, accelerators)
        found = []
        for i in range(first, replicates, THREADS):
            film = Film(settings.width, settings.height, settings.filter)
            tracer.trace((i * count, count), None, film)
            found.append((i, film.image(settings.method, passes).astype(np.float64)))
        return found

    with concurrent.futures.ThreadPoolExecutor(THREADS) as pool:
        parts = dict(item for part in pool.map(images, range(min(THREADS, replicates))) for item in part)
    return np.stack([parts[i] for i in range(replicates)])


def record(
    scene: Scene, settings: TraceSettings, walks: Any = None, film: Film | None = None, tile: int = TILE, names: Collection[str] | None = None
) -> Tables:
    """The recorded tables of some walks (by default all), copied, by name; ``names``: only these tables."""
    tracer = Tracer(scene, settings, tile=tile)
    schemas = {name: schema for name, schema in tracer.schemas().items() if names is None or name in names}
    sinks: dict[str, pa.BufferOutputStream] = {name: pa.BufferOutputStream() for name in schemas}
    writers = {name: pa.ipc.new_stream(sinks[name], schema) for name, schema in schemas.items()}

    def write(table: str, batch: pa.RecordBatch) -> None:
        if table in writers:
            writers[table].write_batch(batch)

    tracer.trace(walks if walks is not None else (0, settings.walks), write, film)
    for writer in writers.values():
        writer.close()
    return {name: pa.ipc.open_stream(sink.getvalue()).read_all() for name, sink in sinks.items()}


def columns(table: pa.Table) -> dict[str, np.ndarray]:
    """A table's columns as arrays."""
    return {name: table[name].to_numpy() for name in table.column_names}


def with_all_features(scene: Scene) -> Scene:
    """The same scene with every optional piece present but a lens, whose points are rows of the tables.

    Tests share this one specialization: compiling one for each small scene would take longer than all tests.
    """
    return dataclasses.replace(scene, arrays=all_features(scene.arrays))


def all_features(arrays: SceneArrays) -> SceneArrays:
    """The same arrays with every optional piece present but a lens."""
    geometry, emitters = arrays.geometry, arrays.emitters
    nt = len(geometry.p0)
    quadrics = Quadrics(np.zeros(0, np.int32), np.zeros((0, 3, 4)), np.zeros((0, 3, 4)), np.zeros(0, np.uint8))
    no_images = Textures(
        np.zeros(0, np.int32),
        np.zeros((0, 2, 3), np.float32),
        np.zeros((0, 2, 3), np.float32),
        np.zeros(0, np.int64),
        np.zeros((0, 2), np.int32),
        np.zeros((0, 2), np.int32),
        np.zeros((0, 3), np.float32),
    )
    no_environment = Environment(np.zeros((1, 1, 3), np.float32), np.zeros(2, np.float32), np.zeros((1, 2), np.float32), np.eye(3, dtype=np.float32))

    def given(piece: Any, otherwise: Any) -> Any:
        return otherwise if piece is None else piece

    corners = np.tile(np.array([[0, 0], [1, 0], [0, 1]], np.float32), (nt, 1, 1))
    return arrays._replace(
        geometry=geometry._replace(
            normals=given(geometry.normals, np.repeat(geometry.ng[:, None, :], 3, axis=1)),
            uvs=given(geometry.uvs, corners),
            quadrics=given(geometry.quadrics, quadrics),
        ),
        families=Families(True, True, True),
        materials=arrays.materials._replace(tables=given(arrays.materials.tables, np.zeros((1, 64), np.float32))),
        textures=given(arrays.textures, no_images),
        emitters=emitters._replace(
            cdf=given(emitters.cdf, np.zeros(1, np.float32)),
            curved=True,
            delta=True,
            sky=True,
            environment=given(emitters.environment, no_environment),
        ),
    )
