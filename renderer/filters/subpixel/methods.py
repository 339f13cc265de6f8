"""The ways to give subpixels their values that are compared: one filter for each pixel, or one for each subpixel (thesis 4.5.4)."""

from renderer.filters.reconstruction import FILTERS, ReconstructionFilter
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.windowed_sinc import Fit, box

METHODS = ("pixel_box", "pixel_mitchell", "none", "box", "mitchell", "optimal", "kernels")
TITLES = {
    "pixel_box": "box per pixel",
    "pixel_mitchell": "Mitchell per pixel",
    "none": "no filter per subpixel",
    "box": "box per subpixel",
    "mitchell": "Mitchell per subpixel",
    "optimal": "optimal, analytic",
    "kernels": "optimal, all kernels",
}
"""What the methods are called for people."""


def subpixel_filter(method: str, layout: Layout, fits: tuple[Fit, ...] | None = None, zeros: int = 2) -> SubpixelFilter:
    """The filter of a method; ``fits`` (of ``windowed_sinc.fit``) and ``zeros``, where it is clamped, are for ``optimal`` alone.

    Raises ValueError for ``kernels``, which are no weights of samples but mix the channels of a signal, for unknown methods, and for an
    ``optimal`` filter without fits or with those of another layout.
    """
    if method == "optimal":
        return _optimal(layout, fits, zeros)
    pixel = box("box", 0.5)
    if method in ("pixel_box", "pixel_mitchell"):
        one = pixel if method == "pixel_box" else FILTERS["mitchell"]
        return _same(method, layout, one, one, at_pixel=True)
    if method == "none":
        width, height = layout.cells
        return _same(method, layout, box("none", 0.5 / width), box("none", 0.5 / height))
    if method == "box":
        return _same(method, layout, pixel, pixel)
    if method == "mitchell":
        return _same(method, layout, FILTERS["mitchell"], FILTERS["mitchell"])
    if method == "kernels":
        raise ValueError("`kernels` is no filter of samples: apply the kernels of `derive` to a signal of the layout")
    raise ValueError(f"unknown method {method!r}; known: {', '.join(METHODS)}")


def _same(method: str, layout: Layout, across: ReconstructionFilter, down: ReconstructionFilter, at_pixel: bool = False) -> SubpixelFilter:
    count = len(layout.active)
    return SubpixelFilter(method, layout, (across,) * count, (down,) * count, at_pixel)


def _optimal(layout: Layout, fits: tuple[Fit, ...] | None, zeros: int) -> SubpixelFilter:
    if fits is None or len(fits) != len(layout.active):
        found = "none" if fits is None else str(len(fits))
        raise ValueError(f"{layout.name}: expected fits of its {len(layout.active)} subpixels, found {found}: use `fit(derive(layout))`")
    down = [fit.reconstruction_down(layout, zeros) for fit in fits]
    both = tuple(one for one in down if one is not None)
    return SubpixelFilter("optimal", layout, tuple(fit.reconstruction(layout, zeros) for fit in fits), both if len(both) == len(down) else None)
