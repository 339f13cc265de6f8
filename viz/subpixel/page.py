"""The page of an analysis of subpixel filters: one folder that opens in a browser, without a network, years later."""

import json
import os
import pathlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from queries.subpixel.analysis import Analysis
from viz.report.numbers import seconds
from viz.report.pages import Copier, Shown, copy_static, environment, picture_size, slug
from viz.report.picture import Picture
from viz.report.subpixel import CONTENTS, image_title, interval, layout_title, layouts_table, method_title, ranking_tables, scores_table
from viz.subpixel import sections
from viz.subpixel.figure import Figure
from viz.subpixel.findings import result
from viz.subpixel.look import viewer
from viz.subpixel.mosaic import pixel_light
from viz.subpixel.renderings import strongest

_STATIC = ("report.css", "subpixel.css", "report.js", "subpixel.js")
_PIXEL = 18  # pixels of the screen for each pixel of the display, where a picture is seen closely
_ROWS = 14  # of all scores, before a reader asks for more


@dataclass(frozen=True)
class Closely:
    """A picture on the page. ``zoom``: pixels of the screen for each of its own where it is seen closely; 0 where it is no picture of subpixels."""

    shown: Shown
    zoom: float

    @property
    def width(self) -> int:
        """Pixels of the screen, seen closely."""
        return round(self.shown.width * self.zoom)

    @property
    def height(self) -> int:
        """The same of its height."""
        return round(self.shown.height * self.zoom)


@dataclass(frozen=True)
class Told:
    """A figure on the page, and what it says of the thesis."""

    anchor: str
    figure: Figure
    file: str
    width: int
    height: int


def write_page(folder: pathlib.Path, analysis: Analysis, figures: Sequence[Figure], pictures: Sequence[Picture], command: str = "") -> pathlib.Path:
    """Write the page of an analysis into a folder, which may hold other things: the path of the page, ``index.html``.

    ``pictures``: what the displays would show, in the order of the page; ``command``: what makes the analysis again. Figures and pictures that lie
    in the folder are linked where they are, others are copied. The same analysis gives the same bytes. Raises ``QueryError`` where one of them
    cannot be read.
    """
    folder.mkdir(parents=True, exist_ok=True)
    copier = Copier(folder, [*(figure.file for figure in figures), *(file for one in pictures for file in (one.file, *one.files.values()))])
    shown = [_closely(copier.picture(picture, "view"), analysis.size) for picture in pictures]
    told = [_told(folder, figure, copier) for figure in figures]
    copy_static(folder, _STATIC)
    html = environment().get_template("subpixel.html.j2").render(_contents(analysis, told, shown, command))
    linked = [*(one.shown.file for one in shown), *(file for one in shown for _, file, _ in one.shown.links), *(figure.file for figure in told)]
    contents = {
        "files": sorted({"index.html", *_STATIC, *linked}),
        "figures": [{"anchor": one.anchor, "title": one.figure.title, "alt": one.figure.alt, "file": one.file} for one in told],
    }
    _replace(folder / "index.html", html)
    _replace(folder / CONTENTS, json.dumps(contents, indent=1, ensure_ascii=False) + "\n")
    return folder / "index.html"


def _contents(analysis: Analysis, figures: Sequence[Told], pictures: Sequence[Closely], command: str) -> dict[str, Any]:
    """What the template shows."""
    return {
        "name": analysis.name,
        "glance": _glance(analysis),
        "result": result(analysis),
        "pictures": pictures,
        "middle": _middle(analysis),
        "rankings": ranking_tables(analysis.methods),
        "layouts": layouts_table(analysis.layouts) if analysis.layouts is not None else None,
        "matrices": sections.matrices(analysis.scores) if analysis.scores is not None else [],
        "scores": scores_table(analysis.scores, _ROWS) if analysis.scores is not None else None,
        "reasons": [(f"{layout_title(one.layout)}, {image_title(one.image)}", one.text) for one in analysis.reasons],
        "fits": sections.fit_table(analysis),
        "conditions": sections.condition_table(analysis),
        "warnings": sections.warnings(analysis),
        "figures": figures,
        "viewer": viewer(analysis.description),
        "agreements": [(word, sum(one.figure.agreement == word for one in figures)) for word in ("agrees", "differs", "not comparable")],
        "settings": sections.settings_rows(analysis),
        "patterns": sections.patterns(analysis),
        "seconds": sections.times(analysis),
        "command": command,
    }


def _glance(analysis: Analysis) -> list[tuple[str, str, str]]:
    """The few facts that come first: name, value, and what is to be added."""
    facts = []
    for name, ranked in analysis.methods.items():
        first = ranked.slice(0, 1).to_pylist()[0]
        facts.append((layout_title(name), method_title(first["method"]), f"ranks first: S-CIELAB {interval(first['scielab'], None, None)}"))
    if not facts:
        facts = [(layout_title(one.layout.name), method_title(analysis.description.method), "not compared") for one in analysis.displays]
    if analysis.seconds:
        facts.append(("time", seconds(sum(analysis.seconds.values())), "for the whole analysis"))
    return facts


def _closely(shown: Shown, size: tuple[int, int]) -> Closely:
    """A picture whose pixels are positions of the display, whole ones for each of its pixels, can be seen closely."""
    across, down = shown.width / size[0], shown.height / size[1]
    return Closely(shown, _PIXEL / across if across == down and across == int(across) else 0.0)


def _middle(analysis: Analysis) -> tuple[int, int]:
    """Where close views begin, pixels of the screen from the upper left: where the method changes the first display most."""
    display = analysis.displays[0]
    change = np.abs(pixel_light(display.lattice, display.layout) - pixel_light(display.standard, display.layout))
    crop = strongest(change, display.layout)
    return round(_PIXEL * (crop.left + crop.width / 2)), round(_PIXEL * (crop.top + crop.height / 2))


def _told(folder: pathlib.Path, figure: Figure, copier: Copier) -> Told:
    file = copier.copy(figure.file, f"figure-{slug(figure.name)}", "figures")
    return Told(f"figure-{slug(figure.name)}", figure, file, *picture_size(folder / file))


def _replace(file: pathlib.Path, text: str) -> None:
    """Write a file that is there as a whole or not at all."""
    work = file.with_name(f".{file.name}.tmp")
    work.write_text(text, "utf-8")
    os.replace(work, file)
