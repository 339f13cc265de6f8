"""What the kernels from other channels add to a picture of every frequency, as Fig. 4.8 of the thesis shows it."""

import pathlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from queries.subpixel.display import fine_grid, shown
from queries.subpixel.full import apply_kernels
from queries.subpixel.images import signal_of_image
from queries.subpixel.scielab import scielab
from queries.subpixel.targets import target
from viz.numbers import number, percent
from viz.report.subpixel import layout_title
from viz.subpixel.figure import Agreement, Figure
from viz.subpixel.fits import family, same_viewer
from viz.subpixel.mosaic import as_picture, enlarged, mosaic, pixel_light

F32 = npt.NDArray[np.float32]

PATTERN = "zone_plate"
SIZE, ENLARGED = 108, 4  # pixels of the display, across and down; screen pixels for each
TIMES = 32  # by how much the thesis scales the difference
NOTICED = 1.0  # S-CIELAB difference that can just be seen
_STATED = {
    "RGB": "",
    "RGBG": " Fig. 4.6: their contribution on RGBG is similarly low as on RGB displays.",
    "RGBW": " Section 4.3.5 ignores them on 2-D RGBW again.",
}
STATED_SHARE = 0.95  # of the picture must stay below that for a difference to be insignificant


@dataclass(frozen=True, eq=False)
class Influence:
    """A display with all kernels and without those from other channels, ``full`` and ``own``: its pixels' linear light, float32 (height, width, 3).

    ``largest`` and ``mean``: of the absolute difference of drives, cut to [0, 1]; ``above``: the share of drives whose difference is beyond full
    drive when it is scaled. ``noticed``: the share of the picture in which S-CIELAB tells both
    apart; ``scielab`` and ``scielab_95``: mean and 95th percentile of that difference; ``gray``: ``noticed`` in the gray half of the pattern alone.
    """

    full: F32
    own: F32
    largest: float
    mean: float
    above: float
    scielab: float
    scielab_95: float
    noticed: float
    gray: float


def band_pass_figure(display: Display, description: SubpixelDescription, folder: pathlib.Path) -> Figure:
    """A zone plate by all kernels, without those from other channels, and the difference, scaled."""
    title, found = layout_title(display.layout.name), influence(display, description)
    lights = (found.full, found.own, TIMES * np.abs(found.full - found.own))
    panels = [enlarged(as_picture(light), ENLARGED) for light in lights]
    names = ["All kernels", "Without those from other channels", f"Absolute difference × {TIMES}"]
    file = folder / f"band_pass_{display.layout.name}.png"
    mosaic(file, [panels], [names], f"{title}: influence of the band-pass kernels")
    agreement, comparison = compared(found, description)
    return Figure(
        name=f"band_pass_{display.layout.name}",
        title=f"Influence of the band-pass kernels on {title}",
        file=file,
        alt=f"Three pictures of a zone plate: by all kernels, by the low-pass kernels alone, and {TIMES} times their difference, whose mean is "
        f"{number(found.mean)} of full drive.",
        caption="A zone plate with every frequency up to the pixel Nyquist frequency at the middle of its edges (gray on the left, red against "
        f"green at the upper right, blue against yellow at the lower right), on {SIZE} x {SIZE} pixels of {title}: the mean light of the subpixels "
        f"around each pixel's center, sRGB. Right: the absolute difference of linear light, × {TIMES}.",
        thesis="Section 4.5.1 and Fig. 4.8: left out, the band-pass kernels make a visually insignificant difference on a high-frequency pattern, "
        f"which becomes visible only when it is scaled {TIMES}-fold.{_STATED.get(family(display.layout), ' The display is not named.')}",
        agreement=agreement,
        comparison=comparison,
    )


def influence(display: Display, description: SubpixelDescription) -> Influence:
    """Show the pattern both ways and measure the difference."""
    layout, fine = display.layout, fine_grid([display.layout])
    image = target(PATTERN, SIZE, SIZE, fine)
    signal = signal_of_image(image, layout, fine)
    full, own = (np.asarray(apply_kernels(signal, display.kernels, only_own=only), np.float32) for only in (False, True))
    active = layout.pattern[np.arange(len(full))[:, None] % layout.pattern.shape[0], np.arange(full.shape[1]) % layout.pattern.shape[1]] >= 0
    change = np.abs(np.clip(full, 0, 1) - np.clip(own, 0, 1))[active]
    lights = [shown(lattice, layout, fine, clip=True) for lattice in (full, own)]
    seen = scielab(lights[0], lights[1], description.viewing.degrees_per_pixel / fine)
    return Influence(
        full=pixel_light(full, layout),
        own=pixel_light(own, layout),
        largest=float(change.max()),
        mean=float(change.mean(dtype=np.float64)),
        above=float(np.mean(change > 1 / TIMES)),
        scielab=float(seen.mean(dtype=np.float64)),
        scielab_95=float(np.percentile(seen, 95)),
        noticed=float(np.mean(seen > NOTICED)),
        gray=float(np.mean(seen[:, : seen.shape[1] // 2] > NOTICED)),
    )


def compared(found: Influence, description: SubpixelDescription) -> tuple[Agreement, str]:
    """Whether the difference is insignificant to S-CIELAB's viewer, and so small that it takes the scale to see it."""
    limit = 1 - STATED_SHARE
    insignificant, faint = found.noticed <= limit, found.above <= limit
    text = (
        f"S-CIELAB sees a mean difference of {number(found.scielab)}, {number(found.scielab_95)} at the 95th percentile; {percent(found.noticed)} "
        f"of the picture ({percent(found.gray)} of its gray half) lies above {NOTICED:g}, which can just be seen: "
        f"{'insignificant' if insignificant else 'not insignificant'} (limit {percent(limit)}). Drives differ by {number(found.mean)} of full drive "
        f"on average and {number(found.largest)} at most; {percent(found.above)} of them by more than 1/{TIMES}, so that scaled they are beyond "
        f"full drive: {'faint' if faint else 'larger than a difference that shows only when scaled'} (limit {percent(limit)})."
    )
    if not insignificant:
        text += " The spectra tell why: on this display kernels from other channels are neither narrow nor weak."
    elif not faint:
        text += " It lies near the pixel Nyquist frequency and along sharp edges: where these kernels peak the viewer sees little."
    if not same_viewer(description):
        text += " The thesis's viewer is another one, so its bands lie at other frequencies."
    return ("agrees" if insignificant and faint else "differs"), text
