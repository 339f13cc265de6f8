"""Depth: how many paths, and how much light, come of each number of segments, and where walks end."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.diagnostics.answers import INTEGER, REAL, TEXT, Figure, answer, require_paths
from queries.diagnostics.tallies import I32, energies, shares
from queries.run import Run
from queries.shards import Piece, map_shards
from renderer.tables import ABSORBED, DEPTH_LIMIT, EMITTER_HIT, ESCAPED, FIRST_SCATTERING, MERGE, ROULETTE

I64 = npt.NDArray[np.int64]
_MOST = 512  # segments that a path of two walks may have
_ENDS = {"absorbed": ABSORBED, "escaped": ESCAPED, "roulette": ROULETTE, "depth_limit": DEPTH_LIMIT}
_VERTICES = ("camera_vertices", "light_vertices")

FIGURES = (
    Figure("depth", INTEGER, "segments of the full path from the camera to the light, which `max_depth` limits; 1: light seen directly"),
    Figure("paths", INTEGER, "recorded paths, or lobes' shares of one, of so many segments"),
    Figure("energy", REAL, "what they add to the image's mean luminance, of linear sRGB"),
    Figure("share", REAL, "their share, 0 … 1, of the image's"),
    Figure("standard_error", REAL, "standard error of `energy`; NULL where it cannot be trusted"),
    Figure("absorbed", INTEGER, "recorded walks that were absorbed at their vertex of this depth"),
    Figure("escaped", INTEGER, "recorded walks that left the scene on their segment of this depth"),
    Figure("roulette", INTEGER, "recorded walks that Russian roulette ended at their vertex of this depth"),
    Figure("depth_limit", INTEGER, "recorded walks that `max_depth` ended at their vertex of this depth"),
    Figure("units", INTEGER, "independent units (replicates, passes or groups of walks) that standard errors rest on"),
    Figure("verdict", TEXT, "why the estimate of variance cannot be trusted; NULL where it can"),
)


def depths(run: Run) -> pa.Table:
    """The depth histogram (columns: ``FIGURES``), from depth 1 to the deepest path or walk. Raises ``QueryError`` for a run without paths."""
    require_paths(run)
    sums = energies(run, _MOST, segments)
    ends = walk_ends(run)
    met = np.flatnonzero((sums.moments.rows > 0) | ends.any(axis=0))
    shown = np.arange(1, met[-1] + 1) if len(met) else np.arange(0)
    values = {
        "depth": shown,
        "paths": sums.moments.rows[shown].astype(np.int64),
        "energy": sums.energy[shown],
        "share": shares(sums.energy)[shown],
        "standard_error": sums.trusted_error[shown],
        **{name: ends[event, shown] for name, event in _ENDS.items()},
        "units": [sums.units] * len(shown),
        "verdict": [sums.reasons[number] or None if sums.moments.rows[number] > 0 else None for number in shown],
    }
    return answer(FIGURES, values)


def segments(piece: Piece, table: str = "paths") -> I32:
    """Segments of the full path of each row: int32 (rows). Depths count vertices of walks; an emitter hit's include the emitter."""
    technique = piece.column(table, "technique")
    count = np.ones(piece.rows(table), np.int32)
    for name in ("camera_depth", "light_depth"):
        if piece.has(table, name):
            count += piece.column(table, name)
    # a hit's last vertex is the emitter, and two merged vertices are one: no segment joins them to anything
    return np.asarray(count - ((technique == EMITTER_HIT) | (technique == MERGE)), np.int32)


def walk_ends(run: Run) -> I64:
    """How many recorded walks ended by each event at each depth: int64 (event, depth)."""

    def work(pieces: Iterator[Piece]) -> I64:
        ends = np.zeros(FIRST_SCATTERING * _MOST, np.int64)
        for piece in pieces:
            for table in _VERTICES:
                if piece.rows(table):
                    event = piece.column(table, "event")
                    last = np.flatnonzero(event <= DEPTH_LIMIT)
                    key = event[last].astype(np.int64) * _MOST + piece.column(table, "depth")[last]
                    ends += np.bincount(key, minlength=len(ends))
        return ends

    total = np.zeros(FIRST_SCATTERING * _MOST, np.int64)
    for ends in map_shards(run.shard_files, work, run.threads):
        total += ends
    return total.reshape(FIRST_SCATTERING, _MOST)
