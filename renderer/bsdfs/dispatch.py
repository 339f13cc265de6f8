"""From a scene's material to a BSDF at a point, and from a BSDF to its family's functions.

``families`` says which families a scene has. Each family beside diffuse is reached through a function that takes the
family's tag first and returns at once where the tag is ``None``: numba then drops the family from the kernel.
"""

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.base import (
    ALPHA_U,
    ALPHA_V,
    CONDUCTOR,
    DIELECTRIC,
    DIFFUSE,
    DISTRIBUTION,
    ETA,
    INTERNAL_REFLECTANCE,
    NO_SAMPLE,
    NONLINEAR,
    PLASTIC,
    ROUGH_CONDUCTOR,
    ROUGH_DIELECTRIC,
    ROUGH_PLASTIC,
    SPECULAR_PROBABILITY,
    TABLE,
    TEXTURE_A,
    TEXTURE_ALPHA_U,
    TEXTURE_ALPHA_V,
    TEXTURE_B,
    THIN_DIELECTRIC,
    Bsdf,
    Families,
    Materials,
    Sample,
)
from renderer.bsdfs.conductor import sample_conductor
from renderer.bsdfs.dielectric import sample_dielectric, sample_thin_dielectric
from renderer.bsdfs.diffuse import eval_diffuse, sample_diffuse
from renderer.bsdfs.plastic import eval_plastic, eval_rough_plastic, sample_plastic, sample_rough_plastic
from renderer.bsdfs.rough_conductor import eval_rough_conductor, sample_rough_conductor
from renderer.bsdfs.rough_dielectric import eval_rough_dielectric, sample_rough_dielectric
from renderer.kernel import kernel
from renderer.math.vec import BLACK, ONE, ZERO, Vec3
from renderer.tables import ABSORBED
from renderer.textures.base import Textures
from renderer.textures.lookup import texture_rgb

INT_ZERO = np.int32(0)
INT_ONE = np.int32(1)
INT_TWO = np.int32(2)
NO_EVENT = np.int32(ABSORBED)
NO_LOBE = (NO_EVENT, BLACK, ZERO)
MIN_ALPHA = np.float32(1e-4)
# Luminance of linear sRGB, by which a color texture gives a roughness
LUMINANCE_R, LUMINANCE_G, LUMINANCE_B = np.float32(0.212671), np.float32(0.715160), np.float32(0.072169)

Lobe = tuple[np.int32, Vec3, np.float32]  # event, f |cos theta_o|, p_l pdf_l


# --- a material at a point ----------------------------------------------------------------------------------------


@kernel
def load_bsdf(materials: Materials, textures: Textures | None, families: Families, b: int, u: np.float32, v: np.float32) -> Bsdf:
    """The BSDF of material row b (not negative) at texture coordinates (u, v)."""
    kind = materials.kind[b]
    a = texture_rgb(textures, materials.index[b, TEXTURE_A], color(materials, b, 0), u, v)
    if kind == DIFFUSE:
        return plain_bsdf(kind, a)
    return load_interface(families.specular, families.microfacet, families.plastic, materials, textures, b, a, u, v)


@kernel
def color(materials: Materials, b: int, column: int) -> Vec3:
    """Color a, b or c (column 0, 1, 2) of a material."""
    return (materials.rgb[b, column, 0], materials.rgb[b, column, 1], materials.rgb[b, column, 2])


@kernel
def plain_bsdf(kind: np.int32, a: Vec3) -> Bsdf:
    """A BSDF that is nothing but its kind and color a."""
    return Bsdf(kind, a, BLACK, BLACK, ONE, ONE, ONE, ZERO, ZERO, INT_ZERO, INT_ZERO, INT_ZERO)


@kernel
def load_interface(
    specular: bool | None,
    microfacet: bool | None,
    plastic: bool | None,
    materials: Materials,
    textures: Textures | None,
    b: int,
    a: Vec3,
    u: np.float32,
    v: np.float32,
) -> Bsdf:
    """All that conductors, dielectrics and plastics are made of; the scene may lack every one of them."""
    kind = materials.kind[b]
    if specular is None and microfacet is None and plastic is None:
        return plain_bsdf(kind, a)
    index = materials.index
    scalar = materials.scalar
    return Bsdf(
        kind,
        a,
        texture_rgb(textures, index[b, TEXTURE_B], color(materials, b, 1), u, v),
        color(materials, b, 2),
        load_alpha(textures, index[b, TEXTURE_ALPHA_U], scalar[b, ALPHA_U], u, v),
        load_alpha(textures, index[b, TEXTURE_ALPHA_V], scalar[b, ALPHA_V], u, v),
        scalar[b, ETA],
        scalar[b, SPECULAR_PROBABILITY],
        scalar[b, INTERNAL_REFLECTANCE],
        index[b, DISTRIBUTION],
        index[b, TABLE],
        index[b, NONLINEAR],
    )


