"""A sample of paths as bundled curves: from vertices to points of curves, all at once."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.path_sample import PathSample
from viz.bundles.assign import Segments, segments_of
from viz.bundles.axes import Axes, axes_of
from viz.bundles.curves import curves_of, targets

F32 = npt.NDArray[np.float32]
I64 = npt.NDArray[np.int64]


@dataclass(frozen=True)
class BundledPaths:
    """``segments`` of the paths, with their bundles; the ``axes`` of these; ``curves``: float32 (segments, points, 3), world."""

    segments: Segments
    axes: Axes
    curves: F32


def bundled(
    sample: PathSample, codes: I64, amount: float, points: int = 24, flatten: bool = False, keep: npt.NDArray[np.bool_] | None = None
) -> BundledPaths:
    """The segments of paths as curves (thesis 8.3), in the paths' order.

    ``codes``: int64 (m), what tells vertices apart (``vertex_codes``); ``amount``: how far curves are drawn to their axes, 0 (straight segments,
    exactly) to 1; ``points``: of each curve; ``flatten``: bundles fan out at the ends of whole paths alone; ``keep``: bool (segments), which
    segments to make curves of (none: all), in bundles that all of them shape.
    """
    segments = segments_of(sample.start, codes)
    ends = np.ascontiguousarray(sample.points[segments.begin]), np.ascontiguousarray(sample.points[segments.begin + 1])
    axes = axes_of(*ends, segments.bundle, segments.bundles)
    begin, end, kind = targets(segments, *ends, axes, flatten)
    if keep is not None:
        rows = np.flatnonzero(keep)
        segments, kind = segments.take(rows), kind[rows]
        ends, begin, end = (ends[0][rows], ends[1][rows]), begin[rows], end[rows]
    return BundledPaths(segments, axes, curves_of(ends, (begin, end), kind, amount, points))
