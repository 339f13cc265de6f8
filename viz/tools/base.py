"""The contract of a tool: a section of a job that draws some light onto a stage."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import numpy.typing as npt
from pydantic import Field, model_validator

from queries.regions.description import Number, Part

if TYPE_CHECKING:
    import pyvista

    from queries.run import Run
    from queries.selection import Selection
    from viz.stage import Stage

U8 = npt.NDArray[np.uint8]
Color = tuple[float, float, float]  # sRGB, 0 … 1
Area = Annotated[tuple[Number, Number, Number, Number], Field(strict=False)]


@dataclass(frozen=True)
class ColorBar:
    """What colors mean: uint8 (256, 3), from ``low`` to ``high``, on a logarithmic scale or a linear one. ``label`` names quantity and unit."""

    label: str
    colors: U8
    low: float
    high: float
    logarithmic: bool = False


@dataclass(frozen=True)
class Drawn:
    """What a tool drew.

    ``caption``: what is seen, in one to three sentences; ``legend``: names of colors; ``figures``: quantities, with the unit in the name; ``frames``:
    each sets the stage for one picture of a sequence (none: one picture); ``frame_notes``: a line of text for each; ``frame_seconds``: how long
    each is shown; ``image``: uint8 (height, width, 3), a picture made in image space, instead of the stage's; ``meshes``: what can be exported (VTP,
    glTF), with its attributes. ``empty``: nothing was selected.
    """

    caption: str
    legend: tuple[tuple[str, Color], ...] = ()
    color_bar: ColorBar | None = None
    figures: Mapping[str, float | int | str] = field(default_factory=dict)
    frames: tuple[Callable[[], None], ...] = ()
    frame_notes: tuple[str, ...] = ()
    frame_seconds: float = 0.08
    image: U8 | None = None
    meshes: "Mapping[str, pyvista.PolyData]" = field(default_factory=dict)
    empty: bool = False


class Tool(Part):
    """What all tools are told: which light they draw."""

    expression: Annotated[str, Field(min_length=1, max_length=10_000)] | None = Field(
        default=None, description="A light path expression: only the light that it selects is drawn. Default: all light."
    )
    dialect: Literal["std", "osl", "thesis"] | None = Field(default=None, description="The expression's notation. Default: the job's.")
    region: str | None = Field(default=None, description="A name of `regions`: only light with an interaction there.")
    film: Area | None = Field(default=None, description="Only light that is seen in this part of the film: left, top, right, bottom, pixels.")

    @model_validator(mode="after")
    def _some_film(self) -> "Tool":
        if self.film is not None and not (self.film[0] < self.film[2] and self.film[1] < self.film[3]):
            raise ValueError("expected `film` as left, top, right, bottom, with left below right and top below bottom")
        return self

    def selection(self, run: "Run") -> "Selection":
        """The light that the tool draws. Raises ``QueryError``."""
        from queries.selection import Selection

        job: Mapping[str, Any] = run.manifest.get("job") or {}
        return Selection.of(run, self.expression, self.region, self.film, self.dialect or str(job.get("dialect") or "std"))

    @abstractmethod
    def draw(self, run: "Run", stage: "Stage") -> Drawn:
        """Draw onto the stage. The same run gives the same picture. Raises ``QueryError``."""


class WalkTool(Tool):
    """A tool that measures walks on their way: light, or the importance of camera walks."""

    walks: Literal["light", "camera"] = Field(
        default="light",
        description="`light`: what arrives from emitters, which needs a run of `method: light` or the job's `inspection`. "
        "`camera`: importance, what matters to the image.",
    )
