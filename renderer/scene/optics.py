"""Optical constants by name, equal to Mitsuba's: indices of refraction, and metals in linear RGB."""

import math

from renderer.scene.description import listing, nearest
from renderer.scene.metals import METALS
from renderer.scene.reader import Reader
from renderer.scene.spectra import Rgb, color

INDICES = {
    "vacuum": 1.0,
    "helium": 1.000036,
    "hydrogen": 1.000132,
    "air": 1.000277,
    "carbon dioxide": 1.00045,
    "water": 1.3330,
    "acetone": 1.36,
    "ethanol": 1.361,
    "carbon tetrachloride": 1.461,
    "glycerol": 1.4729,
    "benzene": 1.501,
    "silicone oil": 1.52045,
    "bromine": 1.661,
    "water ice": 1.31,
    "fused quartz": 1.458,
    "pyrex": 1.470,
    "acrylic glass": 1.49,
    "polypropylene": 1.49,
    "bk7": 1.5046,
    "sodium chloride": 1.544,
    "amber": 1.55,
    "pet": 1.5750,
    "diamond": 2.419,
}


def index_of_refraction(reader: Reader, name: str, default: str) -> float:
    """An index of refraction, as a number or by a material's name."""
    data = reader.value(name, default)
    if isinstance(data, str):
        if data.lower() not in INDICES:
            hint = nearest(data.lower(), INDICES)
            raise reader.error(f"{name!r}: no index of refraction is known for {data!r}{hint}; known: {listing(INDICES)}", name)
        return INDICES[data.lower()]
    return reader.number(name, default, above=0)


def relative_ior(reader: Reader, interior: str) -> float:
    """Interior over exterior index of refraction."""
    eta = index_of_refraction(reader, "int_ior", interior) / index_of_refraction(reader, "ext_ior", "air")
    if not math.isfinite(eta):
        raise reader.error("'int_ior' / 'ext_ior' must be finite", "int_ior")
    return eta


def conductor_constants(reader: Reader) -> tuple[Rgb, Rgb]:
    """Complex index of refraction of a metal: (eta, k), by ``material`` or by both numbers."""
    if reader.has("eta") or reader.has("k"):
        if reader.has("material"):
            raise reader.error("give either 'material' or 'eta' and 'k', not both", "material")
        return color(reader, "eta", 0.0, bounded=False), color(reader, "k", 1.0, bounded=False)
    name = reader.text("material", "none")
    if name not in METALS:
        raise reader.error(f"no metal {name!r} is known{nearest(name, METALS)}; known: {listing(METALS)}", "material")
    return METALS[name]
