"""Lambert's diffuse reflection: one-sided, one lobe, value a / pi."""

import numpy as np

from renderer.bsdfs.base import NO_SAMPLE, Bsdf, Sample
from renderer.kernel import kernel
from renderer.math.vec import BLACK, ONE, ZERO, Vec3, scale
from renderer.math.warp import pdf_cosine_hemisphere, sample_cosine_hemisphere
from renderer.tables import DIFFUSE_REFLECTION

EVENT = np.int32(DIFFUSE_REFLECTION)


@kernel
def sample_diffuse(m: Bsdf, wi: Vec3, u: np.float32, v: np.float32) -> Sample:
    """A cosine-distributed direction; its weight is the reflectance."""
    if wi[2] <= ZERO:
        return NO_SAMPLE
    wo = sample_cosine_hemisphere(u, v)
    pdf = pdf_cosine_hemisphere(wo[2])
    if pdf <= ZERO:
        return NO_SAMPLE
    return Sample(EVENT, wo, m.a, pdf, ONE)


@kernel
def eval_diffuse(m: Bsdf, wi: Vec3, wo: Vec3) -> tuple[np.int32, Vec3, np.float32]:
    """Event, reflectance / pi * cos, and the cosine density; zero where either direction is below the surface."""
    if wi[2] <= ZERO or wo[2] <= ZERO:
        return EVENT, BLACK, ZERO
    pdf = pdf_cosine_hemisphere(wo[2])
    return EVENT, scale(m.a, pdf), pdf
