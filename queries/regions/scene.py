"""The scene of a run as arrays, from its catalogues: what regions ask about objects, the camera and what hides what."""

import difflib
import threading
from collections.abc import Callable, Hashable
from typing import Any, Protocol, TypeVar

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.errors import QueryError
from queries.regions.base import F32, F64, I32, Bools
from queries.regions.camera import Camera, camera_of
from queries.regions.closed import Solid
from queries.regions.rays import RayCaster
from renderer.tables import NO_OBJECT

T = TypeVar("T")
UNKNOWN_EXTENT = 1e6  # of runs that do not say where their surfaces are
_CORNERS = [f"{axis}{corner}" for corner in range(3) for axis in "xyz"]
_BOUNDS = ("min_x", "min_y", "min_z", "max_x", "max_y", "max_z")
_SPHERE = 0  # kind of quadrics
_EXACT_SHAPES = ("sphere", "disk", "cylinder")  # which are quadrics


class HasTables(Protocol):
    """A run, as far as its scene is concerned."""

    manifest: dict[str, Any]
    tables: dict[str, pa.Table]


class SceneGeometry:
    """The scene of one run. Everything is made when first asked for, once, and may be asked for by several threads."""

    def __init__(self, run: HasTables) -> None:
        self._tables = {name: run.tables[name] for name in ("objects", "triangles", "quadrics") if name in run.tables}
        self._camera = run.manifest.get("camera")
        self._lock = threading.RLock()
        self._made: dict[Hashable, Any] = {}
        objects = self._tables["objects"]
        self._names = dict(zip(objects["name"].to_pylist(), objects["object"].to_pylist()))

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What ``make`` returned the first time that it was called for this key."""
        with self._lock:
            if key not in self._made:
                self._made[key] = make()
            found: T = self._made[key]
            return found

    # --- objects ------------------------------------------------------------------------------------------------------

    @property
    def object_names(self) -> list[str]:
        """The names of all objects, in the order of their keys."""
        return list(self._names)

    def object_id(self, name: str) -> int:
        """The key of the object of this name. Raises QueryError, with the nearest name, where there is none."""
        if name not in self._names:
            near = difflib.get_close_matches(name, self._names, n=1, cutoff=0.0)
            raise QueryError(f"the scene has no object `{name}`" + (f": did you mean `{near[0]}`?" if near else ", nor any other"))
        return int(self._names[name])

    def object_caster(self, name: str) -> RayCaster:
        """Rays against one object alone. Raises QueryError for an unknown object, or one whose surface the run does not store."""
        return self.once(("caster", name), lambda: RayCaster(*self._surfaces(self.object_id(name))))

    def solid(self, name: str) -> Solid:
        """What an object encloses. Raises QueryError for an unknown object, and for one that is not closed."""
        return self.once(("solid", name), lambda: self._solid(name))

    def inside(self, name: str, points: F32) -> Bools:
        """Whether each point (n, 3) is enclosed by the object; see ``Solid``."""
        return self.solid(name).inside(points)

    def object_bounds(self, name: str) -> F64:
        """The least and largest coordinates (2, 3) of an object."""
        objects, row = self._tables["objects"], self.object_id(name)
        if _BOUNDS[0] in objects.schema.names:
            key = objects["object"].to_numpy() == row
            return np.array([objects[column].to_numpy()[key][0] for column in _BOUNDS], np.float64).reshape(2, 3)
        return self.object_caster(name).bounds

    # --- the whole scene ----------------------------------------------------------------------------------------------

    @property
    def camera(self) -> Camera:
        """The run's camera. Raises QueryError where the run does not say."""
        return self.once("camera", lambda: camera_of(self._camera))

    @property
    def caster(self) -> RayCaster:
        """Rays against all surfaces. Raises QueryError where the run does not store them."""
        return self.once("caster", lambda: RayCaster(*self._surfaces(None)))

    @property
    def primitive_objects(self) -> I32:
        """The object of each primitive of ``caster``."""
        return self.once("owner", self._owner)

    @property
    def extent(self) -> float:
        """The diagonal of the bounds of all surfaces and the camera, world units: no two of them are farther apart."""
        return self.once("extent", self._extent)

    def occluded(self, origins: F32, directions: F32, far: F32) -> Bools:
        """Whether a surface lies on each ray before ``far`` (n,), in units of the direction (n, 3)."""
        return self.caster.occluded(origins, directions, far)

    def closest(self, origins: F32, directions: F32, far: F32) -> tuple[I32, F32]:
        """The object that each ray meets first before ``far`` (n,), ``NO_OBJECT`` where none, and the distance, in units of the direction (n, 3)."""
        primitive, t = self.caster.closest(origins, directions, far)
        owner = self.primitive_objects
        return np.where(primitive >= 0, owner[primitive], NO_OBJECT).astype(np.int32), t

    # --- from the catalogues ------------------------------------------------------------------------------------------

    def _solid(self, name: str) -> Solid:
        corners, kinds, to_world = self._surfaces(self.object_id(name))
        if (kinds != _SPHERE).any():
            raise QueryError(f"object `{name}` encloses nothing: expected a sphere or a closed mesh, found an open disk or cylinder")
        return Solid(corners, to_world, f"object `{name}`")

    def _surfaces(self, key: int | None) -> tuple[F32, npt.NDArray[np.uint8], F64]:
        """Corners of triangles (nt, 3, 3), kinds (nq,) and matrices (nq, 3, 4) of quadrics: of one object, or of all."""
        triangles = self._tables.get("triangles")
        if triangles is None or _CORNERS[0] not in triangles.schema.names:
            raise QueryError("this run does not store the surfaces of its scene, which this region needs: render it again")
        corners = np.stack([triangles[name].to_numpy() for name in _CORNERS], axis=1).reshape(-1, 3, 3)
        kinds, to_world = self._quadrics()
        if key is None:
            return corners, kinds, to_world
        owner = self.primitive_objects
        mine, curved = owner[: len(corners)] == key, owner[len(corners) :] == key
        return corners[mine], kinds[curved], to_world[curved]

    def _quadrics(self) -> tuple[npt.NDArray[np.uint8], F64]:
        """Kinds (nq,) and matrices (nq, 3, 4). Raises QueryError for a run that has quadrics but does not store them."""
        if "quadrics" in self._tables:
            table = self._tables["quadrics"].combine_chunks()
            flat = pa.concat_arrays(table["to_world"].chunks).flatten() if table.num_rows else pa.array([], pa.float64())
            return table["kind"].to_numpy(), flat.to_numpy(zero_copy_only=False).reshape(-1, 3, 4)
        objects = self._tables["objects"]
        shapes = objects["shape"].to_pylist() if "shape" in objects.schema.names else []
        if any(shape in _EXACT_SHAPES for shape in shapes):
            raise QueryError("this run was recorded before exact spheres, disks and cylinders were kept, which this region needs: render it again")
        return np.empty(0, np.uint8), np.empty((0, 3, 4))

    def _owner(self) -> I32:
        """The object of each primitive."""
        tables = [self._tables[name]["object"].to_numpy().astype(np.int32) for name in ("triangles", "quadrics") if name in self._tables]
        return np.concatenate(tables) if tables else np.empty(0, np.int32)

    def _extent(self) -> float:
        try:
            points = [self.caster.bounds]
            if self._camera:
                points.append(self.camera.origin[None])
        except QueryError:
            return UNKNOWN_EXTENT
        everything = np.concatenate(points)
        return float(np.linalg.norm(everything.max(axis=0) - everything.min(axis=0))) or UNKNOWN_EXTENT
