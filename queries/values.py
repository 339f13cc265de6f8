"""What a matched path counts: its contribution, or what the prefixes of an expression make of it.

- ``unoccluded;``: emitter samples and blocked connections, each at weight 1, as if nothing cast a shadow. Emitter hits that compete with
  emitter samples are left out: scattered rays that hit the blocker have no row, so the weighted sum of both would be biased. Emitters seen
  directly, or by way of singular or straight scattering alone, which no emitter sample finds, count as they are.
- ``shadows;``: the blocked connections alone, at weight 1: the light that is missing in shadows.
- ``noclamp;``: changes nothing, as nothing is clamped.
- ``nothruput;``: divides by the walk's throughput on arrival at the path's last interaction (at the emitter, where it is seen directly), channel
  by channel; 0 where that is 0. Emitter hits and samples then still estimate one quantity, the light that the interaction sends back.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.by_words import word_rows
from queries.errors import QueryError
from queries.kernels.vertices import find_walks
from queries.lpe import Expression
from queries.run import Run
from queries.shards import Piece
from queries.word_tree import WordTree
from renderer.tables import EMITTER_HIT, EVENTS

F32 = npt.NDArray[np.float32]
I64 = npt.NDArray[np.int64]
Chosen = npt.NDArray[np.bool_]
_UNSAMPLED = [event.key for event in EVENTS if event.scattering in ("S", "s")]  # no emitter sample goes by these lobes


@dataclass(frozen=True)
class Term:
    """Rows of one table that count. ``whole``: at weight 1; ``bare``: without the walk's throughput; ``words``: without competing emitter hits."""

    table: str
    whole: bool = False
    bare: bool = False
    words: WordTree | None = None

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that it reads."""
        return (self.table, "camera_vertices") if self.bare else (self.table,)

    def select(self, piece: Piece, chosen: Chosen) -> Chosen:
        """Those of the chosen rows that count: bool (rows)."""
        if self.words is None:
            return chosen
        event = self.words.event[np.maximum(word_rows(self.words, piece, self.table, "camera"), 0)]
        competing = (piece.column(self.table, "technique") == EMITTER_HIT) & (event != 0) & ~np.isin(event, _UNSAMPLED)
        counted: Chosen = chosen & ~competing
        return counted

    def values(self, piece: Piece) -> tuple[F32, F32, F32]:
        """What each row counts: red, green and blue, float32 (rows)."""
        red, green, blue = (self._values(piece, channel) for channel in "rgb")
        return red, green, blue

    def _values(self, piece: Piece, channel: str) -> F32:
        contribution: F32 = piece.column(self.table, f"contribution_{channel}")
        if not (self.whole or self.bare):
            return contribution
        divisor = np.ones(len(contribution), np.float32)
        if self.whole and piece.has(self.table, "mis_weight"):
            divisor *= piece.column(self.table, "mis_weight")
        if self.bare:
            row = piece.once(("last vertex", self.table), lambda: _last_vertex(piece, self.table))
            divisor *= np.where(row >= 0, piece.column("camera_vertices", f"throughput_{channel}")[row], np.float32(0))
        value = np.divide(contribution, divisor, out=np.zeros_like(contribution), where=divisor > 0)
        value.flags.writeable = False  # of the same type as stored columns: kernels are compiled for it once
        return value


def terms_of(run: Run, expression: Expression | None) -> tuple[Term, ...]:
    """What an expression's paths count in a run. Raises QueryError where the run lacks what a prefix needs."""
    prefixes = () if expression is None else expression.prefixes
    bare = "nothruput" in prefixes
    if bare and run.light_words:
        raise QueryError("`nothruput;` divides by the throughput of camera walks, and this run's paths use light walks: leave the prefix out")
    if bare and "camera_vertices" not in run.tables:
        raise QueryError("`nothruput;` needs the vertices of walks, which this run did not record")
    if not {"unoccluded", "shadows"} & set(prefixes):
        return (Term("paths", bare=bare),)
    if not run.settings.get("occluded") or "occluded" not in run.tables:
        prefix = "shadows" if "shadows" in prefixes else "unoccluded"
        raise QueryError(f"`{prefix};` needs the blocked connections, which `{run.path}` did not keep: record them with `record: {{occluded: true}}`")
    blocked = Term("occluded", whole=True, bare=bare)
    return (blocked,) if "shadows" in prefixes else (Term("paths", whole=True, bare=bare, words=run.words), blocked)


def _last_vertex(piece: Piece, table: str) -> I64:
    """The row of each path's last interaction on the camera side, or of an emitter that is seen directly; -1 where there is none."""
    walk, vertex_walk = piece.column(table, "camera_walk"), piece.column("camera_vertices", "walk")
    hits = piece.column(table, "technique") == EMITTER_HIT  # their last vertex is the emitter
    depth, vertex_depth = np.maximum(piece.column(table, "camera_depth").astype(np.int64) - hits, 1), piece.column("camera_vertices", "depth")
    start = np.empty(len(walk), np.int64)
    find_walks(walk, vertex_walk, vertex_depth, start)
    row = np.minimum(start + depth - 1, len(vertex_walk) - 1)
    found: I64 = np.where((start >= 0) & (vertex_walk[row] == walk) & (vertex_depth[row] == depth), row, -1)
    return found
