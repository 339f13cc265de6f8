"""Surfaces in false color: how much light arrives where (thesis 8.1)."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.luminance import luminance_of
from queries.regions.description import Length, Number
from viz.measures import ON_SURFACES, TOTAL, Quantity, figures, nothing_arrives, sentences, what_light, whose_walks
from viz.numbers import count, measured, number, percent
from viz.tools.base import Drawn, WalkTool

if TYPE_CHECKING:
    from queries.irradiance import IrradianceImage
    from queries.run import Run
    from queries.selection import Selection
    from viz.false_color import FalseColor
    from viz.stage import Stage

F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]

RAINBOW = "turbo"
ARRIVALS_PER_PATCH = 400  # on average, that patches of a size nobody chose should get: 5 % of noise
COARSEST, FINEST = 1 / 25, 1 / 250  # sizes of such patches, in diagonals of the scene's bounds
_LINE = 0.55  # how dark borders between objects are in an image


class Irradiance(WalkTool):
    """Surfaces in false color: the irradiance, which is the density of arriving light, on the meshes or in the job camera's image."""

    space: Literal["surface", "image"] = Field(
        default="surface",
        description="`surface`: on the meshes, seen from any camera. `image`: for each pixel of the job's camera, which is sharper.",
    )
    patch: Length | None = Field(
        default=None,
        description="The largest size of the patches that surfaces are cut into, world units (`surface` only). Default: such that about 400 "
        "arrivals fall on each, between 1/250 and 1/25 of the diagonal of the scene's bounds.",
    )
    smooth: bool = Field(default=True, description="Whether colors change smoothly between patches, or each patch has its own (`surface` only).")
    neighbors: Annotated[int, Field(ge=1, le=100_000)] = Field(
        default=400, description="How many arrivals each pixel's irradiance is estimated from (`image` only): more are less noisy and less sharp."
    )
    map: Literal["viridis", "cividis", "magma", "inferno", "turbo", "rainbow"] = Field(
        default="viridis", description="The color map. All but `turbo` (or `rainbow`) are perceptually uniform; `cividis` is for color-blind readers."
    )
    scale: Literal["linear", "log"] = Field(default="linear", description="Of the color bar.")
    range: Annotated[tuple[Number, Number], Field(strict=False)] | None = Field(
        default=None,
        description="The color bar's ends, flux / world unit². Default: from 0 (`log`: the 1st percentile of the lit area) to the 99th percentile.",
    )

    @model_validator(mode="after")
    def _some_range(self) -> "Irradiance":
        if self.range is not None and not self.range[0] < self.range[1]:
            raise ValueError(f"expected `range` as [low, high], low below high, found {list(self.range)}")
        if self.range is not None and self.scale == "log" and self.range[0] <= 0:
            raise ValueError(f"expected a `range` above 0 on a logarithmic scale, found {list(self.range)}")
        other, foreign = ("image", ("neighbors",)) if self.space == "surface" else ("surface", ("patch", "smooth"))
        fields = type(self).model_fields
        for name in foreign:
            if getattr(self, name) != fields[name].default:
                raise ValueError(f"`{name}` belongs to `space: {other}`: leave it out of `space: {self.space}`")
        return self

    @property
    def quantity(self) -> Quantity:
        """What is drawn."""
        return ON_SURFACES[self.walks]

    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """Paint the surfaces of the stage, or an image. Raises ``QueryError``."""
        selection = self.selection(run)
        return self._on_surfaces(run, stage, selection) if self.space == "surface" else self._in_image(run, stage, selection)

    # --- on the meshes ------------------------------------------------------------------------------------------------

    def _on_surfaces(self, run: "Run", stage: "Stage", selection: "Selection") -> Drawn:
        from queries.irradiance import irradiance
        from queries.patches import patches
        from viz.patch_surface import PatchSurface

        objects = shown_objects(run, stage)
        size = self.patch or patch_size(run, self.walks, objects)
        cut = patches(run.geometry, size, objects)
        found = irradiance(run, selection, cut, self.walks)
        arrivals, total = int(found.hits.sum()), float(luminance_of(found.flux))
        if not arrivals:
            return self._nothing(run, selection)
        values, area = luminance_of(found.values), cut.area
        lit = found.hits > 0
        error = median_error(found.error[lit], values[lit], area[lit])
        surface = PatchSurface(cut)
        scale = self._scale(values, area)
        shares = surface.interpolated(scale.shares(values)) if self.smooth else surface.flat(scale.shares(values))
        stage.show_surfaces(False)
        surface.add(stage, shares, scale.bar("").colors)
        attributes: dict[str, npt.NDArray[Any]] = {
            "irradiance": found.values,
            "luminance": values.astype(np.float32),
            "standard_error": found.error,
            "arrivals": found.hits,
            "color": scale.colors(values),
        }
        caption = sentences(
            [
                f"{self.quantity.name.capitalize()} in false color.",
                f"{what_light(selection, self.walks)}: {count(arrivals, 'arrival')} on {count(len(cut), 'patch', 'patches')} no larger than "
                f"{number(size)} world units, from {whose_walks(run, self.walks)}.",
                self._ends(scale, values, area, "area"),
                f"The total {TOTAL[self.walks].name} is {measured(total, found.flux_error)}; half of the lit area is known to {percent(error)} or "
                "better.",
            ]
        )
        known: dict[str, float | int | str] = {
            f"total_{TOTAL[self.walks].name}": total,
            "total_standard_error": found.flux_error,
            "area": found.area,
            "mean": total / found.area,
            "largest": float(values.max()),
            "median_relative_error": error,
            "arrivals": arrivals,
            "patches": len(cut),
            "patch_size": size,
            "unit": self.quantity.unit,
        }
        return Drawn(caption, color_bar=scale.bar(self.quantity.label), figures=figures(known), meshes={"irradiance": surface.mesh(attributes)})

    # --- in the image -------------------------------------------------------------------------------------------------

    def _in_image(self, run: "Run", stage: "Stage", selection: "Selection") -> Drawn:
        from queries.irradiance import irradiance_image

        width, height = film_within(run, stage.size)
        found = irradiance_image(run, selection, width, height, self.neighbors, side=self.walks, objects=shown_objects(run, stage))
        values = luminance_of(found.values)
        if not found.hits or not (values > 0).any():
            return self._nothing(run, selection)
        seen, lit = found.seen, found.seen & (values > 0)
        error = median_error(found.error[lit], values[lit], np.ones(int(lit.sum())))
        scale = self._scale(values[seen], np.ones(int(seen.sum())))
        picture = bordered(scale.colors(values), found, stage.look.background_color)
        caption = sentences(
            [
                f"{self.quantity.name.capitalize()} in false color, as the job's camera sees the surfaces.",
                f"{what_light(selection, self.walks)}: {count(found.hits, 'arrival')} from {whose_walks(run, self.walks)}; each pixel is the mean "
                f"over a disc that grows until it holds {self.neighbors:,} of them, or to a radius of {number(found.radius)} world units.",
                self._ends(scale, values[seen], np.ones(int(seen.sum())), "picture"),
                f"Half of the lit pixels are known to {percent(error)} or better.",
            ]
        )
        known: dict[str, float | int | str] = {
            "mean_of_pixels": float(values[seen].mean()),
            "largest": float(values.max()),
            "median_relative_error": error,
            "arrivals": found.hits,
            "unit": self.quantity.unit,
        }
        return Drawn(caption, color_bar=scale.bar(self.quantity.label), figures=figures(known), image=picture)

    # --- both ---------------------------------------------------------------------------------------------------------

    def _scale(self, values: F64, weights: F64) -> "FalseColor":
        from viz.false_color import FalseColor

        return FalseColor.of(RAINBOW if self.map == "rainbow" else self.map, values, weights, self.scale == "log", self.range)

    def _ends(self, scale: "FalseColor", values: F64, weights: F64, of: str) -> str:
        """What the color bar covers, and how much lies beyond."""
        above = float(weights[values > scale.high].sum() / weights.sum())
        below = float(weights[(values < scale.low)].sum() / weights.sum())
        beyond = [f"{percent(share)} of the {of} is {word}" for share, word in ((above, "brighter"), (below, "darker")) if share > 0]
        chosen = "" if self.range is not None else ", up to the 99th percentile"
        end = f": {' and '.join(beyond)}." if beyond else "."
        return f"Colors run from {number(scale.low)} to {number(scale.high)} {self.quantity.unit}{chosen}{end}"

    def _nothing(self, run: "Run", selection: "Selection") -> Drawn:
        return Drawn(nothing_arrives(selection, run, self.walks, "on the surfaces"), figures={"arrivals": 0}, empty=True)


