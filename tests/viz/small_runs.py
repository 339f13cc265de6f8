"""The project's own scenes, rendered small, for pictures of them."""

import pathlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.stages import run_job
from queries.regions import SceneGeometry

CONFIGS = pathlib.Path(__file__).parent.parent.parent / "configs"
NOTHING_ELSE = ("aovs={}", "rank={}", "views={}", "report=null", "inspection=null")


def small_run(name: str, folder: pathlib.Path, *overrides: str) -> pathlib.Path:
    """A run of one of the project's jobs, 32 x 32 pixels of 4 samples, in a new folder."""
    given = ("render.resolution=[32, 32]", "render.samples=4", *NOTHING_ELSE, *overrides)
    return run_job(CONFIGS / f"{name}.yaml", given, out=folder / name, threads=2).path


def scene_of_triangles(corners: np.ndarray, camera: dict[str, Any] | None) -> SceneGeometry:
    """A scene of one object, triangles (n, 3, 3), and a camera as manifests describe it."""
    names = [f"{axis}{corner}" for corner in range(3) for axis in "xyz"]
    flat = np.asarray(corners, np.float32).reshape(-1, 9)
    tables = {
        "objects": pa.table({"object": pa.array([0], pa.uint16()), "name": ["thing"]}),
        "triangles": pa.table({"object": pa.array(np.zeros(len(flat), np.uint16)), **{name: flat[:, i].copy() for i, name in enumerate(names)}}),
    }
    return SceneGeometry(SimpleNamespace(manifest={"camera": camera}, tables=tables))
