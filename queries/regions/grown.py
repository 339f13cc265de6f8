"""Larger regions around others."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from queries.regions.base import F32, F64, Bools, Objects, Region, growth
from queries.regions.scene import SceneGeometry
from renderer.tables import NO_OBJECT


class Centered(Region):
    """A region of any shape that grows about a center."""

    @abstractmethod
    def center(self, scene: SceneGeometry) -> F64:
        """The point (3,) about which the region grows."""

    def enlarged(self, factor: float = 1.5) -> Region:
        """The region and what it covers when it is scaled about its center."""
        return Grown(self, growth(factor))


@dataclass(frozen=True)
class Grown(Centered):
    """A region together with what it covers when it is scaled by ``factor`` about its center, of which it may not be a part itself."""

    inner: Centered
    factor: float

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``. What lies *on* an object counts for the object where it is, not for the scaled one."""
        inside = self.inner.contains(scene, points, objects)
        rows = np.flatnonzero(~inside)
        inside[rows] = self.inner.contains(scene, self._shrunk(scene, points[rows]), np.full(len(rows), NO_OBJECT, np.int32))
        return inside

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        crosses = self.inner.crosses(scene, start, end)
        rows = np.flatnonzero(~crosses)
        crosses[rows] = self.inner.crosses(scene, self._shrunk(scene, start[rows]), self._shrunk(scene, end[rows]))
        return crosses

    def center(self, scene: SceneGeometry) -> F64:
        """The inner region's center."""
        return self.inner.center(scene)

    def describe(self) -> str:
        """See ``Region``."""
        return f"{self.inner.describe()}, grown {self.factor:.6g} times"

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``."""
        self.inner.check(scene)

    def _shrunk(self, scene: SceneGeometry, points: F32) -> F32:
        center = self.center(scene)
        return np.asarray(center + (points - center) / self.factor, np.float32)


@dataclass(frozen=True)
class Union(Region):
    """All that lies in one of several regions."""

    parts: tuple[Region, ...]

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        inside = np.zeros(len(points), np.bool_)
        for part in self.parts:
            rows = np.flatnonzero(~inside)
            inside[rows] = part.contains(scene, points[rows], objects[rows])
        return inside

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        crosses = np.zeros(len(start), np.bool_)
        for part in self.parts:
            rows = np.flatnonzero(~crosses)
            crosses[rows] = part.crosses(scene, start[rows], end[rows])
        return crosses

    def enlarged(self, factor: float = 1.5) -> "Union":
        """Each part enlarged."""
        return Union(tuple(part.enlarged(factor) for part in self.parts))

    def describe(self) -> str:
        """See ``Region``."""
        return " or ".join(part.describe() for part in self.parts)

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``."""
        for part in self.parts:
            part.check(scene)
