"""A closed room in which light is the same everywhere and from everywhere: its walls and a block shine and reflect alike.

Radiance is Le / (1 - Kd), irradiance pi times, fluence 4 pi times as much, and of all light the share 1 - Kd comes straight from an emitter.
"""

import pathlib

import numpy as np
import yaml
from running import run_job
from scenes.parts import area, camera, diffuse, move, scale, scene, shape, turn

KD, LE = np.array([0.3, 0.6, 0.4]), np.array([2.0, 1.0, 0.5])
RADIANCE = LE / (1 - KD)
SIDE = 3.0
BLOCK, BLOCK_SIDE = (0.7, -0.5, 0.2), 0.8
AREA = 6 * (SIDE**2 + BLOCK_SIDE**2)


def make_furnace(folder: pathlib.Path) -> pathlib.Path:
    """Render the room from its emitters; the run's folder."""
    surface = {"bsdf": diffuse(*KD.tolist()), "emitter": area(*LE.tolist())}
    walls = shape("cube", scale(SIDE / 2), **surface, flip_normals=True)
    block = shape("cube", scale(BLOCK_SIDE / 2), turn("y", 30), move(*BLOCK), **surface)
    description = scene(camera((-0.9, 0.6, 1.2), (0.4, -0.3, -0.4), 32, 32, fov=70.0), -1, walls=walls, block=block)
    render = {"method": "light", "resolution": [32, 32], "samples": 64, "max_depth": -1, "seed": 5, "sampler": "independent", "filter": "box"}
    job = {"name": "furnace", "scene": description, "render": render, "regions": {"corner": {"box": {"min": [-2, -2, -2], "max": [-1, -1, -1]}}}}
    (folder / "furnace.yaml").write_text(yaml.safe_dump(job, sort_keys=False))
    return run_job(folder / "furnace.yaml", out=folder / "run", threads=1).path
