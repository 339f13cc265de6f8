"""The elliptical weighted average: its sum, its footprints, and planes that it renders against the same filter over many samples."""

import json
import math

import numpy as np
import OpenImageIO as oiio
import pytest
import yaml
from rendering import columns, record, settings_of, with_all_features

from pipeline.errors import JobError
from pipeline.identity import differences
from pipeline.prepare import prepare_job
from queries.subpixel.accumulate import accumulate_samples
from queries.subpixel.description import layout as shipped_layout
from renderer.film import Film
from renderer.filters.reconstruction import ReconstructionFilter
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import OPPONENT_RGB, PRIMARIES, Layout, stripe
from renderer.filters.subpixel.windowed_sinc import box, windowed_sinc
from renderer.scene.load import load_scene
from renderer.sensors.dispatch import lens_point, sample_ray
from renderer.settings import TraceSettings
from renderer.shapes.base import Hit
from renderer.shapes.quadrics import intersect_quadric, parameters_of, transform_point, transform_vector
from renderer.textures.base import BILINEAR, BITMAP, CLAMP, NEAREST, REPEAT, Textures
from renderer.textures.ewa import MOST_CELLS, average, choose_cells
from renderer.textures.footprint import footprint
from renderer.textures.pixel_filter import GAUSSIAN_REACH, ewa_filter, gaussian, triples, with_ewa
from renderer.textures.pyramid import levels_of
from renderer.trace import Tracer

F32 = np.float32
TABLE_4_1 = (92.65, 76.58, 46.62)  # b of R, G and B of the stripe, in subpixels
RNG = np.random.default_rng(5)
NOISE = RNG.random((64, 64, 3)).astype(F32)


def thesis_filter(letter: str) -> ReconstructionFilter:
    """The analytic filter of a primary of the stripe."""
    b = TABLE_4_1[PRIMARIES.index(letter)]
    return ReconstructionFilter("optimal", 2.0, lambda x: windowed_sinc(3 * x, math.pi / 3, b))


def stripe_filter(order: str = "RGB") -> SubpixelFilter:
    """The filters of a stripe, with the thesis's parameters."""
    return SubpixelFilter("optimal", stripe("stripe", order), tuple(map(thesis_filter, order)), (box("box", 0.5),) * 3)


def float32s(values):
    """A tuple of float32: compiled functions hand Python its own floats."""
    return tuple(F32(x) for x in values)


def textures_of(image, filter=BILINEAR, wrap=REPEAT) -> Textures:
    height, width, _ = image.shape
    return Textures(
        np.array([BITMAP], np.int32), np.eye(2, 3, dtype=F32)[None], np.zeros((1, 2, 3), F32), np.array([0], np.int64),
        np.array([[width, height]], np.int32), np.array([[filter, wrap]], np.int32), np.ascontiguousarray(image.reshape(-1, 3), F32),
    )  # fmt: skip


def averaged(ewa, textures, s, t, j):
    return np.array(average(ewa, textures, 0, F32(s), F32(t), tuple(F32(x) for x in j), 0, 0))


def looked_up(image, s, t, filter=BILINEAR):
    """Colors (…, 3) of a repeated image at (s, t), in its pixels."""
    height, width, _ = image.shape
    if filter == NEAREST:
        return image[np.floor(t).astype(int) % height, np.floor(s).astype(int) % width]
    s, t = s - 0.5, t - 0.5
    i, j = np.floor(s).astype(int), np.floor(t).astype(int)
    fs, ft = (s - i)[..., None], (t - j)[..., None]
    top = image[j % height, i % width] * (1 - fs) + image[j % height, (i + 1) % width] * fs
    bottom = image[(j + 1) % height, i % width] * (1 - fs) + image[(j + 1) % height, (i + 1) % width] * fs
    return top * (1 - ft) + bottom * ft


# --- the sum ------------------------------------------------------------------------------------------------------


def spread(filter, offset, width):
    """The mean of a filter over an interval of a width around each offset."""
    places = offset[..., None] + width * ((np.arange(32) + 0.5) / 32 - 0.5)
    return np.where(abs(places) <= filter.radius, filter.weight(places), 0.0).mean(axis=-1)


