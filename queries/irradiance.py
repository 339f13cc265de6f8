"""Irradiance on surfaces: the density of the vertices at which light walks arrive.

What arrives on a patch, over its area, estimates the mean irradiance there without bias (thesis 5.11.3 read at the vertices). Light counts from
both sides of a surface unless one is asked for. Camera walks give importance by the same formulas.
"""

import functools
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from queries.arrivals import Arrivals
from queries.errors import QueryError
from queries.inspection import walks_of
from queries.kernels.meters import EMPTY, add_to_patches, fill_keys, fill_slots, smooth
from queries.luminance import luminance_of
from queries.patches import MOST_PATCHES, Patches, patches, surface_area
from queries.regions.rays import RayCaster
from queries.run import Run
from queries.selection import Selection
from queries.shards import Piece, cores, map_shards
from queries.statistics import Units
from renderer.tables import ESCAPED, NO_OBJECT

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
Faces = Literal["both", "front", "back"]
SeenFaces = Literal["seen", "both", "front", "back"]
_SMOOTHED_PATCHES = 400_000  # of an image: more would cost time, and be finer than pixels
_PATCHES_PER_DISC = 16  # about as many lie in the disc that holds the wanted arrivals
_POINTS = 8192  # of an image that a thread takes at once
_LARGEST_GROWTH = 10.0  # of the disc's radius, in sizes of patches
_ALIGNED = 0.8  # cosine between normals of patches that are taken together


@dataclass(frozen=True, eq=False)
class Irradiance:
    """Irradiance on ``p`` patches.

    ``values``: float32 (p, 3), flux / world unit²; ``error``: float32 (p), the standard error of the luminance, which takes walks as
    independent: an upper bound where they are stratified; ``hits``: int64 (p), arrivals; ``flux``: float64 (3), all that arrives on the
    patches, and ``flux_error``, of its luminance, over independent units (``queries.statistics``), NaN where it cannot be known;
    ``area``: that of all patches.
    """

    values: F32
    error: F32
    hits: I64
    flux: F64
    flux_error: float
    area: float


@dataclass(frozen=True, eq=False)
class IrradianceImage:
    """Irradiance in image space.

    ``values``: float32 (height, width, 3), flux / world unit²; ``error``: float32 (height, width), of the luminance; ``seen``: bool (height,
    width), where there is a surface; ``object``: int32 (height, width), which; ``hits``: how many arrivals on the patches; ``size``: of the
    patches and ``radius``: of the largest disc, world units.
    """

    values: F32
    error: F32
    seen: npt.NDArray[np.bool_]
    object: I32
    hits: int
    size: float
    radius: float


def irradiance(
    run: Run, selection: Selection, patches: Patches, side: str = "light", threads: int | None = None, faces: Faces = "both"
) -> Irradiance:
    """The irradiance of selected light on patches of the run's scene. ``faces``: which sides of surfaces count.

    The sums have the same bits on any number of threads. Raises ``QueryError`` where the run has no such walks, or the expression does not fit them.
    """
    if faces not in ("both", "front", "back"):
        raise QueryError(f"expected light on `both`, `front` or `back` faces, found `{faces}`")
    with walks_of(run, side) as found:
        arrivals, units = Arrivals(found, selection, side), Units.of_run(found)
        work = functools.partial(_sum_shard, arrivals, patches, faces, units)
        total = _Sums.zeros(len(patches), units.count)
        for part in map_shards(found.files(*arrivals.tables), work, threads or found.threads):
            total.add(part)
        walks = found.settings["passes"] * found.settings["width"] * found.settings["height"]
    area = np.where(patches.area > 0, patches.area, np.inf)
    mean = total.sums * arrivals.per_walk
    variance = total.squares * arrivals.per_walk**2 - luminance_of(mean) ** 2 / walks
    overall = units.jackknife(lambda sums: sums * arrivals.per_walk, total.units)
    return Irradiance(
        (mean / area[:, None]).astype(np.float32),
        (np.sqrt(np.maximum(variance, 0.0)) / area).astype(np.float32),
        total.hits,
        mean.sum(axis=0),
        float(overall.error),
        float(patches.area.sum()),
    )


