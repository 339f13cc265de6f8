"""Spherical plots: light that arrives at a point, as a surface around it (thesis 8.1, reiner2012)."""

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field

from queries.luminance import luminance_of
from queries.regions.description import Length
from viz.measures import FROM_DIRECTIONS, IN_SPACE, LIGHT, ON_SURFACES, Quantity, figures, nothing_arrives, sentences, what_light, whose_walks
from viz.numbers import count, measured, number
from viz.tools.base import Color, Drawn, WalkTool
from viz.tools.probes import MOST_PROBES, ProbeSection, diagonal, marker, places, probes_of

if TYPE_CHECKING:
    import pyvista

    from queries.probes import Incident, Probe
    from queries.run import Run
    from viz.stage import Stage

F64 = npt.NDArray[np.float64]

SIZE = 0.16  # of the farthest point of a plot, in diagonals of the scene's bounds
SEGMENTS = "segment"


class SphericalPlot(WalkTool):
    """Surfaces around points, as far away in each direction as light from there is strong, in the color of that light."""

    probes: Annotated[list[ProbeSection], Field(min_length=1, max_length=MOST_PROBES)] = Field(description="Where light is measured.")
    resolution: Annotated[int, Field(ge=8, le=128)] = Field(
        default=48, description="Bands of directions from pole to pole, with twice as many sectors around. A disk has the upper half of them."
    )
    smooth: Annotated[float, Field(ge=0, le=45)] = Field(
        default=6.0, description="Directions are blurred by a Gaussian of this standard deviation, degrees, which keeps the integral. 0: not at all."
    )
    size: Length | None = Field(
        default=None, description="How far the farthest point is from its probe, world units. Default: 16 % of the diagonal of the scene's bounds."
    )
    power: Annotated[float, Field(gt=0, le=1)] = Field(
        default=1.0, description="Distances are radiance to this power: below 1, weak light is seen beside strong light."
    )
    scale: Literal["together", "each"] = Field(
        default="together", description="Whether all probes share one scale, or each one's farthest point lies at `size`."
    )

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """Add the plots and their probes' rings to the stage. Raises ``QueryError``."""
        from queries.probes import incident
        from viz.colors import distinct_colors

        selection = self.selection(run)
        probes = probes_of(run, self.probes)
        size = self.size or SIZE * diagonal(run)
        found = [incident(run, selection, probe, self.resolution, self.walks) for probe in probes]
        if not any(light.count for light in found):
            return Drawn(nothing_arrives(selection, run, self.walks, f"at {places(probes)}"), figures={"probes": len(probes)}, empty=True)
        radiance = [self._smoothed(light) for light in found]
        peaks = [float(luminance_of(values).max()) for values in radiance]
        meshes: dict[str, pyvista.PolyData] = {}
        legend: list[tuple[str, Color]] = []
        rings = distinct_colors(len(probes)) if len(probes) > 1 else np.full((1, 3), 0.85 if stage.look.dark else 0.3, np.float32)
        for i, (light, values) in enumerate(zip(found, radiance)):
            peak = peaks[i] if self.scale == "each" else max(peaks)
            if light.count:
                meshes[f"probe_{i + 1}"] = plot = self._plot(light, values, peak, size)
                stage.add(plot, scalars="color", rgb=True, smooth_shading=True, ambient=0.35, diffuse=0.7, specular=0.12, specular_power=20)
            meshes[f"marker_{i + 1}"] = mark = marker(light.probe, diagonal(run)).surface()
            stage.add(mark, color=tuple(rings[i]), smooth_shading=True, ambient=0.6, diffuse=0.4)
            legend.append((self._legend(i, light), (float(rings[i][0]), float(rings[i][1]), float(rings[i][2]))))
        caption = sentences(
            [
                f"{what_light(selection, self.walks)} at {places(probes)}, by the direction that it comes from: {self._distances(peaks, size)}, and "
                f"colored like the {LIGHT[self.walks]}.",
                f"From {whose_walks(run, self.walks)}{f'; directions are blurred by {self.smooth:g}°' if self.smooth else ''}.",
            ]
        )
        return Drawn(caption, legend=tuple(legend), figures=self._figures(found, peaks), meshes=meshes)

    def _smoothed(self, light: "Incident") -> F64:
        from viz.directions import low_pass

        return low_pass(light.radiance, light.directions, light.projected, self.smooth)

    def _plot(self, light: "Incident", radiance: F64, peak: float, size: float) -> "pyvista.PolyData":
        """The surface of one probe, with its numbers: at points that stand for no direction of their own, poles and rims, solid angles are 0."""
        from viz.colors import chrominance
        from viz.glyphs import radial_surface

        bands, sectors, _ = radiance.shape
        distances = size * (np.maximum(luminance_of(radiance), 0) / peak) ** self.power
        found = radial_surface(np.array(light.probe.position), light.directions, distances, closed=light.probe.normal is None)
        plot: pyvista.PolyData = found.surface()
        rows = _nearest_cells(bands, sectors, len(found.points))
        weights = np.zeros(len(found.points))
        weights[: bands * sectors] = np.repeat(light.projected, sectors)
        of_points = radiance.reshape(-1, 3)[rows]
        plot.point_data["radiance"] = of_points.astype(np.float32)
        plot.point_data["luminance"] = luminance_of(of_points).astype(np.float32)
        plot.point_data["solid_angle"] = weights
        plot.point_data["color"] = np.rint(255 * chrominance(of_points)).astype(np.uint8)
        return plot

    # --- in words -----------------------------------------------------------------------------------------------------

    def _quantity(self, probe: "Probe") -> Quantity:
        return (IN_SPACE if probe.normal is None else ON_SURFACES)[self.walks]

    def _distances(self, peaks: list[float], size: float) -> str:
        unit = FROM_DIRECTIONS[self.walks].unit
        power = "" if self.power == 1 else f" to the power {self.power:g}"
        how = f"the surface is as far away as {FROM_DIRECTIONS[self.walks].name}{power} says"
        if self.scale == "each" and len(peaks) > 1:
            return f"{how}, each to its own scale"
        return f"{how} ({number(max(peaks))} {unit} at {number(size)} world units)"

    def _legend(self, i: int, light: "Incident") -> str:
        quantity = self._quantity(light.probe)
        value = measured(float(luminance_of(light.value)), light.value_error)
        return f"probe {i + 1}: {quantity.name} {value} {quantity.unit}, {count(light.count, SEGMENTS)}"

    def _figures(self, found: "list[Incident]", peaks: list[float]) -> dict[str, float | int | str]:
        known: dict[str, float | int | str] = {"probes": len(found), "unit": IN_SPACE[self.walks].unit}
        for i, (light, peak) in enumerate(zip(found, peaks)):
            name = self._quantity(light.probe).name.replace(" ", "_")
            known |= {
                f"probe_{i + 1}_{name}": float(luminance_of(light.value)),
                f"probe_{i + 1}_standard_error": light.value_error,
                f"probe_{i + 1}_largest_radiance": peak,
                f"probe_{i + 1}_segments": light.count,
            }
        return figures(known)


def _nearest_cells(bands: int, sectors: int, points: int) -> npt.NDArray[np.int64]:
    """For each point of a ``radial_surface`` the cell whose light it shows: its own, or one beside it. Poles show the first cell of their band."""
    cells = np.arange(bands * sectors).reshape(bands, sectors)
    extra = [cells[:1, 0], cells[-1]] if points == bands * sectors + 1 + sectors else [cells[:1, 0], cells[-1:, 0]]
    return np.concatenate([cells.ravel(), *extra])
