"""Cameras: rays are Mitsuba's, and importance is the dual of rays."""

import mitsuba as mi
import numpy as np
import pytest

from renderer.kernel import kernel
from renderer.sensors.base import Sensor
from renderer.sensors.dispatch import clip_distance, sample_lens, sample_ray

F32 = np.float32
WIDTH, HEIGHT = 48, 32
NEAR, FAR = 0.3, 60.0


def placement() -> np.ndarray:
    """A rigid camera-to-world matrix, (4, 4)."""
    m = mi.ScalarTransform4f().look_at(origin=[1.0, -2.0, 3.0], target=[0.2, 0.3, 0.5], up=[0.1, 0.2, 1.0])
    return np.array(m.matrix)


def camera(tan_x=0.5, shift=(0.0, 0.0), lens_radius=None, focus=None) -> Sensor:
    mi.set_variant("scalar_rgb")
    to_world = placement()
    return Sensor(
        to_world[:3].astype(F32), np.linalg.inv(to_world)[:3].astype(F32), F32(tan_x), F32(tan_x * HEIGHT / WIDTH), F32(shift[0]), F32(shift[1]),
        np.int32(WIDTH), np.int32(HEIGHT), F32(NEAR), F32(FAR),
        None if lens_radius is None else F32(lens_radius), None if focus is None else F32(focus),
    )  # fmt: skip


def vector(a):
    return tuple(F32(x) for x in a)


AXES = {  # tangent of half the horizontal angle for a 50 degree field along each axis
    "x": np.tan(np.radians(25)),
    "y": np.tan(np.radians(25)) * WIDTH / HEIGHT,
    "diagonal": np.tan(np.radians(25)) * WIDTH / np.hypot(WIDTH, HEIGHT),
}


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.1, -0.07)])
def test_pinhole_rays_are_mitsubas(axis, shift):
    sensor = camera(AXES[axis], shift)
    theirs = mi.load_dict({
        "type": "perspective", "fov": 50, "fov_axis": axis, "near_clip": NEAR, "far_clip": FAR,
        "to_world": mi.ScalarTransform4f(placement()), "principal_point_offset_x": shift[0], "principal_point_offset_y": shift[1],
        "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT},
    })  # fmt: skip
    for x, y in np.random.default_rng(1).random((40, 2)):
        ray, _ = theirs.sample_ray(0, 0, [x, y], [0.5, 0.5])
        o, d = sample_ray(sensor, F32(x * WIDTH), F32(y * HEIGHT), F32(0), F32(0))
        assert np.allclose(d, ray.d, atol=2e-6)
        assert np.allclose(o, ray.o, atol=2e-6)
        assert np.isclose(clip_distance(sensor, d), ray.maxt, rtol=1e-5)


def test_thin_lens_rays_are_mitsubas():
    sensor = camera(AXES["x"], lens_radius=0.2, focus=4.0)
    theirs = mi.load_dict({
        "type": "thinlens", "fov": 50, "near_clip": NEAR, "far_clip": FAR, "aperture_radius": 0.2, "focus_distance": 4.0,
        "to_world": mi.ScalarTransform4f(placement()), "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT},
    })  # fmt: skip
    for x, y, u, v in np.random.default_rng(2).random((40, 4)):
        ray, _ = theirs.sample_ray(0, 0, [x, y], [u, v])
        o, d = sample_ray(sensor, F32(x * WIDTH), F32(y * HEIGHT), F32(u), F32(v))
        assert np.allclose(d, ray.d, atol=3e-6)
        assert np.allclose(o, ray.o, atol=3e-6)


CAMERAS = {"pinhole": {"shift": (0.1, -0.07)}, "lens": {"lens_radius": 0.3, "focus": 2.0, "shift": (0.05, 0.1)}}


@pytest.mark.parametrize("kind", CAMERAS)
def test_lens_sample_inverts_ray(kind):
    """A point on a camera ray, connected through the same lens point, lands where the ray came from."""
    sensor = camera(**CAMERAS[kind])
    rng = np.random.default_rng(3)
    for x, y, u, v, t in rng.random((200, 5)):
        x, y, t = x * WIDTH, y * HEIGHT, 0.1 + 5 * t
        o, d = sample_ray(sensor, F32(x), F32(y), F32(u), F32(v))
        p = np.asarray(o, float) + t * np.asarray(d, float)
        lens = sample_lens(sensor, vector(p), F32(u), F32(v))
        assert lens.visible
        assert np.allclose((lens.raster_x, lens.raster_y), (x, y), atol=2e-3)
        assert np.allclose(lens.d, -np.asarray(d), atol=1e-5)
        assert np.isclose(lens.free, t, rtol=1e-4, atol=1e-5)
        assert np.allclose(p + lens.distance * np.asarray(lens.d), lens.point, atol=1e-5)


