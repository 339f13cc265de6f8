"""Emitters: samples follow their densities, and carry the light that closed forms say."""

import lights
import mitsuba as mi
import numpy as np
import pytest
import scipy.integrate
import scipy.stats
from chi2 import Chart, chi_square_p_value, significance

from renderer.emitters.base import BEAM, CUTOFF, Emitters
from renderer.emitters.delta import sample_delta_direction
from renderer.emitters.dispatch import (
    emission_toward,
    emitted,
    pdf_direction,
    sample_direction,
    sample_emission,
    select_emitter,
    sky_pdf,
    sky_radiance,
)
from renderer.emitters.envmap import build_environment
from renderer.errors import SceneError
from renderer.kernel import kernel
from renderer.math.vec import cross, dot, row, sub
from renderer.scene.load import load_scene
from renderer.shapes.quadrics import intersect_quadric
from renderer.shapes.surface import surface

F32 = np.float32
EMITTERS, GEOMETRY = lights.build()
SKY_EMITTERS, _ = lights.build(environment=True)
COUNT = len(lights.ROWS)
AREA = ("rectangle", "mesh", "sphere", "disk", "cylinder", "inside")
SMOOTH = (*AREA, "constant", "envmap")
P = np.array([0.25, -0.15, 0.1], F32)  # inside the sphere "inside", outside all else
N = np.array([0.1, -0.2, 1.0]) / np.linalg.norm([0.1, -0.2, 1.0])
ALL = (*lights.ROWS, "envmap")
Z_LIMIT = scipy.stats.norm.isf(significance(3 * len(ALL)) / 2)


def table(kind: str) -> Emitters:
    return SKY_EMITTERS if kind == "envmap" else EMITTERS


def select(kind: str) -> np.float32:
    """The random number that chooses the kind's row."""
    return F32((lights.ROWS.index("constant" if kind == "envmap" else kind) + 0.5) / COUNT)


@kernel
def directions(emitters, geometry, p, choice, uv, d, weight, scalars):
    """scalars: pdf, distance, distance of the endpoint from p + distance d."""
    for i in range(len(uv)):
        q = (p[i, 0], p[i, 1], p[i, 2])
        s = sample_direction(emitters, geometry, None, q, choice, uv[i, 0], uv[i, 1])
        scalars[i, 0] = s.pdf
        scalars[i, 1] = s.distance
        scalars[i, 2] = s.emitter
        for k in range(3):
            d[i, k] = s.d[k]
            weight[i, k] = s.weight[k]


@kernel
def first_hit(geometry, first, count, o, d):
    """The nearest of some primitives along a ray, by brute force."""
    best = np.inf
    found = -1
    nt = geometry.p0.shape[0]
    for primitive in range(first, first + count):
        t = np.inf
        if primitive >= nt:
            t = intersect_quadric(geometry.quadrics, primitive - nt, o, d)
        else:
            e1 = row(geometry.e1, primitive)
            e2 = row(geometry.e2, primitive)
            h = cross(d, e2)
            r = sub(o, row(geometry.p0, primitive))
            inverse = 1 / dot(e1, h)
            u = dot(r, h) * inverse
            q = cross(r, e1)
            v = dot(d, q) * inverse
            distance = dot(e2, q) * inverse
            if u >= 0 and v >= 0 and u + v <= 1 and distance > 0:
                t = distance
        if t < best:
            best = t
            found = primitive
    return np.float32(best), found


@kernel
def densities(emitters, geometry, emitter, p, d, out):
    o = (p[0], p[1], p[2])
    for i in range(len(d)):
        w = (d[i, 0], d[i, 1], d[i, 2])
        if emitter == emitters.infinite:
            out[i] = sky_pdf(emitters, w)
        else:
            t, primitive = first_hit(geometry, emitters.primitive[emitter, 0], emitters.primitive[emitter, 1], o, w)
            out[i] = 0
            if primitive >= 0:
                hit = surface(geometry, primitive, o, w, t)
                out[i] = pdf_direction(emitters, geometry, emitter, o, w, t, -dot(w, hit.ng), primitive)


