"""BSDFs of a description as rows of the material table, with Mitsuba's defaults."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.base import (
    ALPHA_U,
    ALPHA_V,
    BECKMANN,
    DISTRIBUTION,
    ETA,
    GGX,
    INTERNAL_REFLECTANCE,
    KINDS,
    NONLINEAR,
    SPECULAR_PROBABILITY,
    TABLE,
    TEXTURE_A,
    TEXTURE_ALPHA_U,
    TEXTURE_ALPHA_V,
    TEXTURE_B,
    Families,
    Materials,
)
from renderer.errors import SceneError
from renderer.scene.context import Context
from renderer.scene.description import Node
from renderer.scene.optics import conductor_constants, relative_ior
from renderer.scene.reader import Reader
from renderer.scene.spectra import Rgb
from renderer.scene.textures import Slot, slot

BLACK: Rgb = (0.0, 0.0, 0.0)
CONSTANT_BLACK = Slot(BLACK, -1)
DISTRIBUTIONS = {"beckmann": BECKMANN, "ggx": GGX}
TRANSMISSIVE = ("dielectric", "roughdielectric", "thindielectric")
BSDFS = (*KINDS, "twosided")
_DEFAULT = Node("diffuse", "diffuse", "")  # of shapes without a BSDF: gray


@dataclass
class Material:
    """One BSDF before it is packed; colors a, b, c as ``renderer.bsdfs.base.Materials`` says."""

    a: Slot
    b: Slot = CONSTANT_BLACK
    c: Rgb = BLACK
    alpha: tuple[Slot, Slot] = (CONSTANT_BLACK, CONSTANT_BLACK)
    eta: float = 1.0
    p_specular: float = 0.0
    internal: float = 0.0
    distribution: int = BECKMANN
    table: npt.NDArray[np.float32] | None = None
    nonlinear: bool = False

    @property
    def anisotropic(self) -> bool:
        """Whether the look depends on the tangents, and so on texture coordinates."""
        return self.alpha[0] != self.alpha[1]


@dataclass(frozen=True)
class Sides:
    """The material rows of a surface's front and back (-1: black), and what to call them."""

    front: int
    back: int
    two_sided: bool
    name: str


@dataclass
class MaterialTable:
    """The rows of all BSDFs; a node that is used twice is one row."""

    context: Context
    kinds: list[int] = field(default_factory=list)
    rows: list[Material] = field(default_factory=list)
    of_node: dict[int, tuple[Node, int]] = field(default_factory=dict)  # by the node's id; it is kept, so that no other node gets that id

    def sides(self, node: Node | None) -> Sides:
        """A shape's BSDF; None stands for Mitsuba's default, gray diffuse."""
        node = node or _DEFAULT
        name = node.name if node.named else node.plugin
        if node.plugin != "twosided":
            row = self.row(node)
            return Sides(row, row, False, name)
        reader = Reader(node)
        inner = reader.children(BSDFS, "BSDFs", most=2)
        reader.finish([kind for kind in KINDS if kind not in TRANSMISSIVE])
        if not inner:
            raise reader.error("needs one BSDF for both sides, or two")
        for child in inner:
            if child.plugin in (*TRANSMISSIVE, "twosided"):
                raise SceneError(f"twosided: {child.plugin!r} cannot stand inside; only BSDFs that do not transmit light can", child.place)
        rows = [self.row(child) for child in inner]
        if not node.named and inner[0].named:
            name = inner[0].name
        return Sides(rows[0], rows[-1], True, name)

    def row(self, node: Node) -> int:
        """The row of a one-sided BSDF."""
        if id(node) not in self.of_node:
            reader = Reader(node)
            material = BUILDERS[node.plugin](reader, self.context)
            reader.finish()
            self.kinds.append(KINDS.index(node.plugin))
            self.rows.append(material)
            self.of_node[id(node)] = (node, len(self.rows) - 1)
        return self.of_node[id(node)][1]

    def families(self) -> Families:
        """Which families beside diffuse the scene has."""
        used = {KINDS[kind] for kind in self.kinds}
        return Families(
            True if used & {"conductor", "dielectric", "thindielectric"} else None,
            True if used & {"roughconductor", "roughdielectric"} else None,
            True if used & {"plastic", "roughplastic"} else None,
        )

    def pack(self) -> Materials:
        """The material table as kernels read it."""
        n = len(self.rows)
        rgb, scalar, index = np.zeros((n, 3, 3), np.float32), np.zeros((n, 5), np.float32), np.full((n, 7), -1, np.int32)
        tables: list[npt.NDArray[np.float32]] = []
        for i, m in enumerate(self.rows):
            rgb[i] = m.a.rgb, m.b.rgb, m.c
            scalar[i, [ALPHA_U, ALPHA_V]] = m.alpha[0].rgb[0], m.alpha[1].rgb[0]
            scalar[i, [ETA, SPECULAR_PROBABILITY, INTERNAL_REFLECTANCE]] = m.eta, m.p_specular, m.internal
            index[i, [TEXTURE_A, TEXTURE_B]] = m.a.texture, m.b.texture
            index[i, [TEXTURE_ALPHA_U, TEXTURE_ALPHA_V]] = m.alpha[0].texture, m.alpha[1].texture
            index[i, [DISTRIBUTION, NONLINEAR]] = m.distribution, m.nonlinear
            if m.table is not None:
                index[i, TABLE] = len(tables)
                tables.append(m.table)
        packed = np.ascontiguousarray(np.stack(tables), np.float32) if tables else None
        return Materials(np.array(self.kinds, np.int32), rgb, scalar, index, packed)


