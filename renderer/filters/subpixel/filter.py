"""A subpixel filter: how samples of the film are weighed for each subpixel of a display (thesis 4.4.1)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from renderer.filters.reconstruction import ReconstructionFilter
from renderer.filters.subpixel.layout import Layout


@dataclass(frozen=True, eq=False)
class SubpixelFilter:
    """Weights of samples by their offset, in pixels, from a subpixel's center, or where ``at_pixel`` from its pixel's.

    ``across`` and ``down``: one for each subpixel of ``layout.active``. The weight is ``across(dx) * down(dy)``; a box of radius 1/2 down takes
    the samples of the subpixel's own row of pixels, as 1-D layouts do. Without ``down``, it is ``across(hypot(dx, dy))``.
    Weights need no scale: a subpixel's value is the weighted mean of its samples.
    """

    name: str
    layout: Layout
    across: tuple[ReconstructionFilter, ...]
    down: tuple[ReconstructionFilter, ...] | None
    at_pixel: bool = False

    def __post_init__(self) -> None:
        """Check that every subpixel has a filter."""
        for filters in (self.across, self.across if self.down is None else self.down):
            if len(filters) != len(self.layout.active):
                raise ValueError(f"{self.name}: expected {len(self.layout.active)} filters, one for each subpixel, found {len(filters)}")

    @property
    def radius(self) -> tuple[float, float]:
        """How far samples are taken from, across and down, pixels."""
        across = max(one.radius for one in self.across)
        return across, across if self.down is None else max(one.radius for one in self.down)

    def centers(self) -> npt.NDArray[np.float64]:
        """Where each subpixel of ``layout.active`` weighs its samples from, float64 (subpixels, 2): x and y in pixels in the first period."""
        cells, active = np.array(self.layout.cells), self.layout.active[:, ::-1]
        center = (active + np.array(self.layout.origin)) / cells
        return np.asarray(np.floor(center) + 0.5 if self.at_pixel else center, np.float64)
