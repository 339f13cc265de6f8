"""Objects of the scene as regions: their surface, what they enclose, what is around them."""

from dataclasses import dataclass

import numpy as np

from queries.regions.base import F32, F64, Bools, Objects, Region, growth
from queries.regions.grown import Centered, Union
from queries.regions.scene import SceneGeometry
from queries.regions.solids import Box


@dataclass(frozen=True)
class Surface(Region):
    """The surface of an object: vertices on it. A segment crosses it where it pierces, touches, or starts or ends on it."""

    name: str

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        return np.asarray(objects == scene.object_id(self.name), np.bool_)

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        return scene.object_caster(self.name).touches(start, end)

    def enlarged(self, factor: float = 1.5) -> Region:
        """The surface and all that is around it: a surface itself has no larger one on which vertices could lie."""
        return Union((self, Surroundings(self.name, growth(factor))))

    def describe(self) -> str:
        """See ``Region``."""
        return f"the surface of {self.name}"

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``."""
        if scene is not None:
            scene.object_id(self.name)


@dataclass(frozen=True)
class Inside(Centered):
    """What an object encloses, and its surface."""

    name: str

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        inside = np.asarray(objects == scene.object_id(self.name), np.bool_)
        rows = np.flatnonzero(~inside)
        inside[rows] = scene.inside(self.name, points[rows])
        return inside

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        return scene.solid(self.name).crosses(start, end)

    def center(self, scene: SceneGeometry) -> F64:
        """The center of the object's bounds."""
        return np.asarray(scene.object_bounds(self.name).mean(axis=0))

    def describe(self) -> str:
        """See ``Region``."""
        return f"the inside of {self.name}"

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``."""
        if scene is not None:
            scene.solid(self.name)


@dataclass(frozen=True)
class Surroundings(Region):
    """The bounds of an object, scaled by ``factor`` about their center; a flat object's are made as thick as its longest side grows."""

    name: str
    factor: float

    def contains(self, scene: SceneGeometry, points: F32, objects: Objects) -> Bools:
        """See ``Region``."""
        return self._box(scene).contains(scene, points, objects)

    def crosses(self, scene: SceneGeometry, start: F32, end: F32) -> Bools:
        """See ``Region``."""
        return self._box(scene).crosses(scene, start, end)

    def enlarged(self, factor: float = 1.5) -> "Surroundings":
        """Larger surroundings."""
        return Surroundings(self.name, self.factor * growth(factor))

    def describe(self) -> str:
        """See ``Region``."""
        return f"the surroundings of {self.name}"

    def check(self, scene: SceneGeometry | None = None) -> None:
        """See ``Region``."""
        if scene is not None:
            self._box(scene)

    def _box(self, scene: SceneGeometry) -> Box:
        low, high = scene.object_bounds(self.name)
        x, y, z = np.maximum(self.factor * (high - low), (self.factor - 1) * np.max(high - low)).tolist()
        center_x, center_y, center_z = ((low + high) / 2).tolist()
        return Box((center_x, center_y, center_z), (x, y, z))
