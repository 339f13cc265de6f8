"""How the scene is shown around what a view draws."""

from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from queries.luminance import luminance_of
from queries.regions.description import LARGEST, Part, Position

BACKGROUNDS = {"dark": (0.07, 0.075, 0.09), "black": (0.0, 0.0, 0.0), "white": (1.0, 1.0, 1.0)}
_HEX = "0123456789abcdefABCDEF"
_DARK = 0.4  # weighted mean of sRGB channels below which a background asks for light lines


def _color(text: str) -> str:
    if text in BACKGROUNDS or (len(text) == 7 and text[0] == "#" and all(digit in _HEX for digit in text[1:])):
        return text
    raise ValueError(f"expected {', '.join(f'`{name}`' for name in BACKGROUNDS)} or a color such as `#1a2b3c`")


class Cut(Part):
    """A plane that cuts the scene open: what lies on the side to which the normal points is not drawn."""

    point: Position = Field(description="A point of the plane, world units.")
    normal: Position = Field(description="The direction, of any length but 0, to the side that is cut away.")

    @model_validator(mode="after")
    def _some_normal(self) -> "Cut":
        if max(map(abs, self.normal)) < 1 / LARGEST:
            raise ValueError("expected a `normal` that is not (0, 0, 0)")
        return self


class Look(Part):
    """How the scene and the background look. What a tool draws is not changed by it."""

    scene: Literal["translucent", "solid", "cut", "silhouette", "hidden"] = Field(
        default="translucent",
        description="`translucent`: as if of glass. `solid`: opaque. `cut`: opaque, without the outer walls that face the camera, "
        "so that one looks into a closed room (or without what `cut` takes away). `silhouette`: edges and outlines only. `hidden`: not at all.",
    )
    opacity: Annotated[float, Field(gt=0, le=1)] = Field(default=0.25, description="How much translucent surfaces hide of what is behind, 0 to 1.")
    cut: Cut | None = Field(default=None, description="Cuts the scene along a plane, whatever its look: `point` and `normal`, world units.")
    hide: list[Annotated[str, Field(min_length=1, max_length=1000)]] = Field(default=[], description="Names of objects that are not drawn.")
    background: Annotated[str, AfterValidator(_color)] = Field(
        default="dark", description="`dark` (almost black), `black`, `white` (for print) or a color such as `#1a2b3c`."
    )

    @property
    def background_color(self) -> tuple[float, float, float]:
        """The background: sRGB, 0 … 1."""
        if self.background in BACKGROUNDS:
            return BACKGROUNDS[self.background]
        red, green, blue = (int(self.background[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return red, green, blue

    @property
    def dark(self) -> bool:
        """Whether the background is so dark that lines on it must be light."""
        return bool(luminance_of(np.array(self.background_color)) < _DARK)