def double_loop(image, s, t, j, subpixels):
    """Every texel of some periods, weighed where the inverse Jacobian puts it on the film."""
    inverse = np.linalg.inv(np.reshape(j, (2, 2)))
    x, y = np.meshgrid(np.arange(-40, 40) + math.floor(s), np.arange(-40, 40) + math.floor(t))
    dx, dy = np.tensordot(inverse, [x + 0.5 - s, y + 0.5 - t], axes=1)
    if subpixels is None:
        weights = gaussian().weight(np.hypot(dx, dy))[..., None]
    else:  # integrals over the texel's shadow
        across, down = np.linalg.norm(inverse, axis=1)
        of_channel = [spread(one, dx - (c - 1) / 3, across) * spread(subpixels.down[c], dy, down) for c, one in enumerate(subpixels.across)]
        weights = np.stack(of_channel, axis=-1)
    colors = image[y % image.shape[0], x % image.shape[1]]
    return np.maximum((weights * colors).sum(axis=(0, 1)) / weights.sum(axis=(0, 1)), 0)


@pytest.mark.parametrize("subpixels", [None, stripe_filter()], ids=["pixel", "stripe"])
def test_sum_is_the_double_loop_over_texels(subpixels):
    textures = textures_of(NOISE)
    ewa = ewa_filter(textures, subpixels)
    for j in ((6.5, 0.5, -1.0, 7.0), (5.5, 0.0, 0.0, 7.9)):
        level, size_s, size_t, *_ = choose_cells(ewa, 0, tuple(F32(x) for x in j), F32(j[0] * j[3] - j[1] * j[2]))
        assert (level, size_s, size_t) == (0, 1, 1)  # cells are texels
        for s, t in ((31.2, 17.9), (3.0, 60.5)):
            assert np.allclose(averaged(ewa, textures, s, t, j), double_loop(NOISE, s, t, j, subpixels), atol=2e-3)


JACOBIANS = (
    (0.01, 0, 0, 0.01),
    (0.3, 0.1, 0, -0.3),
    (1, 0, 0, 1),
    (1.3, 0.2, -0.4, 1.1),
    (4, 2, -3, 4),
    (20, 1, -2, 20),
    (0.5, 0, 0, 10),
    (30, 0, 0, 1),
)


def integrated(image, s, t, j, subpixels):
    """The filter times the looked-up texture, over the film, by the midpoint rule."""
    n = max(24, math.ceil(4 * np.abs(j).max()))
    reach = (GAUSSIAN_REACH, GAUSSIAN_REACH) if subpixels is None else (7 / 3, 0.5)
    x, y = np.meshgrid(*((np.arange(m) + 0.5) / m * 2 * r - r for r in reach for m in [math.ceil(2 * r * n)]))
    colors = looked_up(image, s + j[0] * x + j[1] * y, t + j[2] * x + j[3] * y)
    weights = []
    for c in range(3):
        dx = x - (c - 1) / 3
        weights.append(gaussian().weight(np.hypot(x, y)) if subpixels is None else np.where(abs(dx) <= 2, subpixels.across[c].weight(dx), 0.0))
    w = np.stack(weights, axis=-1)
    return np.maximum((w * colors).sum(axis=(0, 1)) / w.sum(axis=(0, 1)), 0)


@pytest.mark.parametrize("subpixels", [None, stripe_filter()], ids=["pixel", "stripe"])
@pytest.mark.parametrize("j", JACOBIANS)
def test_average_is_the_integral_over_the_film(j, subpixels):
    """White noise, the hardest texture: its frequencies go on to the texel."""
    textures, rng = textures_of(NOISE), np.random.default_rng(1)
    ewa = ewa_filter(textures, subpixels)
    places = rng.uniform(0, 64, (6, 2))
    errors = [averaged(ewa, textures, s, t, j) - integrated(NOISE, s, t, j, subpixels) for s, t in places]
    assert np.sqrt(np.mean(np.square(errors))) < 0.02 * NOISE.std()


@pytest.mark.parametrize("subpixels", [None, stripe_filter()], ids=["pixel", "stripe"])
@pytest.mark.parametrize("wrap", [REPEAT, CLAMP])
def test_constant_stays_constant(subpixels, wrap):
    image = np.broadcast_to(np.array([0.3, 0.7, 0.5], F32), (13, 9, 3))  # sizes that halve with a remainder
    textures = textures_of(image, wrap=wrap)
    ewa = ewa_filter(textures, subpixels)
    for j in (*JACOBIANS, (500, 3, 2, 400), (1e4, 0, 0, 1e-2), (1, 1, 1, 1.001)):
        assert np.allclose(averaged(ewa, textures, 4.7, -11.3, j), image[0, 0], rtol=0, atol=1e-6), j


