"""Which bundle each segment of each path belongs to: that of all segments whose two ends are of the same kinds (thesis 8.3)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.path_sample import PathSample
from renderer.tables import NO_OBJECT

I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
Ints = npt.NDArray[np.integer]

_DENSEST = 1 << 22  # codes below this are numbered by a table, which is faster than sorting


@dataclass(frozen=True)
class Segments:
    """``s`` segments of paths, in the paths' order, each path's as light travels.

    ``begin``: int64 (s), the vertex that each leaves; it arrives at the next. ``path``: int32 (s), the path's number in the sample.
    ``bundle``: int32 (s), from 0 to ``bundles`` - 1, numbered by the codes of both ends, so that they do not depend on the order of paths.
    """

    begin: I64
    path: I32
    bundle: I32
    bundles: int

    def __len__(self) -> int:
        """How many segments there are."""
        return len(self.begin)

    def take(self, rows: I64) -> "Segments":
        """Some of the segments; bundles keep their numbers."""
        return Segments(self.begin[rows], self.path[rows], self.bundle[rows], self.bundles)


def vertex_codes(sample: PathSample, by: tuple[str, ...], materials: Ints, normals: Ints | None = None) -> I64:
    """What tells vertices apart, as one number for each: int64 (m).

    ``by``: some of event, object, material, normal. ``materials``: a number below 2^16 for each object; ``normals``: one below 16 for each vertex.
    """
    codes = np.zeros(len(sample.event), np.int64)
    objects = sample.object.astype(np.int64)
    if "event" in by:
        codes |= sample.event.astype(np.int64)
    if "object" in by:
        codes |= objects << 8
    if "material" in by and len(materials):
        known = np.where(objects < len(materials), np.asarray(materials)[np.minimum(objects, len(materials) - 1)], NO_OBJECT)
        codes |= known << 40
    if "normal" in by and normals is not None:
        codes |= normals.astype(np.int64) << 56
    return codes


def segments_of(start: I64, codes: I64) -> Segments:
    """The segments of paths that begin at the vertices ``start`` (n + 1), in bundles by the codes (m) of their ends."""
    length = np.diff(start)
    path = np.repeat(np.arange(len(length), dtype=np.int32), np.maximum(length - 1, 0))
    # The k-th segment leaves the k-th vertex, but for one vertex of each path before it, the last, which none leaves
    begin = np.arange(len(path), dtype=np.int64) + path + (start[0] if len(start) else 0)
    kind, kinds = _numbered(codes)
    bundle, bundles = _numbered(kind[begin].astype(np.int64) * max(1, kinds) + kind[begin + 1])
    return Segments(begin, path, bundle, bundles)


def _numbered(codes: I64) -> tuple[I32, int]:
    """The rank of each code among those that occur, int32, and how many occur."""
    if not len(codes):
        return np.zeros(0, np.int32), 0
    largest = int(codes.max())
    if int(codes.min()) >= 0 and largest < _DENSEST:
        present = np.zeros(largest + 1, np.bool_)
        present[codes] = True
        rank = np.cumsum(present, dtype=np.int32) - np.int32(1)
        return rank[codes], int(rank[-1]) + 1
    distinct, rank = np.unique(codes, return_inverse=True)
    return rank.reshape(-1).astype(np.int32), len(distinct)
