"""Where a display is seen from: lengths on it as angles (thesis 4.3.2)."""

import math
from dataclasses import dataclass

CENTIMETERS_PER_INCH = 2.54


@dataclass(frozen=True)
class Viewing:
    """``dpi``: pixels per inch; ``distance``: of the viewer's eye, centimeters.

    At 100 DPI and 46 cm, 300 subpixels of an RGB stripe subtend 3.2 degrees: the frequency of one period in six subpixels is 16 cycles per degree.
    Raises ValueError where either is not positive and finite.
    """

    dpi: float = 100.0
    distance: float = 46.0

    def __post_init__(self) -> None:
        """Check that both are lengths."""
        if not (0.0 < self.dpi < math.inf and 0.0 < self.distance < math.inf):
            raise ValueError(
                f"expected a positive number of pixels per inch and a positive distance in centimeters, found {self.dpi}, {self.distance}"
            )

    @property
    def degrees_per_pixel(self) -> float:
        """The angle of one pixel in the middle of the display."""
        return math.degrees(2.0 * math.atan(0.5 * CENTIMETERS_PER_INCH / self.dpi / self.distance))
