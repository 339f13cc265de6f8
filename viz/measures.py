"""What meters measure, in words: quantities with their units, values with their errors, and the walks that they come from."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from viz.ticks import number

if TYPE_CHECKING:
    from queries.run import Run
    from queries.selection import Selection

Side = Literal["light", "camera"]
_PLAIN = range(-3, 6)  # powers of ten of numbers that are written without an exponent
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


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


def luminance(rgb: npt.NDArray[np.floating[Any]]) -> npt.NDArray[np.float64]:
    """The luminance (…) of linear RGB (…, 3)."""
    from queries.kernels.luminance import LUMINANCE

    found: npt.NDArray[np.float64] = np.asarray(rgb, np.float64) @ LUMINANCE
    return found


def measured(value: float, error: float) -> str:
    """A value and its standard error, which has two digits; the value has as many decimals.

    >>> measured(12.3456, 0.1234), measured(1234.5, 67.8), measured(3.0, 0.0)
    ('12.35 ± 0.12', '1,234 ± 68', '3')
    """
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return number(value)
    power = int(f"{error:.1e}".partition("e")[2])
    largest = max(power, int(f"{value:e}".partition("e")[2]))
    if largest in _PLAIN and power >= -7:
        decimals = max(0, 1 - power)
        return f"{value:,.{decimals}f} ± {error:,.{decimals}f}"
    decimals = max(0, largest - power + 1)
    return f"({value / 10.0**largest:.{decimals}f} ± {error / 10.0**largest:.{decimals}f}) × 10{str(largest).translate(_SUPERSCRIPTS)}"


def percent(share: float) -> str:
    """A share in percent.

    >>> percent(0.624), percent(0.0123), percent(0.00042)
    ('62 %', '1.2 %', '0.042 %')
    """
    value = 100 * share
    return f"{value:.0f} %" if abs(value) >= 9.95 else f"{value:.2g} %"


def share_of(share: float, error: float) -> str:
    """A share in percent and its standard error, with the decimals that the error is worth.

    >>> share_of(0.6243, 0.0098), share_of(0.05, 0.0012), share_of(0.05, 0)
    ('62 ± 1 %', '5.0 ± 0.1 %', '5 %')
    """
    if not error > 0:
        return percent(share)
    decimals = min(6, max(0, -int(f"{100 * error:.0e}".partition("e")[2])))
    return f"{100 * share:.{decimals}f} ± {100 * error:.{decimals}f} %"


def count(found: int, one: str, many: str = "") -> str:
    """So many of something.

    >>> count(1, "arrival"), count(12345, "arrival")
    ('1 arrival', '12,345 arrivals')
    """
    return f"{found:,} {one if found == 1 else many or one + 's'}"


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
