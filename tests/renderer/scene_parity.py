"""Rays against a scene in both programs: what each finds, as arrays."""

from typing import Any

import numpy as np
import numpy.typing as npt

from renderer.accelerators import Accelerators
from renderer.kernel import kernel
from renderer.math.vec import FAR, row
from renderer.scene.arrays import Scene
from renderer.scene.to_mitsuba import mitsuba_dict
from renderer.shapes.base import Geometry
from renderer.shapes.surface import surface
from tests.rendering import with_all_features

Found = dict[str, npt.NDArray[Any]]


@kernel
def surfaces(geometry: Geometry, primitive: Any, o: Any, d: Any, t: Any, out: Any) -> None:
    """Fill out (n, 11): shading normal, tangent, point, u, v."""
    for i in range(len(t)):
        if primitive[i] >= 0:
            hit = surface(geometry, primitive[i], row(o, i), row(d, i), t[i])
            for k, vector in enumerate((hit.n, hit.s, hit.p)):
                out[i, 3 * k], out[i, 3 * k + 1], out[i, 3 * k + 2] = vector
            out[i, 9], out[i, 10] = hit.u, hit.v


def rays(low: Any, high: Any, n: int, seed: int) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Rays from around a box toward points inside it."""
    rng = np.random.default_rng(seed)
    low, high = np.asarray(low), np.asarray(high)
    target = rng.uniform(low, high, (n, 3))
    far = rng.normal(size=(n, 3))
    origin = (low + high) / 2 + far / np.linalg.norm(far, axis=1, keepdims=True) * np.linalg.norm(high - low) * 1.3
    d = target - origin
    return origin.astype(np.float32), (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)


def our_hits(scene: Scene, o: npt.NDArray[np.float32], d: npt.NDArray[np.float32]) -> Found:
    """What our accelerators and surfaces say."""
    t = np.full(len(o), FAR, np.float32)
    primitive = Accelerators(scene).closest(o, d, t)
    out = np.zeros((len(o), 11), np.float32)
    geometry = with_all_features(scene).arrays.geometry
    surfaces(geometry, primitive, o, d, t, out)
    t = np.einsum("ij,ij->i", out[:, 6:9] - o, d)
    return {"hit": primitive >= 0, "t": t, "n": out[:, :3], "s": out[:, 3:6], "uv": out[:, 9:]}


def mitsuba_hits(scene: Scene, o: npt.NDArray[np.float32], d: npt.NDArray[np.float32]) -> Found:
    """What Mitsuba says of the same description."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    theirs = mi.load_dict(mitsuba_dict(scene.description))
    records = []
    for i in range(len(o)):
        si = theirs.ray_intersect(mi.Ray3f(o[i].tolist(), d[i].tolist()))
        n, du = np.array(si.sh_frame.n), np.array(si.dp_du)
        s = du - n * (n @ du)
        length = np.linalg.norm(s)
        # Where a triangle's texture coordinates collapse, Mitsuba takes any unit frame: no tangent to compare
        lengths = np.linalg.norm(du), np.linalg.norm(si.dp_dv)
        firm = length > 0.2 * lengths[0] and max(lengths) < 1e4 and not np.allclose(lengths, 1, atol=1e-5)
        records.append((si.is_valid(), si.t, n, s / max(length, 1e-30), np.array(si.uv), firm))
    hit, t, n, s, uv, firm = (np.array(column) for column in zip(*records, strict=True))
    return {"hit": hit, "t": t, "n": n, "s": s, "uv": uv, "firm": firm}


def compare(scene: Scene, n: int, seed: int, tangents: bool = True, from_camera: bool = False) -> None:
    """Assert that both programs find the same; rays that graze an edge may differ, at most one in two hundred.

    Texture coordinates are compared where the scene has textures, and so keeps them.
    """
    bounds = [info.bounds for info in scene.objects]
    o, d = rays(np.min([b[0] for b in bounds], axis=0), np.max([b[1] for b in bounds], axis=0), n, seed)
    if from_camera:
        eye = scene.arrays.sensor.to_world[:, 3]
        d = o + d * np.linalg.norm(o - np.mean(bounds, axis=(0, 1)), axis=1, keepdims=True) - eye
        o, d = np.tile(eye, (n, 1)), (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)
    ours, theirs = our_hits(scene, o, d), mitsuba_hits(scene, o, d)
    both = ours["hit"] & theirs["hit"]
    assert both.mean() > 0.1, "too few rays meet anything"
    size = float(np.linalg.norm(np.max([b[1] for b in bounds], axis=0) - np.min([b[0] for b in bounds], axis=0)))
    same = both & (np.abs(ours["t"] - np.where(both, theirs["t"], 0)) < 1e-4 * size)
    assert (ours["hit"] == theirs["hit"]).mean() >= 0.995
    assert same.sum() >= 0.995 * both.sum()
    tolerances = {"n": 2e-3} | ({"uv": 2e-3} if scene.arrays.geometry.uvs is not None else {}) | ({"s": 2e-2} if tangents else {})
    for key, tolerance in tolerances.items():
        which = same & theirs["firm"] if key == "s" else same
        assert which.sum() > 0.5 * same.sum()
        error = np.abs(ours[key][which] - theirs[key][which]).max(axis=1)
        if key == "uv":  # the seam, where 0 and 1 are one place
            error = np.minimum(error, np.abs(error - 1))
        assert (error < tolerance).mean() >= 0.995, f"{key}: worst {error.max()}, {np.mean(error >= tolerance):.3f} differ"
