"""The contract of a BSDF.

Directions are unit vectors in the shading frame, z along the normal, both pointing away from the surface: ``wi`` to
where the walk came from, ``wo`` to where it goes. With ``adjoint`` true the walk carries importance's dual (a light
walk), so transmission keeps its value instead of being scaled by eta² (thesis Eq. 5.37).

A BSDF is a sum of *lobes*, each with its own event. Each family of BSDFs is one file with, for every kind:

- ``sample_<kind>(m, …, wi, u_lobe, u, v, adjoint) -> Sample``: choose a lobe with probability ``p_l``, then a direction
  from that lobe's own density.
- ``eval_<kind>(m, …, lobe, wi, wo, adjoint) -> (f |cos|, pdf)``: one smooth lobe's value, color times |cos theta_o|, and
  its density ``p_l * pdf_l`` per steradian (never the mixture's: one lobe's light must not smear into another's class).
  A delta lobe gives zero and zero.

``weight`` is f |cos| / (p_l pdf_l) of the sampled lobe, so each class's energy is unbiased by itself.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.math.vec import BLACK, ONE, ZERO, Vec3
from renderer.tables import ABSORBED

# Kinds, the values of Materials.kind
DIFFUSE, CONDUCTOR, ROUGH_CONDUCTOR, DIELECTRIC, ROUGH_DIELECTRIC, THIN_DIELECTRIC, PLASTIC, ROUGH_PLASTIC = range(8)
KINDS = ("diffuse", "conductor", "roughconductor", "dielectric", "roughdielectric", "thindielectric", "plastic", "roughplastic")

# Columns of Materials.scalar
ALPHA_U, ALPHA_V, ETA, SPECULAR_PROBABILITY, INTERNAL_REFLECTANCE = range(5)
# Columns of Materials.index
TEXTURE_A, TEXTURE_B, TEXTURE_ALPHA_U, TEXTURE_ALPHA_V, DISTRIBUTION, TABLE, NONLINEAR = range(7)
BECKMANN, GGX = 0, 1


class Families(NamedTuple):
    """Which families of BSDFs a scene uses beside diffuse: True, or None so that kernels lose the rest."""

    specular: bool | None  # conductor, dielectric, thindielectric
    microfacet: bool | None  # roughconductor, roughdielectric
    plastic: bool | None  # plastic, roughplastic


class Materials(NamedTuple):
    """One row for each BSDF.

    ``rgb[b]`` holds colors a, b, c: diffuse: a reflectance. Conductors: a specular reflectance, b eta, c k. Dielectrics:
    a specular reflectance, b specular transmittance. Plastics: a diffuse reflectance, b specular reflectance.
    """

    kind: npt.NDArray[np.int32]  # (nb,)
    rgb: npt.NDArray[np.float32]  # (nb, 3, 3)
    scalar: npt.NDArray[np.float32]  # (nb, 5) alpha along the tangents, relative IOR int/ext, p(specular), internal reflectance
    index: npt.NDArray[np.int32]  # type: ignore[assignment]  # (nb, 7) textures of a, b, alpha (-1: constant), distribution, table, nonlinear
    tables: npt.NDArray[np.float32] | None  # (n, 64) rough plastics' transmittance over cos theta in [0, 1]


class Bsdf(NamedTuple):
    """One BSDF at one point, its textures looked up: what the families' functions read."""

    kind: Any  # int32
    a: Vec3
    b: Vec3
    c: Vec3
    alpha_u: Any  # float32, roughness along the first tangent
    alpha_v: Any  # float32, along the second
    eta: Any  # float32, interior index of refraction over exterior
    p_specular: Any  # float32, probability weight of the specular lobe of plastics (Mitsuba's specular sampling weight)
    internal: Any  # float32, diffuse internal reflectance of plastics
    distribution: Any  # int32, BECKMANN or GGX
    table: Any  # int32, row of Materials.tables
    nonlinear: Any  # int32, plastics: color shifts by internal scattering


class Sample(NamedTuple):
    """What ``sample`` gives. ``event`` is ABSORBED where there is no direction; ``pdf`` is zero for delta lobes."""

    event: Any  # int32, key into tables.EVENTS
    wo: Vec3
    weight: Vec3  # f |cos| / (p_l pdf_l)
    pdf: Any  # float32, p_l * pdf_l per steradian
    eta: Any  # float32, relative index of refraction along the walk: 1, or eta_t / eta_i where it is transmitted


NO_SAMPLE = Sample(np.int32(ABSORBED), BLACK, BLACK, ZERO, ONE)
