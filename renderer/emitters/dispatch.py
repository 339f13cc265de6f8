"""All emitters behind one interface: what camera walks and light walks ask of a scene's light.

One emitter is chosen uniformly and its probability is inside every density and weight. Kinds that a scene lacks cost
nothing: their functions take a tag of ``Emitters`` (``curved``, ``delta``, ``sky``) and are pruned where it is None.
"""

import numpy as np

from renderer.emitters.base import (
    AREA,
    AREA_RECTANGLE,
    NO_DIRECTION,
    DirectionSample,
    Emitters,
)
from renderer.emitters.rectangle import pdf_area, sample_rectangle
from renderer.kernel import kernel
from renderer.math.vec import ONE, Vec3, row
from renderer.shapes.base import Geometry
from renderer.textures.base import Textures
from renderer.textures.lookup import texture_rgb


@kernel
def select_emitter(emitters: Emitters, u: np.float32) -> tuple[np.int32, np.float32]:
    """An emitter chosen uniformly, and the probability of the choice."""
    count = emitters.kind.shape[0]
    emitter = min(np.int32(u * np.float32(count)), np.int32(count - 1))
    return emitter, ONE / np.float32(count)


@kernel
def sample_direction(
    emitters: Emitters, geometry: Geometry, textures: Textures | None, p: Vec3, u_select: np.float32, u: np.float32, v: np.float32
) -> DirectionSample:
    """Sample light that reaches the world point ``p`` (visibility aside)."""
    emitter, select = select_emitter(emitters, u_select)
    kind = emitters.kind[emitter]
    if kind == AREA_RECTANGLE:
        return sample_rectangle(emitters, geometry, textures, emitter, p, u, v, select)
    return NO_DIRECTION


@kernel
def pdf_direction(
    emitters: Emitters,
    geometry: Geometry,
    emitter: int,
    p: Vec3,
    d: Vec3,
    distance: np.float32,
    cos_light: np.float32,
    primitive: int,
) -> np.float32:
    """Density per steradian with which ``sample_direction`` finds the point of an area emitter that a ray from ``p`` met.

    ``distance`` is from ``p`` to that point, ``cos_light`` the cosine there between the light's geometric normal and -d.
    """
    select = ONE / np.float32(emitters.kind.shape[0])
    return pdf_area(distance, cos_light, select / emitters.scalar[emitter, AREA])


@kernel
def emitted(emitters: Emitters, textures: Textures | None, emitter: int, u: np.float32, v: np.float32) -> Vec3:
    """Radiance of an area emitter at texture coordinates (u, v), on its front side (the caller checks the side)."""
    return texture_rgb(textures, emitters.texture[emitter], row(emitters.rgb, emitter), u, v)
