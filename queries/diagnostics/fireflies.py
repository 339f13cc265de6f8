"""Fireflies with their provenance: outlier pixels, the walks that carry their variance, and the paths of those walks."""

from collections.abc import Iterator

import numpy as np
import pyarrow as pa

from queries.diagnostics.answers import INTEGER, REAL, TEXT, Figure, answer, require_paths
from queries.diagnostics.outliers import LEAST_WALKS, Outliers, PixelSums, light_of, outlier_pixels, pixel_sums
from queries.diagnostics.provenance import Provenance
from queries.errors import QueryError
from queries.kernels.pixels import mark_above
from queries.luminance import luminance_of
from queries.run import Run
from queries.shards import Array, Piece, map_shards
from renderer.tables import TECHNIQUES

_RASTER = ("raster_x", "raster_y")
_LIGHT = ("contribution_r", "contribution_g", "contribution_b")
_KEPT = ("path", "technique", "emitter", *_RASTER, *_LIGHT)
_WORDS = ("camera_word", "light_word")

FIGURES = (
    Figure("pixel_x", INTEGER, "the outlier pixel's column, pixels from the left"),
    Figure("pixel_y", INTEGER, "its row, pixels from the top"),
    Figure("luminance", REAL, "the pixel's luminance, of linear sRGB"),
    Figure("typical", REAL, "median luminance of the pixels around it"),
    Figure("deviations", REAL, "by how many spreads of the pixels around it the pixel lies above that; NULL where they do not differ at all"),
    Figure("without", REAL, "the pixel's luminance if the walk had not been sampled"),
    Figure("variance_share", REAL, "the walk's share, 0 … 1, of the sum of squared deviations of the pixel's walks"),
    Figure("walk", INTEGER, "the walk's id, by which it can be traced again"),
    Figure("path", INTEGER, "the path's ordinal within the walk"),
    Figure("technique", TEXT, "how the path's two ends were joined"),
    Figure("description", TEXT, "the path in words"),
    Figure("objects", TEXT, "the objects that it meets, from the camera outward"),
    Figure("emitter", TEXT, "the emitter's name"),
    Figure("path_luminance", REAL, "luminance of the path's contribution, before it is divided by the passes"),
    Figure("walk_share", REAL, "the path's share, 0 … 1, of what its walk adds to the pixel"),
    Figure("expression", TEXT, "selects the paths with these events"),
)


def fireflies(
    run: Run, variance_share: float = 0.25, deviations: float = 8.0, radius: int = 2, most: int | None = None, path_share: float = 0.1
) -> pa.Table:
    """The paths that make pixels stand out (columns: ``FIGURES``), pixels with the largest excess first; ``outliers`` has the rule.

    ``variance_share``: 0 … 1, also the least that a listed walk has; ``deviations``: spreads; ``radius``: pixels, of the square around; ``most``: how
    many pixels at most (None: all); ``path_share``: 0 … 1, paths that carry less of their walk's value are left out. Two passes over the paths.
    Raises ``QueryError`` for a run without paths, or with fewer than ``LEAST_WALKS`` recorded walks for each pixel.
    """
    require_paths(run)
    sums = pixel_sums(run)
    if sums.walks < LEAST_WALKS:
        raise QueryError(f"outliers need {LEAST_WALKS} recorded walks for each pixel, found {sums.walks:g}: raise render.samples or record.keep")
    found = outlier_pixels(sums, run.settings["width"], variance_share, deviations, radius).first(most)
    return _provenance(run, sums, found, _rows_of(run, sums, found, variance_share), path_share)


def _rows_of(run: Run, sums: PixelSums, found: Outliers, variance_share: float) -> dict[str, Array]:
    """The path rows of walks that carry the variance of outlier pixels, by column; ``slot``: which outlier, ``value``: what the walk adds."""
    width = int(run.settings["width"])
    slot = np.full(len(sums.total), -1, np.int32)
    slot[found.pixel] = np.arange(len(found.pixel), dtype=np.int32)
    limit = sums.total[found.pixel] / sums.walks + np.sqrt(variance_share * sums.deviation[found.pixel])
    words = [name for name in _WORDS if name in run.tables["paths"].schema.names]

    def work(pieces: Iterator[Piece]) -> list[dict[str, Array]]:
        parts: list[dict[str, Array]] = []
        for piece in pieces:
            marked, value = np.empty(piece.rows("paths"), np.int32), np.empty(piece.rows("paths"))
            x, y, r, g, b = light_of(piece)
            if mark_above(piece.owner(), x, y, r, g, b, width, slot, limit, marked, value):
                rows = np.flatnonzero(marked >= 0)
                columns = {name: piece.column("paths", name)[rows] for name in (*_KEPT, *words)}
                parts.append({"walk": piece.owner()[rows].astype(np.int64), "slot": marked[rows], "value": value[rows], **columns})
        return parts

    parts = [part for shard in map_shards(run.shard_files, work, run.threads) for part in shard]
    names = ("walk", "slot", "value", *_KEPT, *words)
    return {name: np.concatenate([part[name] for part in parts]) if parts else np.zeros(0) for name in names}


def _provenance(run: Run, sums: PixelSums, found: Outliers, rows: dict[str, Array], path_share: float) -> pa.Table:
    """The rows that matter, in the order of the outliers, with what is known of pixel, walk and path."""
    luminance = luminance_of(np.stack([rows[name] for name in _LIGHT]).T)
    kept = np.flatnonzero(luminance > path_share * rows["value"])
    kept = kept[np.lexsort((rows["path"][kept], -luminance[kept], rows["walk"][kept], -rows["value"][kept], rows["slot"][kept]))]
    rows = {name: column[kept] for name, column in rows.items()}
    slot, value = rows["slot"].astype(np.int64), rows["value"]
    pixel = found.pixel[slot]
    shown = sums.total[pixel] * sums.scale
    provenance = Provenance(run)
    paths = [provenance.of({name: rows[name][i] for name in ("technique", "emitter", *_WORDS) if name in rows}) for i in range(len(kept))]
    with np.errstate(divide="ignore", invalid="ignore"):
        values = {
            "pixel_x": pixel % run.settings["width"],
            "pixel_y": pixel // run.settings["width"],
            "luminance": shown,
            "typical": found.typical[slot],
            "deviations": (shown - found.typical[slot]) / found.spread[slot],
            "without": sums.without(pixel, value),
            "variance_share": (value - sums.total[pixel] / sums.walks) ** 2 / sums.deviation[pixel],
            "walk": rows["walk"],
            "path": rows["path"].astype(np.int64),
            "technique": [TECHNIQUES[int(key)] for key in rows["technique"]],
            "expression": [path.expression for path in paths],
            "description": [path.words for path in paths],
            "objects": [", ".join(path.objects) for path in paths],
            "emitter": [path.emitter for path in paths],
            "path_luminance": luminance[kept],
            "walk_share": luminance[kept] / value,
        }
    return answer(FIGURES, values)
