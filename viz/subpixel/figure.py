"""One figure of the subpixel analysis, with what the thesis states about its counterpart and what was measured."""

import pathlib
from dataclasses import dataclass
from typing import Literal

Agreement = Literal["agrees", "differs", "not comparable"]


@dataclass(frozen=True)
class Figure:
    """A picture and its words. All numbers in ``comparison`` come from the analysis that is shown.

    ``name``: a slug, unique in an analysis. ``file``: the PNG. ``alt``: what the picture shows, for people who do not see it. ``caption``: what is
    plotted, with units and settings. ``thesis``: what the thesis states, with its figure or section; empty where it states nothing.
    ``agreement``: of our numbers with that. ``comparison``: our numbers beside the thesis's, and the criterion that decided.
    """

    name: str
    title: str
    file: pathlib.Path
    alt: str
    caption: str
    thesis: str
    agreement: Agreement
    comparison: str
