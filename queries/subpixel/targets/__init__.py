"""The project's own test images: what is hard to show with few subpixels, drawn anew each time from formulas and seeds."""

from collections.abc import Callable
from types import MappingProxyType

from queries.errors import QueryError
from queries.subpixel.targets.base import F32, LEAST_DENSITY, Raster
from queries.subpixel.targets.foliage import foliage
from queries.subpixel.targets.hair import hair
from queries.subpixel.targets.noise import noise
from queries.subpixel.targets.text import text, text_inverted
from queries.subpixel.targets.wire_frame import wire_frame
from queries.subpixel.targets.zone_plate import zone_plate

LEAST_SIZE = 16  # pixels: less has no room for a line of text
MOST_POINTS = 1 << 27  # of a target: noise takes some 16 bytes for each

_TARGETS: dict[str, Callable[[Raster], F32]] = {
    "text": text,
    "text_inverted": text_inverted,
    "hair": hair,
    "foliage": foliage,
    "wire_frame": wire_frame,
    "zone_plate": zone_plate,
    "noise": noise,
}

TITLES = MappingProxyType(
    {
        "text": "Text",
        "text_inverted": "Text, inverted",
        "hair": "Hair",
        "foliage": "Foliage",
        "wire_frame": "Wire frame",
        "zone_plate": "Zone plate",
        "noise": "Natural-spectrum noise",
    }
)
"""What each target is called in words."""

DESCRIPTIONS = MappingProxyType(
    {
        "text": "Black text on white, set in sizes of 9 to 14 pixels, upright and italic, with and without serifs.",
        "text_inverted": "The same text, white on black.",
        "hair": "Curved strands, 0.2 to 0.9 pixels thin, of varied color and shading, before a background that goes from dark to light.",
        "foliage": "Leaves, twigs and blades of grass, many less than a pixel wide, in greens and browns against a bright sky.",
        "wire_frame": "A torus and a rolling plane in perspective as lines, 0.2 to 0.5 pixels thin, white and colored on near black.",
        "zone_plate": "A circular chirp, gray on the left, red against green and blue against yellow on the right; its frequency grows in "
        "proportion to the distance from the center and reaches half a cycle per pixel at the nearest edges.",
        "noise": "Gaussian noise with the spectrum of natural images, amplitude in inverse proportion to frequency, and with correlated colors.",
    }
)
"""What each target shows, in a sentence."""


def target(name: str, width: int, height: int, fine: int) -> F32:
    """A test image for a display of ``width`` x ``height`` pixels, with ``fine`` x ``fine`` samples in each.

    float32 (height * fine, width * fine, 3): linear light in [0, 1], averages over the areas of samples, row 0 on top. The scene does not depend
    on ``fine``. Letters, strands, leaves and lines keep their size in pixels: a larger display shows more of them. Raises QueryError for an unknown
    name or a bad size.
    """
    if name not in _TARGETS:
        raise QueryError(f"there is no test image `{name}`: known are {', '.join(_TARGETS)}")
    if width < LEAST_SIZE or height < LEAST_SIZE:
        raise QueryError(f"the test image `{name}` needs a display of at least {LEAST_SIZE} x {LEAST_SIZE} pixels, found {width} x {height}")
    if fine < 1:
        raise QueryError(f"the test image `{name}` needs at least 1 sample across each pixel, found {fine}")
    raster = Raster(width, height, fine)
    if raster.area * (fine * raster.oversampling(LEAST_DENSITY)) ** 2 > MOST_POINTS:
        raise QueryError(f"the test image `{name}` of {width} x {height} pixels of {fine} x {fine} samples is too large: take fewer pixels")
    return _TARGETS[name](raster)
