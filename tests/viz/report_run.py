"""A run that is small, quick and hard to report: its objects have names that a page must not obey."""

import copy
import pathlib
from typing import Any

import yaml

from pipeline.stages import run_job

EVIL = "<script>document.title='obeyed'</script>"
SCENE: dict[str, Any] = {
    "type": "scene",
    "sensor": {
        "type": "perspective",
        "fov": 60,
        "to_world": [{"lookat": {"origin": [0, 1, 4], "target": [0, 1, 0], "up": [0, 1, 0]}}],
        "film": {"type": "hdrfilm", "width": 24, "height": 16, "rfilter": {"type": "box"}},
    },
    "floor": {
        "type": "rectangle",
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"scale": 3}],
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.4, 0.2]}},
    },
    EVIL: {"type": "cube", "to_world": [{"scale": 0.4}, {"translate": [0, 0.4, 0]}], "bsdf": {"type": "diffuse"}},
    "lamp": {
        "type": "rectangle",
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, 2, 0]}],
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 5}},
    },
}
JOB: dict[str, Any] = {
    "name": "small",
    "scene": SCENE,
    "render": {"method": "path", "samples": 16, "max_depth": 4, "seed": 3, "sampler": "sobol"},
    "regions": {"block": {"object": EVIL}},
    "aovs": {"direct": "C D L", "indirect": "C D .+ L"},
    "rank": {"block": {"region": "block", "with_objects": True, "top": 6}},
}


def report_run(folder: pathlib.Path, **changes: Any) -> pathlib.Path:
    """Make the run in a folder, with sections of its job replaced; where it lies."""
    job = copy.deepcopy(JOB) | changes
    file = folder / "job.yaml"
    file.write_text(yaml.safe_dump(job, sort_keys=False))
    return run_job(file, out=folder / "run", threads=2).path
