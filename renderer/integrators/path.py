"""Unidirectional path tracing: next-event estimation and scattering, combined by the power heuristic (thesis 5.11.2, veach1997).

One call of ``interact`` advances all walks of a tile by one bounce: it meets the surface that ``extend`` found, adds what
the surface emits, asks one emitter for light, and scatters the walk. What it writes is what gets recorded.
"""

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.base import DIFFUSE
from renderer.bsdfs.dispatch import eval_bsdf_lobe, load_bsdf, lobe_count, sample_bsdf
from renderer.emitters.dispatch import emitted, pdf_direction, sample_direction, sky_pdf, sky_radiance
from renderer.integrators.buffers import Counters, Lanes, PathRows, Rays, ShadowRays, VertexRows, WordRows
from renderer.integrators.first_hit import seen_bsdf, seen_emission
from renderer.integrators.rows import append_path, append_ray, append_shadow_ray, append_vertex, append_word, set_surface_point
from renderer.kernel import kernel
from renderer.math.hash import extend_word
from renderer.math.vec import FAR, HALF, ONE, ZERO, Vec3, dot, max3, mul, neg, row, scale, sub, to_local, to_world
from renderer.samples import (
    DIRECT_CHOICE,
    DIRECT_POINT,
    DIRECTION,
    FILM,
    LENS,
    LOBE_ROULETTE,
    PrimarySamples,
    WalkSamples,
    block_dimension,
    sample_pair,
    walk_samples,
)
from renderer.scene.arrays import SceneArrays
from renderer.sensors.dispatch import back_to_lens, clip_distance, sample_ray
from renderer.shapes.surface import offset_point, surface
from renderer.tables import (
    ABSORBED,
    CAMERA_ROOT,
    DEPTH_LIMIT,
    DIFFUSE_REFLECTION,
    EMITTER,
    EMITTER_HIT,
    EMITTER_SAMPLE,
    ESCAPED,
    NO_OBJECT,
    ROULETTE,
)
from renderer.tables import LENS as LENS_POINT

ROOT = np.uint64(CAMERA_ROOT)
NEVER_MORE_THAN = np.float32(0.95)  # survival probability of Russian roulette, as in Mitsuba


@kernel
def power_heuristic(p: np.float32, q: np.float32) -> np.float32:
    """Weight of the technique with density p against one with density q: p² / (p² + q²), without overflow (veach1997)."""
    if p >= q:
        r = q / p
        return ONE / (ONE + r * r)
    r = p / q
    return r * r / (ONE + r * r)


@kernel
def carries_light(c: Vec3) -> bool:
    """Whether a color is a number and not black. What is 1e30 or more came of a division by nearly zero, and is dropped."""
    m = c[0] + c[1] + c[2]
    return bool(m > ZERO and m < FAR)


@kernel
def lens_numbers(lens_radius: np.float32 | None, samples: PrimarySamples, numbers: WalkSamples, dimension: int) -> tuple[np.float32, np.float32]:
    """Where on the lens: its middle where the sensor is a pinhole."""
    if lens_radius is None:
        return HALF, HALF
    return sample_pair(samples, numbers, dimension)


