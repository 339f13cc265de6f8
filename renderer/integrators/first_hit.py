"""What the camera sees first: colors of bitmaps there are averages over the pixel's footprint, where the scene asks for it (thesis 4.4.2).

Only colors are averaged. Roughness keeps its value at the point: it is no light, and its channels are not the display's.
"""

import numpy as np

from renderer.bsdfs.base import DIFFUSE, TEXTURE_A, TEXTURE_B, Bsdf
from renderer.integrators.buffers import Lanes
from renderer.kernel import kernel
from renderer.math.vec import ONE, ZERO, Vec3
from renderer.samples import LENS, PrimarySamples, sample_pair, walk_samples
from renderer.scene.arrays import SceneArrays
from renderer.sensors.dispatch import lens_point
from renderer.shapes.base import Hit, Index
from renderer.textures.base import BITMAP, Ewa, Textures
from renderer.textures.ewa import filtered
from renderer.textures.footprint import footprint


@kernel
def is_bitmap(textures: Textures | None, index: Index) -> bool:
    """Whether texture ``index`` is an image."""
    if textures is None:
        return False
    return bool(index >= 0 and textures.kind[index] == BITMAP)


@kernel
def lens_of(lens_radius: np.float32 | None, samples: PrimarySamples, walk: np.uint64) -> Vec3:
    """The point of the lens that a walk came through, in camera space."""
    if lens_radius is None:
        return (ZERO, ZERO, ZERO)
    u, v = sample_pair(samples, walk_samples(samples, walk), LENS)
    return lens_point(lens_radius, u, v)


@kernel
def over_pixel(
    ewa: Ewa | None, textures: Textures | None, scene: SceneArrays, samples: PrimarySamples, lanes: Lanes, lane: Index, primitive: Index, hit: Hit,
    index: Index, color: Vec3,
) -> Vec3:  # fmt: skip
    """The average of bitmap ``index`` over the footprint of the lane's pixel on the surface that its walk met first."""
    if ewa is None or textures is None:
        return color
    lens = lens_of(scene.sensor.lens_radius, samples, np.uint64(lanes.walk[lane]))
    x, y = lanes.raster[lane, 0], lanes.raster[lane, 1]
    place = footprint(scene.sensor, scene.geometry, primitive, hit, x, y, lens)
    return filtered(ewa, textures, index, place, int(x), int(y), primitive, color)


@kernel
def seen_bsdf(
    ewa: Ewa | None, scene: SceneArrays, samples: PrimarySamples, lanes: Lanes, lane: Index, depth: int, primitive: Index, hit: Hit,
    material: Index, m: Bsdf,
) -> Bsdf:  # fmt: skip
    """The BSDF ``m`` of a row of the materials; at depth 1 its colors a and b are averages where they are bitmaps."""
    if ewa is None:
        return m
    if depth > 1:
        return m
    a, b = m.a, m.b
    index = scene.materials.index
    if is_bitmap(scene.textures, index[material, TEXTURE_A]):
        a = over_pixel(ewa, scene.textures, scene, samples, lanes, lane, primitive, hit, index[material, TEXTURE_A], a)
    if m.kind != DIFFUSE and is_bitmap(scene.textures, index[material, TEXTURE_B]):
        b = over_pixel(ewa, scene.textures, scene, samples, lanes, lane, primitive, hit, index[material, TEXTURE_B], b)
    if m.nonlinear != 0:  # light that a plastic keeps inside is a series in its color, which a filter may lift above one
        a = (min(a[0], ONE), min(a[1], ONE), min(a[2], ONE))
    return Bsdf(m.kind, a, b, m.c, m.alpha_u, m.alpha_v, m.eta, m.p_specular, m.internal, m.distribution, m.table, m.nonlinear)


@kernel
def seen_emission(
    ewa: Ewa | None, scene: SceneArrays, samples: PrimarySamples, lanes: Lanes, lane: Index, depth: int, primitive: Index, hit: Hit,
    emitter: Index, radiance: Vec3,
) -> Vec3:  # fmt: skip
    """The radiance of an emitter; at depth 1 an average where it is a bitmap."""
    if ewa is None:
        return radiance
    if depth > 1:
        return radiance
    index = scene.emitters.texture[emitter]
    if is_bitmap(scene.textures, index):
        return over_pixel(ewa, scene.textures, scene, samples, lanes, lane, primitive, hit, index, radiance)
    return radiance
