"""Light tracing: the dual of path tracing, on the same steps (thesis 5.11.3).

Light walks leave the emitters and scatter by the adjoint BSDF; each of their vertices is connected to the lens. There is
no competing technique, so every weight is one. What only a chain of delta lobes joins to the lens stays unseen, and so does an
infinite emitter that the camera sees directly.
"""

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.base import DIFFUSE
from renderer.bsdfs.dispatch import eval_bsdf_lobe, load_bsdf, lobe_count, sample_bsdf
from renderer.emitters.dispatch import emission_toward, sample_emission
from renderer.integrators.buffers import Counters, Lanes, PathRows, Rays, ShadowRays, VertexRows, WordRows
from renderer.integrators.path import NEVER_MORE_THAN, carries_light, lens_numbers
from renderer.integrators.rows import append_path, append_ray, append_shadow_ray, append_vertex, append_word, set_surface_point
from renderer.kernel import kernel
from renderer.math.hash import extend_word
from renderer.math.vec import FAR, HALF, ONE, ZERO, Vec3, dot, max3, mul, neg, row, scale, sub, to_local, to_world
from renderer.samples import (
    DIRECT_POINT,
    DIRECTION,
    EMISSION_DIRECTION,
    EMISSION_POINT,
    EMITTER_CHOICE,
    LENS_OF_EMITTER,
    LOBE_ROULETTE,
    PrimarySamples,
    block_dimension,
    sample_pair,
    walk_samples,
)
from renderer.scene.arrays import SceneArrays
from renderer.sensors.dispatch import sample_lens
from renderer.shapes.surface import offset_point, surface
from renderer.tables import ABSORBED, DEPTH_LIMIT, DIFFUSE_REFLECTION, EMITTER, ESCAPED, LENS_SAMPLE, LIGHT_ROOT, NO_OBJECT, ROULETTE

ROOT = np.uint64(LIGHT_ROOT)
GRAZING = np.float32(1e-6)


@kernel
def shading_correction(normals: npt.NDArray[np.float32] | None, wi: Vec3, wo: Vec3, ng: Vec3, wi_cos: np.float32, wo_cos: np.float32) -> np.float32:
    """What the adjoint of a BSDF gains where the shading normal is not the geometric one (veach1997, Eq. 5.19).

    ``wi``, ``wo`` are in the world, ``wi_cos`` and ``wo_cos`` their cosines with the shading normal.
    """
    if normals is None:
        return ONE
    below = abs(dot(wi, ng) * wo_cos)
    if below < GRAZING:
        return ZERO
    return abs(wi_cos * dot(wo, ng)) / below