@kernel
def emissions(emitters, geometry, choice, u, point, normal, d, radiance, weight):
    for i in range(len(u)):
        s = sample_emission(emitters, geometry, None, choice, u[i, 0], u[i, 1], u[i, 2], u[i, 3])
        for k in range(3):
            point[i, k] = s.point[k]
            normal[i, k] = s.normal[k]
            d[i, k] = s.d[k]
            radiance[i, k] = s.radiance[k]
            weight[i, k] = s.weight[k]


@kernel
def toward(emitters, geometry, choice, u, target, n, out):
    """Irradiance at a target, by connecting emission samples with it."""
    for i in range(len(u)):
        s = sample_emission(emitters, geometry, None, choice, u[i, 0], u[i, 1], u[i, 2], u[i, 3])
        away = sub(target, s.point)
        squared = dot(away, away)
        distance = np.sqrt(squared)
        w = (away[0] / distance, away[1] / distance, away[2] / distance)
        out[i] = emission_toward(emitters, None, s, w)[0] * max(np.float32(0), -dot(n, w)) / squared


def draw(kind, n, seed, p=P):
    uv = np.random.default_rng(seed).random((n, 2), F32)
    d, weight, scalars = np.zeros((n, 3), F32), np.zeros((n, 3), F32), np.zeros((n, 3), F32)
    points = np.broadcast_to(np.asarray(p, F32), (n, 3)).copy()
    directions(table(kind), GEOMETRY, points, select(kind), uv, d, weight, scalars)
    return d, weight, scalars[:, 0], scalars[:, 1]


def emit(kind, n, seed):
    u = np.random.default_rng(seed).random((n, 4), F32)
    out = [np.zeros((n, 3), F32) for _ in range(5)]
    emissions(table(kind), GEOMETRY, select(kind), u, *out)
    return out


def density(kind, d):
    """Density of the kind's directions, the choice of the emitter taken out."""
    out = np.zeros(len(d), F32)
    densities(table(kind), GEOMETRY, np.int32(int(select(kind) * COUNT)), P, np.ascontiguousarray(d, F32), out)
    return out.astype(float) * COUNT


def z_score(values, expected):
    values = np.asarray(values, float)
    return (values.mean() - expected) / max(values.std() / np.sqrt(len(values)), 1e-6 * abs(expected))


# ---- sample_direction ----


@pytest.mark.parametrize("kind", SMOOTH)
def test_directions_follow_their_density(kind):
    n = 40_000
    d, _, pdf, _ = draw(kind, n, seed=1)
    # a fine quadrature, since silhouettes cut cells
    p = chi_square_p_value(d[pdf > 0], n, lambda w: density(kind, w), Chart(16, 24), order=96)
    assert p > significance(len(SMOOTH))


@pytest.mark.parametrize("kind", SMOOTH)
def test_pdf_direction_is_the_density_of_the_sample(kind):
    d, _, pdf, _ = draw(kind, 5000, seed=2)
    d, pdf = d[pdf > 0], pdf[pdf > 0] * COUNT
    again = density(kind, d)
    # A sample on the very rim of a shape may miss it, or land in the next cell of a map, by rounding
    close = np.abs(again / pdf - 1) < 2e-3
    assert close.mean() > 0.995


def lambert(vertices):
    """Irradiance at P, normal N, of a polygon above the horizon with radiance 1 (lambert1760)."""
    r = vertices - P
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(r, np.roll(r, -1, axis=0)):
        axis = np.cross(a, b)
        total += np.arccos(np.clip(a @ b, -1, 1)) * (N @ axis) / np.linalg.norm(axis)
    return abs(total) / 2


def by_area(name, nu=400, nv=400):
    """Irradiance at P of a disk or cylinder by quadrature over its area, hidden sides left out."""
    _, m, _ = lights.QUADRICS[name]
    u, v = np.meshgrid((np.arange(nu) + 0.5) / nu, (np.arange(nv) + 0.5) / nv)
    c, s = np.cos(2 * np.pi * v), np.sin(2 * np.pi * v)
    if name == "disk":
        local, normal = np.stack([np.sqrt(u) * c, np.sqrt(u) * s, 0 * u], -1), np.broadcast_to([0.0, 0, 1], (*u.shape, 3))
    else:
        local, normal = np.stack([c, s, u], -1), np.stack([c, s, 0 * u], -1)
    x, n = local @ m[:3, :3].T + m[:3, 3], normal @ np.linalg.inv(m[:3, :3])
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    to = x - P
    r2 = (to**2).sum(-1)
    cosines = np.maximum(0, -(n * to).sum(-1)) * np.maximum(0, to @ N) / r2
    area = EMITTERS.scalar[lights.ROWS.index(name), 0]
    return float((cosines / r2).mean() * area)


