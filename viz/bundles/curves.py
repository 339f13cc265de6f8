"""Segments as curves that are pulled toward their bundle's axis (thesis 8.1 and 8.2).

A point of a curve is p(u) = lerp(x, x', t(u)): x = lerp(x0, x1, u) on the segment, x' = lerp(x0', x1', u) on the axis, between the projections of
the segment's ends, t(u) the influence, which is 0 where the curve fans out. Flattened, the influence stays at its largest through the inside of a
path: a vertex inside is then drawn away from its place too. Since it belongs to two bundles, its target is the mean of its two projections, the same
for the segment that arrives and for the one that leaves, so that the curve of the whole path is continuous.
"""

import enum
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from queries.shards import cores
from viz.bundles.assign import Segments
from viz.bundles.axes import Axes

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]
CHUNK = 2048  # segments at a time: what they need stays in the cache


class Influence(enum.IntEnum):
    """Where a segment's influence is 0: at both ends, at the start alone (a flattened path's first segment), at the end alone, nowhere."""

    BOTH = 0
    FIRST = 1
    INNER = 2
    LAST = 3


def influence(u: npt.NDArray[np.floating], amount: float, kind: Influence = Influence.BOTH) -> F32:
    """t(u), float32, of u from 0 to 1: ``amount`` (1/2 + 1/2 cos(2 pi u - pi)) (Eq. 8.1), or its largest value where a flattened path goes on."""
    u = np.asarray(u, np.float64)
    if kind == Influence.FIRST:
        u = np.minimum(u, 0.5)
    elif kind == Influence.LAST:
        u = np.maximum(u, 0.5)
    elif kind == Influence.INNER:
        u = np.full_like(u, 0.5)
    t: F32 = (amount * (0.5 + 0.5 * np.cos(2 * np.pi * u - np.pi))).astype(np.float32)
    return t


def targets(segments: Segments, begin: F32, end: F32, axes: Axes, flatten: bool = False) -> tuple[F32, F32, U8]:
    """The points x0' and x1' that the ends (s, 3) are drawn to, and the ``Influence`` of each segment, uint8 (s)."""
    drawn_begin, drawn_end = axes.project(begin, segments.bundle), axes.project(end, segments.bundle)
    kind = np.full(len(segments), Influence.BOTH, np.uint8)
    if flatten and len(segments):
        inside = np.flatnonzero(segments.path[1:] == segments.path[:-1])  # segments that another of the same path follows
        middle = np.float32(0.5) * (drawn_end[inside] + drawn_begin[inside + 1])
        drawn_end[inside], drawn_begin[inside + 1] = middle, middle
        follows, goes_on = np.zeros(len(segments), np.bool_), np.zeros(len(segments), np.bool_)
        follows[inside + 1], goes_on[inside] = True, True
        kind[~follows & goes_on] = Influence.FIRST
        kind[follows & goes_on] = Influence.INNER
        kind[follows & ~goes_on] = Influence.LAST
    return drawn_begin, drawn_end, kind


def curves_of(ends: tuple[F32, F32], drawn: tuple[F32, F32], kind: U8, amount: float, points: int, threads: int | None = None) -> F32:
    """The curves' points p(u) at ``points`` equal steps of u: float32 (s, points, 3).

    ``ends``: the segments' x0 and x1, (s, 3) each; ``drawn``, ``kind``: as from ``targets``. Each point is computed by itself in float32, so that a
    curve has the same bits whatever stands beside it; first and last points are the segment's own unless a flattened path goes on there.
    """
    u = np.linspace(0, 1, points)
    t = np.stack([influence(u, amount, k) for k in Influence])
    steps = u.astype(np.float32)[:, None]
    curves = np.empty((len(kind), points, 3), np.float32)

    def bend(first: int) -> None:
        rows = slice(first, first + CHUNK)
        pull = t.T[:, kind[rows]]  # (points, rows)
        rest = 1 - steps
        x, target, part = (np.empty_like(pull) for _ in range(3))
        for k in range(3):
            for line, (a, b) in ((x, ends), (target, drawn)):
                np.multiply(a[rows, k], rest, out=line)
                np.multiply(b[rows, k], steps, out=part)
                line += part
            target -= x
            target *= pull
            x += target
            curves[rows, :, k] = x.T

    for_chunks(bend, len(kind), threads)
    return curves


def for_chunks(work: Callable[[int], None], rows: int, threads: int | None = None) -> None:
    """``work`` on the first row of every chunk, by so many threads (None: one for each core)."""
    with ThreadPoolExecutor(threads or cores()) as pool:
        for _ in pool.map(work, range(0, rows, CHUNK)):
            pass
