"""The scene's surfaces as meshes, one for each object, from a run's catalogues."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.errors import QueryError
from queries.kernels.regions import CYLINDER, DISK, SPHERE

if TYPE_CHECKING:
    from queries.run import Run

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

_CORNERS = [f"{axis}{corner}" for corner in range(3) for axis in "xyz"]
_FINEST = 96  # steps around a round surface: the outline of a sphere is then within 0.05 % of its radius
_COARSEST = 12
_MOST_TRIANGLES = 2_000_000  # of all round surfaces together; beyond it they get coarser


@dataclass(frozen=True)
class SceneMesh:
    """The surface of one object.

    ``points`` float64 (n, 3), world; ``triangles`` int64 (m, 3), corners in the order of the catalogue, shared between triangles where they are the
    same point; ``emits``: whether it is a lamp.
    """

    key: int
    name: str
    material: str
    emits: bool
    points: F64
    triangles: I64

    @property
    def mesh(self) -> Any:
        """As ``pyvista.PolyData``."""
        import pyvista

        faces = np.column_stack([np.full(len(self.triangles), 3), self.triangles])
        return pyvista.PolyData(self.points, faces.ravel())


def scene_meshes(run: "Run") -> tuple[SceneMesh, ...]:
    """The objects that have surfaces, in the order of their keys. Raises ``QueryError`` for a run that does not store them."""
    tables = run.tables
    if "triangles" not in tables or _CORNERS[0] not in tables["triangles"].schema.names:
        raise QueryError(f"`{run.path}` does not store the surfaces of its scene, to be drawn: render it again, or `look: {{scene: hidden}}`")
    corners = np.stack([tables["triangles"][name].to_numpy() for name in _CORNERS], axis=1).astype(np.float64).reshape(-1, 3, 3)
    owner = tables["triangles"]["object"].to_numpy()
    order = np.argsort(owner, kind="stable")
    kinds, to_world, round_owner = _quadrics(run)
    steps = _steps(len(kinds))
    emitting = {key for key in tables["emitters"]["object"].to_pylist() if key is not None}
    objects = tables["objects"].select(["object", "name", "material"]).to_pylist()
    found = []
    for row in sorted(objects, key=lambda row: int(row["object"])):
        key = row["object"]
        first, last = np.searchsorted(owner, [key, key + 1], sorter=order)
        parts = [merged(corners[order[first:last]])] if last > first else []
        parts += [_placed(int(kinds[i]), to_world[i], steps) for i in np.flatnonzero(round_owner == key)]
        if parts:
            points, triangles = _joined(parts)
            found.append(SceneMesh(key, row["name"], row["material"], key in emitting, points, triangles))
    return tuple(found)


def merged(corners: npt.NDArray[np.floating[Any]]) -> tuple[F64, I64]:
    """Triangles, given by their corners (m, 3, 3), as points (n, 3), each once, and indices (k, 3); triangles without area are dropped."""
    flat = np.ascontiguousarray(corners, np.float64).reshape(-1, 3) + 0.0  # -0 is 0
    order = np.lexsort(flat.T[::-1])
    fresh = np.ones(len(flat), np.bool_)
    fresh[1:] = (flat[order[1:]] != flat[order[:-1]]).any(axis=1)
    index = np.empty(len(flat), np.int64)
    index[order] = np.cumsum(fresh) - 1
    triangles = index.reshape(-1, 3)
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return flat[order[fresh]], triangles[whole]


def _quadrics(run: "Run") -> tuple[npt.NDArray[np.uint8], F64, I64]:
    """Kinds (q,), matrices (q, 3, 4) and objects (q,)."""
    if "quadrics" not in run.tables:
        return np.empty(0, np.uint8), np.empty((0, 3, 4)), np.empty(0, np.int64)
    table = run.tables["quadrics"]
    chunks = table["to_world"].chunks
    flat = pa.concat_arrays(chunks).flatten().to_numpy(zero_copy_only=False) if table.num_rows else np.empty(0)
    return table["kind"].to_numpy(), np.asarray(flat, np.float64).reshape(-1, 3, 4), table["object"].to_numpy().astype(np.int64)


def _steps(count: int) -> int:
    """Steps around each of so many round surfaces."""
    return int(np.clip(np.sqrt(_MOST_TRIANGLES / max(count, 1)), _COARSEST, _FINEST)) // 2 * 2


def _placed(kind: int, to_world: F64, steps: int) -> tuple[F64, I64]:
    points, triangles = {SPHERE: _sphere, DISK: _disk, CYLINDER: _cylinder}[kind](steps)
    return points @ to_world[:, :3].T + to_world[:, 3], triangles


def _sphere(steps: int) -> tuple[F64, I64]:
    """The unit sphere: rings between two poles."""
    theta = np.pi * np.arange(1, steps // 2) / (steps // 2)
    ring = _circle(steps)
    rings = np.column_stack([np.kron(np.sin(theta)[:, None], ring), np.repeat(np.cos(theta), steps)])
    points = np.concatenate([rings, [[0, 0, 1], [0, 0, -1]]])
    i, after = np.arange(steps), np.roll(np.arange(steps), -1)
    last = (len(theta) - 1) * steps
    top = np.column_stack([np.full(steps, len(rings)), i, after])
    bottom = np.column_stack([np.full(steps, len(rings) + 1), last + after, last + i])
    return points, np.concatenate([top, *(_band(steps, k * steps) for k in range(len(theta) - 1)), bottom])


def _disk(steps: int) -> tuple[F64, I64]:
    """The unit disk at z = 0."""
    points = np.column_stack([np.concatenate([_circle(steps), [[0, 0]]]), np.zeros(steps + 1)])
    i = np.arange(steps)
    return points, np.column_stack([np.full(steps, steps), i, np.roll(i, -1)])


def _cylinder(steps: int) -> tuple[F64, I64]:
    """The open cylinder of radius 1 over z in [0, 1]."""
    circle = _circle(steps)
    points = np.concatenate([np.column_stack([circle, np.full(steps, z)]) for z in (1.0, 0.0)])
    return points, _band(steps, 0)


def _circle(steps: int) -> F64:
    phi = 2 * np.pi * np.arange(steps) / steps
    return np.column_stack([np.cos(phi), np.sin(phi)])


def _band(steps: int, first: int) -> I64:
    """The triangles between two rings of points, the upper one first."""
    i, after = first + np.arange(steps), first + np.roll(np.arange(steps), -1)
    return np.concatenate([np.column_stack([i, i + steps, after + steps]), np.column_stack([i, after + steps, after])])


def _joined(parts: list[tuple[F64, I64]]) -> tuple[F64, I64]:
    offsets = np.cumsum([0] + [len(points) for points, _ in parts])
    return np.concatenate([points for points, _ in parts]), np.concatenate([triangles + offset for (_, triangles), offset in zip(parts, offsets)])
