"""Effective sample size: of the image as a whole, and of each technique that its paths were found by."""

import numpy as np
import pyarrow as pa

from queries.diagnostics.answers import INTEGER, REAL, TEXT, Figure, answer, require_paths
from queries.diagnostics.classes_energy import efficiency
from queries.diagnostics.tallies import I32, energies
from queries.run import Run
from queries.shards import Piece
from renderer.tables import TECHNIQUES

FIGURES = (
    Figure("technique", TEXT, "how the paths' two ends were joined; `all`: whatever joined them"),
    Figure("paths", INTEGER, "recorded paths, or lobes' shares of one"),
    Figure("samples", INTEGER, "walks that have such paths"),
    Figure("effective_samples", REAL, "how many walks of equal value would have the same relative variance"),
    Figure("effectiveness", REAL, "effective samples over all recorded walks, 0 … 1"),
    Figure("energy", REAL, "what these paths add to the image's mean luminance, of linear sRGB"),
    Figure("share", REAL, "their share, 0 … 1, of the image's"),
    Figure("standard_error", REAL, "standard error of `energy`; NULL where it cannot be trusted"),
    Figure("efficiency", REAL, "1 / (variance x render seconds of the whole run); NULL where it cannot be trusted"),
    Figure("units", INTEGER, "independent units (replicates, passes or groups of walks) that standard errors rest on"),
    Figure("verdict", TEXT, "why the estimate of variance cannot be trusted; NULL where it can"),
)


def effective(run: Run) -> pa.Table:
    """How many samples the run is worth (columns: ``FIGURES``): first of all paths, then by technique, weighted as in the image.

    Raises ``QueryError`` for a run without paths.
    """
    require_paths(run)
    whole = energies(run, 1, _all)
    parts = energies(run, len(TECHNIQUES), _technique)
    used = np.flatnonzero(parts.moments.rows > 0)
    # walks that found nothing are no rows, but they are samples too
    walks = run.settings["passes"] * run.settings["width"] * run.settings["height"] * run.settings["keep"]

    def column(of_all: np.ndarray, of_parts: np.ndarray) -> np.ndarray:
        return np.concatenate([of_all, of_parts[used]])

    energy = column(whole.energy, parts.energy)
    error = column(whole.trusted_error, parts.trusted_error)
    samples = column(whole.effective, parts.effective)
    values = {
        "technique": ["all", *(TECHNIQUES[number] for number in used)],
        "paths": column(whole.moments.rows, parts.moments.rows).astype(np.int64),
        "samples": column(whole.moments.walks, parts.moments.walks).astype(np.int64),
        "effective_samples": samples,
        "effectiveness": samples / walks,
        "energy": energy,
        "share": energy / energy[0] if energy[0] > 0 else np.full(len(energy), np.nan),
        "standard_error": error,
        "efficiency": efficiency(run, error**2),
        "units": [whole.units] * len(energy),
        "verdict": [reason or None for reason in (*whole.reasons, *(parts.reasons[number] for number in used))],
    }
    return answer(FIGURES, values)


def _all(piece: Piece) -> I32:
    return np.zeros(piece.rows("paths"), np.int32)


def _technique(piece: Piece) -> I32:
    return piece.column("paths", "technique").astype(np.int32)