def irradiance_image(
    run: Run,
    selection: Selection,
    width: int,
    height: int,
    neighbors: int = 120,
    radius: float | None = None,
    side: str = "light",
    threads: int | None = None,
    faces: SeenFaces = "seen",
    objects: Sequence[str] | None = None,
) -> IrradianceImage:
    """The irradiance on what the run's camera sees first in each pixel of an image of this size.

    ``faces``: "seen" is the side toward the camera. ``objects``: only these are there, by name; default all.

    Surfaces are cut into small patches, and each pixel takes the flux over the area of the patches around its point, weighted by
    Epanechnikov's kernel, of the same object and with about the same normal. So the estimate is a mean of irradiance over a disc that ends
    where the surface ends: constant irradiance is found without bias, up to edges and corners, and detail finer than the disc is blurred. Its
    radius is ``radius``, or grows from pixel to pixel until it holds ``neighbors`` arrivals (or is some patches large); that rule favors discs
    that hold many by chance, a bias of at most about 1 / ``neighbors``. Raises as ``irradiance``.
    """
    if width < 1 or height < 1 or neighbors < 1 or (radius is not None and not 0 < radius < np.inf):
        raise QueryError(f"expected a size, neighbors and a radius above 0, found {width} x {height}, {neighbors} and {radius}")
    with walks_of(run, side) as found:
        arrivals = found.tables[f"{side}_vertices"].num_rows
    size = _patch_size(surface_area(run.geometry, objects), arrivals, neighbors, radius)
    made = patches(run.geometry, size, objects)
    points, things, directions = _seen(run, width, height, objects)
    rows = np.flatnonzero(things != NO_OBJECT)
    _, normals = made.locate(points[rows], things[rows])
    front = np.einsum("ij,ij->i", normals, directions[rows].astype(np.float64)) <= 0
    least, most = (radius, radius) if radius else (1.5 * size, _LARGEST_GROWTH * size)
    values, errors, hits = np.zeros((len(rows), 3)), np.zeros(len(rows)), 0
    for face, mine in (("front", front), ("back", ~front)) if faces == "seen" else ((faces, np.ones(len(rows), np.bool_)),):
        if not mine.any():
            continue
        known = irradiance(run, selection, made, side, threads, face)  # type: ignore[arg-type]
        hits += int(known.hits.sum())
        at = rows[mine]
        enough = neighbors if radius is None else 0
        smoothed = _smoothed(made, known, points[at], normals[mine], things[at], least, most, enough, threads or run.threads or cores())
        values[mine], errors[mine] = smoothed
    image, error = np.zeros((height * width, 3), np.float32), np.zeros(height * width, np.float32)
    image[rows], error[rows] = values, errors
    shape = (height, width)
    seen = (things != NO_OBJECT).reshape(shape)
    return IrradianceImage(image.reshape(*shape, 3), error.reshape(shape), seen, things.reshape(shape), hits, size, most)


# --- sums over a run ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Sums:
    """Throughputs by patch (p, 3), squares of what walks bring (p), arrivals (p), luminance by unit (units)."""

    sums: F64
    squares: F64
    hits: I64
    units: F64

    @classmethod
    def zeros(cls, count: int, units: int) -> "_Sums":
        return cls(np.zeros((count, 3)), np.zeros(count), np.zeros(count, np.int64), np.zeros(units))

    def add(self, other: "_Sums") -> None:
        for name in ("sums", "squares", "hits", "units"):
            mine = getattr(self, name)
            mine += getattr(other, name)