def test_gray_stays_gray_without_a_display():
    gray = np.repeat(NOISE[:, :, :1], 3, axis=2)
    textures = textures_of(gray)
    ewa = ewa_filter(textures)
    for j in JACOBIANS:
        c = averaged(ewa, textures, 20.2, 33.3, j)
        assert c[0] == c[1] == c[2]


def test_channels_are_read_at_their_subpixels():
    """A ramp along the film: red lies a third of a pixel left of green, blue a third right, in a stripe; mirrored, the other way round."""
    ramp = np.repeat(np.repeat(np.linspace(0.2, 0.8, 64, dtype=F32)[None, :, None], 64, axis=0), 3, axis=2)
    slope = 0.6 / 63
    textures = textures_of(ramp, wrap=CLAMP)
    for order, sign in (("RGB", 1), ("BGR", -1)):
        c = averaged(ewa_filter(textures, stripe_filter(order)), textures, 32.0, 32.0, (3, 0, 0, 3))
        assert np.allclose(c - c[1], sign * np.array([-1, 0, 1]) * slope, atol=2e-2 * slope)


def test_work_is_bounded_and_colors_stay_between_texels():
    textures, rng = textures_of(NOISE), np.random.default_rng(2)
    ewa = ewa_filter(textures)
    for _ in range(300):
        long, short = 10.0 ** rng.uniform(-4, 7, 2)
        a, b = rng.uniform(0, 2 * math.pi, 2)
        turn, other = (np.array([[math.cos(x), -math.sin(x)], [math.sin(x), math.cos(x)]]) for x in (a, b))
        j = tuple(F32(x) for x in (turn @ np.diag([long, short]) @ other).ravel())
        determinant = F32(j[0] * j[3] - j[1] * j[2])
        if abs(determinant) < 1e-6:
            continue
        level, _, _, count, _ = choose_cells(ewa, 0, j, determinant)
        assert count <= MOST_CELLS or level == ewa.pyramid.top[0]
        c = averaged(ewa, textures, *rng.uniform(-1e3, 1e3, 2), j)
        assert c.min() >= NOISE.min() - 1e-6
        assert c.max() <= NOISE.max() + 1e-6


def test_tables_end_with_the_filter():
    """Beyond a table, its last entry holds: of a box that a lookup follows by distance, nothing must be left there."""
    around = SubpixelFilter("around", stripe("stripe", "RGB"), (box("box", 0.5), box("box", 0.7), box("box", 0.7)), None)
    across = ewa_filter(textures_of(NOISE), around).across
    assert across.shape[0] == 2
    assert (across[:, 0] > 0).all()
    assert (across[:, -1] == 0).all()


def test_levels_keep_the_mean():
    for size in ((64, 64), (13, 9), (1, 7), (5, 1)):
        image = RNG.random((*size, 3)).astype(F32)
        levels = levels_of(image)
        assert levels[-1].shape == (1, 1, 3)
        assert all(np.allclose(level.mean(axis=(0, 1)), image.mean(axis=(0, 1)), atol=1e-6) for level in levels)
    halves = levels_of(NOISE)[0]
    assert np.allclose(halves, NOISE.reshape(32, 2, 32, 2, 3).mean(axis=(1, 3)), atol=1e-6)


# --- footprints ---------------------------------------------------------------------------------------------------


def camera(kind, **more):
    film = {"type": "hdrfilm", "width": 64, "height": 48, "rfilter": {"type": "box"}}
    look = [{"lookat": {"origin": [0.4, -0.3, -5], "target": [0, 0, 0], "up": [0, 1, 0]}}]
    return {"type": kind, "fov": 30, "principal_point_offset_x": 0.05, "to_world": look, "film": film, **more}


def shown(shape, sensor):
    bsdf = {"type": "diffuse", "reflectance": {"type": "checkerboard"}}
    return with_all_features(load_scene({"type": "scene", "sensor": sensor, "shape": {**shape, "bsdf": bsdf}, "light": {"type": "constant"}}))


def hit_of(p, u, v):
    """What a footprint reads of a hit: its place. Kernels that find hits would take longer to compile than all footprints."""
    none = (F32(0),) * 3
    return Hit(float32s(p), none, none, none, none, F32(u), F32(v), F32(u), F32(v), F32(0), np.int32(0))


