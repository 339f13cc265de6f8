"""Energy, variance and efficiency of each class of paths (thesis 2.4.5)."""

import numpy as np
import pyarrow as pa

from queries.classes import PathClasses
from queries.diagnostics.answers import F64, INTEGER, REAL, TEXT, Figure, answer, require_paths
from queries.diagnostics.tallies import energies, shares
from queries.lpe.class_words import describe_class
from queries.lpe.descriptors import class_expression
from queries.run import Run

FIGURES = (
    Figure("description", TEXT, "the class in words"),
    Figure("paths", INTEGER, "recorded paths, or lobes' shares of one"),
    Figure("samples", INTEGER, "walks that have such paths"),
    Figure("energy", REAL, "what the class adds to the image's mean luminance, of linear sRGB"),
    Figure("share", REAL, "its share, 0 … 1, of the image's"),
    Figure("standard_error", REAL, "standard error of `energy`; NULL where it cannot be trusted"),
    Figure("relative_error", REAL, "standard error over energy; NULL where it cannot be trusted"),
    Figure("variance", REAL, "variance of `energy`, squared luminance; NULL where it cannot be trusted"),
    Figure("effective_samples", REAL, "how many walks of equal value would have the same relative variance"),
    Figure("efficiency", REAL, "1 / (variance x render seconds of the whole run, all classes together); NULL where it cannot be trusted"),
    Figure("units", INTEGER, "independent units (replicates, passes or groups of walks) that standard errors rest on"),
    Figure("verdict", TEXT, "why the estimate of variance cannot be trusted; NULL where it can"),
    Figure("expression", TEXT, "selects the paths of the class (from all lights, where its own has no name)"),
)


def classes(run: Run, with_objects: bool = False, most: int | None = None) -> pa.Table:
    """What each class contributes, how noisily, and at what cost (columns: ``FIGURES``), the largest energy first.

    ``with_objects``: paths also differ by the objects that they meet, which expressions and descriptions then name; ``most``: how many classes
    at most (None: all). Raises ``QueryError`` for a run without paths.
    """
    require_paths(run)
    found = PathClasses(run, with_objects, threads=run.threads)
    sums = energies(run, len(found), found.of)
    order = np.lexsort((np.arange(len(found)), -sums.energy))[:most]
    error, energy = sums.trusted_error, sums.energy
    spelled = [(found.letters(int(number)), found.objects(int(number))) for number in order]
    values = {
        "expression": [class_expression(letters, objects) for letters, objects in spelled],
        "description": [describe_class(letters, objects) for letters, objects in spelled],
        "paths": sums.moments.rows[order].astype(np.int64),
        "samples": sums.moments.walks[order].astype(np.int64),
        "energy": energy[order],
        "share": shares(energy)[order],
        "standard_error": error[order],
        "relative_error": _relative(error, energy)[order],
        "variance": error[order] ** 2,
        "effective_samples": sums.effective[order],
        "efficiency": efficiency(run, error**2)[order],
        "units": [sums.units] * len(order),
        "verdict": [sums.reasons[number] or None for number in order],
    }
    return answer(FIGURES, values)


def efficiency(run: Run, variance: F64) -> F64:
    """1 / (V T) (thesis 2.20): T is the run's render time in seconds, which all paths shared; NaN where V is zero or either is unknown."""
    seconds = float(run.manifest.get("stats", {}).get("render_seconds") or np.nan)
    cost = variance * seconds
    return np.where(cost > 0, 1.0 / np.where(cost > 0, cost, 1.0), np.nan)


def _relative(error: F64, energy: F64) -> F64:
    return np.where(energy > 0, error / np.where(energy > 0, energy, 1.0), np.nan)
