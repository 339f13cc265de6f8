"""Facets: the flat and round parts that surfaces are made of, each with coordinates of its own and a grid of patches in them.

A facet's local coordinates (x, y, z), by ``kind``: of flat ones the weights of two edges and the height above the plane; of round ones those
of the unit sphere, the unit disk at z = 0, the open cylinder of radius 1 over z in [0, 1]. All arithmetic is float64.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
Vec3 = tuple[float, float, float]
Index = int | np.integer[Any]

TRIANGLE, PARALLELOGRAM, SPHERE, DISK, CYLINDER = range(5)
QUARTER = np.pi / 4
NOWHERE = np.int64(-1)


class Facets(NamedTuple):
    """``kind`` uint8 (f); ``to_world``, ``to_local`` (f, 3, 4); ``first`` int64 (f), the first patch; ``counts`` int64 (f, 2), patches each way."""

    kind: U8
    to_world: F64
    to_local: F64
    first: I64
    counts: I64


class FacetGrid(NamedTuple):
    """Cells of a grid over each object, and the facets that each cell touches.

    ``low``, ``per_unit`` (objects, 3); ``shape``, int64 (objects, 3), zeros for objects without facets; ``first``: int64 (objects), the
    object's first cell; ``starts``: int64 (cells + 1) into ``facets``, int32.
    """

    low: F64
    per_unit: F64
    shape: I64
    first: I64
    starts: I64
    facets: I32


@kernel
def apply(m: F64, i: Index, x: float, y: float, z: float, w: float) -> Vec3:
    """Matrix ``i`` of (n, 3, 4) times (x, y, z, w): w is 1 for points, 0 for directions."""
    return (
        m[i, 0, 0] * x + m[i, 0, 1] * y + m[i, 0, 2] * z + m[i, 0, 3] * w,
        m[i, 1, 0] * x + m[i, 1, 1] * y + m[i, 1, 2] * z + m[i, 1, 3] * w,
        m[i, 2, 0] * x + m[i, 2, 1] * y + m[i, 2, 2] * z + m[i, 2, 3] * w,
    )


@kernel
def onto_facet(kind: Index, x: float, y: float, z: float) -> Vec3:
    """A point of the facet near a local point: the nearest one, where the point lies on the facet but for rounding."""
    if kind in (TRIANGLE, PARALLELOGRAM):
        x, y = min(max(x, 0.0), 1.0), min(max(y, 0.0), 1.0)
        over = x + y - 1.0
        if kind == TRIANGLE and over > 0.0:
            x = min(max(x - 0.5 * over, 0.0), 1.0)
            y = 1.0 - x
        return x, y, 0.0
    if kind == DISK:
        shrink = 1.0 / max(np.sqrt(x * x + y * y), 1.0)
        return x * shrink, y * shrink, 0.0
    if kind == CYLINDER:
        shrink = 1.0 / max(np.sqrt(x * x + y * y), 1e-300)
        return x * shrink, y * shrink, min(max(z, 0.0), 1.0)
    shrink = 1.0 / max(np.sqrt(x * x + y * y + z * z), 1e-300)
    return x * shrink, y * shrink, z * shrink


@kernel
def square_of_disk(x: float, y: float) -> tuple[float, float]:
    """The point of the unit square that the concentric map (shirley1997) sends to a point of the unit disk."""
    r = np.sqrt(x * x + y * y)
    if abs(x) >= abs(y):
        a = r if x >= 0.0 else -r
        b = a * np.arctan(y / x) / QUARTER if x != 0.0 else 0.0
    else:
        b = r if y >= 0.0 else -r
        a = b * np.arctan(x / y) / QUARTER
    return 0.5 * (a + 1.0), 0.5 * (b + 1.0)


@kernel
def cell_of(share: float, count: Index) -> np.int64:
    """Which of ``count`` equal parts of [0, 1] a number lies in."""
    return min(max(np.int64(np.floor(share * count)), np.int64(0)), np.int64(count) - np.int64(1))


@kernel
def patch_of(kind: Index, nu: np.int64, nv: np.int64, x: float, y: float, z: float) -> np.int64:
    """Which patch of its facet a local point lies in, counted from 0."""
    if kind == TRIANGLE:
        # n rows of congruent triangles, each upright one followed by the upside-down one beside it
        i = cell_of(x, nu)
        j = min(max(np.int64(np.floor(y * nu)), np.int64(0)), nu - 1 - i)
        beyond = (x * nu - i) + (y * nu - j) > 1.0 and j < nu - 1 - i
        return i * (2 * nu - i) + 2 * j + np.int64(beyond)
    if kind == PARALLELOGRAM:
        return cell_of(x, nu) * nv + cell_of(y, nv)
    if kind == DISK:
        a, b = square_of_disk(x, y)
        return cell_of(a, nu) * nv + cell_of(b, nv)
    if kind == CYLINDER:
        turn = np.arctan2(y, x) / (8.0 * QUARTER)
        return cell_of(turn if turn >= 0.0 else turn + 1.0, nu) * nv + cell_of(z, nv)
    # a cube's faces blown up to the sphere, cut at equal angles
    if abs(x) >= abs(y) and abs(x) >= abs(z):
        face, major, a, b = 0, x, y, z
    elif abs(y) >= abs(z):
        face, major, a, b = 1, y, z, x
    else:
        face, major, a, b = 2, z, x, y
    i = cell_of(0.5 * (1.0 + np.arctan(a / abs(major)) / QUARTER), nu)
    j = cell_of(0.5 * (1.0 + np.arctan(b / abs(major)) / QUARTER), nv)
    return ((2 * np.int64(face) + np.int64(major < 0.0)) * nu + i) * nv + j


@kernel
def nearest_facet(facets: Facets, grid: FacetGrid, thing: np.int64, px: float, py: float, pz: float) -> np.int64:
    """The facet of an object on which a point lies; -1 where the object has none there. The first of those that are equally near."""
    if thing < 0 or thing >= len(grid.shape) or grid.shape[thing, 0] == 0:
        return NOWHERE
    nx, ny, nz = grid.shape[thing, 0], grid.shape[thing, 1], grid.shape[thing, 2]
    i = min(max(np.int64(np.floor((px - grid.low[thing, 0]) * grid.per_unit[thing, 0])), np.int64(0)), nx - 1)
    j = min(max(np.int64(np.floor((py - grid.low[thing, 1]) * grid.per_unit[thing, 1])), np.int64(0)), ny - 1)
    k = min(max(np.int64(np.floor((pz - grid.low[thing, 2]) * grid.per_unit[thing, 2])), np.int64(0)), nz - 1)
    cell = grid.first[thing] + (i * ny + j) * nz + k
    nearest, best = np.inf, NOWHERE
    for at in range(grid.starts[cell], grid.starts[cell + 1]):
        f = np.int64(grid.facets[at])
        x, y, z = apply(facets.to_local, f, px, py, pz, 1.0)
        a, b, c = onto_facet(facets.kind[f], x, y, z)
        dx, dy, dz = apply(facets.to_world, f, x - a, y - b, z - c, 0.0)
        distance = dx * dx + dy * dy + dz * dz
        if distance < nearest:
            nearest, best = distance, f
    return best


@kernel
def find_patches(facets: Facets, grid: FacetGrid, points: F32, things: I32, patches: I64, normals: F64) -> None:
    """The patch of each point (n, 3) of an object (n,): ``patches`` (n,), -1 where there is none; ``normals`` (n, 3), or (0, 3): not asked for."""
    for i in range(len(points)):
        px, py, pz = np.float64(points[i, 0]), np.float64(points[i, 1]), np.float64(points[i, 2])
        f = nearest_facet(facets, grid, np.int64(things[i]), px, py, pz)
        patches[i] = NOWHERE
        if f < 0:
            continue
        kind = facets.kind[f]
        x, y, z = apply(facets.to_local, f, px, py, pz, 1.0)
        patches[i] = facets.first[f] + patch_of(kind, facets.counts[f, 0], facets.counts[f, 1], x, y, z)
        if len(normals):
            # gradients go by the transposed inverse
            gx, gy, gz = (x, y, z) if kind == SPHERE else (x, y, 0.0) if kind == CYLINDER else (0.0, 0.0, 1.0)
            m = facets.to_local[f]
            nx = m[0, 0] * gx + m[1, 0] * gy + m[2, 0] * gz
            ny = m[0, 1] * gx + m[1, 1] * gy + m[2, 1] * gz
            nz = m[0, 2] * gx + m[1, 2] * gy + m[2, 2] * gz
            length = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-300)
            normals[i, 0], normals[i, 1], normals[i, 2] = nx / length, ny / length, nz / length


@kernel
def fill_cells(low: I64, high: I64, shape: I64, first: I64, starts: I64, facets: I32) -> None:
    """Sort facets into cells: facet f touches the cells ``low[f]`` … ``high[f]``, (f, 3) each, of its object's grid of this ``shape`` (f, 3).

    ``first`` (f): the grid's first cell. ``starts`` (cells + 1) comes as zeros; with ``facets`` empty it is counted, then summed by the caller,
    and a second call fills ``facets`` and leaves ``starts`` one cell ahead.
    """
    for f in range(len(low)):
        for i in range(low[f, 0], high[f, 0] + 1):
            for j in range(low[f, 1], high[f, 1] + 1):
                for k in range(low[f, 2], high[f, 2] + 1):
                    cell = first[f] + (i * shape[f, 1] + j) * shape[f, 2] + k
                    if len(facets):
                        facets[starts[cell]] = f
                    starts[cell] += 1
