"""Appending to the wavefront's row buffers, from inside kernels."""

import numpy as np

from renderer.integrators.buffers import SEEN, PathRows, Rays, ShadowRays, VertexRows, WordRows
from renderer.kernel import kernel
from renderer.math.hash import Index
from renderer.math.vec import ZERO, Vec3
from renderer.shapes.base import Hit

SEEN_MASK = np.uint64(SEEN - 1)


@kernel
def append_vertex(rows: VertexRows, k: int, lane: int, depth: int, event: Index, object_id: Index, p: Vec3, beta: Vec3) -> int:
    """Write one vertex at row k; the new number of rows."""
    rows.lane[k] = lane
    rows.depth[k] = depth
    rows.event[k] = event
    rows.object[k] = object_id
    rows.position[k, 0] = p[0]
    rows.position[k, 1] = p[1]
    rows.position[k, 2] = p[2]
    rows.beta[k, 0] = beta[0]
    rows.beta[k, 1] = beta[1]
    rows.beta[k, 2] = beta[2]
    rows.primitive[k] = -1
    rows.uv[k, 0] = ZERO
    rows.uv[k, 1] = ZERO
    return k + 1


@kernel
def set_surface_point(rows: VertexRows, k: int, primitive: int, hit: Hit) -> None:
    """Write where on its primitive the vertex of row k, already there, lies."""
    rows.primitive[k] = primitive
    rows.uv[k, 0] = hit.b1
    rows.uv[k, 1] = hit.b2


@kernel
def append_path(
    rows: PathRows,
    k: int,
    lane: int,
    ray: int,
    technique: int,
    depth: int,
    event: Index,
    word: np.uint64,
    emitter: Index,
    endpoint: Vec3,
    contribution: Vec3,
    weight: np.float32,
) -> int:
    """Write one path at row k; the new number of rows."""
    rows.lane[k] = lane
    rows.ray[k] = ray
    rows.technique[k] = technique
    rows.depth[k] = depth
    rows.event[k] = event
    rows.word[k] = word
    rows.emitter[k] = emitter
    rows.endpoint[k, 0] = endpoint[0]
    rows.endpoint[k, 1] = endpoint[1]
    rows.endpoint[k, 2] = endpoint[2]
    rows.contribution[k, 0] = contribution[0]
    rows.contribution[k, 1] = contribution[1]
    rows.contribution[k, 2] = contribution[2]
    rows.weight[k] = weight
    return k + 1


@kernel
def copy_path(source: PathRows, i: int, target: PathRows, k: int) -> None:
    """Row i of one buffer to row k of another, or of the same."""
    target.lane[k] = source.lane[i]
    target.ray[k] = source.ray[i]
    target.technique[k] = source.technique[i]
    target.depth[k] = source.depth[i]
    target.event[k] = source.event[i]
    target.word[k] = source.word[i]
    target.emitter[k] = source.emitter[i]
    for c in range(3):
        target.endpoint[k, c] = source.endpoint[i, c]
        target.contribution[k, c] = source.contribution[i, c]
    target.raster[k, 0] = source.raster[i, 0]
    target.raster[k, 1] = source.raster[i, 1]
    target.weight[k] = source.weight[i]
    target.blocker[k] = source.blocker[i]


@kernel
def append_word(rows: WordRows, k: int, word: np.uint64, parent: np.uint64, event: Index, object_id: Index) -> int:
    """Write a word at row k unless it was met lately; the new number of rows."""
    slot = word & SEEN_MASK
    if rows.seen[slot] == word:
        return k
    rows.seen[slot] = word
    rows.word[k] = word
    rows.parent[k] = parent
    rows.event[k] = event
    rows.object[k] = object_id
    return k + 1


@kernel
def append_ray(rays: Rays, k: int, lane: int, o: Vec3, d: Vec3, beta: Vec3, pdf: np.float32, eta: np.float32, word: np.uint64) -> int:
    """Write one ray that goes on at row k; the new number of rows."""
    rays.lane[k] = lane
    rays.o[k, 0] = o[0]
    rays.o[k, 1] = o[1]
    rays.o[k, 2] = o[2]
    rays.d[k, 0] = d[0]
    rays.d[k, 1] = d[1]
    rays.d[k, 2] = d[2]
    rays.beta[k, 0] = beta[0]
    rays.beta[k, 1] = beta[1]
    rays.beta[k, 2] = beta[2]
    rays.pdf[k] = pdf
    rays.eta[k] = eta
    rays.word[k] = word
    return k + 1


@kernel
def append_shadow_ray(rays: ShadowRays, k: int, o: Vec3, d: Vec3, far: np.float32) -> int:
    """Write one connection to test at row k; the new number of rows."""
    rays.o[k, 0] = o[0]
    rays.o[k, 1] = o[1]
    rays.o[k, 2] = o[2]
    rays.d[k, 0] = d[0]
    rays.d[k, 1] = d[1]
    rays.d[k, 2] = d[2]
    rays.far[k] = far
    return k + 1
