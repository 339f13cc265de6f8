"""Time of flight: the part of each light path between two travel times, frame after frame (thesis 10.2, [jarabo2014])."""

import functools
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.regions.description import Length, Number
from viz.tools.base import Color, Drawn, Tool

if TYPE_CHECKING:
    import pyvista

    from queries.path_sample import PathSample
    from queries.run import Run
    from viz.flight import Flight
    from viz.segments import SegmentLayer
    from viz.stage import Stage

F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
Times = Annotated[tuple[Number, Number], Field(strict=False)]

MOST_FRAMES = 1000
LEFT = 0.95  # of the paths are on their way to the camera when the frames end, unless `times` says otherwise
WINDOW = 1 / 16  # of the whole time, unless `window` says otherwise
MOST_BOUNCES = 5  # that have a color of their own
_BOUNCES = ((1.0, 0.88, 0.45), (0.98, 0.55, 0.25), (0.90, 0.30, 0.50), (0.62, 0.38, 0.85), (0.35, 0.55, 0.95), (0.25, 0.75, 0.80))


class TimeOfFlight(Tool):
    """Light on its way: each frame shows where the light of some paths is between two travel times.

    Times are travelled lengths in world units (the time is the length over the speed of light). Tables keep no indices of refraction, so glass does
    not slow light down here. Time 0 is at a finite emitter; light from infinity is in phase on the plane that touches the sphere around the scene.
    """

    most: Annotated[int, Field(ge=1, le=100_000)] = Field(default=10_000, description="How many paths are drawn, at most.")
    choose: Literal["contribution", "uniform"] = Field(
        default="contribution", description="`contribution`: paths are drawn as often as they are bright. `uniform`: all alike."
    )
    seed: Annotated[int, Field(ge=0, lt=2**32)] = Field(default=0, description="Of the choice of paths.")
    amount: Annotated[float, Field(ge=0, le=1)] = Field(default=0.0, description="How much segments are drawn into bundles; 0: light goes straight.")
    times: Times | None = Field(
        default=None,
        description="From and to which travelled length frames are made, world units. "
        "Default: from 0 until the light of 95 % of the paths is on its last segment, to the camera.",
    )
    window: Length | None = Field(default=None, description="How much of each path a frame shows, world units. Default: 1/16 of the whole time.")
    frames: Annotated[int, Field(ge=1, le=MOST_FRAMES)] = Field(default=48, description="How many frames.")
    seconds: Annotated[float, Field(ge=0.02, le=10)] = Field(default=0.08, description="How long each frame of the animation is shown, seconds.")
    fade: bool = Field(default=True, description="Whether light fades toward the earlier end of the window.")
    color: Literal["bounce", "chrominance", "object"] = Field(
        default="bounce",
        description="By the number of interactions behind the light, by the color that the path brings, or by the object that it left last.",
    )
    width: Annotated[float, Field(gt=0, le=20)] = Field(default=1.5, description="Of lines, pixels.")
    opacity: Annotated[float, Field(gt=0, le=1)] = Field(default=0.6, description="Of lines.")

    @model_validator(mode="after")
    def _some_time(self) -> "TimeOfFlight":
        if self.times is not None and not self.times[0] < self.times[1]:
            raise ValueError("expected `times` as from and to, the first below the second")
        if self.times is not None and self.window is not None and self.window > self.times[1] - self.times[0]:
            raise ValueError(f"expected a `window` within `times`, that is, of at most {self.times[1] - self.times[0]:g}")
        return self

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """See ``Tool``."""
        from queries.path_sample import sample_paths
        from queries.priority import by_luminance
        from viz.flight import windows
        from viz.numbers import number
        from viz.segments import SegmentLayer

        selection = self.selection(run)
        sample = sample_paths(run, selection, self.most, self.choose, self.seed)
        selected = selection.describe()
        if not len(sample):
            return Drawn(caption=f"Time of flight: the run has no light path{' ' + selected if selected else ''}.", empty=True)
        flight = self._flight(run, sample)
        low, high, window = self._span(flight)
        colors, legend = self._colors(run, sample, flight)
        layer = SegmentLayer(stage, self.width)
        spans = list(windows(low, high, window, self.frames))
        show = [functools.partial(self._show, layer, flight, colors, span) for span in spans]
        show[0]()
        drawn = f"{len(sample):,} of {sample.found:,}" if len(sample) < sample.found else f"{len(sample):,}"
        first, median = float(flight.arrival.min()), _median(flight.arrival, sample.scale * by_luminance(sample.contribution))
        bundled = " Bundled curves are not physical paths; their ends are." if self.amount > 0 else ""
        return Drawn(
            caption=f"Light on {drawn} paths{' ' + selected if selected else ''} that has travelled {number(low)} to {number(high)} world units, "
            f"{number(window)} a frame. The first reaches the camera after {number(first)}, half of all that they bring after {number(median)}; "
            f"glass does not slow it here.{bundled}",
            legend=legend,
            figures={
                "paths_found": sample.found,
                "paths_drawn": len(sample),
                "from_world_units": low,
                "to_world_units": high,
                "window_world_units": window,
                "frames": self.frames,
                "first_arrival_world_units": first,
                "median_arrival_world_units": median,
                "drawn_length_world_units": float((flight.arrives - flight.leaves).sum()),
            },
            frames=tuple(show) if self.frames > 1 else (),
            frame_notes=tuple(f"Travelled {number(a)} to {number(b)} world units" for a, b in spans) if self.frames > 1 else (),
            frame_seconds=self.seconds,
            meshes={"paths": _mesh(sample, flight, colors)},
        )

    def _flight(self, run: "Run", sample: "PathSample") -> "Flight":
        """The segments to be drawn."""
        from viz.flight import bent, flight

        scene = run.geometry
        corners = np.concatenate([scene.caster.bounds, scene.camera.origin[None]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        light = flight(sample, (low + high) / 2, float(np.linalg.norm(high - low)) / 2)
        return bent(light, sample, self.amount) if self.amount > 0 else light

    def _span(self, flight: "Flight") -> tuple[float, float, float]:
        """From when to when, and how much a frame shows: travelled lengths."""
        if self.times is not None:
            low, high = self.times
            return low, high, self.window or (high - low) * WINDOW
        late = float(np.quantile(flight.departure, LEFT)) or float(flight.arrival.max()) or 1.0
        window = self.window or late * WINDOW
        return 0.0, late + window, window

    def _show(self, layer: "SegmentLayer", flight: "Flight", colors: U8, span: tuple[float, float]) -> None:
        """Set the stage for one frame."""
        low, high = span
        rows, part = flight.between(low, high)
        ends = np.stack([part.leaves, part.arrives], axis=1)
        share = (ends - low) / (high - low) if self.fade else np.ones_like(ends)
        layer.show(part.begin, part.end, colors[rows], self.opacity * share)

    def _colors(self, run: "Run", sample: "PathSample", flight: "Flight") -> tuple[U8, tuple[tuple[str, Color], ...]]:
        """The color of each segment, uint8 (s, 3), and what colors mean."""
        from viz.colors import as_bytes, as_color, chrominance, object_colors

        if self.color == "chrominance":
            return as_bytes(chrominance(sample.contribution)[flight.path]), ()
        if self.color == "bounce":
            bounce = np.minimum(flight.bounce, MOST_BOUNCES)
            return as_bytes(np.array(_BOUNCES, np.float32)[bounce]), tuple((_bounce_name(i), _BOUNCES[i]) for i in np.unique(bounce).tolist())
        colors = object_colors(run)
        names = run.geometry.object_names
        left = sample.object[flight.vertex].astype(np.int64)
        left = np.where((left >= 0) & (left < len(names)), left, len(colors) - 1)
        seen = np.unique(left).tolist()
        named = [(f"from {names[i]}" if i < len(names) else "from an emitter without a surface", as_color(colors[i])) for i in seen]
        return as_bytes(colors[left]), tuple(named)


def _bounce_name(bounce: int) -> str:
    if bounce == 0:
        return "from the emitter"
    return f"after {bounce}{' or more' if bounce == MOST_BOUNCES else ''} interaction{'s' if bounce > 1 else ''}"


def _median(values: F64, weights: F64) -> float:
    """The least value up to which half of all weight lies; that of equal weights where there is none."""
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(weights[order] if weights.any() else np.ones(len(values)))
    return float(values[order[np.searchsorted(upto, upto[-1] / 2)]])


def _mesh(sample: "PathSample", flight: "Flight", colors: U8) -> "pyvista.PolyData":
    """All segments, with the travelled length at their ends."""
    from viz.segments import segment_mesh

    mesh = segment_mesh(flight.begin, flight.end)
    mesh.point_data["travelled"] = np.stack([flight.leaves, flight.arrives], axis=1).reshape(-1)
    mesh.cell_data["owner"] = sample.owner[flight.path]
    mesh.cell_data["path"] = sample.path[flight.path]
    mesh.cell_data["interactions"] = flight.bounce
    mesh.cell_data["object"] = sample.object[flight.vertex]
    mesh.cell_data["color"] = colors
    return mesh