def sky_quadrature(n=700):
    """Directions and weights over the sphere, and the map's radiance there, first channel."""
    z, phi = np.meshgrid(-1 + 2 * (np.arange(n) + 0.5) / n, 2 * np.pi * (np.arange(n) + 0.5) / n)
    d = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], -1).reshape(-1, 3)
    out = np.zeros((len(d), 3), F32)
    radiances(SKY_EMITTERS, d.astype(F32), out)
    return d, 4 * np.pi / len(d), out[:, 0].astype(float)


@kernel
def radiances(emitters, d, out):
    for i in range(len(d)):
        c = sky_radiance(emitters, (d[i, 0], d[i, 1], d[i, 2]))
        for k in range(3):
            out[i, k] = c[k]


def spot_falloff(cos):
    angle = np.arccos(np.clip(cos, -1, 1))
    cutoff, beam = np.radians(40), np.radians(25)
    return np.clip((cutoff - angle) / (cutoff - beam), 0, 1)


def irradiance(kind):
    """What arrives at P on a surface with normal N, of radiance (intensity, irradiance) 1."""
    frame = EMITTERS.frame[lights.ROWS.index("spot")].reshape(3, 4)
    to = frame[:, 3] - P
    r = np.linalg.norm(to)
    if kind == "rectangle":
        c, a, b = lights.RECTANGLE
        return lambert(np.array([c, c + a, c + a + b, c + b]))
    if kind == "mesh":
        triangles = lights.CORNERS[lights.FACES]
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        return sum(lambert(t) for t, n in zip(triangles, normals) if n @ (P - t[0]) > 0)
    if kind == "sphere":
        to = lights.QUADRICS["sphere"][1][:3, 3] - P
        return np.pi * 0.81 / (to @ to) * (to @ N) / np.linalg.norm(to)
    if kind in ("disk", "cylinder"):
        return by_area(kind)
    if kind in ("inside", "constant"):
        return np.pi
    if kind == "point":
        return to @ N / r**3
    if kind == "spot":
        return to @ N / r**3 * spot_falloff(-(to / r) @ frame[:, 2])
    if kind == "directional":
        return -frame[:, 2] @ N
    d, weight, radiance = sky_quadrature()
    return float((radiance * np.maximum(0, d @ N)).sum() * weight)


@pytest.mark.parametrize("kind", ALL)
def test_irradiance_is_the_closed_form(kind):
    d, weight, _, _ = draw(kind, 100_000, seed=3)
    values = weight * np.maximum(0, d @ N.astype(F32))[:, None] / COUNT
    expected = irradiance(kind)
    assert expected > 0.01
    for channel, radiance in enumerate(lights.RADIANCE if kind != "envmap" else lights.RADIANCE[:1]):
        scale = 1.0 if kind == "envmap" else radiance
        # the quadratures are good to 1e-4
        assert abs(z_score(values[:, channel], expected * scale)) < Z_LIMIT or np.isclose(values[:, channel].mean(), expected * scale, rtol=1e-4)


def test_delta_lights_have_no_density():
    for kind in ("point", "spot", "directional"):
        _, weight, pdf, _ = draw(kind, 10, seed=4)
        assert (pdf == 0).all()
        assert (weight > 0).all()


def test_nothing_behind_a_light():
    """Above the rectangle, which shines down."""
    _, weight, pdf, _ = draw("rectangle", 100, seed=5, p=(0.0, 0.0, 9.0))
    assert (weight == 0).all()
    assert (pdf == 0).all()


def test_small_far_sphere_keeps_its_light():
    """Cancellation in 1 - cos of a narrow cone would show here."""
    away = np.array([0, 0, -4000.0])
    _, weight, pdf, _ = draw("sphere", 1000, seed=6, p=away)
    squared = ((lights.QUADRICS["sphere"][1][:3, 3] - away) ** 2).sum()
    assert np.allclose(weight[pdf > 0, 0] / COUNT, np.pi * 0.81 / squared, rtol=1e-3)
    assert (pdf > 0).mean() > 0.99


