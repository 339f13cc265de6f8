"""Materials for the tests of BSDFs, in our arrays and in Mitsuba, and kernels that sample and evaluate many at once."""

import functools
from typing import Any

import mitsuba as mi
import numpy as np

from renderer.bsdfs.base import KINDS, Families, Materials
from renderer.bsdfs.dispatch import eval_bsdf_lobe, load_bsdf, lobe_count, sample_bsdf
from renderer.bsdfs.tables import (
    internal_diffuse_reflectance,
    rough_internal_reflectance,
    rough_plastic_table,
    specular_sampling_weight,
)
from renderer.kernel import kernel
from renderer.tables import (
    DIFFUSE_REFLECTION,
    GLOSSY_REFLECTION,
    GLOSSY_TRANSMISSION,
)

mi.set_variant("scalar_rgb")

ALL_FAMILIES = Families(True, True, True)
Array = np.ndarray


# --- materials, from the dictionaries that Mitsuba takes -----------------------------------------------------------


def rgb(*value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


GOLD = {"eta": rgb(0.14, 0.37, 1.44), "k": rgb(3.98, 2.39, 1.60), "specular_reflectance": rgb(0.9, 0.8, 0.7)}
GLASS = {"int_ior": 1.5, "ext_ior": 1.0, "specular_reflectance": rgb(0.9, 0.8, 0.7), "specular_transmittance": rgb(0.6, 0.7, 0.8)}
PAINT = {"int_ior": 1.49, "ext_ior": 1.0, "diffuse_reflectance": rgb(0.2, 0.5, 0.8), "specular_reflectance": rgb(0.9, 0.8, 0.7)}

DELTA = {
    "conductor": {"type": "conductor", **GOLD},
    "dielectric": {"type": "dielectric", **GLASS},
    "thindielectric": {"type": "thindielectric", **GLASS},
}
SMOOTH = {
    "diffuse": {"type": "diffuse", "reflectance": rgb(0.2, 0.5, 0.8)},
    "plastic": {"type": "plastic", **PAINT},
    "plastic-nonlinear": {"type": "plastic", **PAINT, "nonlinear": True},
}
for _name in ("beckmann", "ggx"):
    for _alpha in (0.1, 0.5, 1.0):
        SMOOTH[f"roughconductor-{_name}-{_alpha}"] = {"type": "roughconductor", "distribution": _name, "alpha": _alpha, **GOLD}
        SMOOTH[f"roughdielectric-{_name}-{_alpha}"] = {"type": "roughdielectric", "distribution": _name, "alpha": _alpha, **GLASS}
    SMOOTH[f"roughconductor-{_name}-aniso"] = {"type": "roughconductor", "distribution": _name, "alpha_u": 0.15, "alpha_v": 0.4, **GOLD}
    SMOOTH[f"roughdielectric-{_name}-aniso"] = {"type": "roughdielectric", "distribution": _name, "alpha_u": 0.4, "alpha_v": 0.2, **GLASS}
    SMOOTH[f"roughplastic-{_name}-0.2"] = {"type": "roughplastic", "distribution": _name, "alpha": 0.2, **PAINT}
    SMOOTH[f"roughplastic-{_name}-0.6"] = {"type": "roughplastic", "distribution": _name, "alpha": 0.6, **PAINT, "nonlinear": True}
CASES = {**DELTA, **SMOOTH}


EVENTS = {
    "diffuse": (DIFFUSE_REFLECTION,),
    "plastic": (DIFFUSE_REFLECTION,),
    "roughconductor": (GLOSSY_REFLECTION,),
    "roughdielectric": (GLOSSY_REFLECTION, GLOSSY_TRANSMISSION),
    "roughplastic": (GLOSSY_REFLECTION, DIFFUSE_REFLECTION),
}


def materials_of(description: dict[str, Any]) -> Materials:
    """One row of materials with the meaning of a Mitsuba dictionary."""
    kind = description["type"]
    distribution = ("beckmann", "ggx").index(description.get("distribution", "beckmann"))
    alpha = description.get("alpha", 0.1)
    alphas = description.get("alpha_u", alpha), description.get("alpha_v", alpha)
    eta = description.get("int_ior", 1.0) / description.get("ext_ior", 1.0)

    def color(name: str, default: float = 1.0) -> list[float]:
        return description[name]["value"] if name in description else [default] * 3

    names = {
        "diffuse": ("reflectance",),
        "plastic": ("diffuse_reflectance", "specular_reflectance"),
        "roughplastic": ("diffuse_reflectance", "specular_reflectance"),
        "conductor": ("specular_reflectance", "eta", "k"),
        "roughconductor": ("specular_reflectance", "eta", "k"),
    }.get(kind, ("specular_reflectance", "specular_transmittance"))
    rows = [color(name) for name in names] + [[0.0] * 3] * (3 - len(names))
    weight, internal, table = 0.0, 0.0, None
    if "plastic" in kind:
        weight = specular_sampling_weight(np.mean(rows[0]), np.mean(rows[1]))
        internal = internal_diffuse_reflectance(eta)
    if kind == "roughplastic":
        internal = rough_internal_reflectance(distribution, alpha, eta)
        table = rough_plastic_table(distribution, alpha, eta)
    return Materials(
        np.array([KINDS.index(kind)], np.int32),
        np.array([rows], np.float32),
        np.array([[*alphas, eta, weight, internal]], np.float32),
        np.array([[-1, -1, -1, -1, distribution, 0, int(description.get("nonlinear", False))]], np.int32),
        np.ones((1, 64), np.float32) if table is None else table[None],
    )


@functools.cache
def case(name: str) -> tuple[Materials, Any]:
    """Our materials and Mitsuba's BSDF."""
    return materials_of(CASES[name]), mi.load_dict(CASES[name])


# --- kernels that run many at once ---------------------------------------------------------------------------------


@kernel
def sample_many(families, materials, wi, uniforms, adjoint, event, wo, weight, pdf, eta):
    for i in range(uniforms.shape[0]):
        m = load_bsdf(materials, None, families, 0, np.float32(0.5), np.float32(0.5))
        w = (wi[i, 0], wi[i, 1], wi[i, 2])
        s = sample_bsdf(families, materials.tables, m, w, uniforms[i, 0], uniforms[i, 1], uniforms[i, 2], adjoint)
        event[i] = s.event
        for c in range(3):
            wo[i, c] = s.wo[c]
            weight[i, c] = s.weight[c]
        pdf[i] = s.pdf
        eta[i] = s.eta


@kernel
def eval_many(families, materials, lobe, wi, wo, adjoint, event, value, pdf):
    lobes = 0
    for i in range(wo.shape[0]):
        m = load_bsdf(materials, None, families, 0, np.float32(0.5), np.float32(0.5))
        lobes = lobe_count(m)
        a, b = (wi[i, 0], wi[i, 1], wi[i, 2]), (wo[i, 0], wo[i, 1], wo[i, 2])
        event[i], f, pdf[i] = eval_bsdf_lobe(families, materials.tables, m, lobe, a, b, adjoint)
        for c in range(3):
            value[i, c] = f[c]
    return lobes


def sample_arrays(n: int) -> tuple[Array, ...]:
    """Empty event, wo, weight, pdf, eta."""
    scalars, vectors = (n,), (n, 3)
    return np.empty(n, np.int32), *(np.empty(shape, np.float32) for shape in (vectors, vectors, scalars, scalars))


def sample(materials: Materials, wi: Array, uniforms: Array, adjoint: bool = False) -> tuple[Array, ...]:
    """Event, wo, weight, pdf, eta of samples from the directions wi (n, 3), or one wi for all."""
    n = len(uniforms)
    wi = np.ascontiguousarray(np.broadcast_to(np.asarray(wi, np.float32), (n, 3)))
    out = sample_arrays(n)
    sample_many(ALL_FAMILIES, materials, wi, uniforms.astype(np.float32), adjoint, *out)
    return out


def evaluate(materials: Materials, lobe: int, wi: Array, wo: Array, adjoint: bool = False) -> tuple[Array, ...]:
    """Event, value, pdf of one lobe."""
    n = len(wo)
    wi = np.ascontiguousarray(np.broadcast_to(np.asarray(wi, np.float32), (n, 3)))
    out = (np.empty(n, np.int32), np.empty((n, 3), np.float32), np.empty(n, np.float32))
    eval_many(ALL_FAMILIES, materials, lobe, wi, np.ascontiguousarray(wo, np.float32), adjoint, *out)
    return out


def lobes(name: str) -> int:
    one = np.array([[0, 0, 1]], np.float32)
    return eval_many(ALL_FAMILIES, case(name)[0], 0, one, one, False, np.empty(1, np.int32), np.empty((1, 3), np.float32), np.empty(1, np.float32))


def total_value(materials: Materials, wi: Array, wo: Array, adjoint: bool = False) -> Array:
    """Sum over two lobes, or the one there is."""
    first = evaluate(materials, 0, wi, wo, adjoint)[1].astype(float)
    two = KINDS[materials.kind[0]] in ("roughdielectric", "roughplastic")
    return first + (evaluate(materials, 1, wi, wo, adjoint)[1] if two else 0.0)


def direction(degrees: float, azimuth: float = 40.0) -> Array:
    theta, phi = np.radians([degrees, azimuth])
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], np.float32)


def random_directions(rng: np.random.Generator, n: int, whole_sphere: bool = True) -> Array:
    z = rng.uniform(-1 if whole_sphere else 0, 1, n)
    phi = rng.uniform(0, 2 * np.pi, n)
    r = np.sqrt(1 - z * z)
    return np.stack((r * np.cos(phi), r * np.sin(phi), z), axis=1).astype(np.float32)
