"""The estimators by the names that jobs use."""

from renderer.integrators.base import Estimator
from renderer.integrators.light import interact_light, start_light_walks
from renderer.integrators.path import interact, start_camera_walks

ESTIMATORS = {
    "path": Estimator(start_camera_walks, interact),
    "light": Estimator(start_light_walks, interact_light),
}
"""All estimators by name."""


def estimator(method: str) -> Estimator:
    """The estimator of that name. Raises ValueError with the known names."""
    if method not in ESTIMATORS:
        raise ValueError(f"unknown method {method!r}; known: {', '.join(ESTIMATORS)}")
    return ESTIMATORS[method]
