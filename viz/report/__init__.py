"""The report of a run: one folder that opens in a browser, without a network, years later."""

from typing import TYPE_CHECKING, Any

from viz.report.model import Eye, Model, Shape
from viz.report.picture import Picture
from viz.report.sections import DrawClass
from viz.report.write import Answer, write_report

if TYPE_CHECKING:
    from viz.report.paths import draw_classes, model_of_paths

__all__ = ["Answer", "DrawClass", "Eye", "Model", "Picture", "Shape", "draw_classes", "model_of_paths", "write_report"]


def __getattr__(name: str) -> Any:
    """What draws in three dimensions is imported when it is asked for."""
    if name in ("draw_classes", "model_of_paths"):
        from viz.report import paths

        return getattr(paths, name)
    raise AttributeError(f"module `viz.report` has no `{name}`")