def met(scene, x, y, lens):
    """Primitive, hit, and texture coordinates (float64) where film position (x, y) meets the scene's only shape, on its plane if it is a triangle."""
    arrays = scene.arrays
    geometry, quadrics = arrays.geometry, arrays.geometry.quadrics
    o, d = map(float32s, sample_ray(arrays.sensor, F32(x), F32(y), *lens))
    if len(quadrics.kind):
        t = intersect_quadric(quadrics, 0, o, d)
        local = np.add(transform_point(quadrics.to_object, 0, o), np.multiply(t, transform_vector(quadrics.to_object, 0, d)))
        u, v = parameters_of(quadrics.kind[0], tuple(local))
        return 0, hit_of(np.add(o, np.multiply(t, d)), u, v), np.array([u, v], np.float64)
    p0, e1, e2 = (np.asarray(a[0], np.float64) for a in (geometry.p0, geometry.e1, geometry.e2))
    b1, b2, t = np.linalg.solve(np.stack([e1, e2, -np.asarray(d, np.float64)], axis=1), np.asarray(o, np.float64) - p0)
    uv = geometry.uvs[0].astype(np.float64)
    found = uv[0] + b1 * (uv[1] - uv[0]) + b2 * (uv[2] - uv[0])
    return 0, hit_of(np.add(o, np.multiply(t, d)), *found), found


TILTED = [{"rotate": {"axis": [1, 0.3, 0], "angle": 50}}, {"scale": [2, 1.5, 1]}]
SENSORS = {"pinhole": camera("perspective"), "lens": camera("thinlens", aperture_radius=0.2, focus_distance=4.0)}
SHAPES = {
    "triangles": {"type": "rectangle", "to_world": TILTED},
    "sphere": {"type": "sphere", "radius": 1.3, "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 70}}]},
    "disk": {"type": "disk", "to_world": TILTED},
    "cylinder": {"type": "cylinder", "p0": [-1, 0.2, 0], "p1": [1, -0.2, 0.1], "radius": 0.8},
}


@pytest.mark.parametrize(
    ("shape", "sensor"), [("triangles", "pinhole"), ("triangles", "lens"), ("sphere", "pinhole"), ("disk", "pinhole"), ("cylinder", "pinhole")]
)
def test_footprints_are_finite_differences_of_rays(shape, sensor):
    scene = shown(SHAPES[shape], SENSORS[sensor])
    arrays, lens, h = scene.arrays, (F32(0.3), F32(0.8)), 0.25
    point = float32s(lens_point(arrays.sensor.lens_radius, *lens))
    for x, y in ((29.3, 25.9), (33.8, 22.1), (36.6, 27.7)):
        primitive, hit, uv = met(scene, x, y, lens)
        place = footprint(arrays.sensor, arrays.geometry, primitive, hit, F32(x), F32(y), point)
        center = (math.floor(x) + 0.5, math.floor(y) + 0.5)
        exact = shape == "triangles"
        assert place.anchored == exact

        # Triangles: value and derivatives at the center of the pixel. Others: derivatives at the sample, value by the first order
        ax, ay = center if exact else (x, y)
        along_x = (met(scene, ax + h, ay, lens)[2] - met(scene, ax - h, ay, lens)[2]) / (2 * h)
        along_y = (met(scene, ax, ay + h, lens)[2] - met(scene, ax, ay - h, lens)[2]) / (2 * h)
        step = max(np.linalg.norm(along_x), np.linalg.norm(along_y))
        assert np.allclose((place.u_x, place.v_x), along_x, atol=5e-3 * step)
        assert np.allclose((place.u_y, place.v_y), along_y, atol=5e-3 * step)
        expected = met(scene, *center, lens)[2] if exact else uv + along_x * (center[0] - x) + along_y * (center[1] - y)
        assert np.allclose((place.u, place.v), expected, atol=5e-3 * step)


def test_footprint_on_a_triangle_does_not_depend_on_the_sample():
    scene = shown(SHAPES["triangles"], SENSORS["pinhole"])
    places = set()
    for x, y in RNG.uniform(0.01, 0.99, (20, 2)):
        primitive, hit, _ = met(scene, 31 + x, 24 + y, (F32(0.5), F32(0.5)))
        places.add(footprint(scene.arrays.sensor, scene.arrays.geometry, primitive, hit, F32(31 + x), F32(24 + y), (F32(0),) * 3))
    assert len(places) == 1


# --- rendered planes ----------------------------------------------------------------------------------------------

WIDTH, HEIGHT = 40, 24
DISTANCE, HALF_WIDTH = 4.0, 2.0  # of the camera from the plane, and what it sees of it


def plane(folder, image, angle):
    """A luminous plane through the origin, turned about the x axis by ``angle`` degrees, under an image that repeats after 6, seen from z = -4."""
    file = folder / f"plane{len(list(folder.iterdir()))}.exr"
    out = oiio.ImageOutput.create(str(file))
    height, width, _ = image.shape
    assert out.open(str(file), oiio.ImageSpec(width, height, 3, oiio.FLOAT))
    assert out.write_image(np.ascontiguousarray(image, F32))
    assert out.close()
    turned = [{"scale": [60, 60, 1]}, {"rotate": {"axis": [0, 1, 0], "angle": 180}}, {"rotate": {"axis": [1, 0, 0], "angle": angle}}]
    radiance = {"type": "bitmap", "filename": str(file), "raw": True, "to_uv": [{"scale": [20, 20, 1]}]}
    return load_scene({
        "type": "scene", "integrator": {"type": "path", "max_depth": 1},
        "sensor": {
            "type": "perspective", "fov": 2 * math.degrees(math.atan(HALF_WIDTH / DISTANCE)), "near_clip": 0.1,
            "to_world": [{"lookat": {"origin": [0, 0, -DISTANCE], "target": [0, 0, 0], "up": [0, 1, 0]}}],
            "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
        },
        "plane": {
            "type": "rectangle", "to_world": turned,
            "emitter": {"type": "area", "radiance": radiance},
        },
    })  # fmt: skip


def seen(image, angle, fine):
    """x, y (n), and the colors (n, 3) that the plane shows there: ``fine`` x ``fine`` samples in each pixel, by analytic geometry."""
    x, y = np.meshgrid((np.arange(WIDTH * fine) + 0.5) / fine, (np.arange(HEIGHT * fine) + 0.5) / fine)
    px = HALF_WIDTH / DISTANCE * (1 - 2 * x / WIDTH)  # to the left
    py = HALF_WIDTH / DISTANCE * (HEIGHT / WIDTH) * (1 - 2 * y / HEIGHT)
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))

    # The plane through the origin, spanned by (-1, 0, 0) and (0, c, s): camera rays (px, py, 1) from (0, 0, -DISTANCE)
    t = DISTANCE * c / (c - s * py)
    across, up = -t * px, t * py * c + (t - DISTANCE) * s
    u, v = across / 6 + 10, up / 6 + 10
    return x.ravel(), y.ravel(), looked_up(image, u * image.shape[1], v * image.shape[0]).reshape(-1, 3).astype(F32)


