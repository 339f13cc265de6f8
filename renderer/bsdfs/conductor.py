"""The smooth conductor: a one-sided mirror with Fresnel's reflectance, one delta lobe."""

import numpy as np

from renderer.bsdfs.base import NO_SAMPLE, Bsdf, Sample
from renderer.kernel import kernel
from renderer.math.fresnel import fresnel_conductor_rgb, reflect
from renderer.math.vec import ONE, ZERO, Vec3, mul
from renderer.tables import SPECULAR_REFLECTION

EVENT = np.int32(SPECULAR_REFLECTION)


@kernel
def sample_conductor(m: Bsdf, wi: Vec3) -> Sample:
    """The mirror direction, weighted by Fresnel's reflectance times the specular reflectance."""
    if wi[2] <= ZERO:
        return NO_SAMPLE
    return Sample(EVENT, reflect(wi), mul(m.a, fresnel_conductor_rgb(wi[2], m.b, m.c)), ZERO, ONE)
