"""Direct volume rendering of fluence: light in free space as glowing fog (thesis 8.1, [reiner2012])."""

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.regions.description import Length
from viz.colors import ColorMap
from viz.grids import BoxField, Resolution, beyond, grid_of
from viz.measures import IN_SPACE, LIGHT, TOTAL
from viz.tools.base import Drawn, WalkTool

if TYPE_CHECKING:
    from queries.run import Run
    from viz.stage import Stage

F64 = npt.NDArray[np.float64]
Range = Annotated[tuple[Length, Length], Field(strict=False)]
BRIGHTEST = 0.999  # share of the voxels with light that are no brighter than the scale's upper end
DECADES = 3.0  # of a logarithmic scale, at most
FAINTEST = 0.01  # share of the voxels with light that are fainter than the lower end of a logarithmic scale


class FluenceVolume(WalkTool):
    """Light in free space: how much passes through each voxel of a grid, from all sides, as a volume that glows."""

    resolution: Resolution = Field(default=96, description="How many voxels there are along the longest side.")
    box: BoxField = None
    scale: Literal["log", "linear"] = Field(default="log", description="How fluence is turned into colors.")
    range: Range | None = Field(
        default=None,
        description="The lower and the upper end of the scale, flux / world unit². Default: from what is there; a linear scale begins at 0.",
    )
    color: Literal["fluence", "chrominance"] = Field(default="fluence", description="By how much light there is, or by its color.")
    map: ColorMap = Field(default="inferno", description="The color map, of `color: fluence`.")
    opacity: Annotated[float, Field(gt=0, le=1)] = Field(
        default=0.7, description="How much of what is behind it the brightest light hides, along a tenth of the longest side."
    )
    contrast: Annotated[float, Field(ge=0.25, le=8)] = Field(
        default=2.0, description="The power of the place on the scale that opacity follows: the larger, the clearer faint light is."
    )

    @model_validator(mode="after")
    def _some_range(self) -> "FluenceVolume":
        if self.range is not None and not self.range[0] < self.range[1]:
            raise ValueError("expected `range` as its lower and its upper end, the first below the second")
        return self

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """See ``Tool``."""
        from queries.fluence import fluence
        from queries.inspection import walks_of
        from queries.luminance import luminance_of
        from viz.colors import as_bytes, chrominance
        from viz.false_color import FalseColor
        from viz.numbers import number
        from viz.volume import add_volume

        selection = self.selection(run)
        grid = grid_of(run, self.box, self.resolution)
        with walks_of(run, self.walks) as walks:
            found, outside = fluence(walks, selection, grid, self.walks), beyond(walks, grid, self.walks)
        light = luminance_of(found.values)
        what = "Fluence" if self.walks == "light" else "Importance in free space"
        of = f"{' of light' if self.walks == 'light' else ''} {selection.describe()}" if selection.describe() else ""
        if not light.max() > 0:
            return Drawn(caption=f"{what}{of}: no such {LIGHT[self.walks]} passes through these voxels.", empty=True)
        scale = FalseColor(self.map, *self._ends(light), self.scale == "log")
        colors = scale.colors(light) if self.color == "fluence" else as_bytes(chrominance(found.values))
        add_volume(stage, grid, colors, (scale.shares(light) ** self.contrast).astype(np.float32), self.opacity)
        nx, ny, nz = grid.shape
        unit = TOTAL[self.walks].unit
        total = float(luminance_of(found.total))
        return Drawn(
            caption=f"{what}{of} in {nx} x {ny} x {nz} voxels of {number(float(grid.cell.max()))} world units, from {found.segments:,} segments of "
            f"{self.walks} walks: {number(total)} {unit} x world units in all, at most {number(float(light.max()))} {unit} / world unit².{outside}",
            color_bar=None if self.color == "chrominance" else scale.bar(IN_SPACE[self.walks].label),
            legend=(("color of the light, without its brightness", (1.0, 1.0, 1.0)),) if self.color == "chrominance" else (),
            figures={
                f"total_{unit}_times_length": total,
                f"largest_{unit}_per_square_unit": float(light.max()),
                "scale_low": scale.low,
                "scale_high": scale.high,
                "segments": found.segments,
                "voxels": f"{nx} x {ny} x {nz}",
                "voxel_world_units": float(grid.cell.max()),
            },
        )

    def _ends(self, light: F64) -> tuple[float, float]:
        """The ends of the scale."""
        if self.range is not None:
            return self.range
        there = light[light > 0]
        high = float(np.quantile(there, BRIGHTEST))
        if self.scale == "linear":
            return 0.0, high
        low = max(float(np.quantile(there, FAINTEST)), high * 10**-DECADES)
        return (low, high) if low < high else (high / 10, high)
