"""A view as a job describes it: one tool, and how its picture is taken."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from queries.regions.description import Part
from viz.cameras import JOB_CAMERA, CameraDescription
from viz.look import Look
from viz.tools.arrows import Arrows
from viz.tools.base import Tool
from viz.tools.bundles import Bundles
from viz.tools.fluence import FluenceVolume
from viz.tools.irradiance import Irradiance
from viz.tools.particles import Particles
from viz.tools.probe import SphericalPlot
from viz.tools.time_of_flight import TimeOfFlight

Side = Annotated[int, Field(ge=64, le=8192)]


class View(Part):
    """One picture, or a sequence of them, written into the run folder as `views/<name>.png`: exactly one of the tools, and how it is shown."""

    bundles: Bundles | None = Field(default=None, description="Light paths as bundled curves (thesis 8.3).")
    irradiance: Irradiance | None = Field(default=None, description="Surfaces in false color.")
    probe: SphericalPlot | None = Field(default=None, description="Spherical plots of the light that arrives at points.")
    arrows: Arrows | None = Field(default=None, description="Arrows: where the light that arrives at points comes from.")
    fluence: FluenceVolume | None = Field(default=None, description="Light in free space as a volume.")
    particles: Particles | None = Field(default=None, description="Particles that flow with the light.")
    time_of_flight: TimeOfFlight | None = Field(default=None, description="Light on its way: frames of consecutive travel times.")
    camera: str | CameraDescription = Field(default=JOB_CAMERA, description="`job`, a name of `cameras`, or the keys of one.")
    look: Look = Field(default=Look(), description="How the scene is shown.")
    size: Annotated[tuple[Side, Side], Field(strict=False)] = Field(default=(960, 720), description="Width and height of the picture, pixels.")
    export: list[Literal["vtp", "gltf"]] = Field(
        default=[], description="Also write what is drawn, with its numbers: `vtp` for ParaView, `gltf` (a `.glb` file) for other programs."
    )

    @model_validator(mode="after")
    def _one_tool(self) -> "View":
        found = [name for name in TOOLS if getattr(self, name) is not None]
        if len(found) != 1:
            expected = ", ".join(f"`{name}`" for name in TOOLS)
            raise ValueError(f"expected exactly one of {expected}, found {' and '.join(f'`{name}`' for name in found) or 'none'}")
        return self

    @property
    def tool(self) -> Tool:
        """The tool that the view names."""
        found: Tool = getattr(self, self.tool_name)
        return found

    @property
    def tool_name(self) -> str:
        """Its name."""
        return next(name for name in TOOLS if getattr(self, name) is not None)


TOOLS: dict[str, type[Tool]] = {
    "bundles": Bundles,
    "irradiance": Irradiance,
    "probe": SphericalPlot,
    "arrows": Arrows,
    "fluence": FluenceVolume,
    "particles": Particles,
    "time_of_flight": TimeOfFlight,
}
