"""A job small enough to be run many times: 16 shards of a floor, a block and a lamp; and what must be equal between two runs of it."""

import copy
import pathlib
from typing import Any

import yaml

from pipeline.files import checksum

SCENE: dict[str, Any] = {
    "type": "scene",
    "sensor": {
        "type": "perspective",
        "fov": 60,
        "to_world": [{"lookat": {"origin": [0, 1, 4], "target": [0, 1, 0], "up": [0, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
    },
    "floor": {
        "type": "rectangle",
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"scale": 3}],
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.4, 0.2]}},
    },
    "block": {"type": "cube", "to_world": [{"scale": 0.4}, {"translate": [0, 0.4, 0]}], "bsdf": {"type": "diffuse"}},
    "lamp": {
        "type": "rectangle",
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, 2, 0]}],
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 5}},
    },
}
JOB: dict[str, Any] = {
    "name": "tiny",
    "scene": SCENE,
    "render": {"method": "path", "resolution": [64, 64], "samples": 64, "max_depth": 4, "seed": 3, "filter": "tent"},
    "record": {"occluded": True},
    "aovs": {"direct": "C D L"},
}
SHARDS = 16


def write_job(folder: pathlib.Path, **changes: Any) -> pathlib.Path:
    """Write the tiny job into a folder, with whole sections replaced or added to; returns its file."""
    job = copy.deepcopy(JOB)
    for key, value in changes.items():
        job[key] = {**job.get(key, {}), **value} if isinstance(value, dict) and key in ("render", "record") else value
    path = folder / "tiny.yaml"
    path.write_text(yaml.safe_dump(job, sort_keys=False))
    return path


def results(run: pathlib.Path) -> dict[str, tuple[int, str]]:
    """Size and checksum of all that must not depend on how the run went: tables, words, film, images, shard records."""
    kept = ("tables", "words", "film", "images", "shards")
    return {file.relative_to(run).as_posix(): checksum(file) for folder in kept for file in sorted((run / folder).rglob("*")) if file.is_file()}
