"""The report of a run: one folder that opens in a browser, without a network, years later."""

from viz.report.model import Eye, Model, Shape
from viz.report.picture import Picture
from viz.report.write import Answer, DrawClass, write_report

__all__ = ["Answer", "DrawClass", "Eye", "Model", "Picture", "Shape", "write_report"]
