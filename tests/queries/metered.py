"""Small runs of light in scenes whose irradiance is known, and how far estimates may be off."""

import pathlib
from typing import Any

import numpy as np
import yaml
from running import run_job
from scipy import stats

BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
Description = dict[str, Any]


def gray(reflectance: float) -> Description:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}}


def floor(half: float, height: float = 0.0, bsdf: Description = BLACK) -> Description:
    """A square in the plane y = height that faces up."""
    place = [{"scale": half}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"translate": [0, height, 0]}]
    return {"type": "rectangle", "to_world": place, "bsdf": {"type": "twosided", "bsdf": bsdf}}


def ceiling_lamp(half: float, height: float, radiance: float) -> Description:
    """A square that faces down and glows."""
    place = [{"scale": half}, {"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, height, 0]}]
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
    return {"type": "rectangle", "to_world": place, "bsdf": BLACK, "emitter": emitter}


def point_light(position: list[float], intensity: Any) -> Description:
    return {"type": "point", "position": position, "intensity": {"type": "rgb", "value": intensity}}


def trace(
    folder: pathlib.Path, objects: Description, origin: Any = (0, 1, 4), target: Any = (0, 1, 0), fov: float = 60, **render: Any
) -> pathlib.Path:
    """A run of these objects: light walks, independent, unless ``render`` says otherwise."""
    up = [0, 0, 1] if abs(target[0] - origin[0]) + abs(target[2] - origin[2]) < 1e-6 else [0, 1, 0]
    sensor = {
        "type": "perspective",
        "fov": fov,
        "to_world": [{"lookat": {"origin": list(origin), "target": list(target), "up": up}}],
        "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
    }
    job = {
        "name": "metered",
        "scene": {"type": "scene", "sensor": sensor, **objects},
        "render": {"method": "light", "resolution": [64, 64], "samples": 16, "seed": 5, "sampler": "independent", "filter": "box"} | render,
    }
    (folder / "job.yaml").write_text(yaml.safe_dump(job, sort_keys=False))
    return run_job(folder / "job.yaml", out=folder / "run", threads=2).path


def assert_scatter(found: np.ndarray, expected: np.ndarray, error: np.ndarray, level: float = 1e-4) -> None:
    """Estimates differ from what is expected as their errors say: no more, and in the mean no less (chi-square, both sides); none stands out."""
    assert (error > 0).all()
    z = ((found - expected) / error).ravel()
    assert len(z) >= 20
    chance = stats.chi2.cdf((z * z).sum(), len(z))
    assert level / 2 < chance < 1 - level / 2, f"chi2 {np.mean(z * z):.3f} a degree of freedom over {len(z)}"
    assert abs(z).max() < stats.norm.isf(level / 2 / len(z)) + 1, f"largest z {abs(z).max():.2f}"
    assert abs(z.mean()) * np.sqrt(len(z)) < stats.norm.isf(level / 2), f"mean z {z.mean():.3f}"