def _sum_shard(arrivals: Arrivals, patches: Patches, faces: Faces, units: Units, found: Iterator[Piece]) -> _Sums:
    total = _Sums.zeros(len(patches), units.count)
    table = arrivals.table
    for piece in found:
        rows = np.flatnonzero(arrivals.select(piece) & (piece.column(table, "event") != ESCAPED))
        points = np.stack([piece.column(table, axis)[rows] for axis in "xyz"], axis=1)
        patch, normals = patches.locate(points, piece.column(table, "object")[rows], faces != "both")
        if faces != "both":
            start, end = arrivals.segments(piece, rows)
            from_front = np.einsum("ij,ij->i", normals, end.astype(np.float64) - start) < 0
            patch[from_front != (faces == "front")] = -1
        walks, (r, g, b) = piece.column(table, "walk"), (piece.column(table, f"throughput_{c}") for c in "rgb")
        add_to_patches(walks, rows, patch, r, g, b, total.sums, total.squares, total.hits)
        kept = rows[patch >= 0]
        brought = luminance_of(np.stack([channel[kept] for channel in (r, g, b)], axis=1))
        total.units[:] += np.bincount(units.of_walks(walks[kept]), weights=brought, minlength=units.count)
        piece.forget()
    return total


# --- images -------------------------------------------------------------------------------------------------------


def _patch_size(area: float, arrivals: int, neighbors: int, radius: float | None) -> float:
    """The size of patches that images are made of."""
    wanted = arrivals * _PATCHES_PER_DISC / neighbors if radius is None else _PATCHES_PER_DISC * area / radius**2
    limit = _SMOOTHED_PATCHES if radius is None else MOST_PATCHES / 2
    return float(np.sqrt(area / min(max(wanted, 1000.0), limit)))


def _seen(run: Run, width: int, height: int, objects: Sequence[str] | None) -> tuple[F32, I32, F32]:
    """What the camera sees through the center of each pixel, of all objects or of some: points (n, 3), objects (n), directions (n, 3)."""
    camera, geometry = run.geometry.camera, run.geometry
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    directions = camera.rays(np.column_stack([x.ravel(), y.ravel()]) * camera.film[4:6])
    # rays begin and end at the clipping distances, which are depths
    depth = np.maximum(directions.astype(np.float64) @ camera.optical_axis, 1e-6)
    near, far = camera.film[6] / depth, camera.film[7] / depth
    origins = (camera.origin + near[:, None] * directions).astype(np.float32)
    caster, owner = geometry.caster, geometry.primitive_objects
    if objects is not None:
        mine = np.isin(owner, [geometry.object_id(name) for name in objects])
        flat = mine[: len(caster.corners)]
        caster, owner = RayCaster(caster.corners[flat], caster.kinds[mine[len(flat) :]], caster.to_world[mine[len(flat) :]]), owner[mine]
    primitive, t = caster.closest(origins, directions, (far - near).astype(np.float32))
    things = np.where(primitive >= 0, np.append(owner, NO_OBJECT)[primitive], NO_OBJECT).astype(np.int32)
    return origins + np.where(things == NO_OBJECT, np.float32(0), t)[:, None] * directions, things, directions


def _smoothed(
    made: Patches, known: Irradiance, points: F32, normals: F64, things: I32, least: float, most: float, wanted: int, threads: int
) -> tuple[F64, F64]:
    """Irradiance (n, 3) and the errors of its luminance (n) around points: see ``queries.kernels.meters.smooth``."""
    cell = max(least, 0.25 * most)
    key = np.empty(len(made), np.int64)
    fill_keys(made.center, cell, key)
    order = np.argsort(key, kind="stable")
    keys, first = np.unique(key[order], return_index=True)
    starts = np.append(first, len(made)).astype(np.int64)
    slots = np.full(1 << int(np.ceil(np.log2(2 * len(keys) + 2))), EMPTY)
    fill_slots(keys, slots)
    area = made.area[:, None]
    columns = (made.center, made.normal, area, known.values * area, known.error[:, None] * area, known.hits[:, None], made.object[:, None])
    packed = np.concatenate([column[order].astype(np.float32) for column in columns], axis=1)
    values, errors = np.empty((len(points), 3)), np.empty(len(points))

    def some(rows: slice) -> None:
        smooth(
            points[rows], normals[rows], things[rows], packed, keys, starts, slots,
            cell, least, most, wanted, _ALIGNED, values[rows], errors[rows],
        )  # fmt: skip

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(some, (slice(i, i + _POINTS) for i in range(0, len(points), _POINTS))))
    return values, errors
