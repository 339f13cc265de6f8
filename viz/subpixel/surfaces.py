"""The low-pass kernels of displays whose subpixels stand in two dimensions, as Fig. 4.7 of the thesis shows them, with the analytic fits."""

import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from viz.charts import INK
from viz.report.subpixel import layout_title
from viz.subpixel.figure import Figure
from viz.subpixel.fits import compared_fits, display_rows, family
from viz.subpixel.look import (
    PRIMARY_COLORS,
    choice,
    label_panels,
    letters,
    listed,
    new_panels,
    panel_grid,
    panel_title,
    save_panels,
    shown_subpixels,
    subpixel_names,
    subpixel_words,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

F64 = npt.NDArray[np.float64]

REACH = 6  # positions to each side that are shown
LINEAR = 0.05  # share of the scale around 0 within which colors are linear; beyond they are logarithmic, so that side lobes show
_LEVELS = (0.02, 0.1, 0.5)  # of the largest value: where the fit's contour lines run, and the same below 0


def surfaces_figure(display: Display, description: SubpixelDescription, folder: pathlib.Path) -> Figure:
    """One map for each subpixel: its own kernel in colors, the analytic filter as contour lines."""
    layout, kernels, shown = display.layout, display.kernels, shown_subpixels(display.layout)
    words = [subpixel_words(layout)[i] for i in shown]
    title = layout_title(layout.name)
    rows_at, columns_at = (_near(at) for at in (kernels.rows_at, kernels.columns_at))
    own = {i: kernels.own(i)[np.ix_(rows_at, columns_at)] for i in shown}
    largest = max(float(np.abs(values).max()) for values in own.values())
    rows, columns = panel_grid(len(words))
    figure, panels = new_panels(
        rows, columns, 0.9 + 3.2 * rows, f"{title}: low-pass kernels, and the analytic filters as contour lines", sharex=True, sharey=True
    )
    image = None
    for i, axes in zip(shown, panels.ravel(), strict=False):
        image = _draw_map(axes, display, i, own[i], kernels.rows_at[rows_at], kernels.columns_at[columns_at], largest)
    across = f"offset across (positions; a pixel is {layout.cells[0]} × {layout.cells[1]})"
    label_panels(panels, len(words), across, "offset down (positions)")
    _color_bar(figure, image, panels, largest)
    file = save_panels(figure, folder / f"surfaces_{layout.name}.png")

    fits = display_rows(display, description)
    agreement, comparison = compared_fits(fits, description)
    applied = [row for row in fits if row.applied]
    quality = ", ".join(f"{row.subpixel} {row.rms:.2g} (largest deviation {row.largest:.2g})" for row in applied)
    shape = {"radial": "function of the distance", "separable": "product of one across and one down", "down": "function of the offset down"}
    levels = listed([f"{level:.0%}".replace("%", " %") for level in _LEVELS])
    return Figure(
        name=f"surfaces_{layout.name}",
        title=f"Two-dimensional kernels of {title}",
        file=file,
        alt=f"{len(words)} maps, one for each subpixel ({listed(words)}): the largest weight is {largest:.2g}, in the middle.",
        caption=f"What each subpixel of {title} takes from its own channel of the image around it. Colors: the solved kernel, on a scale that is "
        f"linear up to {LINEAR * largest:.2g} and logarithmic beyond. Lines: the fitted Gaussian-windowed sinc, here a "
        f"{shape.get(applied[0].model, 'function')}, at {levels} of the largest value, dashed where negative. Root mean square errors of the fits: "
        f"{quality}.{choice(layout)}",
        thesis="Fig. 4.7 and section 4.3.5: the low-pass kernels of 2-D RGBW have the overall shape of those in Fig. 4.3, and are approximated by "
        "a radial Gaussian-windowed sinc (Eq. 4.13) with the parameters of Table 4.1."
        if family(layout) == "RGBW"
        else "Fig. 4.7 shows 2-D RGBW alone.",
        agreement=agreement,
        comparison=comparison,
    )


def _near(at: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Which offsets are near enough to be shown."""
    return np.flatnonzero(np.abs(at) <= REACH)


def _draw_map(
    axes: "Axes", display: Display, subpixel: int, own: F64, rows_at: npt.NDArray[np.int64], columns_at: npt.NDArray[np.int64], largest: float
) -> Any:
    """One kernel (rows, columns) as squares of color with the fit's contour lines."""
    from matplotlib.colors import SymLogNorm

    left, right, top, bottom = columns_at[0] - 0.5, columns_at[-1] + 0.5, rows_at[0] - 0.5, rows_at[-1] + 0.5
    norm = SymLogNorm(LINEAR * largest, linscale=1.0, vmin=-largest, vmax=largest)
    image = axes.imshow(own, cmap="PuOr_r", norm=norm, extent=(left, right, bottom, top), interpolation="nearest", aspect="auto")
    axes.set_aspect(display.layout.cells[0] / display.layout.cells[1])

    # The fit, on a fine grid
    across, down = np.meshgrid(np.linspace(left, right, 131), np.linspace(top, bottom, 131))
    values = display.fits[subpixel].values(across, down)
    levels = [-level * largest for level in reversed(_LEVELS)] + [level * largest for level in _LEVELS]
    axes.contour(across, down, values, levels=levels, colors=INK, linewidths=0.8, linestyles=["--"] * len(_LEVELS) + ["-"] * len(_LEVELS))
    letter = letters(display.layout)[subpixel]
    panel_title(axes, f"{subpixel_names(display.layout)[subpixel]}: {subpixel_words(display.layout)[subpixel]} subpixel", PRIMARY_COLORS[letter])
    return image


def _color_bar(figure: Any, image: Any, panels: npt.NDArray[Any], largest: float) -> None:
    """One bar for all maps."""
    bar = figure.colorbar(image, ax=panels.ravel().tolist(), shrink=0.7, aspect=32, pad=0.02)
    ticks = [-largest, -0.2 * largest, -LINEAR * largest, 0.0, LINEAR * largest, 0.2 * largest, largest]
    bar.set_ticks(ticks, labels=[f"{tick:.3g}".replace("-", "−") for tick in ticks])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize=8.5)
    bar.outline.set_visible(False)
    bar.set_label("weight", fontsize=9)
