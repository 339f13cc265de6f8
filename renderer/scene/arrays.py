"""The compiled scene: named tuples of arrays, which kernels take as they are.

A piece that a scene lacks is ``None``. Since numba compiles a kernel for each *type* of argument, such a piece costs
nothing in code either (``renderer.kernel``). Indices are -1 where there is nothing. ``nt`` triangles come first in
every array over primitives, then ``nq`` quadrics; an object is one shape of the description.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.bsdfs.base import Families, Materials
from renderer.emitters.base import Emitters
from renderer.sensors.base import Sensor
from renderer.shapes.base import Geometry
from renderer.textures.base import Ewa, Textures

F32 = npt.NDArray[np.float32]
I32 = npt.NDArray[np.int32]


class Objects(NamedTuple):
    """What each object is made of; ``no`` rows."""

    front: I32  # (no,) material on the side of the normal, -1: none, light is absorbed
    back: I32  # (no,) material behind; equals front except where `twosided` names two
    two_sided: npt.NDArray[np.uint8]  # (no,) 1: the back is shaded as a front (Mitsuba's `twosided`)
    emitter: I32  # (no,) row of the emitters, -1: none


class SceneArrays(NamedTuple):
    """All that kernels know of a scene."""

    geometry: Geometry
    objects: Objects
    materials: Materials
    families: Families
    textures: Textures | None
    emitters: Emitters
    sensor: Sensor
    ewa: Ewa | None = None  # the filter over bitmaps that the camera sees; None: they are read at points


@dataclass(frozen=True)
class ObjectInfo:
    """One row of the ``objects`` catalogue. Bounds are in world units, area in squared world units."""

    name: str
    shape: str  # the plugin: "rectangle", "sphere", …
    material: str  # the BSDF's id, or its plugin where it has none
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    area: float


@dataclass(frozen=True)
class EmitterInfo:
    """One row of the ``emitters`` catalogue. ``symbol`` is L, O or B, as light path expressions see it."""

    name: str
    kind: str  # the plugin: "area", "point", …
    object: int  # row of objects, -1: none
    infinite: bool
    symbol: str


@dataclass(frozen=True)
class RenderDefaults:
    """What the description's film, sampler and integrator ask for; a job may say otherwise."""

    width: int
    height: int
    filter: str
    samples: int
    method: str  # "path" or "light"
    max_depth: int  # Mitsuba's meaning; -1 is unbounded
    rr_depth: int
    sampler: str = "sobol"  # "independent" where the scene names that one
    seed: int = 0


@dataclass(frozen=True)
class Scene:
    """A compiled scene: arrays for kernels, catalogues for tables, triangles for rays and pictures."""

    arrays: SceneArrays
    objects: tuple[ObjectInfo, ...]
    emitters: tuple[EmitterInfo, ...]
    defaults: RenderDefaults
    vertices: F32  # (nv, 3) world positions of all meshes
    triangles: I32  # (nt, 3) rows of vertices
    description: dict[str, Any]  # the Mitsuba dictionary, normalized, as `mi.load_dict` takes it
    warnings: tuple[str, ...]
