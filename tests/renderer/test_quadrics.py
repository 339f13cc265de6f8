"""Exact spheres, disks and cylinders: hits and frames are Mitsuba's, far away and close up."""

import lights
import mitsuba as mi
import numpy as np
import pytest

from renderer.kernel import kernel
from renderer.shapes.base import CYLINDER, DISK, SPHERE, Geometry, Quadrics
from renderer.shapes.bounds import quadric_offsets
from renderer.shapes.quadrics import intersect_quadrics, occluded_quadrics
from renderer.shapes.surface import offset_point, surface, surface_at

F32 = np.float32
KINDS = {"sphere": SPHERE, "disk": DISK, "cylinder": CYLINDER}
TURN = lights.rotation((1, 2, 3), 70)
PLACES = {
    "sphere": lights.affine(TURN * 1.5, (0.4, -0.3, 0.8)),
    "disk": lights.affine(TURN @ np.diag([1.5, 0.8, 1.0]), (0.4, -0.3, 0.8)),
    "cylinder": lights.affine(TURN @ np.diag([0.7, 0.7, 2.0]), (0.4, -0.3, 0.8)),
}
NONE = 1_000_000  # an id that no quadric has
SHIFT = 5  # number of triangles before the quadrics


def geometry(matrices, kinds, flips) -> Geometry:
    m = np.stack(matrices)
    quadrics = Quadrics(
        np.array(kinds, np.int32), np.ascontiguousarray(m[:, :3]), np.ascontiguousarray(np.linalg.inv(m)[:, :3]), np.array(flips, np.uint8)
    )
    empty = np.zeros((SHIFT, 3), F32)
    offset = np.concatenate([np.zeros(SHIFT, F32), quadric_offsets(quadrics.to_world)])
    return Geometry(empty, empty, empty, empty, offset, np.arange(SHIFT + len(kinds), dtype=np.int32), None, None, quadrics)


def rays(n, seed, reach=4.0, target=1.2):
    """Rays (n, 3) from around toward the shapes, of various lengths of d."""
    rng = np.random.default_rng(seed)
    o = rng.normal(size=(n, 3)) * reach
    d = np.array([0.4, -0.3, 0.8]) + rng.normal(size=(n, 3)) * target - o
    return o.astype(F32), (d * rng.uniform(0.2, 1.5, (n, 1))).astype(F32)


def trace(g, o, d, far=np.inf):
    t, primitive = np.full(len(o), far, F32), np.full(len(o), NONE, np.int32)
    intersect_quadrics(g.quadrics, SHIFT, o, d, t, primitive, len(o))
    return t, primitive


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_hits_and_frames_are_mitsubas(kind, flip):
    mi.set_variant("scalar_rgb")
    shape = {"type": kind, "to_world": mi.ScalarTransform4f(PLACES[kind]), "flip_normals": flip}
    scene = mi.load_dict({"type": "scene", "shape": shape})
    g = geometry([PLACES[kind]], [KINDS[kind]], [flip])
    o, d = rays(400, seed=1)
    t, primitive = trace(g, o, d)
    hits = 0
    for k in range(len(o)):
        si = scene.ray_intersect(mi.Ray3f(o[k], d[k]))
        assert si.is_valid() == (primitive[k] == SHIFT)
        if not si.is_valid():
            continue
        hits += 1
        hit = surface(g, SHIFT, tuple(o[k]), tuple(d[k]), t[k])
        assert np.isclose(t[k], si.t, rtol=1e-5, atol=2e-6)
        assert np.allclose(hit.p, si.p, atol=2e-5)
        assert np.allclose(hit.ng, si.n, atol=2e-5)
        assert np.allclose(hit.n, si.sh_frame.n, atol=2e-5)
        assert np.allclose(np.array((hit.u, hit.v)) - si.uv, 0, atol=2e-5)
        tangent = np.array(si.dp_du) / np.linalg.norm(si.dp_du)
        tangent -= (tangent @ np.array(si.sh_frame.n)) * np.array(si.sh_frame.n)
        assert np.allclose(hit.s, tangent / np.linalg.norm(tangent), atol=1e-4)
        assert np.allclose(np.cross(hit.n, hit.s), hit.t, atol=1e-6)
        assert surface_at(g, SHIFT, F32(hit.b1), F32(hit.b2)) == hit
    assert hits > 60


