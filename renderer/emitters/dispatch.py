"""All emitters behind one interface: what camera walks and light walks ask of a scene's light.

One emitter is chosen uniformly and its probability is inside every density and weight. Kinds that a scene lacks cost
nothing: their functions take a tag of ``Emitters`` (``curved``, ``delta``, ``sky``) and are pruned where it is None.
"""

import numpy as np

from renderer.emitters import emission
from renderer.emitters.base import AREA, AREA_CYLINDER, AREA_RECTANGLE, DIRECTIONAL, DirectionSample, EmissionSample, Emitters
from renderer.emitters.curved import pdf_curved, sample_curved
from renderer.emitters.delta import sample_delta
from renderer.emitters.rectangle import pdf_area, sample_rectangle
from renderer.emitters.sky import pdf_toward, radiance_from, sample_sky_direction
from renderer.kernel import kernel
from renderer.math.vec import ONE, Vec3, row
from renderer.shapes.base import Geometry, Index
from renderer.textures.base import Textures
from renderer.textures.lookup import texture_rgb

emission_toward = emission.emission_toward
emit = emission.emission


@kernel
def select_emitter(emitters: Emitters, u: np.float32) -> tuple[np.int32, np.float32]:
    """An emitter chosen uniformly, and the probability of the choice."""
    count = emitters.kind.shape[0]
    return np.int32(min(np.int64(u * np.float32(count)), count - 1)), ONE / np.float32(count)


@kernel
def sample_direction(
    emitters: Emitters, geometry: Geometry, textures: Textures | None, p: Vec3, u_select: np.float32, u: np.float32, v: np.float32
) -> DirectionSample:
    """Sample light that reaches the world point ``p`` (visibility aside)."""
    emitter, select = select_emitter(emitters, u_select)
    kind = emitters.kind[emitter]
    if kind == AREA_RECTANGLE:
        return sample_rectangle(emitters, geometry, textures, emitter, p, u, v, select)
    if kind <= AREA_CYLINDER:
        return sample_curved(emitters.curved, emitters, geometry, textures, emitter, p, u, v, select)
    if kind <= DIRECTIONAL:
        return sample_delta(emitters.delta, emitters, emitter, p, select)
    return sample_sky_direction(emitters.sky, emitters, u, v, select)


@kernel
def pdf_direction(
    emitters: Emitters, geometry: Geometry, emitter: Index, p: Vec3, d: Vec3, distance: np.float32, cos_light: np.float32, primitive: Index
) -> np.float32:
    """Density per steradian with which ``sample_direction`` finds the point of an area emitter that a ray from ``p`` met.

    ``p`` is the point that ``sample_direction`` would be given, to a ray's offset; ``distance`` is from there to the light's point,
    ``cos_light`` the cosine there between the light's geometric normal and -d. Zero behind the light.
    """
    select = ONE / np.float32(emitters.kind.shape[0])
    if emitters.kind[emitter] == AREA_RECTANGLE:
        return pdf_area(distance, cos_light, select / emitters.scalar[emitter, AREA])
    return pdf_curved(emitters.curved, emitters, geometry, emitter, p, distance, cos_light, primitive, select)


@kernel
def emitted(emitters: Emitters, textures: Textures | None, emitter: Index, u: np.float32, v: np.float32) -> Vec3:
    """Radiance of an area emitter at texture coordinates (u, v), on its front side (the caller checks the side)."""
    return texture_rgb(textures, emitters.texture[emitter], row(emitters.rgb, emitter), u, v)


@kernel
def sky_radiance(emitters: Emitters, d: Vec3) -> Vec3:
    """Radiance that an escaped ray with unit direction ``d`` finds; black where the scene has no sky."""
    return radiance_from(emitters.sky, emitters, d)


@kernel
def sky_pdf(emitters: Emitters, d: Vec3) -> np.float32:
    """Density per steradian with which ``sample_direction`` gives the direction ``d`` of the sky; zero where there is none."""
    return pdf_toward(emitters.sky, emitters, d) / np.float32(emitters.kind.shape[0])


@kernel
def sample_emission(
    emitters: Emitters,
    geometry: Geometry,
    textures: Textures | None,
    u_select: np.float32,
    u1: np.float32,
    u2: np.float32,
    u3: np.float32,
    u4: np.float32,
) -> EmissionSample:
    """A ray of light: (u1, u2) choose where it starts on the emitter, (u3, u4) its direction."""
    emitter, select = select_emitter(emitters, u_select)
    return emit(emitters, geometry, textures, emitter, u1, u2, u3, u4, select)