def median_error(errors: npt.NDArray[np.floating[Any]], values: F64, weights: F64) -> float:
    """The relative error that half of the weight is below."""
    from viz.false_color import quantiles

    return quantiles(np.asarray(errors, np.float64) / np.maximum(values, np.finfo(np.float64).tiny), weights, (0.5,))[0]


def shown_objects(run: "Run", stage: "Stage") -> list[str] | None:
    """The names of the objects that the look does not hide; none where it hides nothing. Raises ``QueryError`` where it hides all of them."""
    from queries.errors import QueryError

    if not stage.look.hide:
        return None
    shown = [name for name in run.geometry.object_names if name not in stage.look.hide]
    if not shown:
        raise QueryError("the look hides every object of the scene: expected at least one to be shown, so leave some out of `hide`")
    return shown


def patch_size(run: "Run", side: str, objects: list[str] | None) -> float:
    """A size of patches, world units, at which each gets enough arrivals, within what is seen as smooth and as sharp."""
    from queries.inspection import walks_of
    from queries.patches import surface_area
    from viz.tools.probes import diagonal

    with walks_of(run, side) as source:
        arrivals = source.tables[f"{side}_vertices"].num_rows
    wanted = float(np.sqrt(surface_area(run.geometry, objects) * ARRIVALS_PER_PATCH / max(arrivals, 1)))
    return float(np.clip(wanted, FINEST * diagonal(run), COARSEST * diagonal(run)))


def film_within(run: "Run", size: tuple[int, int]) -> tuple[int, int]:
    """The largest size of the film's shape within a picture's."""
    film = run.geometry.camera.film
    factor = min(size[0] / film[4], size[1] / film[5])
    return max(1, round(film[4] * factor)), max(1, round(film[5] * factor))


def bordered(colors: U8, image: "IrradianceImage", background: tuple[float, float, float]) -> U8:
    """The colors (h, w, 3), with the background where nothing is seen, and dark lines between objects."""
    found = colors.copy()
    found[~image.seen] = np.round(np.array(background) * 255)
    border = np.zeros(image.seen.shape, np.bool_)
    for axis in (0, 1):
        one, other = ((slice(None),) * axis + (part,) for part in (slice(1, None), slice(None, -1)))
        border[one] |= image.object[one] != image.object[other]
        border[other] |= image.object[one] != image.object[other]
    found[border] = np.round(found[border] * (1 - _LINE))
    return found
