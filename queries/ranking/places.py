"""Where paths lie: in a region, in the ring around it, or in neither."""

import numpy as np
import numpy.typing as npt

from queries.kernels.ranges import largest_in_ranges, mark_ranges
from queries.kernels.vertices import find_walks
from queries.regions import Region
from queries.run import Run
from queries.shards import Piece
from renderer.tables import EMITTER_HIT

I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
ELSEWHERE, RING, INSIDE = 0, 1, 2


class Places:
    """Tells which paths lie in a region, and which in the ring: an outer region (None: no ring) without the region itself.

    ``at`` "seen": a path lies where its interaction next to the camera does (thesis 9.4.2: L(D|G|S)*X_pE); "any": in the region if any of its
    interactions does, or else in the ring if any does. Paths without interactions (emitters seen directly) lie elsewhere.
    """

    def __init__(self, run: Run, region: Region, outer: Region | None, at: str) -> None:
        self._run, self._region, self._outer, self._at = run, region, outer, at

    def of(self, piece: Piece) -> U8:
        """``INSIDE``, ``RING`` or ``ELSEWHERE`` for each path: uint8 (rows)."""
        places = np.zeros(piece.rows("paths"), np.uint8)
        camera_count = _interactions(piece, "camera")
        for side in ("camera", "light"):
            vertices = f"{side}_vertices"
            if not piece.rows(vertices) or not piece.has("paths", f"{side}_walk"):
                continue
            first = np.empty(len(places), np.int64)
            find_walks(piece.column("paths", f"{side}_walk"), piece.column(vertices, "walk"), piece.column(vertices, "depth"), first)
            count = camera_count if side == "camera" else _interactions(piece, side)
            count = np.where(first < 0, 0, count)
            end = first + count
            if self._at == "seen" and side == "camera":
                end = first + np.minimum(count, 1)
            elif self._at == "seen":
                # The light walk's last interaction is what the camera sees, unless a camera walk is in between
                first = np.where(camera_count > 0, end, np.maximum(end - 1, first))
            used = np.zeros(piece.rows(vertices), np.bool_)
            mark_ranges(first, end, used)
            largest_in_ranges(first, end, self._codes(piece, vertices, used), places)
        return places

    def _codes(self, piece: Piece, vertices: str, used: npt.NDArray[np.bool_]) -> U8:
        """Where each vertex lies; ``ELSEWHERE`` for those that are not used."""
        codes = np.zeros(len(used), np.uint8)
        rows = np.flatnonzero(used)
        points = np.stack([piece.column(vertices, axis)[rows] for axis in "xyz"], axis=1)
        things = piece.column(vertices, "object")[rows].astype(np.int32)
        inside = self._region.contains(self._run.geometry, points, things)
        codes[rows[inside]] = INSIDE
        if self._outer is not None:
            rest = np.flatnonzero(~inside)
            around = self._outer.contains(self._run.geometry, points[rest], things[rest])
            codes[rows[rest[around]]] = RING
        return codes


def _interactions(piece: Piece, side: str) -> I64:
    """How many interactions of one side's walk each path has: a camera walk that hit an emitter ends there, where nothing scatters."""
    if not piece.has("paths", f"{side}_depth"):
        return np.zeros(piece.rows("paths"), np.int64)
    depth = piece.column("paths", f"{side}_depth").astype(np.int64)
    return depth - (piece.column("paths", "technique") == EMITTER_HIT) if side == "camera" else depth
