"""What a run's tables say of the film: samples, each a place and a color, of the paths that an expression matches."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.images import Layer
from queries.kernels.samples import gather_samples
from queries.lpe import Expression
from queries.run import Run
from queries.shards import Piece
from queries.values import Term

F32 = npt.NDArray[np.float32]
WANTED = "resolved for subpixels"


class Samples(NamedTuple):
    """Places in pixels, float32 (samples), and colors, float32 (samples, 3). ``counted``: they count as samples; else they add color alone."""

    x: F32
    y: F32
    color: F32
    counted: bool


class Walks(NamedTuple):
    """Rows of ``paths``, of which those of a walk lie together and are one sample: the walk, whether its color counts, place and color."""

    walk: npt.NDArray[np.unsignedinteger]
    chosen: npt.NDArray[np.bool_]
    x: F32
    y: F32
    red: F32
    green: F32
    blue: F32

    def gathered(self) -> Samples:
        """One sample for each walk."""
        n = len(self.walk)
        x, y, color = np.empty(n, np.float32), np.empty(n, np.float32), np.empty((n, 3), np.float32)
        count = gather_samples(*self, x, y, color) if n else 0
        return Samples(x[:count], y[:count], color[:count], True)


@dataclass(frozen=True)
class SampledRun:
    """The samples of a run: of camera walks, each one sample, lit or not; of light walks, each path one, that adds color alone."""

    run: Run
    layer: Layer
    camera: bool

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that are read."""
        return (*self.layer.tables, *(("paths", "unlit") if self.camera else ()))

    @property
    def expected(self) -> float:
        """How many samples a pixel has, on average: what divides sums where samples are not counted."""
        return float(self.run.settings["passes"] * self.run.settings["keep"])

    @property
    def most(self) -> float:
        """How many samples of a pixel a shard has, about."""
        settings = self.run.settings
        return float(self.run.manifest["shards"]["walks"] / (settings["width"] * settings["height"]))

    @property
    def banded(self) -> bool:
        """Whether a shard reaches but a band of the film."""
        settings = self.run.settings
        return self.camera and bool(self.run.manifest["shards"]["walks"] < settings["width"] * settings["height"])

    def heights(self, piece: Piece) -> tuple[float, float]:
        """Between which heights on the film a piece's samples lie; (inf, -inf) where there are none."""
        found = [piece.column(table, "raster_y") for table in self._placed() if piece.rows(table)]
        return min((float(y.min()) for y in found), default=np.inf), max((float(y.max()) for y in found), default=-np.inf)

    def of(self, piece: Piece) -> Iterator[Samples]:
        """The samples of a piece, in the order of its rows."""
        if self.camera:
            yield self.walks(piece).gathered()
        yield from self.others(piece)

    def walks(self, piece: Piece) -> Walks:
        """The camera walks of a piece that have paths."""
        term = next((term for term in self.layer.terms if term.table == "paths"), None)
        return self._walks(piece, "paths", term)

    def others(self, piece: Piece) -> Iterator[Samples]:
        """Samples that are no such walks."""
        n = piece.rows("unlit") if self.camera else 0
        if n:
            yield Samples(piece.column("unlit", "raster_x"), piece.column("unlit", "raster_y"), np.zeros((n, 3), np.float32), True)
        for term in self.layer.terms:
            if not self.camera:
                yield self._paths(piece, term.table, term)
            elif term.table != "paths":
                yield self._walks(piece, term.table, term).gathered()._replace(counted=False)

    def _placed(self) -> set[str]:
        """The tables whose rows have a place on the film."""
        return {term.table for term in self.layer.terms} | ({"paths", "unlit"} if self.camera else set())

    def _walks(self, piece: Piece, table: str, term: Term | None) -> Walks:
        """The walks of a table."""
        chosen = np.zeros(piece.rows(table), np.bool_) if term is None else self.layer.chosen(piece, term)
        red, green, blue = (piece.column(table, f"contribution_{c}") for c in "rgb") if term is None else term.values(piece)
        return Walks(piece.column(table, "camera_walk"), chosen, piece.column(table, "raster_x"), piece.column(table, "raster_y"), red, green, blue)

    def _paths(self, piece: Piece, table: str, term: Term) -> Samples:
        """One sample for each path."""
        if not piece.rows(table):
            return Samples(np.empty(0, np.float32), np.empty(0, np.float32), np.empty((0, 3), np.float32), False)
        chosen = self.layer.chosen(piece, term)
        color = np.stack([value[chosen] for value in term.values(piece)], axis=1)
        return Samples(piece.column(table, "raster_x")[chosen], piece.column(table, "raster_y")[chosen], color, False)


def sampled(run: Run, expression: Expression | str | None) -> SampledRun:
    """The samples that an expression selects, or all. Raises QueryError where the run did not record what is needed."""
    run.require_paths("nothing can be resolved for subpixels")
    camera = run.settings["method"] == "path"
    if camera:
        run.require_unlit(WANTED)
    return SampledRun(run, Layer.of(run, run.compile(expression) if isinstance(expression, str) else expression), camera)
