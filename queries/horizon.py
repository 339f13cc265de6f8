"""Where the scene ends: light that comes from infinity, or leaves for it, is followed as far as a sphere around the scene."""

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
        """Where rays from ``points`` (n, 3) along ``ways`` (n, 3) leave the sphere, or one of twice their own distance from its center, if that is
        more: rays of lights that stand beside all surfaces are not cut short.
        """
        offset, way = points.astype(np.float64) - self.center, ways.astype(np.float64)
        a, b, c = (np.einsum("ij,ij->i", x, y) for x, y in ((way, way), (offset, way), (offset, offset)))
        a = np.maximum(a, 1e-30)
        t = (np.sqrt(b * b + a * (np.maximum(self.radius**2, 4 * c) - c)) - b) / a
        left: F32 = (points + t[:, None] * way).astype(np.float32)
        return left
