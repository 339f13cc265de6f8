"""What meters measure, in words: quantities with their units, the light that is measured, and the walks that it comes from."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from viz.numbers import count

if TYPE_CHECKING:
    from queries.run import Run
    from queries.selection import Selection

Side = Literal["light", "camera"]


@dataclass(frozen=True)
class Quantity:
    """A quantity's name and its unit."""

    name: str
    unit: str

    @property
    def label(self) -> str:
        """Both, as a color bar shows them."""
        return f"{self.name} ({self.unit})"


TOTAL = {"light": Quantity("flux", "flux"), "camera": Quantity("importance", "importance")}
ON_SURFACES = {"light": Quantity("irradiance", "flux / world unit²"), "camera": Quantity("importance on surfaces", "importance / world unit²")}
IN_SPACE = {"light": Quantity("fluence", "flux / world unit²"), "camera": Quantity("importance in space", "importance / world unit²")}
FROM_DIRECTIONS = {
    "light": Quantity("radiance", "flux / (world unit² sr)"),
    "camera": Quantity("importance from directions", "importance / (world unit² sr)"),
}
LIGHT = {"light": "light", "camera": "importance"}
"""What walks carry, in one word."""


def what_light(selection: "Selection", side: Side) -> str:
    """The light that a selection leaves, as it begins a sentence: "Light selected by `C L`", or "All light"."""
    described = selection.describe()
    if not described:
        return f"All {LIGHT[side]}"
    return f"{LIGHT[side].capitalize()}{'' if described.startswith(('selected', 'with')) else ' seen'} {described}"


def whose_walks(run: "Run", side: Side) -> str:
    """The walks that a figure comes from: "1,048,576 light walks of the run", or of its inspection pass. Raises ``QueryError`` without any."""
    from queries.inspection import walks_of

    with walks_of(run, side) as source:
        settings = source.settings
        walks = int(settings["width"]) * int(settings["height"]) * int(settings["passes"])
        kept = float(settings["keep"])
        found = count(round(walks * kept), f"{side} walk")
        return f"{found}{'' if kept == 1 else f' kept of {walks:,}'} of the {'run' if source is run else 'inspection pass'}"


def figures(found: Mapping[str, float | int | str]) -> dict[str, float | int | str]:
    """Figures without those that cannot be known, such as the errors of a run of one unit."""
    return {name: value for name, value in found.items() if isinstance(value, str) or math.isfinite(value)}


def nothing_arrives(selection: "Selection", run: "Run", side: Side, where: str) -> str:
    """What a picture says that shows nothing. Raises ``QueryError`` where there are no such walks."""
    described = selection.describe()
    return f"No {LIGHT[side]}{' ' if described else ''}{described} arrives {where}: none of {whose_walks(run, side)} does."


def sentences(parts: Iterable[str]) -> str:
    """Sentences joined, without the empty ones."""
    return " ".join(part for part in parts if part)
