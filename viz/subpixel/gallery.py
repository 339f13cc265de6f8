"""All figures of a subpixel analysis that apply to it, in the order in which a report shows them."""

import pathlib

from queries.subpixel.analysis import Analysis
from viz.subpixel.band_pass import band_pass_figure
from viz.subpixel.comparison import layouts_figure, methods_figure
from viz.subpixel.cost import cost_figure
from viz.subpixel.figure import Figure
from viz.subpixel.kernels import kernels_figure
from viz.subpixel.low_pass import low_pass_figure
from viz.subpixel.renderings import rendering_figure
from viz.subpixel.spectra import spectra_figure
from viz.subpixel.surfaces import surfaces_figure


def figures(analysis: Analysis, folder: pathlib.Path) -> list[Figure]:
    """Draw them into a folder, which is made if it is not there. Each display's rendering and kernels, then what was compared."""
    description = analysis.description
    found: list[Figure | None] = []
    for display in analysis.displays:
        found.append(rendering_figure(display, description, folder))
        found.append((kernels_figure if display.layout.one_dimensional else surfaces_figure)(display, description, folder))
        found.append(low_pass_figure(display, description, folder))
        found.append(spectra_figure(display, description, folder))
        found.append(band_pass_figure(display, description, folder))
        found.append(methods_figure(analysis, display.layout.name, folder))
    found += [layouts_figure(analysis, folder), cost_figure(analysis, folder)]
    return [figure for figure in found if figure is not None]