def test_every_emitter_is_chosen_equally():
    for k in range(1000):
        assert select_emitter(EMITTERS, F32(k / 1000))[0] == int(F32(k / 1000) * F32(COUNT))
    emitter, probability = select_emitter(EMITTERS, np.nextafter(F32(1), F32(0)))
    assert emitter == COUNT - 1
    assert probability == F32(1 / COUNT)


# ---- sample_emission ----


def power(kind):
    """Flux of radiance (intensity, irradiance) 1."""
    disk = np.pi * lights.RADIUS**2
    if kind in AREA:
        return np.pi * EMITTERS.scalar[lights.ROWS.index(kind), 0]
    if kind == "point":
        return 4 * np.pi
    if kind == "spot":
        low, middle = 1 - EMITTERS.scalar[7, [CUTOFF, BEAM]].astype(float)
        return 2 * np.pi * (scipy.integrate.quad(spot_falloff, low, middle)[0] + 1 - middle)
    if kind == "directional":
        return disk
    if kind == "constant":
        return 4 * np.pi * disk
    _, weight, radiance = sky_quadrature()
    return radiance.sum() * weight * disk


@pytest.mark.parametrize("kind", ALL)
def test_emission_carries_the_power(kind):
    *_, weight = emit(kind, 100_000, seed=8)
    assert np.isfinite(weight).all()
    expected = power(kind)
    values = weight[:, 0] / COUNT
    assert abs(z_score(values, expected)) < Z_LIMIT or np.isclose(values.mean(), expected, rtol=1e-4)


