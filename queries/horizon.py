"""Where pictures end: light that comes from infinity, or leaves for it, is drawn as far as a sphere around the scene."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.regions import SceneGeometry

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Horizon:
    """A sphere: ``center`` float64 (3) and ``radius``, world units."""

    center: F64
    radius: float

    @classmethod
    def of(cls, geometry: SceneGeometry) -> "Horizon":
        """The sphere around the center of the bounds of all surfaces whose radius is the scene's extent, the diagonal of its bounds."""
        try:
            low, high = geometry.caster.bounds
        except QueryError:  # surfaces that are not stored: the extent is then large enough for any center
            low = high = np.zeros(3)
        return cls((low + high) / 2, geometry.extent)

    def leave(self, points: F32, ways: F32) -> F32:
        """Where rays from ``points`` (n, 3) along unit ``ways`` (n, 3) leave the sphere; from outside it, the point at a distance of ``radius``."""
        offset, way = points.astype(np.float64) - self.center, ways.astype(np.float64)
        along, beyond = np.sum(offset * way, axis=1), np.sum(offset * offset, axis=1) - self.radius**2
        distance = np.where(beyond > 0, self.radius, -along + np.sqrt(np.maximum(along * along - beyond, 0.0)))
        left: F32 = (points + distance[:, None] * way).astype(np.float32)
        return left