@kernel
def load_alpha(textures: Textures | None, index: int, constant: np.float32, u: np.float32, v: np.float32) -> np.float32:
    """A roughness, never below 1e-4."""
    r, g, b = texture_rgb(textures, index, (constant, constant, constant), u, v)
    return max(MIN_ALPHA, LUMINANCE_R * r + LUMINANCE_G * g + LUMINANCE_B * b)


# --- scattering ---------------------------------------------------------------------------------------------------


@kernel
def lobe_count(m: Bsdf) -> np.int32:
    """How many smooth lobes ``eval_bsdf_lobe`` knows: 0 for a purely specular BSDF."""
    kind = m.kind
    if kind in (ROUGH_DIELECTRIC, ROUGH_PLASTIC):
        return INT_TWO
    if kind in (DIFFUSE, ROUGH_CONDUCTOR, PLASTIC):
        return INT_ONE
    return INT_ZERO


@kernel
def sample_bsdf(
    families: Families,
    tables: npt.NDArray[np.float32] | None,
    m: Bsdf,
    wi: Vec3,
    u_lobe: np.float32,
    u: np.float32,
    v: np.float32,
    adjoint: bool,
) -> Sample:
    """Choose a lobe with ``u_lobe``, then a direction with (u, v); event ABSORBED where there is none."""
    kind = m.kind
    if kind == DIFFUSE:
        return sample_diffuse(m, wi, u, v)
    if kind in (ROUGH_CONDUCTOR, ROUGH_DIELECTRIC):
        return sample_microfacet(families.microfacet, m, wi, u_lobe, u, v, adjoint)
    if kind in (PLASTIC, ROUGH_PLASTIC):
        return sample_plastics(families.plastic, tables, m, wi, u_lobe, u, v)
    return sample_specular(families.specular, m, wi, u_lobe, adjoint)


@kernel
def eval_bsdf_lobe(families: Families, tables: npt.NDArray[np.float32] | None, m: Bsdf, lobe: int, wi: Vec3, wo: Vec3, adjoint: bool) -> Lobe:
    """Event, f |cos theta_o| and density p_l pdf_l of one smooth lobe, 0 <= lobe < ``lobe_count(m)``."""
    kind = m.kind
    if kind == DIFFUSE:
        return eval_diffuse(m, wi, wo)
    if kind in (ROUGH_CONDUCTOR, ROUGH_DIELECTRIC):
        return eval_microfacet(families.microfacet, m, lobe, wi, wo, adjoint)
    if kind in (PLASTIC, ROUGH_PLASTIC):
        return eval_plastics(families.plastic, tables, m, lobe, wi, wo)
    return NO_LOBE


# --- families, each behind its tag --------------------------------------------------------------------------------


@kernel
def sample_specular(tag: bool | None, m: Bsdf, wi: Vec3, u_lobe: np.float32, adjoint: bool) -> Sample:
    """Conductor, dielectric or thin dielectric."""
    if tag is None:
        return NO_SAMPLE
    if m.kind == CONDUCTOR:
        return sample_conductor(m, wi)
    if m.kind == DIELECTRIC:
        return sample_dielectric(m, wi, u_lobe, adjoint)
    if m.kind == THIN_DIELECTRIC:
        return sample_thin_dielectric(m, wi, u_lobe)
    return NO_SAMPLE


@kernel
def sample_microfacet(tag: bool | None, m: Bsdf, wi: Vec3, u_lobe: np.float32, u: np.float32, v: np.float32, adjoint: bool) -> Sample:
    """Rough conductor or rough dielectric."""
    if tag is None:
        return NO_SAMPLE
    if m.kind == ROUGH_CONDUCTOR:
        return sample_rough_conductor(m, wi, u, v)
    return sample_rough_dielectric(m, wi, u_lobe, u, v, adjoint)


@kernel
def eval_microfacet(tag: bool | None, m: Bsdf, lobe: int, wi: Vec3, wo: Vec3, adjoint: bool) -> Lobe:
    """Rough conductor or rough dielectric."""
    if tag is None:
        return NO_LOBE
    if m.kind == ROUGH_CONDUCTOR:
        return eval_rough_conductor(m, wi, wo)
    return eval_rough_dielectric(m, lobe, wi, wo, adjoint)


@kernel
def sample_plastics(
    tag: bool | None, tables: npt.NDArray[np.float32] | None, m: Bsdf, wi: Vec3, u_lobe: np.float32, u: np.float32, v: np.float32
) -> Sample:
    """Plastic or rough plastic."""
    if tag is None:
        return NO_SAMPLE
    if m.kind == PLASTIC:
        return sample_plastic(m, wi, u_lobe, u, v)
    return sample_rough_plastic(m, tables, wi, u_lobe, u, v)


@kernel
def eval_plastics(tag: bool | None, tables: npt.NDArray[np.float32] | None, m: Bsdf, lobe: int, wi: Vec3, wo: Vec3) -> Lobe:
    """Plastic or rough plastic."""
    if tag is None:
        return NO_LOBE
    if m.kind == PLASTIC:
        return eval_plastic(m, wi, wo)
    return eval_rough_plastic(m, tables, lobe, wi, wo)