@pytest.mark.parametrize("kind", ALL)
def test_emission_lights_a_patch_as_directions_do(kind):
    """Light walks that meet a patch carry what the patch's points ask the emitters for: all densities at once."""
    n = 400_000
    s = np.cross(N, [1.0, 0, 0])
    s /= np.linalg.norm(s)
    t = np.cross(N, s)
    half = 0.4
    point, _, d, _, weight = (a.astype(float) for a in emit(kind, n, seed=9))
    cos = d @ N
    with np.errstate(divide="ignore", invalid="ignore"):
        along = ((P - point) @ N) / cos
        x = point + along[:, None] * d - P
    inside = (cos < 0) & (along > 0) & (np.abs(x @ s) < half) & (np.abs(x @ t) < half)
    light = np.where(inside, weight[:, 0], 0) / COUNT

    uv = np.random.default_rng(10).uniform(-half, half, (n // 4, 2))
    points = P + uv[:, :1] * s + uv[:, 1:] * t
    w, carried, _, _ = draw(kind, n // 4, seed=11, p=points)
    camera = carried[:, 0] * np.maximum(0, w @ N) / COUNT * (2 * half) ** 2
    error = np.hypot(light.std() / np.sqrt(n), camera.std() / np.sqrt(n // 4))
    assert inside.sum() > 300
    assert abs(light.mean() - camera.mean()) < Z_LIMIT * error


@pytest.mark.parametrize("kind", ALL)
def test_connections_of_emission_light_a_point_as_directions_do(kind):
    n = 100_000
    u = np.random.default_rng(12).random((n, 4), F32)
    out = np.zeros(n, F32)
    target = (F32(P[0]), F32(P[1]), F32(P[2]))
    toward(table(kind), GEOMETRY, select(kind), u, target, tuple(N.astype(F32)), out)
    if kind in ("directional", "constant", "envmap"):
        assert (out == 0).all()
    else:
        expected = irradiance(kind)
        assert abs(z_score(out / COUNT, expected)) < Z_LIMIT or np.isclose(out.mean() / COUNT, expected, rtol=1e-4)


@pytest.mark.parametrize("kind", AREA)
def test_emission_leaves_by_the_cosine(kind):
    _, normal, d, _, _ = emit(kind, 20_000, seed=13)
    cos = (normal * d).sum(axis=1)
    assert cos.min() > -1e-6
    assert scipy.stats.kstest(np.clip(cos, 0, 1) ** 2, "uniform").pvalue > significance(len(AREA))


# ---- the sky ----


def test_sky_density_integrates_to_one():
    d, weight, _ = sky_quadrature(1000)
    assert np.isclose(density("envmap", d).sum() * weight, 1, rtol=1e-3)


def test_sky_radiance_and_density_are_mitsubas():
    mi.set_variant("scalar_rgb")
    height, width = 60, 128
    j, i = np.mgrid[:height, :width]
    smooth = 1.5 + np.sin(2 * np.pi * (i + 0.5) / width) * np.sin(np.pi * j / (height - 1)) + 0.5 * np.cos(np.pi * j / (height - 1))
    pixels = (smooth[..., None] * [1.0, 0.7, 0.4]).astype(F32)
    turn = lights.rotation((0.3, 1, 0.2), 50)
    ours = SKY_EMITTERS._replace(environment=build_environment(pixels, turn), rgb=np.ones_like(SKY_EMITTERS.rgb))
    theirs = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(pixels), "to_world": mi.ScalarTransform4f(lights.affine(turn, (0, 0, 0)))})
    d = np.random.default_rng(14).normal(size=(300, 3))
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(F32)
    radiance, pdf = np.zeros((300, 3), F32), np.zeros(300, F32)
    radiances(ours, d, radiance)
    densities(ours, GEOMETRY, ours.infinite, P, d, pdf)
    for k in range(300):
        si, ds = mi.SurfaceInteraction3f(), mi.DirectionSample3f()
        si.wi, ds.d = mi.Vector3f(-d[k]), mi.Vector3f(d[k])
        assert np.allclose(radiance[k], theirs.eval(si), rtol=1e-4)
        # theirs varies within a cell: the difference falls with the cell's size
        if abs(turn.T[1] @ d[k]) < 0.95:
            assert np.isclose(pdf[k] * COUNT, theirs.pdf_direction(mi.Interaction3f(), ds), rtol=0.08)


@pytest.mark.parametrize(
    ("pixels", "word"),
    [(np.ones((2, 4, 3), F32), "at least"), (np.zeros((4, 4, 3), F32), "black"), (-np.ones((4, 4, 3), F32), "negative"),
     (np.full((4, 4, 3), np.nan, F32), "finite")],
)  # fmt: skip
def test_bad_maps_are_refused(pixels, word):
    with pytest.raises(SceneError, match=word):
        build_environment(pixels, np.eye(3))


# ---- pruning ----


def test_a_scene_of_rectangles_needs_nothing_else():
    only = EMITTERS._replace(curved=None, delta=None, sky=None, cdf=None, environment=None, infinite=np.int32(-1))
    geometry = GEOMETRY._replace(quadrics=None)
    args = (tuple(P), F32(0.05), F32(0.3), F32(0.6))
    assert sample_direction(only, geometry, None, *args) == sample_direction(EMITTERS, GEOMETRY, None, *args)
    assert sky_radiance(only, (F32(0), F32(0), F32(1))) == (0, 0, 0)
    assert sky_pdf(only, (F32(0), F32(0), F32(1))) == 0
    assert emitted(only, None, 0, F32(0.2), F32(0.2)) == tuple(lights.RADIANCE)


@pytest.mark.parametrize("cutoff", [0.005, 0.1, 5.0])
def test_narrow_spots_keep_their_flux(cutoff: float) -> None:
    # a cone's solid angle is 2 pi (1 - cos): float32 cosines would lose it
    spot = {"type": "spot", "cutoff_angle": cutoff, "beam_width": 0.0, "intensity": 1.0}
    sensor = {"type": "perspective"}
    scene = load_scene({"type": "scene", "sensor": sensor, "spot": spot, "floor": {"type": "rectangle"}}).arrays
    u, v = np.random.default_rng(1).random((2, 4096)).astype(np.float32)
    weights = np.array([sample_delta_direction(True, scene.emitters, 0, a, b)[1][0] for a, b in zip(u, v)])
    edge = np.radians(cutoff)
    flux = 2 * np.pi * scipy.integrate.quad(lambda angle: (1 - angle / edge) * np.sin(angle), 0, edge)[0]
    assert abs(weights.mean() - flux) < 4 * weights.std() / np.sqrt(len(weights))
    assert weights.mean() > 0.9 * flux
