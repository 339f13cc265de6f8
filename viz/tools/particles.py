"""Particle flow: small particles that drift along the dominant direction of light (thesis 8.1, [reiner2012])."""

import functools
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from queries.errors import QueryError
from queries.regions.description import Length
from viz.colors import ColorMap
from viz.grids import BoxField
from viz.measures import IN_SPACE, TOTAL
from viz.numbers import percent
from viz.tools.base import ColorBar, Drawn, WalkTool

if TYPE_CHECKING:
    from queries.flow import Flow, Tracks
    from queries.run import Run
    from viz.comets import Comets
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]

MOST_FRAMES = 1000
MOST_POSITIONS = 10_000_000  # of all particles together: some 30 bytes each
STEP = 0.5  # of a voxel's shortest side
TRAIL = 1 / 14  # of the grid's diagonal, unless `trail` says otherwise
WAY = 1 / 2  # likewise, how far a particle drifts in an animation
FLUENCES = (0.02, 0.999)  # shares of the voxels with light below the ends of the scale
ANISOTROPY = "anisotropy: net flow over fluence"


class Particles(WalkTool):
    """Particles that drift with the light: placed at random, as densely as light with a dominant direction is bright.

    At each point they move along the light vector (the net flow), at one speed; so they follow curves, not light paths. They stop where light has no
    dominant direction, which is where the net flow is less than ``least_anisotropy`` of the fluence, or may be an accident of few segments.
    """

    most: Annotated[int, Field(ge=1, le=50_000)] = Field(default=2500, description="How many particles.")
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(default=0, description="Of their places.")
    resolution: Annotated[int, Field(ge=8, le=128)] = Field(default=40, description="How many voxels there are along the longest side of the field.")
    box: BoxField = None
    least_anisotropy: Annotated[float, Field(ge=0, lt=1)] = Field(
        default=0.25, description="The least net flow, as a share of the fluence, at which light has a dominant direction: 0 (none) to 1 (parallel)."
    )
    color: Literal["chrominance", "anisotropy", "fluence"] = Field(
        default="anisotropy", description="By the color of the light, by how directed it is, or by how much there is (logarithmic)."
    )
    map: ColorMap = Field(default="viridis", description="The color map of numbers.")
    trail: Length | None = Field(default=None, description="The length of trails, world units. Default: 1/14 of the box's diagonal.")
    way: Length | None = Field(default=None, description="How far particles drift in an animation, world units. Default: half of the box's diagonal.")
    frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] = Field(default=1, description="1: a still picture. More: particles move, and begin anew.")
    seconds: Annotated[float, Field(ge=0.02, le=10)] = Field(default=0.08, description="How long each frame of the animation is shown, seconds.")
    width: Annotated[float, Field(gt=0, le=20)] = Field(default=1.6, description="Of trails, pixels.")

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """See ``Tool``."""
        from queries.flow import flow
        from queries.inspection import walks_of
        from viz.comets import Comets
        from viz.grids import beyond, grid_of
        from viz.numbers import number

        selection = self.selection(run)
        grid = grid_of(run, self.box, self.resolution)
        with walks_of(run, self.walks) as walks:
            field, outside = flow(walks, selection, grid, self.walks), beyond(walks, grid, self.walks)
        what = ("Light" if self.walks == "light" else "Importance") + (f" {selection.describe()}" if selection.describe() else "")
        if not field.total > 0:
            return Drawn(caption=f"Particle flow: {what[0].lower()}{what[1:]} does not pass here.", empty=True)
        share = field.directed_share(self.least_anisotropy)
        nx, ny, nz = grid.shape
        figures: dict[str, float | int | str] = {
            "directed_share": share,
            "mean_anisotropy": float(np.average(field.anisotropy, weights=field.fluence)),
            f"total_{TOTAL[self.walks].unit}_times_length": field.total,
            "segments": field.segments,
            "voxels": f"{nx} x {ny} x {nz}",
        }
        diagonal = float(np.linalg.norm(grid.cell * grid.shape))
        trail, way = self.trail or TRAIL * diagonal, self.way or WAY * diagonal
        length, step = way if self.frames > 1 else trail, STEP * float(grid.cell.min())
        if self.most * length > MOST_POSITIONS * step:
            raise QueryError(
                f"expected particles whose ways fit into memory, found {self.most:,} that go {number(length)} units in steps of {number(step)}: "
                f"ask for fewer (`most`), or for a `{'way' if self.frames > 1 else 'trail'}` of at most {number(MOST_POSITIONS * step / self.most)}"
            )
        seeds = field.seeds(self.most, self.least_anisotropy, self.seed)
        tracks = field.tracks(seeds, length, step, self.least_anisotropy)
        if not (tracks.count > 1).any():
            nowhere = f"{what} has no dominant direction anywhere here (net flow above {number(self.least_anisotropy)} of the fluence)"
            return Drawn(caption=f"{nowhere}: there is nothing for particles to follow.", figures=figures, empty=True)
        colors, bar = self._colors(field, tracks)
        comets = Comets(stage, tracks, colors, self.width)
        trail_steps = max(1, round(trail / tracks.step))
        show = self._frames(comets, tracks, trail_steps)
        show[0]()
        return Drawn(
            caption=f"{what}: {len(tracks):,} particles follow its net flow through {nx} x {ny} x {nz} voxels, from {field.segments:,} segments of "
            f"{self.walks} walks. {percent(share)} of it has a dominant direction (net flow above {number(self.least_anisotropy)} of the fluence); "
            f"particles move there alone. Their ways are not light paths.{outside}",
            legend=(("color of the light, without its brightness", (1.0, 1.0, 1.0)),) if bar is None else (),
            color_bar=bar,
            figures=figures | {"particles": len(tracks), "trail_world_units": trail_steps * tracks.step},
            frames=tuple(show) if self.frames > 1 else (),
            frame_seconds=self.seconds,
            meshes={"particles": comets.mesh(field.anisotropy[field.at(tracks.points[:, 0])], field.fluence[field.at(tracks.points[:, 0])])},
        )

    def _frames(self, comets: "Comets", tracks: "Tracks", trail: int) -> list[functools.partial[None]]:
        """What sets the stage for each frame: particles begin one after another, and again, so that the last frame leads to the first."""
        if self.frames == 1:
            return [functools.partial(comets.show, tracks.count - 1, trail)]
        whole = int(tracks.points.shape[1]) + trail  # steps from a particle's begin to its next one: its trail has to fade away
        random = np.random.default_rng([self.seed, 1])
        phase = random.random(len(tracks))
        return [functools.partial(comets.show, np.floor((phase + i / self.frames) % 1.0 * whole).astype(np.int64), trail) for i in range(self.frames)]

    def _colors(self, field: "Flow", tracks: "Tracks") -> tuple[U8, ColorBar | None]:
        """The color of each position of each particle, uint8 (n, steps + 1, 3), and what it means."""
        from viz.colors import as_bytes, chrominance
        from viz.false_color import FalseColor

        voxels = tuple(index.reshape(tracks.points.shape[:2]) for index in field.at(tracks.points.reshape(-1, 3)))
        if self.color == "chrominance":
            return as_bytes(chrominance(field.rgb[voxels])), None
        if self.color == "anisotropy":
            label, values, scale = ANISOTROPY, field.anisotropy, FalseColor(self.map, 0.0, 1.0, logarithmic=False)
        else:
            label, values, there = IN_SPACE[self.walks].label, field.fluence, field.fluence[field.fluence > 0]
            low, high = (float(np.quantile(there, share)) for share in FLUENCES)
            scale = FalseColor(self.map, min(low, high / 2), high, logarithmic=True)
        return scale.colors(values[voxels]), scale.bar(label)
