"""The contract of a region: a part of space, or of the scene's surfaces, in which vertices of paths may lie.

Positions are world coordinates, float32 (n, 3); objects are keys into the catalogue ``objects``, ``NO_OBJECT`` where a vertex
lies on no surface. Directions (of walks that escaped) are no positions: leave them out.
"""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError

if TYPE_CHECKING:
    from queries.regions.scene import SceneGeometry

Bools = npt.NDArray[np.bool_]
F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
Objects = npt.NDArray[Any]  # any integer type
Point = tuple[float, float, float]
LARGEST_FACTOR = 1e6


class Region(ABC):
    """A part of space or of surfaces. Regions are immutable and know no scene: what they need of one is kept by the ``SceneGeometry``.

    All methods may be called from several threads at once. Methods that are given a scene raise ``QueryError`` as ``check`` does.
    """

    @abstractmethod
    def contains(self, scene: "SceneGeometry", points: F32, objects: Objects) -> Bools:
        """Whether each vertex, a point (n, 3) on an object (n,), lies inside; borders belong to the region."""

    @abstractmethod
    def crosses(self, scene: "SceneGeometry", start: F32, end: F32) -> Bools:
        """Whether each closed segment from ``start`` (n, 3) to ``end`` (n, 3) has a point inside.

        A segment meets a part of a surface where it pierces it, and also where it starts or ends on it.
        """

    @abstractmethod
    def enlarged(self, factor: float = 1.5) -> "Region":
        """The region grown by ``factor`` (1 or more) in length about its center; it always contains the region itself."""

    @abstractmethod
    def describe(self) -> str:
        """The region in words, as they follow "in": "the ball of radius 0.2 around (0, 1, 0)"."""

    def check(self, scene: "SceneGeometry | None" = None) -> None:  # noqa: B027 (most regions can always be used)
        """Raise ``QueryError`` where the region cannot be used: unknown objects, open meshes, no camera; without a scene, unreadable files."""


def growth(factor: float) -> float:
    """A factor of ``enlarged``, checked. Raises QueryError."""
    if isinstance(factor, bool) or not isinstance(factor, (int, float)) or not 1 <= factor <= LARGEST_FACTOR:
        raise QueryError(f"a region grows by a factor of 1 to {LARGEST_FACTOR:g}, found {factor!r}")
    return float(factor)


def triple(point: Point) -> str:
    """Three coordinates as text."""
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"