def settings_for(scene, samples, **changes):
    return settings_of(scene, samples, texture_filter="ewa", **changes)


def film_of(scene, settings):
    film = Film(settings.width, settings.height)
    Tracer(scene, settings).trace((0, settings.walks), None, film)
    return film.image("path", settings.passes)


def bands(frequency):
    """An image of 256 x 256 with waves of all directions, of up to ``frequency`` periods across it: smooth, unlike noise of texels."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:256, 0:256] / 256
    image = np.full((256, 256, 3), 0.5)
    for _ in range(60):
        fx, fy = rng.integers(-frequency, frequency + 1, 2)
        image += 0.04 * np.cos(2 * np.pi * (fx * x + fy * y) + rng.uniform(0, 2 * np.pi))[..., None] * rng.uniform(0.3, 1, 3)
    return np.clip(image, 0.02, 0.98)


def inner(lattice):
    """R, G and B of the stripe's pixels whose filters stay on the film."""
    return lattice.reshape(HEIGHT, WIDTH, 3)[3:-3, 4:-4]


@pytest.mark.parametrize(
    ("angle", "tolerance"), [(0, 0.01), pytest.param(55, 0.02, marks=pytest.mark.slow), (68, 0.04)], ids=["facing", "oblique", "grazing"]
)
def test_film_is_the_resolve_of_many_samples(tmp_path, angle, tolerance):
    """Film pixels are the drive of subpixels: what the same filter makes of 24 x 24 point samples in each pixel. One sample is enough."""
    image = bands(40)
    scene = with_ewa(plane(tmp_path, image, angle), stripe_filter())
    film = film_of(scene, settings_for(scene, 1))[3:-3, 4:-4]
    x, y, colors = seen(image, angle, 24)
    expected = inner(np.maximum(accumulate_samples(x, y, colors, stripe_filter(), WIDTH, HEIGHT), 0))
    errors = np.abs(film - expected)
    assert np.sqrt(np.mean(errors**2)) < tolerance * expected.std()

    # Points at the subpixels' centers, without a filter, are far off
    sampled = colors.reshape(HEIGHT, 24, WIDTH, 24, 3)[:, 12]
    points = np.stack([sampled[:, :, at, c] for c, at in enumerate((4, 12, 20))], axis=-1)[3:-3, 4:-4]
    assert np.sqrt(np.mean((points - expected) ** 2)) > 5 * np.sqrt(np.mean(errors**2))


