"""Light paths drawn as bundles (thesis 8.3): segments of one kind are drawn together along their common axis, so that many can be told apart."""

from viz.bundles.assign import Segments, segments_of, vertex_codes
from viz.bundles.axes import Axes, axes_of
from viz.bundles.banks import Lighting, shade
from viz.bundles.bundled import BundledPaths, bundled
from viz.bundles.curves import Influence, curves_of, influence, targets

__all__ = [
    "Axes",
    "BundledPaths",
    "Influence",
    "Lighting",
    "Segments",
    "axes_of",
    "bundled",
    "curves_of",
    "influence",
    "segments_of",
    "shade",
    "targets",
    "vertex_codes",
]