@kernel
def connect(sensor, p, normal, uv, raster, value):
    """Importance times the surface's cosine for points p (n, 3) of a plane."""
    for i in range(len(p)):
        s = sample_lens(sensor, (p[i, 0], p[i, 1], p[i, 2]), uv[i, 0], uv[i, 1])
        cos = normal[0] * s.d[0] + normal[1] * s.d[1] + normal[2] * s.d[2]
        raster[i, 0] = s.raster_x
        raster[i, 1] = s.raster_y
        value[i] = s.importance * max(np.float32(0), cos)


@kernel
def rays(sensor, film, uv, o, d):
    for i in range(len(film)):
        a, b = sample_ray(sensor, film[i, 0], film[i, 1], uv[i, 0], uv[i, 1])
        for k in range(3):
            o[i, k] = a[k]
            d[i, k] = b[k]


@pytest.mark.parametrize("kind", CAMERAS)
def test_importance_is_the_dual_of_rays(kind):
    """A square of radiance 1, out of focus and at a slant: each quarter of the film sees the same of it in both directions."""
    sensor = camera(**CAMERAS[kind])
    n = 400_000
    rng = np.random.default_rng(4)
    m = placement()
    center = m[:3, :3] @ [0.3, -0.2, 3.0] + m[:3, 3]
    normal = m[:3, :3] @ (np.array([0.4, 0.3, -1.0]) / np.linalg.norm([0.4, 0.3, -1.0]))
    s = np.cross(normal, m[:3, 0])
    s /= np.linalg.norm(s)
    t, half = np.cross(normal, s), 0.9

    film = (rng.random((n, 2)) * [WIDTH, HEIGHT]).astype(F32)
    o, d = np.zeros((n, 3), F32), np.zeros((n, 3), F32)
    rays(sensor, film, rng.random((n, 2), F32), o, d)
    o, d = o.astype(float), d.astype(float)
    x = o + ((center - o) @ normal / (d @ normal))[:, None] * d - center
    seen = (np.abs(x @ s) < half) & (np.abs(x @ t) < half)

    ab = rng.uniform(-half, half, (n, 2))
    p = (center + ab[:, :1] * s + ab[:, 1:] * t).astype(F32)
    raster, value = np.zeros((n, 2), F32), np.zeros(n, F32)
    connect(sensor, p, vector(normal), rng.random((n, 2), F32), raster, value)

    for column in (0, 1):
        for line in (0, 1):

            def quarter(r, column=column, line=line):
                return ((r[:, 0] >= WIDTH / 2) == bool(column)) & ((r[:, 1] >= HEIGHT / 2) == bool(line))

            camera_sum = np.where(quarter(film), seen, 0) * float(WIDTH * HEIGHT)
            light_sum = np.where(quarter(raster), value, 0).astype(float) * (2 * half) ** 2
            error = np.hypot(camera_sum.std(), light_sum.std()) / np.sqrt(n)
            assert camera_sum.mean() > 5
            assert abs(camera_sum.mean() - light_sum.mean()) < 4 * error


@pytest.mark.parametrize("kind", CAMERAS)
def test_points_out_of_view(kind):
    sensor = camera(**CAMERAS[kind])
    m = placement()
    for local in ([0, 0, -2.0], [0, 0, 0.2], [0, 0, 70.0], [5.0, 0, 2.0], [0, -5.0, 2.0]):
        s = sample_lens(sensor, vector(m[:3, :3] @ local + m[:3, 3]), F32(0.5), F32(0.5))
        assert not s.visible
        assert s.importance == 0


def test_raster_lies_strictly_inside_the_film():
    """Points on the film's very edge: whatever is visible lands inside."""
    sensor = camera()
    m = placement()
    found = 0
    for edge in np.linspace(-1 - 1e-6, -1 + 1e-6, 400):
        local = np.array([0.5 * edge, 0.5 * edge * HEIGHT / WIDTH, 1]) * 2.7
        s = sample_lens(sensor, vector(m[:3, :3] @ local + m[:3, 3]), F32(0), F32(0))
        if s.visible:
            found += 1
            assert 0 <= s.raster_x < WIDTH
            assert 0 <= s.raster_y < HEIGHT
    assert found > 50