def test_all_samples_of_a_pixel_agree_and_replay_finds_them_again(tmp_path):
    scene = with_ewa(plane(tmp_path, NOISE, 40), stripe_filter())
    settings = settings_for(scene, 6)
    paths = columns(record(scene, settings)["paths"])
    colors = np.stack([paths[f"contribution_{c}"] for c in "rgb"], axis=-1)
    pixel = paths["camera_walk"] % settings.walks_per_pass
    order = np.argsort(pixel, kind="stable")
    groups = colors[order].reshape(-1, 6, 3)  # the plane fills the film
    assert groups.std(axis=0).min() > 0.02
    edge = [len(np.unique(group, axis=0)) for group in groups]
    assert np.mean(np.array(edge) == 1) > 0.95  # but where the diagonal of the rectangle passes, two triangles round differently
    assert np.ptp(groups, axis=1).max() < 1e-4

    # Some walks alone, in another order
    some = np.random.default_rng(4).permutation(settings.walks)[:500].astype(np.uint64)
    again = columns(record(scene, settings, walks=some)["paths"])
    found = {int(w): (r, g, b) for w, r, g, b in zip(*(again[c] for c in ("camera_walk", *(f"contribution_{c}" for c in "rgb"))), strict=True)}
    assert all(found[int(w)] == tuple(colors[i]) for i, w in enumerate(paths["camera_walk"]) if int(w) in found)
    assert len(found) == 500