@kernel
def start_light_walks(
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
    """Let light leave an emitter in each of the first n lanes, and connect the point that it leaves with the lens (``integrators.base``)."""
    emitters, sensor = scene.emitters, scene.sensor
    share = ONE / np.float32(samples.walks_per_pass)
    n_rays = 0
    n_shadow = 0
    n_vertices = 0
    n_paths = 0
    for i in range(n):
        numbers = walk_samples(samples, lanes.walk[i])
        u_choice, _ = sample_pair(samples, numbers, EMITTER_CHOICE)
        u1, u2 = sample_pair(samples, numbers, EMISSION_POINT)
        u3, u4 = sample_pair(samples, numbers, EMISSION_DIRECTION)
        light = sample_emission(emitters, scene.geometry, scene.textures, u_choice, u1, u2, u3, u4)
        lanes.source[i] = light.emitter
        lanes.radiance[i, 0] = ZERO
        lanes.radiance[i, 1] = ZERO
        lanes.radiance[i, 2] = ZERO

        # the emitter's point is a vertex of the walk: depth 0
        thing = NO_OBJECT
        if emitters.object[light.emitter] >= 0:
            thing = emitters.object[light.emitter]
        if recording and lanes.recorded[i] != 0:
            n_vertices = append_vertex(vertices, n_vertices, i, 0, EMITTER, thing, light.point, light.radiance)

        # the lens may see the emitter itself, where that has a shape
        u, v = lens_numbers(sensor.lens_radius, samples, numbers, LENS_OF_EMITTER)
        lens = sample_lens(sensor, light.point, u, v)
        if lens.visible and thing != NO_OBJECT:
            c = scale(emission_toward(emitters, scene.textures, light, lens.d), lens.importance * share)
            if carries_light(c):
                paths.raster[n_paths, 0] = lens.raster_x
                paths.raster[n_paths, 1] = lens.raster_y
                n_paths = append_path(paths, n_paths, i, n_shadow, LENS_SAMPLE, 0, EMITTER, ROOT, light.emitter, lens.point, c, ONE)
                n_shadow = append_shadow_ray(shadow, n_shadow, light.point, sub(lens.point, light.point), lens.free / lens.distance)
        if max_depth > 1 and carries_light(light.weight):
            t[n_rays] = FAR
            n_rays = append_ray(rays, n_rays, i, light.point, light.d, light.weight, ZERO, ONE, ROOT)
    return Counters(n_rays, n_shadow, n_vertices, n_paths, 0)


@kernel
def interact_light(
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
    """One bounce of all light walks at ``depth`` (``integrators.base``)."""
    geometry, objects = scene.geometry, scene.objects
    share = ONE / np.float32(samples.walks_per_pass)
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
        word = rays.word[i]
        primitive = primitives[i]
        kept = recording and lanes.recorded[lane] != 0

        # ---- light that leaves the scene ----
        if primitive < 0:
            if kept:
                n_vertices = append_vertex(vertices, n_vertices, lane, depth, ESCAPED, NO_OBJECT, d, beta)
            continue

        # ---- the surface that it met; two-sided materials shade their back as a front ----
        hit = surface(geometry, primitive, o, d, t[i])
        thing = hit.object
        back = neg(d)
        wi = to_local(hit.s, hit.t, hit.n, back)
        wi_cos = wi[2]
        material = objects.front[thing]
        flip = ONE
        if wi[2] < ZERO:
            material = objects.back[thing]
            if objects.two_sided[thing] != 0:
                flip = -ONE
                wi = (wi[0], wi[1], -wi[2])
        event = ABSORBED
        if material >= 0:
            numbers = walk_samples(samples, lanes.walk[lane])
            m = load_bsdf(scene.materials, scene.textures, scene.families, material, hit.u, hit.v)

            # ---- connect with the lens: one row for each lobe's share ----
            lobes = lobe_count(m)
            if lobes > 0:
                u, v = lens_numbers(scene.sensor.lens_radius, samples, numbers, block_dimension(depth, DIRECT_POINT))
                lens = sample_lens(scene.sensor, hit.p, u, v)
                if lens.visible:
                    wo = to_local(hit.s, hit.t, hit.n, lens.d)
                    correction = shading_correction(geometry.normals, back, lens.d, hit.ng, wi_cos, wo[2])
                    wo = (wo[0], wo[1], wo[2] * flip)
                    asked = n_paths
                    for lobe in range(lobes):
                        lobe_event, value, _ = eval_bsdf_lobe(scene.families, scene.materials.tables, m, lobe, wi, wo, True)
                        c = scale(mul(beta, value), lens.importance * correction * share)
                        if carries_light(c):
                            end = word
                            if kept:
                                end = extend_word(word, lobe_event, thing)
                                n_words = append_word(words, n_words, end, word, lobe_event, thing)
                            paths.raster[n_paths, 0] = lens.raster_x
                            paths.raster[n_paths, 1] = lens.raster_y
                            n_paths = append_path(
                                paths, n_paths, lane, n_shadow, LENS_SAMPLE, depth, lobe_event, end, lanes.source[lane], lens.point, c, ONE
                            )
                    if n_paths > asked:
                        start = offset_point(hit.p, hit.ng, hit.offset, lens.d)
                        n_shadow = append_shadow_ray(shadow, n_shadow, start, sub(lens.point, start), lens.free / lens.distance)

            # ---- scatter by the adjoint ----
            if depth + 1 >= max_depth:
                event = DEPTH_LIMIT
            else:
                u_lobe, u_roulette = HALF, HALF
                if depth >= rr_depth or m.kind != DIFFUSE:
                    u_lobe, u_roulette = sample_pair(samples, numbers, block_dimension(depth, LOBE_ROULETTE))
                u, v = sample_pair(samples, numbers, block_dimension(depth, DIRECTION))
                s = sample_bsdf(scene.families, scene.materials.tables, m, wi, u_lobe, u, v, True)
                event = s.event
                local = (s.wo[0], s.wo[1], s.wo[2] * flip)
                wo = to_world(hit.s, hit.t, hit.n, local)
                gain = scale(s.weight, shading_correction(geometry.normals, back, wo, hit.ng, wi_cos, local[2]))
                if not carries_light(mul(beta, gain)):
                    event = ABSORBED

                # ---- Russian roulette, by what this bounce keeps ----
                if event != ABSORBED and depth >= rr_depth:
                    survival = min(max3(gain), NEVER_MORE_THAN)
                    if u_roulette >= survival:
                        event = ROULETTE
                    gain = scale(gain, ONE / survival)

                # ---- go on ----
                if event >= DIFFUSE_REFLECTION:
                    end = word
                    if kept:
                        end = extend_word(word, event, thing)
                        n_words = append_word(words, n_words, end, word, event, thing)
                    start = offset_point(hit.p, hit.ng, hit.offset, wo)
                    n_out = append_ray(out, n_out, lane, start, wo, mul(beta, gain), s.pdf, ONE, end)

        # ---- the vertex, with what became of the walk ----
        if kept:
            n_vertices = append_vertex(vertices, n_vertices, lane, depth, event, thing, hit.p, beta)
            set_surface_point(vertices, n_vertices - 1, primitive, hit)
    return Counters(n_out, n_shadow, n_vertices, n_paths, n_words)
