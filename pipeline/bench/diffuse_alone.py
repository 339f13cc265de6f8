"""A path tracer that knows diffuse surfaces and rectangular lights and nothing else, made by taking the rest out of ``interact``.

Only for processes with a kernel cache of their own: numba's cache cannot tell these kernels from the program's.
"""

import numpy as np

from renderer.bsdfs.base import DIFFUSE, Bsdf, Families, Materials, Sample
from renderer.bsdfs.diffuse import eval_diffuse, sample_diffuse
from renderer.bsdfs.dispatch import color, plain_bsdf
from renderer.emitters.base import AREA, DirectionSample, Emitters
from renderer.emitters.rectangle import pdf_area, sample_rectangle
from renderer.integrators import path
from renderer.kernel import kernel
from renderer.math.vec import BLACK, ONE, ZERO, Vec3, row
from renderer.shapes.base import Geometry, Hit, Index
from renderer.shapes.surface import barycentrics, triangle_at

KIND = np.int32(DIFFUSE)
ONE_LOBE = np.int32(1)


@kernel
def load_diffuse(materials: Materials, textures: None, families: Families, b: int, u: np.float32, v: np.float32) -> Bsdf:
    """The BSDF of material row b: a reflectance."""
    return plain_bsdf(KIND, color(materials, b, 0))


@kernel
def one_lobe(m: Bsdf) -> np.int32:
    """Diffuse has one lobe."""
    return ONE_LOBE


@kernel
def sample_only(families: Families, tables: None, m: Bsdf, wi: Vec3, u_lobe: np.float32, u: np.float32, v: np.float32, adjoint: bool) -> Sample:
    """Diffuse scattering."""
    return sample_diffuse(m, wi, u, v)


@kernel
def eval_only(families: Families, tables: None, m: Bsdf, lobe: int, wi: Vec3, wo: Vec3, adjoint: bool) -> tuple[np.int32, Vec3, np.float32]:
    """Diffuse scattering's value and density."""
    return eval_diffuse(m, wi, wo)


@kernel
def rectangle_direction(
    emitters: Emitters, geometry: Geometry, textures: None, p: Vec3, u_select: np.float32, u: np.float32, v: np.float32
) -> DirectionSample:
    """Light from one of the rectangles, chosen uniformly."""
    count = emitters.kind.shape[0]
    emitter = np.int32(min(np.int64(u_select * np.float32(count)), count - 1))
    return sample_rectangle(emitters, geometry, textures, emitter, p, u, v, ONE / np.float32(count))


@kernel
def rectangle_pdf(
    emitters: Emitters, geometry: Geometry, emitter: Index, p: Vec3, d: Vec3, distance: np.float32, cos_light: np.float32, primitive: Index
) -> np.float32:
    """Density per steradian of ``rectangle_direction``."""
    return pdf_area(distance, cos_light, ONE / (np.float32(emitters.kind.shape[0]) * emitters.scalar[emitter, AREA]))


@kernel
def rectangle_radiance(emitters: Emitters, textures: None, emitter: Index, u: np.float32, v: np.float32) -> Vec3:
    """Radiance of a rectangle."""
    return row(emitters.rgb, emitter)


@kernel
def no_radiance(emitters: Emitters, d: Vec3) -> Vec3:
    """There is no sky."""
    return BLACK


@kernel
def no_density(emitters: Emitters, d: Vec3) -> np.float32:
    """There is no sky."""
    return ZERO


@kernel
def triangle_surface(geometry: Geometry, primitive: Index, o: Vec3, d: Vec3, t: np.float32) -> Hit:
    """The point of a triangle that a ray met."""
    b1, b2 = barycentrics(geometry, primitive, o, d)
    return triangle_at(geometry, primitive, b1, b2)


REPLACED = {
    "load_bsdf": load_diffuse,
    "lobe_count": one_lobe,
    "sample_bsdf": sample_only,
    "eval_bsdf_lobe": eval_only,
    "sample_direction": rectangle_direction,
    "pdf_direction": rectangle_pdf,
    "emitted": rectangle_radiance,
    "sky_radiance": no_radiance,
    "sky_pdf": no_density,
    "surface": triangle_surface,
}
"""What ``interact`` calls, and what it calls in its place."""


def take_out_the_rest() -> None:
    """Put the simpler functions in place. Call it before any kernel is compiled."""
    for name, simple in REPLACED.items():
        if not hasattr(path, name):
            raise AttributeError(f"renderer.integrators.path calls no {name} any more: the build with diffuse alone must follow it")
        setattr(path, name, simple)
