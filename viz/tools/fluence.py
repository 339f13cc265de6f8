"""Direct volume rendering of fluence: light in free space as glowing fog (thesis 8.1, [reiner2012])."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.regions.description import Length
from viz.grids import BoxField, Resolution
from viz.tools.base import ColorBar, Drawn, WalkTool

if TYPE_CHECKING:
    from queries.fluence import Fluence
    from queries.run import Run
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
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
    map: Literal["viridis", "cividis", "magma", "inferno", "turbo", "gray"] = Field(
        default="inferno", description="The color map, of `color: fluence`."
    )
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
        from queries.kernels.luminance import LUMINANCE
        from viz.ticks import number
        from viz.volume import add_volume

        selection = self.selection(run)
        grid = _grid(run, self)
        with walks_of(run, self.walks) as walks:
            found = fluence(walks, selection, grid, self.walks)
        light = (found.values @ np.array(LUMINANCE, np.float32)).astype(np.float32)
        what = "Fluence" if self.walks == "light" else "Importance in free space"
        of = f" of light {selection.describe()}" if selection.describe() else ""
        if not light.max() > 0:
            return Drawn(caption=f"{what}{of}: no such light passes through these voxels.", empty=True)
        low, high = self._ends(light)
        place = self._place(light, low, high)
        add_volume(stage, grid, self._colors(found, place), place**self.contrast, self.opacity)

        nx, ny, nz = grid.shape
        unit = "flux" if self.walks == "light" else "importance"
        total = float(found.total @ np.array(LUMINANCE))
        label = f"{'fluence' if self.walks == 'light' else what.lower()} ({unit} / world unit²)"
        return Drawn(
            caption=f"{what}{of} in {nx} x {ny} x {nz} voxels of {number(float(grid.cell.max()))} world units, from {found.segments:,} segments of "
            f"{self.walks} walks: {number(total)} {unit} x world units in all, at most {number(float(light.max()))} {unit} / world unit².",
            color_bar=None if self.color == "chrominance" else ColorBar(label, _map(self.map), low, high, self.scale == "log"),
            legend=(("color of the light, without its brightness", (1.0, 1.0, 1.0)),) if self.color == "chrominance" else (),
            figures={
                f"total_{unit}_times_length": total,
                f"largest_{unit}_per_square_unit": float(light.max()),
                "scale_low": low,
                "scale_high": high,
                "segments": found.segments,
                "voxels": f"{nx} x {ny} x {nz}",
                "voxel_world_units": float(grid.cell.max()),
            },
        )

    def _ends(self, light: F32) -> tuple[float, float]:
        """The ends of the scale."""
        if self.range is not None:
            return self.range
        there = light[light > 0]
        high = float(np.quantile(there, BRIGHTEST))
        if self.scale == "linear":
            return 0.0, high
        low = max(float(np.quantile(there, FAINTEST)), high * 10**-DECADES)
        return (low, high) if low < high else (high / 10, high)

    def _place(self, light: F32, low: float, high: float) -> F32:
        """Where on the scale each voxel is, 0 … 1."""
        if self.scale == "log":
            found = np.log(np.maximum(light, low) / low) / np.log(high / low)
        else:
            found = (light - low) / (high - low)
        place: F32 = np.clip(found, 0, 1).astype(np.float32)
        return place

    def _colors(self, found: "Fluence", place: F32) -> npt.NDArray[np.uint8]:
        from viz.colors import chrominance

        if self.color == "fluence":
            return _map(self.map)[np.rint(255 * place).astype(np.int64)]
        colors: npt.NDArray[np.uint8] = np.rint(255 * chrominance(found.values.reshape(-1, 3))).astype(np.uint8).reshape(found.values.shape)
        return colors


def _map(name: str) -> npt.NDArray[np.uint8]:
    from viz.colors import color_map

    return color_map(name)


def _grid(run: "Run", tool: FluenceVolume) -> Any:
    from viz.grids import grid_of

    return grid_of(run, tool.box, tool.resolution)