# --- one function for each kind -----------------------------------------------------------------------------------


def diffuse(reader: Reader, context: Context) -> Material:
    """Lambertian reflection."""
    return Material(slot(reader, "reflectance", 0.5, context))


def conductor(reader: Reader, context: Context) -> Material:
    """A smooth metal, by name or by complex index of refraction."""
    eta, k = conductor_constants(reader)
    return Material(slot(reader, "specular_reflectance", 1.0, context), Slot(eta, -1), k)


def rough_conductor(reader: Reader, context: Context) -> Material:
    """A rough metal."""
    material = conductor(reader, context)
    material.distribution, material.alpha = roughness(reader, context)
    return material


def dielectric(reader: Reader, context: Context) -> Material:
    """A smooth boundary between two transparent media."""
    return Material(
        slot(reader, "specular_reflectance", 1.0, context),
        slot(reader, "specular_transmittance", 1.0, context),
        eta=relative_ior(reader, "bk7"),
    )


def rough_dielectric(reader: Reader, context: Context) -> Material:
    """A rough boundary between two transparent media."""
    material = dielectric(reader, context)
    material.distribution, material.alpha = roughness(reader, context)
    if material.eta == 1:
        raise reader.error("'int_ior' and 'ext_ior' must differ: a rough boundary between equal media has no microfacets", "int_ior")
    return material


def plastic(reader: Reader, context: Context) -> Material:
    """A diffuse base under a smooth dielectric coating."""
    from renderer.bsdfs.tables import internal_diffuse_reflectance

    material = coated(reader, context)
    material.internal = float(internal_diffuse_reflectance(material.eta))
    return material


def rough_plastic(reader: Reader, context: Context) -> Material:
    """A diffuse base under a rough dielectric coating; its roughness is constant, as in Mitsuba."""
    from renderer.bsdfs.tables import rough_internal_reflectance, rough_plastic_table

    material = coated(reader, context)
    if isinstance(reader.value("alpha", 0.1), Node):
        raise reader.error("'alpha' must be a number: Mitsuba's roughplastic has no textured roughness either", "alpha")
    alpha = reader.number("alpha", 0.1, above=0)
    material.distribution = distribution(reader, context)
    material.alpha = (Slot((alpha, alpha, alpha), -1),) * 2
    material.table = rough_plastic_table(material.distribution, alpha, material.eta)
    material.internal = float(rough_internal_reflectance(material.distribution, alpha, material.eta))
    return material


def coated(reader: Reader, context: Context) -> Material:
    """What plastics have in common. The specular lobe is chosen by the share of its mean reflectance, as in Mitsuba."""
    a, b = slot(reader, "diffuse_reflectance", 0.5, context), slot(reader, "specular_reflectance", 1.0, context)
    both = sum(a.rgb) + sum(b.rgb)
    p_specular = sum(b.rgb) / both if both > 0 else 0.5
    eta = relative_ior(reader, "polypropylene")
    return Material(a, b, eta=eta, p_specular=p_specular, nonlinear=reader.flag("nonlinear", False))


def distribution(reader: Reader, context: Context) -> int:
    """The microfacet distribution. Visible normals are sampled whatever the description says: the picture is the same."""
    if not reader.flag("sample_visible", True):
        message = "visible normals are sampled although 'sample_visible' is false; the picture is the same"
        context.warn(f"{reader.node.plugin}: {message}", reader.node.place)
    return DISTRIBUTIONS[reader.choice("distribution", "beckmann", tuple(DISTRIBUTIONS))]


def roughness(reader: Reader, context: Context) -> tuple[int, tuple[Slot, Slot]]:
    """Distribution and roughness along both tangents, constant or textured."""
    kind = distribution(reader, context)
    given = [name for name in ("alpha_u", "alpha_v") if reader.has(name)]
    if given and reader.has("alpha"):
        raise reader.error("give either 'alpha' or 'alpha_u' and 'alpha_v', not both", given[0])
    if len(given) == 1:
        raise reader.error("'alpha_u' and 'alpha_v' must stand together", given[0])
    slots = []
    for name in given or ["alpha"]:
        alpha = slot(reader, name, 0.1, context, bounded=False)
        if alpha.texture < 0 and not alpha.rgb[0] > 0:
            smooth = reader.node.plugin.removeprefix("rough")
            raise reader.error(f"{name!r} must be more than 0 (a smooth surface is a {smooth!r}); it is {alpha.rgb[0]:g}", name)
        slots.append(alpha)
    return kind, (slots[0], slots[-1])


BUILDERS: dict[str, Callable[[Reader, Context], Material]] = {
    "diffuse": diffuse,
    "conductor": conductor,
    "roughconductor": rough_conductor,
    "dielectric": dielectric,
    "roughdielectric": rough_dielectric,
    "thindielectric": dielectric,
    "plastic": plastic,
    "roughplastic": rough_plastic,
}
