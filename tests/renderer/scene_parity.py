"""Rays against a scene in both programs: what each finds, as arrays."""

from typing import Any

import numpy as np
import numpy.typing as npt

from renderer.accelerators import FAR, Accelerators
from renderer.kernel import kernel
from renderer.math.vec import row
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
    names = np.array([info.name for info in scene.objects])
    shape = np.where(primitive >= 0, names[geometry.object[np.maximum(primitive, 0)]], "")
    return {"hit": primitive >= 0, "t": t, "n": out[:, :3], "s": out[:, 3:6], "uv": out[:, 9:], "shape": shape}


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
        records.append((si.is_valid(), si.t, n, s / max(np.linalg.norm(s), 1e-30), np.array(si.uv), si.shape.id() if si.shape else ""))
    hit, t, n, s, uv, shape = (np.array(column) for column in zip(*records, strict=True))
    return {"hit": hit, "t": t, "n": n, "s": s, "uv": uv, "shape": shape}


def compare(scene: Scene, n: int, seed: int, tangents: bool = True) -> None:
    """Assert that both programs find the same; rays that graze an edge may differ, at most one in two hundred."""
    bounds = [info.bounds for info in scene.objects]
    o, d = rays(np.min([b[0] for b in bounds], axis=0), np.max([b[1] for b in bounds], axis=0), n, seed)
    ours, theirs = our_hits(scene, o, d), mitsuba_hits(scene, o, d)
    both = ours["hit"] & theirs["hit"]
    assert both.mean() > 0.2, "too few rays meet anything"
    size = float(np.linalg.norm(np.max([b[1] for b in bounds], axis=0) - np.min([b[0] for b in bounds], axis=0)))
    same = both & (np.abs(ours["t"] - np.where(both, theirs["t"], 0)) < 1e-4 * size)
    assert (ours["hit"] == theirs["hit"]).mean() >= 0.995
    assert same.sum() >= 0.995 * both.sum()
    for key, tolerance in (("n", 2e-3), ("uv", 2e-3)) + ((("s", 2e-2),) if tangents else ()):
        error = np.abs(ours[key][same] - theirs[key][same]).max(axis=1)
        if key == "uv":  # the seam, where 0 and 1 are one place
            error = np.minimum(error, np.abs(error - 1))
        assert (error < tolerance).mean() >= 0.995, f"{key}: worst {error.max()}, {np.mean(error >= tolerance):.3f} differ"
