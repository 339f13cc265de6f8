"""Ready-made questions about how a run went: noise and who makes it, convergence, depth, cost.

Each is a function of an open run that answers with a table; ``answers.meanings`` says what its columns mean, units included.
"""

from collections.abc import Callable

import pyarrow as pa

from queries.diagnostics.classes_energy import classes
from queries.diagnostics.convergence import convergence
from queries.diagnostics.depths import depths
from queries.diagnostics.effective import effective
from queries.diagnostics.fireflies import fireflies

DIAGNOSTICS: dict[str, tuple[Callable[..., pa.Table], str]] = {
    "fireflies": (fireflies, "outlier pixels, and the paths that carry their variance"),
    "classes": (classes, "energy, variance and efficiency of each class of paths"),
    "convergence": (convergence, "mean luminance and its error as passes are added"),
    "depths": (depths, "paths, energy and ends of walks by depth"),
    "effective": (effective, "effective sample size, as a whole and by technique"),
}
"""Functions and titles by name. A function takes an open run, and parameters of its own by keyword. ``pipeline.deeper.cut`` is one more."""
