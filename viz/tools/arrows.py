"""Arrows: where the light at a point comes from, grouped by its last interactions (thesis 8.1, reiner2012)."""

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.luminance import luminance_of
from queries.regions.description import Length
from viz.measures import IN_SPACE, ON_SURFACES, figures, nothing_arrives, sentences, what_light, whose_walks
from viz.numbers import count, measured, percent, share_of
from viz.tools.base import Color, Drawn, WalkTool
from viz.tools.probes import MOST_PROBES, ProbeSection, diagonal, marker, places, probes_of

if TYPE_CHECKING:
    import pyvista

    from queries.clusters import Arrow, Clusters
    from queries.probes import Probe
    from queries.run import Run
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
Name = Annotated[str, Field(min_length=1, max_length=1000)]

FROM_INFINITY = 0.25  # length of arrows from infinity, in diagonals of the scene's bounds
_OUTSIDE = 1e-3  # how far beyond its bounds is outside the scene, likewise
WIDTH = 0.012  # radius of an arrow that carries all light, in diagonals of the scene's bounds
MOST_LINES = 12  # of the legend
BACK = "← "  # before the names of arrows that lead to another one's tail, once for each interaction back
_ROUNDING = 1e-9  # of shares
_ASIDE = 0.45  # how far colors of further clusters on the same object lie from the first one's: toward white and toward black, in turn