@pytest.mark.slow
@pytest.mark.parametrize("angle", [0, 55, 68])
def test_pixel_filter_averages_what_point_sampling_aliases(tmp_path, angle):
    image = bands(110)
    scene = with_ewa(plane(tmp_path, image, angle))
    film = film_of(scene, settings_for(scene, 1))
    fine = 24
    colors = seen(image, angle, fine)[2]
    expected = np.zeros((HEIGHT, WIDTH, 3))
    weights = np.zeros((HEIGHT, WIDTH, 1))
    for i in range(-2, 3):  # the filter reaches a pixel and a half around each pixel's center
        for k in range(-2, 3):
            for part in range(fine * fine):
                a, b = part % fine, part // fine
                w = float(gaussian().weight(np.array(math.hypot(i + (a + 0.5) / fine - 0.5, k + (b + 0.5) / fine - 0.5))))
                if w > 0:
                    grid = colors.reshape(HEIGHT, fine, WIDTH, fine, 3)[:, b, :, a]
                    expected += w * np.roll(grid, (-k, -i), axis=(0, 1))
                    weights += w
    expected /= weights
    inside = (slice(3, -3), slice(3, -3))
    error = np.sqrt(np.mean((film - expected)[inside] ** 2))
    points = np.sqrt(np.mean((colors.reshape(HEIGHT, fine, WIDTH, fine, 3)[:, fine // 2, :, fine // 2] - expected)[inside] ** 2))
    assert error < 0.1 * points


# --- refusals -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"texture_filter": "trilinear"}, "unknown texture filter 'trilinear'; known: point, ewa"),
        ({"texture_layout": "rgb_stripe"}, "is for the texture filter 'ewa'; the filter is 'point'"),
        ({"texture_filter": "ewa", "method": "light"}, "is for camera walks, method 'path'; the method is 'light'"),
        ({"texture_filter": "ewa", "filter": "gaussian"}, "needs the film's filter 'box', but that is 'gaussian'"),
    ],
)
def test_settings_that_do_not_go_together(changes, message):
    with pytest.raises(ValueError, match=message.replace("'", ".")):
        TraceSettings(**{"method": "path", "width": 4, "height": 4, "passes": 1, "max_depth": 2, "rr_depth": 5, "seed": 1} | changes)


def test_displays_without_one_of_each_primary_in_a_pixel():
    with pytest.raises(ValueError, match="'rgbw' has white subpixels, for which a film of R, G and B has no value: filter the run's samples"):
        triples(shipped_layout("rgbw"))
    with pytest.raises(ValueError, match="'rgbg' has a pixel of 1 R, 1 G, but a pixel of the film has one value each"):
        triples(shipped_layout("rgbg"))
    assert triples(shipped_layout("bgr_stripe")).tolist() == [[[2, 1, 0]]]

    # Rows that begin with another primary in every other pixel
    delta = Layout("delta", PRIMARIES[:3], np.array([[0, 1, 2], [2, 0, 1]]), (3, 1), (0.5, 0.5), ((1, 1),) * 3, OPPONENT_RGB)
    assert triples(delta).tolist() == [[[0, 1, 2]], [[4, 5, 3]]]


def test_scene_and_settings_must_agree(tmp_path):
    scene = plane(tmp_path, NOISE, 0)
    with pytest.raises(ValueError, match="the scene has the texture filter 'ewa', but the settings ask for 'point'"):
        Tracer(with_ewa(scene), settings_of(scene, 1))
    bare = shown(SHAPES["triangles"], SENSORS["pinhole"])
    assert with_ewa(bare).arrays.ewa is None
    assert "no bitmaps" in with_ewa(bare).warnings[-1]


# --- jobs ---------------------------------------------------------------------------------------------------------


def write_job(folder, **render):
    scene = plane(folder, NOISE, 0).description
    file = folder / "job.yaml"
    file.write_text(yaml.safe_dump({"name": "plane", "scene": json.loads(json.dumps(scene)), "render": {"samples": 1, **render}}))
    return file


def test_job_folds_in_the_filter_of_a_display(tmp_path):
    job = prepare_job(write_job(tmp_path, texture_filter="ewa", texture_layout="rgb_stripe"))
    ewa = job.scene.arrays.ewa
    assert ewa.centers.ravel().tolist() == pytest.approx([-1 / 3, 0, 0, 0, 1 / 3, 0], abs=1e-7)
    assert ewa.reach == pytest.approx([2.0, 0.5], abs=1e-2)
    assert (job.settings.texture_filter, job.settings.texture_layout) == ("ewa", "rgb_stripe")

    # Another filter is another run, and a run without one is what it always was
    point = prepare_job(tmp_path / "job.yaml", ["render.texture_filter=point", "render.texture_layout=null"])
    plain = prepare_job(tmp_path / "job.yaml", ["render.texture_layout=null"])
    assert point.scene.arrays.ewa is None
    assert plain.scene.arrays.ewa.centers is None
    assert "texture_filter 'point' -> 'ewa'" in differences(point.fingerprint, plain.fingerprint)
    assert "texture_layout None -> 'rgb_stripe', the scene" in differences(plain.fingerprint, job.fingerprint)


def test_runs_from_before_the_switch_are_gone_on_with(tmp_path):
    job = prepare_job(write_job(tmp_path))
    known = {name: value for name, value in job.fingerprint["settings"].items() if name not in ("texture_filter", "texture_layout")}
    before = {**job.fingerprint, "settings": known}
    assert differences(before, job.fingerprint) == ""
    other = prepare_job(tmp_path / "job.yaml", ["render.texture_filter=ewa"])
    assert differences(before, other.fingerprint) == "texture_filter 'point' -> 'ewa', the scene"
    assert "width None -> 40" in differences({}, job.fingerprint)


@pytest.mark.parametrize(
    ("render", "message"),
    [
        ({"texture_layout": "rgbw"}, "render.texture_layout: the display 'rgbw' has white subpixels"),
        ({"texture_layout": "rgbg"}, "render.texture_layout: the display 'rgbg' has a pixel of 1 R, 1 G"),
        ({"texture_layout": "none_such"}, "render.texture_layout: there is no layout `none_such`: known are rgb_stripe"),
        ({"filter": "mitchell"}, "render: the texture filter 'ewa' needs the film's filter 'box', but that is 'mitchell'"),
        ({"method": "light"}, "render: the texture filter 'ewa' is for camera walks"),
    ],
)
def test_jobs_that_are_refused(tmp_path, render, message):
    with pytest.raises(JobError, match=message.replace("'", ".")):
        prepare_job(write_job(tmp_path, texture_filter="ewa", **render))