def test_nearest_of_many_and_far_ends():
    g = geometry(list(PLACES.values()), list(KINDS.values()), [0, 0, 0])
    o, d = rays(2000, seed=2)
    t, primitive = trace(g, o, d)
    alone = np.stack([trace(geometry([PLACES[k]], [KINDS[k]], [0]), o, d)[0] for k in KINDS])
    assert np.array_equal(t, alone.min(axis=0))
    found = np.isfinite(t)
    assert np.array_equal(primitive[found], SHIFT + alone.argmin(axis=0)[found])
    assert (primitive[~found] == NONE).all()
    assert set(primitive[found]) == {SHIFT, SHIFT + 1, SHIFT + 2}

    # What lies nearer already stays, and only what lies within tfar blocks
    nearer, kept = np.where(found, t * F32(0.9), 1).astype(F32), np.full(len(o), 3, np.int32)
    intersect_quadrics(g.quadrics, SHIFT, o, d, nearer, kept, len(o))
    assert (kept[found] == 3).all()
    for factor, expected in ((F32(1.01), 0), (F32(0.99), -1)):
        blocked = np.full(len(o), -1, np.int32)
        occluded_quadrics(g.quadrics, SHIFT, o, d, np.where(found, t * factor, F32(1e30)).astype(F32), blocked, len(o))
        assert (blocked[found] == expected).all()
        assert (blocked[~found] == -1).all()


def test_only_the_first_n_rays_and_never_frees():
    g = geometry([PLACES["sphere"]], [SPHERE], [0])
    o, d = np.tile(F32([0.4, -0.3, 9]), (4, 1)), np.tile(F32([0, 0, -1]), (4, 1))
    blocked = np.array([-1, 0, -1, -1], np.int32)
    occluded_quadrics(g.quadrics, SHIFT, o, d, np.array([100, 1, 1, 100], F32), blocked, 3)
    assert blocked.tolist() == [0, 0, -1, -1]


def test_far_sphere_is_exact():
    """The textbook discriminant in float32 is off by several radii here."""
    m = lights.affine(np.eye(3) * 0.5, (1e5, 2e4, -3e4))
    g = geometry([m], [SPHERE], [0])
    rng = np.random.default_rng(3)
    inside = rng.normal(size=(500, 3))
    target = m[:3, 3] + 0.3 * inside / np.linalg.norm(inside, axis=1, keepdims=True)
    o = np.zeros((500, 3), F32)
    t, primitive = trace(g, o, (target / np.linalg.norm(target, axis=1, keepdims=True)).astype(F32))
    # the direction's own rounding moves the ray by 1e-2 at this distance
    assert (primitive == SHIFT).all()
    assert np.abs(t - np.linalg.norm(m[:3, 3])).max() < 0.52


@kernel
def spawn(geometry, primitive, o, d, t, w, out_o, out_p, out_offset):
    for i in range(len(o)):
        hit = surface(geometry, primitive, (o[i, 0], o[i, 1], o[i, 2]), (d[i, 0], d[i, 1], d[i, 2]), t[i])
        q = offset_point(hit.p, hit.ng, hit.offset, (w[i, 0], w[i, 1], w[i, 2]))
        out_offset[i] = hit.offset
        for k in range(3):
            out_o[i, k] = q[k]
            out_p[i, k] = hit.p[k]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("away", [0.0, 100.0])
def test_spawned_rays_leave_the_surface(kind, scale, away):
    """To the outside never the same surface again; to the inside no hit at the start."""
    place = PLACES[kind].copy()
    place[:3] *= scale
    place[:3, 3] += away * scale
    g = geometry([place], [KINDS[kind]], [0])
    o, d = rays(20_000, seed=4)
    o = (o.astype(float) * scale + away * scale).astype(F32)
    t, primitive = trace(g, o, d)
    hit = primitive == SHIFT
    o, d, t = o[hit], d[hit], t[hit]
    w = np.random.default_rng(5).normal(size=o.shape).astype(F32)
    start, p, offset = np.zeros_like(o), np.zeros_like(o), np.zeros(len(o), F32)
    spawn(g, SHIFT, o, d, t, w, start, p, offset)
    again, _ = trace(g, start, w)
    assert offset.max() < 1e-5 * (np.abs(p).max() + scale)
    local = (p - place[:3, 3]) @ np.linalg.inv(place[:3, :3]).T
    normal = local * ([1, 1, 0] if kind == "cylinder" else [1, 1, 1]) if kind != "disk" else np.tile([0.0, 0, 1], (len(p), 1))
    normal = normal @ np.linalg.inv(place[:3, :3])
    cos = (normal * w).sum(axis=1) / np.linalg.norm(normal, axis=1) / np.linalg.norm(w, axis=1)
    outward = cos > 1e-4 if kind != "disk" else np.abs(cos) > 1e-4
    assert outward.sum() > 1000
    assert np.isinf(again[outward]).all()
    if kind == "sphere":
        inward = cos < -1e-3
        length = again[inward] * np.linalg.norm(w[inward], axis=1)
        # Moving the start by the offset, or by the rounding that it bounds, moves the far end by that over the cosine
        assert (np.abs(length + 3 * scale * cos[inward]) < 2 * offset.max() / -cos[inward] + 1e-5 * scale).all()
