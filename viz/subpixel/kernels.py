"""All kernels of displays whose subpixels stand along one axis, as Fig. 4.3 and Fig. 4.6 of the thesis show them, with the analytic fits."""

import pathlib
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from viz.charts import FAINT, INK
from viz.report.subpixel import layout_title
from viz.subpixel.figure import Figure
from viz.subpixel.fits import compared_fits, display_rows, family
from viz.subpixel.look import (
    PRIMARY_COLORS,
    PRIMARY_WORDS,
    choice,
    colored_lines,
    label_panels,
    listed,
    new_panels,
    panel_grid,
    panel_title,
    room,
    save_panels,
    shown_subpixels,
    subpixel_names,
    subpixel_words,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ZEROS = 4  # of the widest sinc, on each side, that the axis shows
_STATED = {
    "RGB": "Fig. 4.3 shows nine kernels of the RGB stripe. Section 4.3.3 models the three low-pass ones by a Gaussian-windowed sinc with a root mean "
    "square error below 0.02 for each color channel; Table 4.1 lists its parameters.",
    "RGBG": "Table 4.1 lists Gaussian-windowed sincs for the low-pass kernels of RGBG, one of them for each of its four subpixels; Fig. 4.6 shows "
    "these kernels alone.",
}


def kernels_figure(display: Display, description: SubpixelDescription, folder: pathlib.Path) -> Figure:
    """One panel for each subpixel: its kernels as dots, colored by the primary they come from, and the fit of its own one as a line."""
    layout, h, offsets = display.layout, display.kernels.h[:, :, 0], display.kernels.columns_at
    shown = shown_subpixels(layout)
    title, words = layout_title(layout.name), [subpixel_words(layout)[i] for i in shown]
    reach = int(ZEROS * layout.spacing.max())
    near = np.abs(offsets) <= reach
    rows, columns = panel_grid(len(words))
    figure, panels = new_panels(rows, columns, 3.5 if rows == 1 else 0.5 + 2.5 * rows, f"{title}: all kernels", sharex=True, sharey=True)
    for subpixel, axes in zip(shown, panels.ravel(), strict=False):
        _draw_panel(axes, display, subpixel, offsets[near], h[subpixel][:, near])
    label_panels(panels, len(words), f"offset (positions; a pixel is {layout.cells[0]})", "weight")
    spread = float(h[..., near].max() - h[..., near].min())
    panels[0, 0].set_ylim(h[..., near].min() - 0.06 * spread, h[..., near].max() + 0.03 * spread)
    if columns == 3:
        room(panels[0, 0], 3, 2.4)
    file = save_panels(figure, folder / f"kernels_{layout.name}.png")

    agreement, comparison = compared_fits(display_rows(display, description), description)
    return Figure(
        name=f"kernels_{layout.name}",
        title=f"Kernels of {title}",
        file=file,
        alt=f"{len(words)} charts of weight over offset, one for each subpixel ({listed(words)}), with {len(shown) * h.shape[1]} kernels; "
        f"the largest weight is {h.max():.2g}.",
        caption=f"What each subpixel of {title} takes from the red, green and blue of the image at each offset. Dots: the kernels as they were "
        "solved, colored by the channel that influences the subpixel. Line: the analytic filter sin(ax)/(ax)·exp(−x²/b), times the kernel's value "
        f"at 0, fitted to the subpixel's own kernel. A pixel is {layout.cells[0]} positions wide; {reach} of the {len(offsets)} positions are shown "
        f"to each side.{choice(layout)}",
        thesis=_STATED.get(family(layout), ""),
        agreement=agreement,
        comparison=comparison,
    )


def _draw_panel(axes: "Axes", display: Display, subpixel: int, offsets: npt.NDArray[np.int64], h: npt.NDArray[np.float64]) -> None:
    """One subpixel's kernels, (primaries, offsets), and its fit."""
    layout, fit = display.layout, display.fits[subpixel]
    own = int(layout.active_primaries[subpixel])
    size = 3.2 if len(offsets) < 40 else 2.0
    axes.axhline(0.0, color=FAINT, linewidth=0.8, zorder=1)
    for primary in sorted(range(len(layout.primaries)), key=lambda d: d == own):
        color = PRIMARY_COLORS[layout.primaries[primary]]
        if primary != own:
            axes.plot(offsets, h[primary], "-", color=color, linewidth=0.7, alpha=0.55, zorder=2)
        axes.plot(offsets, h[primary], "o", color=color, markersize=size, markeredgewidth=0, zorder=4 + (primary == own))
    x = np.linspace(offsets[0], offsets[-1], 801)
    color = PRIMARY_COLORS[layout.primaries[own]]
    axes.plot(x, fit.values(x, np.zeros_like(x)), "-", color=color, linewidth=1.3, zorder=3)
    panel_title(axes, f"{subpixel_names(layout)[subpixel]}: {subpixel_words(layout)[subpixel]} subpixel", color)
    colored_lines(axes, [(f"from {PRIMARY_WORDS[name]}", PRIMARY_COLORS[name]) for name in layout.primaries])
    colored_lines(axes, [(text, INK) for text in (f"a = π / {np.pi / fit.a:.4g}", f"b = {fit.b:.4g}", f"rms {fit.rms:.2g}")], right=True)
