"""What the recorder makes of rows: words without collisions, the lens points of thin-lens walks."""

import numpy as np
import pyarrow as pa
import pytest

from renderer.integrators.record import Recorder
from renderer.scene.load import load_scene
from renderer.settings import TraceSettings
from renderer.tables import LENS, NO_OBJECT
from renderer.trace import Tracer

WORDS = (np.uint64, np.uint64, np.uint8, np.uint16)


def settings(**changes) -> TraceSettings:
    return TraceSettings(**{"method": "path", "width": 16, "height": 16, "passes": 2, "max_depth": 3, "rr_depth": 5, "seed": 1} | changes)


def word_rows(*rows: tuple[int, int, int, int]) -> tuple[np.ndarray, ...]:
    return tuple(np.array(column, dtype) for column, dtype in zip(zip(*rows), WORDS))


def test_words_are_distinct_and_sorted() -> None:
    batch = Recorder(settings()).words([word_rows((9, 1, 8, 0), (3, 1, 8, 1)), word_rows((9, 1, 8, 0))])
    assert batch.to_pydict() == {"word": [3, 9], "parent": [1, 1], "event": [8, 8], "object": [1, 0]}


def test_no_words_at_all() -> None:
    assert Recorder(settings()).words([]).num_rows == 0


@pytest.mark.parametrize("other", [(9, 2, 8, 0), (9, 1, 9, 0), (9, 1, 8, 1)])
def test_a_collision_is_an_error(other: tuple[int, int, int, int]) -> None:
    with pytest.raises(RuntimeError, match="same hash"):
        Recorder(settings()).words([word_rows((9, 1, 8, 0), other)])


def test_lens_points_are_vertices() -> None:
    look = [{"lookat": {"origin": [0, -4, 1], "target": [0, 0, 1], "up": [0, 0, 1]}}]
    scene = load_scene(
        {
            "type": "scene",
            "sensor": {
                "type": "thinlens",
                "to_world": look,
                "aperture_radius": 0.25,
                "focus_distance": 4.0,
                "near_clip": 0.5,
                "film": {"type": "hdrfilm", "width": 16, "height": 16},
            },
            "light": {"type": "rectangle", "to_world": [{"scale": 3.0}, {"translate": [0, 0, 3]}], "emitter": {"type": "area", "radiance": 1.0}},
        }
    )
    batches: list[pa.RecordBatch] = []
    Tracer(scene, settings()).trace((0, 512), lambda table, batch: batches.append(copied(batch)) if table == "camera_vertices" else None, None)
    vertices = pa.Table.from_batches(batches)
    column = {name: vertices[name].to_numpy() for name in vertices.column_names}
    first = column["depth"] == 0
    assert first.sum() == 512
    assert (column["event"][first] == LENS).all()
    assert (column["object"][first] == NO_OBJECT).all()
    # on the lens: the plane y = -4, within the aperture, and all over it
    x, y, z = (column[name][first] for name in "xyz")
    np.testing.assert_allclose(y, -4, atol=1e-5)
    radius = np.hypot(x, z - 1)
    assert radius.max() <= 0.25 * 1.0001
    assert np.mean((radius / 0.25) ** 2) == pytest.approx(0.5, abs=0.06)  # uniform by area; the mean's deviation is 0.29 / sqrt(512)


def copied(batch: pa.RecordBatch) -> pa.RecordBatch:
    """A batch of its own memory: the tracer's is used again."""
    return pa.RecordBatch.from_pydict({name: np.array(batch[name]) for name in batch.schema.names}, schema=batch.schema)