@kernel
def start_camera_walks(
    scene: SceneArrays,
    samples: PrimarySamples,
    lanes: Lanes,
    rays: Rays,
    t: npt.NDArray[np.float32],
    n: int,
    max_depth: int,
    recording: bool,
    shadow: ShadowRays,
    vertices: VertexRows,
    paths: PathRows,
) -> Counters:
    """Give each of the first n lanes its film position, strictly inside its pixel, and its ray (``integrators.base``)."""
    sensor = scene.sensor
    n_vertices = 0
    for i in range(n):
        walk = lanes.walk[i]
        numbers = walk_samples(samples, walk)
        pixel = np.int64(walk % samples.walks_per_pass)
        x = pixel % sensor.width
        y = pixel // sensor.width

        # pixel + u can round up to the next pixel: step back
        u, v = sample_pair(samples, numbers, FILM)
        raster_x = np.float32(x) + u
        raster_y = np.float32(y) + v
        if raster_x >= np.float32(x + 1):
            raster_x = np.nextafter(np.float32(x + 1), ZERO)
        if raster_y >= np.float32(y + 1):
            raster_y = np.nextafter(np.float32(y + 1), ZERO)
        lens_u, lens_v = lens_numbers(sensor.lens_radius, samples, numbers, LENS)
        o, d = sample_ray(sensor, raster_x, raster_y, lens_u, lens_v)
        t[i] = clip_distance(sensor, d)

        lanes.raster[i, 0] = raster_x
        lanes.raster[i, 1] = raster_y
        lanes.radiance[i, 0] = ZERO
        lanes.radiance[i, 1] = ZERO
        lanes.radiance[i, 2] = ZERO
        append_ray(rays, i, i, o, d, (ONE, ONE, ONE), ZERO, ONE, ROOT)

        # a point of the lens that was sampled is a vertex of the walk: depth 0
        if sensor.lens_radius is not None and recording and lanes.recorded[i] != 0:
            n_vertices = append_vertex(vertices, n_vertices, i, 0, LENS_POINT, NO_OBJECT, back_to_lens(sensor, o, d), (ONE, ONE, ONE))
    return Counters(n, 0, n_vertices, 0, 0)