class Arrows(WalkTool):
    """Arrows to probes, one for each kind of last interaction, as thick as the light that comes that way is strong."""

    probes: Annotated[list[ProbeSection], Field(min_length=1, max_length=MOST_PROBES)] = Field(description="Where light is measured.")
    groups: dict[Name, Annotated[list[Name], Field(min_length=1)]] = Field(
        default={}, description="Objects that count as one, such as a lamp and its shade: name -> names of objects."
    )
    threshold: Annotated[float, Field(ge=0, lt=1)] = Field(
        default=0.01, description="The least share of a probe's light that gets an arrow, from 0 to 1."
    )
    history: Annotated[int, Field(ge=1, le=3)] = Field(
        default=1, description="How many interactions back: further arrows lead to where the first ones begin, as a tree."
    )
    width: Length | None = Field(
        default=None,
        description="Radius of an arrow that carries all light of the strongest probe, world units: cross sections are proportional to flux. "
        "Default: 1.2 % of the diagonal of the scene's bounds.",
    )
    color: Literal["cluster", "chrominance"] = Field(
        default="cluster",
        description="`cluster`: the color of the object that light comes from, as in all pictures of the run. `chrominance`: the color of the light.",
    )

    @model_validator(mode="after")
    def _one_group(self) -> "Arrows":
        seen: dict[str, str] = {}
        for group, names in self.groups.items():
            for name in names:
                if name in seen:
                    raise ValueError(f"expected each object in one group, found `{name}` in `{seen[name]}` and in `{group}`")
                seen[name] = group
        return self

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """Add the arrows and their probes' rings to the stage. Raises ``QueryError``."""
        from queries.clusters import clusters

        selection = self.selection(run)
        probes = probes_of(run, self.probes)
        found = [clusters(run, selection, probe, self.groups, self.threshold, self.history, self.walks) for probe in probes]
        if not any(light.count for light in found):
            return Drawn(nothing_arrives(selection, run, self.walks, f"at {places(probes)}"), figures={"probes": len(probes)}, empty=True)
        colors = self._colors(run, found)
        width = self.width or WIDTH * diagonal(run)
        brightest = max(float(luminance_of(light.value)) for light in found)
        meshes: dict[str, pyvista.PolyData] = {}
        for i, (probe, light) in enumerate(zip(probes, found)):
            if light.arrows:
                meshes[f"arrows_{i + 1}"] = drawn = self._mesh(run, probe, light, colors, width, brightest)
                stage.add(drawn, scalars="color", rgb=True, smooth_shading=True, ambient=0.4, diffuse=0.65, specular=0.1, specular_power=20)
            meshes[f"marker_{i + 1}"] = mark = marker(probe, diagonal(run)).surface()
            stage.add(mark, color=(0.85,) * 3 if stage.look.dark else (0.3,) * 3, smooth_shading=True, ambient=0.6, diffuse=0.4)
        what = what_light(selection, self.walks)
        caption = sentences(
            [
                f"Where {what[0].lower()}{what[1:]} at {places(probes)} comes from"
                f"{f', {self.history} interactions back' if self.history > 1 else ''}: cross sections of arrows are proportional to its flux.",
                self._totals(found),
                f"From {whose_walks(run, self.walks)}.",
            ]
        )
        return Drawn(caption, legend=self._legend(found, colors), figures=self._figures(found), meshes=meshes)

    # --- arrows -------------------------------------------------------------------------------------------------------

    def _mesh(
        self, run: "Run", probe: "Probe", light: "Clusters", colors: dict[str, Color], width: float, brightest: float
    ) -> "pyvista.PolyData":
        """The arrows of one probe, with their numbers at each point."""
        from viz.glyphs import arrow, joined

        parts, tails = [], self._tails(run, probe, light)
        for i, cluster in enumerate(light.arrows):
            radius = width * float(np.sqrt(luminance_of(cluster.value) / brightest))
            parts.append(arrow(tails[i], self._tip(probe, light, i, tails), radius))
        found = joined(parts)
        mesh: pyvista.PolyData = found.surface()
        row = np.repeat(np.arange(len(parts)), [len(part.points) for part in parts])
        flux = np.array([luminance_of(cluster.value) for cluster in light.arrows])
        shades = np.array([self._shade(cluster, colors) for cluster in light.arrows])
        columns = {
            "arrow": np.arange(len(parts)),
            "level": np.array([cluster.level for cluster in light.arrows]),
            "parent": np.array([cluster.parent for cluster in light.arrows]),
            "irradiance": np.array([cluster.value for cluster in light.arrows], np.float32),
            "luminance": flux,
            "standard_error": np.array([cluster.error for cluster in light.arrows]),
            "share": np.array([cluster.share for cluster in light.arrows]),
            "radius": width * np.sqrt(flux / brightest),
            "segments": np.array([cluster.count for cluster in light.arrows]),
            "color": np.rint(255 * shades).astype(np.uint8),
        }
        for name, values in columns.items():
            mesh.point_data[name] = values[row]
        return mesh

    def _tails(self, run: "Run", probe: "Probe", light: "Clusters") -> list[F64]:
        """Where the arrows begin: arrows from infinity, which begin outside the scene, are cut to a length that is seen."""
        low, high = run.geometry.caster.bounds
        slack, tails = _OUTSIDE * diagonal(run), list[F64]()
        for cluster in light.arrows:
            tail, tip = np.asarray(cluster.start, np.float64), tails[cluster.parent] if cluster.parent >= 0 else np.array(probe.position, np.float64)
            length, longest = float(np.linalg.norm(tail - tip)), FROM_INFINITY * diagonal(run)
            outside = bool((tail < low - slack).any() or (tail > high + slack).any())
            tails.append(tip + (tail - tip) * (longest / length) if outside and length > longest else tail)
        return tails

    def _tip(self, probe: "Probe", light: "Clusters", i: int, tails: list[F64]) -> F64:
        """Where an arrow ends: at the ball of its probe, which it points to the middle of, or at the tail of the arrow that it leads to."""
        cluster, tail = light.arrows[i], tails[i]
        if cluster.parent >= 0:
            return tails[cluster.parent]
        center = np.array(probe.position, np.float64)
        length = float(np.linalg.norm(center - tail))
        return center if length <= 2 * probe.radius else center + (tail - center) * (probe.radius / length)

    # --- in words and colors ------------------------------------------------------------------------------------------

    def _colors(self, run: "Run", found: "list[Clusters]") -> dict[str, Color]:
        """A color for each label: of the first of its objects, set aside where another label has it already."""
        from viz.colors import distinct_colors, object_colors

        of_objects = object_colors(run)
        known: dict[str, Color] = {}
        given: dict[int, int] = {}
        for cluster in sorted((cluster for light in found for cluster in light.arrows), key=lambda cluster: (cluster.level, -cluster.share)):
            if cluster.label in known:
                continue
            key = run.geometry.object_id(cluster.objects[0]) if cluster.objects else -1
            base: F32 = distinct_colors(1, 0)[0] if key < 0 and cluster.event == "emitter" else of_objects[key]
            times = given[key] = given.get(key, -1) + 1
            aside = 1 - (1 - _ASIDE) ** ((times + 1) // 2)
            shade = base + (np.float32(times % 2) - base) * aside
            known[cluster.label] = (float(shade[0]), float(shade[1]), float(shade[2]))
        return known

    def _legend(self, found: "list[Clusters]", colors: dict[str, Color]) -> tuple[tuple[str, Color], ...]:
        """The arrows with their shares, the strongest first; an arrow to another one's tail follows it, with a sign for each step back."""
        lines: list[tuple[str, Color]] = []
        for i, light in enumerate(found):
            total = float(luminance_of(light.value))
            for row in _as_tree(light):
                cluster = light.arrows[row]
                back, probe = BACK * (cluster.level - 1), f"{i + 1}: " if len(found) > 1 else ""
                lines.append((f"{probe}{back}{cluster.label} {share_of(cluster.share, cluster.error / total)}", self._shade(cluster, colors)))
        more = len(lines) - MOST_LINES
        return tuple(lines) if more <= 1 else (*lines[:MOST_LINES], (f"and {count(more, 'arrow')} more", (1.0, 1.0, 1.0)))

    def _shade(self, cluster: "Arrow", colors: dict[str, Color]) -> Color:
        """The color of one arrow."""
        from viz.colors import chrominance

        if self.color == "cluster":
            return colors[cluster.label]
        r, g, b = (float(value) for value in chrominance(cluster.value[None])[0])
        return r, g, b

    def _totals(self, found: "list[Clusters]") -> str:
        """What arrives, and what has no arrow."""
        segments = count(sum(light.count for light in found), "segment")
        dropped = max(light.dropped for light in found)
        together = "together" if len(found) == 1 else "at most"
        left = f"; arrows below {percent(self.threshold)} are left out, {percent(dropped)} {together}" if dropped > _ROUNDING else ""
        if len(found) > 1:
            return f"{segments}{left}."
        quantity = (IN_SPACE if self.probes[0].normal is None else ON_SURFACES)[self.walks]
        value = measured(float(luminance_of(found[0].value)), found[0].value_error)
        return f"{quantity.name.capitalize()} {value} {quantity.unit}, {segments}{left}."

    def _figures(self, found: "list[Clusters]") -> dict[str, float | int | str]:
        known: dict[str, float | int | str] = {"probes": len(found), "unit": IN_SPACE[self.walks].unit}
        for i, (light, section) in enumerate(zip(found, self.probes)):
            name = (IN_SPACE if section.normal is None else ON_SURFACES)[self.walks].name.replace(" ", "_")
            known |= {
                f"probe_{i + 1}_{name}": float(luminance_of(light.value)),
                f"probe_{i + 1}_standard_error": light.value_error,
                f"probe_{i + 1}_segments": light.count,
                f"probe_{i + 1}_arrows": len(light.arrows),
                f"probe_{i + 1}_left_out": light.dropped,
            }
        return figures(known)


def _as_tree(light: "Clusters") -> list[int]:
    """The rows of arrows, each followed by those that lead to its tail."""
    children: dict[int, list[int]] = {}
    for row, cluster in enumerate(light.arrows):
        children.setdefault(cluster.parent, []).append(row)

    def below(parent: int) -> list[int]:
        return [found for row in children.get(parent, []) for found in (row, *below(row))]

    return below(-1)
