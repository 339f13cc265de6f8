"""The path tracer's minimal twin: one walk at a time, in plain Python, to learn from and to check the wavefront against.

It draws the same primary samples and asks the same BSDFs, emitters and sensor as ``path``, but it shares none of the
wavefront: rays are tested against every triangle, in float64, and nothing is batched, compacted or recorded.

Run it with ``NUMBA_DISABLE_JIT=1``: then the functions that it shares with the kernels are plain Python too, and float32
stays float32 (a compiled function hands Python its own floats).
"""

from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from renderer.bsdfs.dispatch import eval_bsdf_lobe, load_bsdf, lobe_count, sample_bsdf
from renderer.emitters.dispatch import emitted, pdf_direction, sample_direction, sky_pdf, sky_radiance
from renderer.math.vec import FAR, to_local, to_world
from renderer.samples import (
    DIRECT_CHOICE,
    DIRECT_POINT,
    DIRECTION,
    FILM,
    LENS,
    LOBE_ROULETTE,
    block_dimension,
    primary_samples,
    sample_pair,
    walk_samples,
)
from renderer.scene.arrays import Scene
from renderer.sensors.dispatch import clip_distance, sample_ray
from renderer.settings import TraceSettings
from renderer.shapes.quadrics import intersect_quadrics
from renderer.shapes.surface import offset_point, surface
from renderer.tables import ABSORBED

F64 = npt.NDArray[np.float64]
HALF = np.float32(0.5)


