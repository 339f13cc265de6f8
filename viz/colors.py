"""What colors stand for: objects, the chrominance of light, numbers on a scale. Colors are sRGB, 0 … 1, unless they say uint8."""

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.srgb import to_srgb
from viz.tools.base import Color

if TYPE_CHECKING:
    from queries.run import Run

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]

ColorMap = Literal["viridis", "cividis", "magma", "inferno", "turbo", "gray"]
MAPS: tuple[ColorMap, ...] = get_args(ColorMap)
"""Color maps by name. All but `turbo`, the rainbow, are perceptually uniform: equal steps of the number look like equal steps."""

# Hues of Okabe and Ito, which everybody tells apart, lightened where they would be lost on a dark ground. The first is kept for what shines.
_LAMP = (1.0, 0.85, 0.35)
_FIRST = (
    (0.35, 0.71, 0.91),  # sky blue
    (0.90, 0.45, 0.12),  # vermilion
    (0.10, 0.72, 0.52),  # bluish green
    (0.85, 0.50, 0.70),  # reddish purple
    (0.25, 0.50, 0.85),  # blue
    (0.52, 0.78, 0.28),  # leaf green
    (0.62, 0.45, 0.88),  # violet
)
_NOTHING = (0.66, 0.66, 0.66)  # vertices on no object: cameras, the sky
_GOLDEN = 137.50776405  # degrees: multiples of it never come near each other
_LIGHTNESS = (0.76, 0.62, 0.88)  # of further colors, in turn
_CHROMA = 0.13


def object_colors(run: "Run") -> F32:
    """A color for each object of the run, in the order of their keys, then one for what lies on no object: float32 (objects + 1, 3).

    The first object that emits is warm yellow. A run's objects have the same colors in all its pictures.
    """
    keys = run.tables["objects"]["object"].to_pylist()
    emitting = sorted(key for key in run.tables["emitters"]["object"].to_pylist() if key is not None)
    return distinct_colors(max(keys, default=-1) + 1, emitting[0] if emitting else None)


def distinct_colors(count: int, lamp: int | None = None) -> F32:
    """So many colors that are told apart, then a gray: float32 (count + 1, 3). ``lamp``: which of them is the yellow one."""
    others = [i for i in range(count) if i != lamp]
    colors = np.empty((count + 1, 3), np.float32)
    colors[-1] = _NOTHING
    if lamp is not None:
        colors[lamp] = _LAMP
    given = len(_FIRST)
    colors[others[:given]] = np.array(_FIRST, np.float32)[: len(others)]
    more = np.arange(max(0, len(others) - given))
    hue = np.deg2rad(25.0 + _GOLDEN * more)
    lightness = np.array(_LIGHTNESS)[more % len(_LIGHTNESS)]
    colors[others[given:]] = from_oklab(np.stack([lightness, _CHROMA * np.cos(hue), _CHROMA * np.sin(hue)], axis=1))
    return colors


def chrominance(rgb: npt.NDArray[np.floating]) -> F32:
    """The color of light without its brightness: linear RGB (…, 3), scaled until the largest channel is 1, as sRGB, float32.

    Light of no positive, finite channel has no color: white.
    """
    light = np.maximum(np.nan_to_num(np.asarray(rgb, np.float32), nan=0.0, posinf=0.0, neginf=0.0), 0)
    largest = light.max(axis=-1, keepdims=True, initial=0)
    return to_srgb(np.divide(light, largest, out=np.ones_like(light), where=largest > 0))


def color_map(name: str) -> U8:
    """A color map's 256 colors, low to high: uint8 (256, 3). Raises ``QueryError`` for a name that is not in ``MAPS``."""
    if name not in MAPS:
        raise QueryError(f"there is no color map `{name}`: expected one of {', '.join(MAPS)}")
    import matplotlib

    colors = matplotlib.colormaps[name](np.arange(256), bytes=True)
    return np.ascontiguousarray(colors[:, :3], np.uint8)


def mapped(name: str, values: npt.NDArray[np.floating]) -> U8:
    """The colors of values (n,) between 0 and 1, beyond which they are cut off (not a number: 0): uint8 (n, 3). Raises as ``color_map`` does."""
    steps = np.nan_to_num(np.asarray(values, np.float32), nan=0.0).clip(0, 1) * np.float32(255) + np.float32(0.5)
    return color_map(name)[steps.astype(np.uint8)]


def as_bytes(colors: npt.NDArray[np.floating]) -> U8:
    """Colors, cut to 0 … 1, of 8 bits a channel: uint8 of the same shape."""
    found: U8 = np.rint(255 * np.clip(colors, 0, 1)).astype(np.uint8)
    return found


def as_color(rgb: npt.NDArray[np.floating]) -> Color:
    """One color (3,) as legends have it."""
    return float(rgb[0]), float(rgb[1]), float(rgb[2])


def from_oklab(lab: npt.NDArray[np.floating]) -> F32:
    """Oklab (n, 3), in which lightness and hue are what they look like, as sRGB float32 (n, 3) (ottosson2020). Cut to what screens show."""
    to_lms = np.array([[1, 0.3963377774, 0.2158037573], [1, -0.1055613458, -0.0638541728], [1, -0.0894841775, -1.2914855480]])
    to_rgb = np.array(
        [
            [4.0767416621, -3.3077115913, 0.2309699292],
            [-1.2684380046, 2.6097574011, -0.3413193965],
            [-0.0041960863, -0.7034186147, 1.7076147010],
        ]
    )
    return to_srgb((np.asarray(lab, np.float64) @ to_lms.T) ** 3 @ to_rgb.T)
