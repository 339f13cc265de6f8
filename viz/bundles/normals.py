"""Which way the surface faces at each vertex of paths: one of the six directions along the axes.

Runs keep no normals. A vertex lies at the end of a segment: a short ray along that segment finds the surface, whose geometric normal is turned toward
the light that arrives (at emitters: toward the light that leaves).
"""

import numpy as np
import numpy.typing as npt

from queries.kernels.regions import CYLINDER, SPHERE
from queries.path_sample import PathSample
from queries.regions.rays import RayCaster
from renderer.tables import NO_OBJECT

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
UNKNOWN = 0  # 1 to 6: +x, -x, +y, -y, +z, -z
_SHARE = 1e-3  # of the segment, before and behind the vertex, in which its surface is looked for


def facing(sample: PathSample, caster: RayCaster) -> U8:
    """The direction nearest to the normal at each vertex: uint8 (m), ``UNKNOWN`` where it lies on no surface."""
    points = sample.points.astype(np.float64)
    # Along the segment that arrives; for the first vertex of a path, back along the one that leaves
    other = np.arange(-1, len(points) - 1)
    first = sample.start[:-1]
    other[first] = np.minimum(first + 1, len(points) - 1)
    toward = points - points[other]
    found = np.full(len(points), UNKNOWN, np.uint8)
    rows = np.flatnonzero((sample.object != NO_OBJECT) & (np.abs(toward).max(axis=1, initial=0) > 0))
    ray = toward[rows]
    # Coordinates are rounded: look at least as far as that reaches
    share = np.maximum(_SHARE, caster.touch / np.linalg.norm(ray, axis=1))[:, None]
    begin = points[rows] - share * ray
    primitive, distance = caster.closest(begin, ray, 2 * share[:, 0])
    met = primitive >= 0
    rows, ray = rows[met], ray[met]
    normal = geometric_normals(caster, primitive[met], begin[met] + distance[met, None] * ray)
    normal *= -np.sign(np.einsum("ij,ij->i", normal, ray))[:, None]
    axis = np.abs(normal).argmax(axis=1)
    found[rows] = 1 + 2 * axis + (normal[np.arange(len(rows)), axis] < 0)
    return found


def geometric_normals(caster: RayCaster, primitive: I32, points: F64) -> F64:
    """Normals, of any length and on either side, of primitives (k) at points (k, 3) of them: float64 (k, 3)."""
    normals = np.zeros((len(points), 3))
    flat = np.flatnonzero(primitive < len(caster.corners))
    corners = caster.corners[primitive[flat]].astype(np.float64)
    normals[flat] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    curved = np.flatnonzero(primitive >= len(caster.corners))
    quadric = primitive[curved] - len(caster.corners)
    to_object, kind = caster.to_object[quadric], caster.kinds[quadric]
    local = np.einsum("kij,kj->ki", to_object[:, :, :3], points[curved]) + to_object[:, :, 3]
    local[kind == CYLINDER, 2] = 0
    local[(kind != CYLINDER) & (kind != SPHERE)] = (0, 0, 1)
    # Normals go over to the world by the inverse transpose
    normals[curved] = np.einsum("kij,ki->kj", to_object[:, :, :3], local)
    return normals
