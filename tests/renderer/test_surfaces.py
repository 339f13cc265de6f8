"""Points of triangles: Mitsuba's frames, rebuilt from their parameters, and rays that leave without meeting them again."""

import mitsuba as mi
import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from renderer.kernel import kernel
from renderer.shapes.base import Geometry
from renderer.shapes.bounds import triangle_offsets
from renderer.shapes.surface import offset_point, surface, surface_at

F32 = np.float32


def geometry(corners, normals=None, uvs=None) -> Geometry:
    """Triangles (n, 3, 3) float32."""
    p0, e1, e2 = corners[:, 0].copy(), corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ng = np.cross(e1.astype(float), e2.astype(float))
    ng /= np.linalg.norm(ng, axis=1, keepdims=True)
    return Geometry(p0, e1, e2, ng.astype(F32), triangle_offsets(p0, e1, e2), np.zeros(len(p0), np.int32), normals, uvs, None)


def test_frames_are_mitsubas():
    """A mesh with vertex normals and texture coordinates."""
    mi.set_variant("scalar_rgb")
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(6, 3, 3)).astype(F32)
    flat = geometry(corners)
    normals = flat.ng[:, None] + 0.4 * rng.normal(size=(6, 3, 3))
    normals = (normals / np.linalg.norm(normals, axis=2, keepdims=True)).astype(F32)
    uvs = rng.random((6, 3, 2)).astype(F32)
    g = geometry(corners, normals, uvs)
    for k in range(6):
        mesh = mi.Mesh("triangle", 3, 1, has_vertex_normals=True, has_vertex_texcoords=True)
        params = mi.traverse(mesh)
        params["vertex_positions"], params["vertex_normals"] = corners[k].ravel(), normals[k].ravel()
        params["vertex_texcoords"], params["faces"] = uvs[k].ravel(), [0, 1, 2]
        params.update()
        scene = mi.load_dict({"type": "scene", "mesh": mesh})
        for a, b in rng.random((20, 2)):
            b1, b2 = (a, b) if a + b < 1 else (1 - a, 1 - b)
            target = corners[k, 0] + b1 * g.e1[k] + b2 * g.e2[k]
            o = (target + 2 * rng.normal(size=3)).astype(F32)
            d = ((target - o) / np.linalg.norm(target - o)).astype(F32)
            if abs(d @ g.ng[k]) < 0.1 or not 0.01 < b1 < 0.98 - b2 or b2 < 0.01:
                continue
            si = scene.ray_intersect(mi.Ray3f(o, d))
            hit = surface(g, k, tuple(o), tuple(d), F32(si.t))
            assert np.allclose((hit.b1, hit.b2), (b1, b2), atol=2e-5)
            assert np.allclose(hit.p, si.p, atol=2e-5)
            assert np.allclose(hit.ng, si.n, atol=2e-5)
            assert np.allclose(hit.n, si.sh_frame.n, atol=5e-5)
            assert np.allclose((hit.u, hit.v), si.uv, atol=2e-5)
            assert np.allclose(hit.s, si.sh_frame.s, atol=2e-4)
            assert np.allclose(hit.t, si.sh_frame.t, atol=2e-4)
            assert surface_at(g, k, F32(hit.b1), F32(hit.b2)) == hit


def test_flat_untextured_triangles():
    g = geometry(np.random.default_rng(2).normal(size=(1, 3, 3)).astype(F32))
    hit = surface_at(g, 0, F32(0.2), F32(0.3))
    assert hit.n == hit.ng
    assert np.allclose(np.array([hit.s, hit.t, hit.n]) @ np.array([hit.s, hit.t, hit.n]).T, np.eye(3), atol=1e-6)
    assert (hit.u, hit.v) == (F32(0.2), F32(0.3))


def test_parameters_stay_inside_the_triangle():
    g = geometry(np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], F32))
    for x, y in ((-0.1, 0.5), (0.5, -0.1), (0.8, 0.8), (2.0, 0.0)):
        hit = surface(g, 0, (F32(x), F32(y), F32(1)), (F32(0), F32(0), F32(-1)), F32(1))
        assert hit.b1 >= 0
        assert hit.b2 >= 0
        assert hit.b1 + hit.b2 <= 1
    along = surface(g, 0, (F32(0), F32(0), F32(0)), (F32(1), F32(0), F32(0)), F32(0))
    assert np.isfinite(along.p).all()


@kernel
def spawn(geometry, primitive, o, d, t, w, out):
    for i in range(len(o)):
        hit = surface(geometry, primitive[i], (o[i, 0], o[i, 1], o[i, 2]), (d[i, 0], d[i, 1], d[i, 2]), t[i])
        q = offset_point(hit.p, hit.ng, hit.offset, (w[i, 0], w[i, 1], w[i, 2]))
        for k in range(3):
            out[i, k] = q[k]


def unit(a):
    return a / np.linalg.norm(a, axis=1, keepdims=True)


@pytest.mark.parametrize("grazing", [False, True])
@pytest.mark.parametrize(("size", "away"), [(1e-4, 0), (1e-2, 10), (1.0, 0), (1.0, 1.0), (1.0, 1e3), (30.0, 1e5), (1e4, 0), (1e4, 1e4)])
def test_spawned_rays_never_meet_their_own_triangle(size, away, grazing):
    rng = np.random.default_rng(3)
    per, count = 4000, 12
    for _ in range(count):
        corners = (rng.normal(size=(1, 3, 3)) * size + unit(rng.normal(size=(1, 3)))[:, None] * away).astype(F32)
        g = geometry(corners)
        scene = EmbreeScene()
        TriangleMesh(scene, corners[0].copy(), np.array([[0, 1, 2]], np.int32))
        assert g.offset[0] > 0
        slim = np.linalg.norm(np.cross(g.e1[0].astype(float), g.e2[0])) / max(np.linalg.norm(g.e1[0]), np.linalg.norm(g.e2[0])) ** 2
        assert g.offset[0] < 1e-5 * (np.linalg.norm(corners[0], axis=1).max() + size) / min(1.0, 3 * slim)

        # Rays that meet the triangle from all around
        b = rng.dirichlet([1, 1, 1], per)
        target = b @ corners[0].astype(float)
        o = (target + unit(rng.normal(size=(per, 3))) * size * 10 ** rng.uniform(-2, 2, (per, 1))).astype(F32)
        d = unit(target - o).astype(F32)
        t = np.full(per, 1e30, F32)
        primitive = scene.run(o, d, dists=t, query="INTERSECT")
        met = primitive == 0
        assert met.sum() > per / 2

        # New rays to both sides, some almost along the surface
        w = rng.normal(size=(per, 3))
        if grazing:
            n = g.ng[0].astype(float)
            w = w - (w @ n)[:, None] * n + n * (10 ** rng.uniform(-9, -2, (per, 1)) * rng.choice([-1, 1], (per, 1)))
        w = unit(w).astype(F32)
        start = np.zeros((per, 3), F32)
        spawn(g, np.zeros(per, np.int32), o, d, t, w, start)
        again = scene.run(start, w, dists=np.full(per, 1e30, F32), query="INTERSECT")
        assert (again[met] == -1).all()
