"""The accelerators agree with each other: a flat list, embree's tree, and quadrics among triangles."""

import numpy as np
import pytest

from renderer.accelerators import Accelerators
from renderer.math.vec import FAR
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene


def room(*, sphere: bool) -> Scene:
    shapes = {
        "floor": {"type": "rectangle", "to_world": [{"scale": [5, 5, 1]}]},
        "block": {"type": "cube", "to_world": [{"rotate": {"axis": [1, 2, 3], "angle": 40}}, {"translate": [0.3, 0.2, 2]}]},
        "light": {"type": "rectangle", "to_world": [{"translate": [0, 0, 6]}], "emitter": {"type": "area", "radiance": 1.0}},
    }
    if sphere:
        shapes["ball"] = {"type": "sphere", "center": [0.5, 0.5, 2.5], "radius": 1.0}
    sensor = {"type": "perspective", "to_world": [{"lookat": {"origin": [0, -8, 3], "target": [0, 0, 1], "up": [0, 0, 1]}}]}
    return load_scene({"type": "scene", "sensor": sensor, **shapes})


def rays(n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    o = rng.uniform((-3, -3, 0), (3, 3, 6), (n, 3))
    d = rng.normal(size=(n, 3))
    return o.astype(np.float32), (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)


@pytest.mark.parametrize("sphere", [False, True])
def test_flat_list_and_tree_agree(sphere: bool) -> None:
    scene = room(sphere=sphere)
    o, d = rays(20_001)
    found = []
    for limit in (0, 96):
        t = np.full(len(o), FAR, np.float32)
        accelerators = Accelerators(scene, flat_limit=limit)
        primitive = accelerators.closest(o, d, t)
        far = np.where(primitive >= 0, t, np.float32(10)) * np.float32(0.7)
        near = accelerators.occluded(o, d, far)
        beyond = accelerators.occluded(o, d, far * np.float32(2))
        found.append((primitive, t, near, beyond))
    (tree, tree_t, tree_near, tree_beyond), (flat, flat_t, flat_near, flat_beyond) = found
    # rays through an edge may go to either neighbor
    assert (tree != flat).mean() < 1e-3
    same = tree == flat
    np.testing.assert_allclose(flat_t[same], tree_t[same], rtol=2e-5, atol=2e-6)  # float32 rounding of coordinates up to 10
    assert len(np.unique(flat)) > 10
    assert (flat >= 0).mean() > 0.3
    assert (flat_near[same] == -1).all()
    assert (tree_near[same] == -1).all()
    assert (flat_beyond[same & (flat >= 0)] == 0).all()
    assert (tree_beyond[same & (flat >= 0)] == 0).all()


def test_triangles_hide_a_sphere_in_the_tree() -> None:
    # distances of triangles must be known when quadrics are asked
    scene = room(sphere=True)
    o = np.array([[0.3, 0.2, 10]], np.float32)
    d = np.array([[0, 0, -1]], np.float32)
    t = np.array([FAR])
    assert scene.arrays.geometry.object[Accelerators(scene, flat_limit=0).closest(o, d, t)[0]] == [x.name for x in scene.objects].index("light")
    assert t[0] == pytest.approx(4.0, rel=1e-6)
