"""The grid of voxels that a tool measures light in, as a job describes it."""

from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field, model_validator

from queries.errors import QueryError
from queries.regions.description import Part, Position

if TYPE_CHECKING:
    import numpy.typing as npt

    from queries.run import Run
    from queries.voxels import Grid

Resolution = Annotated[int, Field(ge=8, le=256)]


class Corners(Part):
    """A box along the axes."""

    min: Position = Field(description="The corner of least coordinates, world units.")
    max: Position = Field(description="The corner of largest coordinates, world units: each above that of `min`.")

    @model_validator(mode="after")
    def _some_volume(self) -> "Corners":
        if not all(low < high for low, high in zip(self.min, self.max)):
            raise ValueError("expected each coordinate of `max` above that of `min`")
        return self


BoxField = Annotated[
    Corners | str | None,
    Field(description="Where light is measured: `min` and `max`, world units, or a box or a ball of `regions`. Default: the whole scene."),
]


def grid_of(run: "Run", box: Corners | str | None, resolution: int) -> "Grid":
    """A grid of ``resolution`` voxels along its longest side, cubes if the box allows. Raises ``QueryError`` for a region that is no box."""
    from queries.voxels import Grid

    if box is None:
        return Grid.around(run.geometry, resolution)
    low, high = (np.array(box.min), np.array(box.max)) if isinstance(box, Corners) else _bounds(run, box)
    size = high - low
    return Grid.of(low, high, np.maximum(np.rint(size / (size.max() / resolution)), 1).astype(int))


def beyond(walks: "Run", grid: "Grid", side: str) -> str:
    """A sentence, after a space, about a grid that reaches a voxel or more beyond where all light is known (``Arrivals.reach``); else empty."""
    from queries.arrivals import Arrivals
    from queries.selection import Selection
    from viz.numbers import number

    center, radius = Arrivals(walks, Selection(), side).reach()
    farthest = np.linalg.norm(np.maximum(np.abs(np.array(grid.low) - center), np.abs(np.array(grid.high) - center)))
    if farthest <= radius + np.linalg.norm(grid.cell):
        return ""
    return f" Beyond {number(radius)} world units from the middle of the scene voxels show too little: light is traced around surfaces alone."


def _bounds(run: "Run", name: str) -> "tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]":
    """The least and largest coordinates of a region."""
    from queries.regions import Box, Sphere

    if name not in run.regions:
        known = ", ".join(run.regions) or "none"
        raise QueryError(f"there is no region `{name}` for `box`: expected one of the job's regions ({known}), or `min` and `max`")
    region = run.regions[name]
    if isinstance(region, Sphere):
        half = np.full(3, region.radius)
    elif isinstance(region, Box):
        half = np.abs(region.axes().T) @ np.array(region.size) / 2  # of a turned box: what contains it
    else:
        raise QueryError(f"expected a box or a ball for `box`, found region `{name}`, which is {region.describe()}: give `min` and `max`")
    center = np.array(region.center, np.float64)
    return center - half, center + half
