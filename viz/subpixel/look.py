"""How figures of subpixels look: colors of primaries, names of subpixels and displays, quiet panels, the viewer in words."""

import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from queries.subpixel.description import SubpixelDescription
from renderer.filters.subpixel.layout import Layout
from viz.charts import DPI, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PRIMARY_COLORS = {"R": "#cf222e", "G": "#1a8f3c", "B": "#2563c9", "W": "#6b6b6b"}  # of curves: what they stand for, dark enough for white paper
PRIMARY_WORDS = {"R": "red", "G": "green", "B": "blue", "W": "white"}
QUIET = "#6a6a6a"  # of notes
WIDTH = 8.4  # inches, as all charts
MOST_PANELS = 8
LINE = 12.5  # of text in a panel, points
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def letters(layout: Layout) -> tuple[str, ...]:
    """The primary of each subpixel of ``layout.active``, as a letter."""
    return tuple(layout.primaries[q] for q in layout.active_primaries)


def subpixel_names(layout: Layout) -> tuple[str, ...]:
    """A name for each subpixel of ``layout.active``: its primary's letter, numbered where a period has several of it, as in ``G₁``."""
    found = letters(layout)
    seen: dict[str, int] = {}
    names = []
    for letter in found:
        seen[letter] = seen.get(letter, 0) + 1
        names.append(letter + str(seen[letter]).translate(_SUBSCRIPTS) if found.count(letter) > 1 else letter)
    return tuple(names)


def subpixel_words(layout: Layout) -> tuple[str, ...]:
    """The same in words: ``red``, or ``first green``."""
    found = letters(layout)
    ordinals = ("first ", "second ", "third ", "fourth ", *(f"{n}th " for n in range(5, 1000)))
    return tuple((ordinals[found[:i].count(letter)] if found.count(letter) > 1 else "") + PRIMARY_WORDS[letter] for i, letter in enumerate(found))


def shown_subpixels(layout: Layout) -> tuple[int, ...]:
    """Which subpixels of ``layout.active`` have panels of their own: all, or where they are too many the first of each primary."""
    found = letters(layout)
    return tuple(i for i, letter in enumerate(found) if len(found) <= MOST_PANELS or found.index(letter) == i)


def choice(layout: Layout) -> str:
    """What is left out of figures with a panel for each subpixel, as a sentence that begins with a space; nothing where all are shown."""
    shown = shown_subpixels(layout)
    return "" if len(shown) == len(layout.active) else f" Of the {len(layout.active)} subpixels of a period the first of each primary is shown."


def viewer(description: SubpixelDescription) -> str:
    """Where the displays are seen from, and by whom, in words."""
    viewing = description.viewing
    return (
        f"{viewing.dpi:g} DPI seen from {viewing.distance:g} cm (pixel Nyquist frequency {pixel_nyquist(description):.3g} cycles per degree), "
        f"contrast sensitivity {description.sensitivity.sensitivity().name}"
    )


def pixel_nyquist(description: SubpixelDescription) -> float:
    """The highest frequency that whole pixels show, half a cycle for each, cycles per degree."""
    return 0.5 / description.viewing.degrees_per_pixel


def listed(words: list[str]) -> str:
    """Words as a sentence lists them.

    >>> listed(["red"]), listed(["red", "blue"]), listed(["red", "green", "blue"])
    ('red', 'red and blue', 'red, green and blue')
    """
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}" if words else "none"


def new_panels(rows: int, columns: int, height: float, title: str, **shared: Any) -> tuple[Any, npt.NDArray[Any]]:
    """A figure of quiet axes, (rows, columns) of them, ``height`` inches high, with a title at the left. ``shared``: as of matplotlib's subplots."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(figsize=(WIDTH, height), layout=ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05, wspace=0.02, hspace=0.03))
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, columns, squeeze=False, **shared)
    figure.suptitle(title, x=0.012, ha="left", fontsize=11, color=INK)
    for axes in panels.ravel():
        quiet(axes)
    return figure, np.asarray(panels)


def label_panels(panels: npt.NDArray[Any], count: int, x: str, y: str) -> None:
    """Names of the axes at the outer ones of ``count`` panels, each column's lowest and the first column; panels beyond vanish."""
    columns = panels.shape[1]
    for place, axes in enumerate(panels.ravel()):
        if place >= count:
            axes.set_axis_off()
        elif place + columns >= count:
            axes.set_xlabel(x, fontsize=9)
            axes.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel(y, fontsize=9)


def quiet(axes: "Axes") -> None:
    """Axes without a box, with small numbers."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8.5, colors=INK)


def plain_numbers(axis: Any, of_decade: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    """Plain decimals on a logarithmic axis, at these of each decade."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=of_decade))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def panel_title(axes: "Axes", text: str, color: str = INK) -> None:
    """What one panel shows, at its upper left."""
    axes.set_title(text, loc="left", fontsize=9.5, color=color, fontweight="bold")


def room(axes: "Axes", lines: int, height: float) -> None:
    """Make room above what a panel of so many inches shows for so many lines of text."""
    low, high = axes.get_ylim()
    share = min(0.6, (LINE * lines + 8.0) / (72.0 * height))
    axes.set_ylim(low, low + (high - low) / (1.0 - share))


def colored_lines(axes: "Axes", lines: list[tuple[str, str]], right: bool = False, columns: int = 1) -> None:
    """Lines of text, each with its color, from the upper left corner of a panel down, or from the upper right one, in ``columns``, row by row."""
    for i, (text, color) in enumerate(lines):
        row, column = divmod(i, columns)
        corner, offset, side = (((column + 1) / columns, 1.0), -4, "right") if right else ((0.0, 1.0), 5, "left")
        axes.annotate(
            text, corner, (offset, -4 - LINE * row), "axes fraction", "offset points", ha=side, va="top", fontsize=8.5, color=color, zorder=9
        )


def note(figure: Any, text: str) -> None:
    """A quiet remark at the right of the figure's title."""
    figure.text(0.992, 0.985, text, ha="right", va="top", fontsize=8.5, color=QUIET)


def panel_grid(count: int) -> tuple[int, int]:
    """Rows and columns of so many panels."""
    columns = 3 if count == 3 else min(2, count)
    return -(-count // columns), columns


def save_panels(figure: Any, path: pathlib.Path) -> pathlib.Path:
    """Write the figure as a PNG, the same bytes whenever it is drawn. Returns the path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
    return path