@kernel
def interact(
    scene: SceneArrays,
    samples: PrimarySamples,
    lanes: Lanes,
    rays: Rays,
    t: npt.NDArray[np.float32],
    primitives: npt.NDArray[np.int32],
    depth: int,
    max_depth: int,
    rr_depth: int,
    recording: bool,
    out: Rays,
    shadow: ShadowRays,
    vertices: VertexRows,
    paths: PathRows,
    words: WordRows,
    counters: Counters,
) -> Counters:
    """One bounce of all walks at ``depth`` (``integrators.base``)."""
    geometry, objects, emitters, textures = scene.geometry, scene.objects, scene.emitters, scene.textures
    n_out = 0
    n_shadow = 0
    n_vertices = counters.vertices
    n_paths = counters.paths
    n_words = counters.words
    for i in range(counters.rays):
        # ---- the walk's state ----
        lane = rays.lane[i]
        o = row(rays.o, i)
        d = row(rays.d, i)
        beta = row(rays.beta, i)
        last_pdf = rays.pdf[i]
        word = rays.word[i]
        primitive = primitives[i]
        kept = recording and lanes.recorded[lane] != 0

        # ---- the walk escaped: light of the sky ----
        if primitive < 0:
            if kept:
                n_vertices = append_vertex(vertices, n_vertices, lane, depth, ESCAPED, NO_OBJECT, d, beta)
            if emitters.infinite >= 0:
                weight = ONE
                if last_pdf > ZERO:
                    weight = power_heuristic(last_pdf, sky_pdf(emitters, d))
                c = scale(mul(beta, sky_radiance(emitters, d)), weight)
                if carries_light(c):
                    n_paths = append_path(paths, n_paths, lane, -1, EMITTER_HIT, depth, EMITTER, word, emitters.infinite, d, c, weight)
            continue

        # ---- the surface that it met ----
        hit = surface(geometry, primitive, o, d, t[i])
        thing = hit.object
        wi = to_local(hit.s, hit.t, hit.n, neg(d))

        # ---- light that the surface emits ----
        emitter = objects.emitter[thing]
        cos_light = -dot(hit.ng, d)
        if emitter >= 0 and cos_light > ZERO:
            weight = ONE
            if last_pdf > ZERO:
                weight = power_heuristic(last_pdf, pdf_direction(emitters, geometry, emitter, o, d, t[i], cos_light, primitive))
            radiance = emitted(emitters, textures, emitter, hit.u, hit.v)
            radiance = seen_emission(scene.ewa, scene, samples, lanes, lane, depth, primitive, hit, emitter, radiance)
            c = scale(mul(beta, radiance), weight)
            if carries_light(c):
                n_paths = append_path(paths, n_paths, lane, -1, EMITTER_HIT, depth, EMITTER, word, emitter, hit.p, c, weight)

        # ---- materials: two-sided ones shade their back as a front ----
        material = objects.front[thing]
        flip = ONE
        if wi[2] < ZERO:
            material = objects.back[thing]
            if objects.two_sided[thing] != 0:
                flip = -ONE
                wi = (wi[0], wi[1], -wi[2])
        event = ABSORBED
        if depth >= max_depth:
            event = DEPTH_LIMIT
        elif material >= 0:
            numbers = walk_samples(samples, lanes.walk[lane])
            m = load_bsdf(scene.materials, textures, scene.families, material, hit.u, hit.v)
            m = seen_bsdf(scene.ewa, scene, samples, lanes, lane, depth, primitive, hit, material, m)

            # ---- ask one emitter for light: one row for each lobe's share ----
            lobes = lobe_count(m)
            asked_event, asked_word = np.int32(ABSORBED), word
            if lobes > 0:
                u_choice = ZERO
                if emitters.kind.shape[0] > 1:
                    u_choice, _ = sample_pair(samples, numbers, block_dimension(depth, DIRECT_CHOICE))
                u, v = sample_pair(samples, numbers, block_dimension(depth, DIRECT_POINT))
                light = sample_direction(emitters, geometry, textures, hit.p, u_choice, u, v)
                if max3(light.weight) > ZERO:
                    wo = to_local(hit.s, hit.t, hit.n, light.d)
                    wo = (wo[0], wo[1], wo[2] * flip)
                    asked = n_paths
                    for lobe in range(lobes):
                        lobe_event, value, pdf = eval_bsdf_lobe(scene.families, scene.materials.tables, m, lobe, wi, wo, False)
                        weight = ONE
                        if light.pdf > ZERO:
                            weight = power_heuristic(light.pdf, pdf)
                        c = scale(mul(mul(beta, value), light.weight), weight)
                        if carries_light(c):
                            end = word
                            if kept:
                                end = extend_word(word, lobe_event, thing)
                                n_words = append_word(words, n_words, end, word, lobe_event, thing)
                                asked_event, asked_word = lobe_event, end
                            n_paths = append_path(
                                paths, n_paths, lane, n_shadow, EMITTER_SAMPLE, depth, lobe_event, end, light.emitter, light.endpoint, c, weight
                            )
                    if n_paths > asked:
                        start = offset_point(hit.p, hit.ng, hit.offset, light.d)
                        if light.distance < FAR:
                            n_shadow = append_shadow_ray(shadow, n_shadow, start, sub(light.endpoint, start), ONE)
                        else:
                            n_shadow = append_shadow_ray(shadow, n_shadow, start, light.d, FAR)

            # ---- scatter ----
            u_lobe, u_roulette = HALF, HALF
            if depth >= rr_depth or m.kind != DIFFUSE:
                u_lobe, u_roulette = sample_pair(samples, numbers, block_dimension(depth, LOBE_ROULETTE))
            u, v = sample_pair(samples, numbers, block_dimension(depth, DIRECTION))
            s = sample_bsdf(scene.families, scene.materials.tables, m, wi, u_lobe, u, v, False)
            event = s.event
            throughput = mul(beta, s.weight)
            if not carries_light(throughput):
                event = ABSORBED

            # ---- Russian roulette ----
            eta = rays.eta[i] * s.eta
            if event != ABSORBED and depth >= rr_depth:
                survival = min(max3(throughput) * eta * eta, NEVER_MORE_THAN)
                if u_roulette >= survival:
                    event = ROULETTE
                throughput = scale(throughput, ONE / survival)

            # ---- go on ----
            if event >= DIFFUSE_REFLECTION:
                wo = to_world(hit.s, hit.t, hit.n, (s.wo[0], s.wo[1], s.wo[2] * flip))
                end = asked_word
                if kept and event != asked_event:
                    end = extend_word(word, event, thing)
                    n_words = append_word(words, n_words, end, word, event, thing)
                n_out = append_ray(out, n_out, lane, offset_point(hit.p, hit.ng, hit.offset, wo), wo, throughput, s.pdf, eta, end)

        # ---- the vertex, with what became of the walk ----
        if kept:
            n_vertices = append_vertex(vertices, n_vertices, lane, depth, event, thing, hit.p, beta)
            set_surface_point(vertices, n_vertices - 1, primitive, hit)
    return Counters(n_out, n_shadow, n_vertices, n_paths, n_words)