class MinimalPathTracer:
    """``radiance(walk)`` is what the wavefront adds to the film for that walk."""

    def __init__(self, scene: Scene, settings: TraceSettings) -> None:
        self.scene = scene.arrays
        self.settings = settings
        self.samples = primary_samples(settings)

    def radiance(self, walk: int) -> F64:
        """The radiance, float64 (3,), that one camera walk estimates. Raises RuntimeError where kernels are compiled."""
        if not numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
            raise RuntimeError("the minimal path tracer runs in plain Python: set NUMBA_DISABLE_JIT=1 before starting Python")
        scene, emitters, textures = self.scene, self.scene.emitters, self.scene.textures
        numbers = walk_samples(self.samples, np.uint64(walk))
        o, d, far = self.camera_ray(walk, numbers)
        total, beta = np.zeros(3), np.ones(3)
        last_pdf, eta = 0.0, 1.0
        for depth in range(1, self.settings.max_depth + 1):
            # the next surface, or the sky
            primitive, t = self.closest(o, d, far)
            far = np.inf
            if primitive < 0:
                if emitters.infinite >= 0:
                    weight = power_heuristic(last_pdf, sky_pdf(emitters, d)) if last_pdf > 0 else 1.0
                    total += beta * sky_radiance(emitters, d) * weight
                break
            hit = surface(scene.geometry, primitive, o, d, t)
            wi = to_local(hit.s, hit.t, hit.n, (-d[0], -d[1], -d[2]))

            # light that it emits
            emitter = scene.objects.emitter[hit.object]
            cos_light = np.float32(-np.dot(hit.ng, d))
            if emitter >= 0 and cos_light > 0:
                weight = 1.0
                if last_pdf > 0:
                    weight = power_heuristic(last_pdf, pdf_direction(emitters, scene.geometry, emitter, o, d, t, cos_light, primitive))
                total += beta * emitted(emitters, textures, emitter, hit.u, hit.v) * weight

            # its material, seen from its front
            behind = wi[2] < 0
            material = scene.objects.back[hit.object] if behind else scene.objects.front[hit.object]
            if depth == self.settings.max_depth or material < 0:
                break
            flip = np.float32(-1 if behind and scene.objects.two_sided[hit.object] else 1)
            wi = (wi[0], wi[1], wi[2] * flip)
            m = load_bsdf(scene.materials, textures, scene.families, material, hit.u, hit.v)

            # light from one emitter
            if lobe_count(m):
                u_choice, _ = self.pair(numbers, depth, DIRECT_CHOICE)
                u, v = self.pair(numbers, depth, DIRECT_POINT)
                light = sample_direction(emitters, scene.geometry, textures, hit.p, u_choice, u, v)
                start = offset_point(hit.p, hit.ng, hit.offset, light.d)
                if max(light.weight) > 0 and self.sees(start, light):
                    wo = to_local(hit.s, hit.t, hit.n, light.d)
                    for lobe in range(lobe_count(m)):
                        _, value, pdf = eval_bsdf_lobe(scene.families, scene.materials.tables, m, lobe, wi, (wo[0], wo[1], wo[2] * flip), False)
                        total += beta * value * light.weight * (power_heuristic(light.pdf, pdf) if light.pdf > 0 else 1.0)

            # the next direction
            u_lobe, u_roulette = self.pair(numbers, depth, LOBE_ROULETTE)
            s = sample_bsdf(scene.families, scene.materials.tables, m, wi, u_lobe, *self.pair(numbers, depth, DIRECTION), False)
            beta = beta * s.weight
            eta *= float(s.eta)
            if s.event == ABSORBED or not beta.any():
                break

            # Russian roulette
            if depth >= self.settings.rr_depth:
                survival = min(beta.max() * eta * eta, 0.95)
                if u_roulette >= survival:
                    break
                beta = beta / survival
            d = to_world(hit.s, hit.t, hit.n, (s.wo[0], s.wo[1], s.wo[2] * flip))
            o = offset_point(hit.p, hit.ng, hit.offset, d)
            last_pdf = float(s.pdf)
        return total

    def camera_ray(self, walk: int, numbers: Any) -> tuple[Any, Any, float]:
        """Origin, direction and reach of a walk's first ray."""
        pixel = walk % self.settings.walks_per_pass
        u, v = sample_pair(self.samples, numbers, FILM)
        sensor = self.scene.sensor
        lens = (HALF, HALF) if sensor.lens_radius is None else sample_pair(self.samples, numbers, LENS)
        x, y = np.float32(pixel % sensor.width) + u, np.float32(pixel // sensor.width) + v
        o, d = sample_ray(sensor, np.float32(x), np.float32(y), *lens)
        return o, d, float(clip_distance(sensor, d))

    def pair(self, numbers: Any, depth: int, purpose: int) -> tuple[np.float32, np.float32]:
        """Two primary samples of a purpose at a depth."""
        return sample_pair(self.samples, numbers, block_dimension(depth, purpose))  # type: ignore[no-any-return]

    def sees(self, start: Any, light: Any) -> bool:
        """Whether nothing lies between ``start`` and the sampled light."""
        if light.distance >= FAR:
            return bool(self.closest(start, light.d, np.inf)[0] < 0)
        segment = np.subtract(light.endpoint, start)
        return bool(self.closest(start, tuple(segment), 1.0)[0] < 0)

    def closest(self, o: Any, d: Any, far: float) -> tuple[int, np.float32]:
        """The primitive that a ray meets first within ``far`` (in units of |d|), -1 for none, and its distance (moller1997)."""
        g = self.scene.geometry
        direction = np.asarray(d, np.float64)
        e1, e2, s = g.e1.astype(np.float64), g.e2.astype(np.float64), np.asarray(o, np.float64) - g.p0
        h = np.cross(direction, e2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (e1 * h).sum(1)
            b1 = (s * h).sum(1) * inverse
            q = np.cross(s, e1)
            b2 = q @ direction * inverse
            t = (e2 * q).sum(1) * inverse
            inside = (b1 >= 0) & (b2 >= 0) & (b1 + b2 <= 1) & (t > 0) & (t < far)
        t = np.where(inside, t, np.inf)
        nearest = int(t.argmin()) if len(t) else -1
        best = np.array([min(t[nearest] if len(t) else np.inf, far, FAR)], np.float32)
        primitive = np.array([nearest if len(t) and inside[nearest] else -1], np.int32)
        if g.quadrics is not None:
            origin = np.asarray(o, np.float32)[None]
            intersect_quadrics(g.quadrics, len(g.p0), origin, direction.astype(np.float32)[None], best, primitive, 1)
        return int(primitive[0]), best[0]


def power_heuristic(p: float | np.float32, q: float | np.float32) -> float:
    """The power heuristic's weight of density p against q (veach1997)."""
    return float(p) ** 2 / (float(p) ** 2 + float(q) ** 2)
