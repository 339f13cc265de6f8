"""S-CIELAB (zhang1997scielab): the color difference that a viewer sees between two pictures, at the angle that their samples subtend.

Light is split into three opponent channels, each is blurred as the eye blurs it, and CIELAB's difference is taken of what is left. Patterns too
fine to see vanish, colored ones before those of luminance; in uniform areas the difference is that of CIELAB.

A channel's blur is a sum of Gaussians, w exp(-(x² + y²) / s²), whose sum is normalized to 1. Beyond its edges a picture is mirrored, as in the
authors' software. Mirrored pictures are sums of cosines, and Gaussians only scale those, so filtering is exact at any width: the widest Gaussian of
luminance (s = 4.3 degrees) is wider than most pictures, and takes from each place a share of about the picture's mean. The software cuts all
Gaussians to a window of half a degree to one degree instead; that is not done here, and changes the means of methods by 3 % or less. Dark places
beside bright ones may get less than no light by that share; their differences count as those of black.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import fft

from queries.errors import QueryError

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]

# Linear sRGB to XYZ, IEC 61966-2-1 (its white, D65, is the sum of the rows)
XYZ_OF_RGB: F64 = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])
WHITE: F64 = XYZ_OF_RGB.sum(axis=1)

# XYZ to the opponent channels O1 (light to dark), O2 (red to green), O3 (blue to yellow), as in the software: the paper prints 0.077 with a minus
OPPONENT_OF_XYZ: F64 = np.array([[0.2787336, 0.7218031, -0.1065520], [-0.4487736, 0.2898056, 0.0771569], [0.0859513, -0.5899859, 0.5011089]])
OPPONENT_OF_RGB: F64 = OPPONENT_OF_XYZ @ XYZ_OF_RGB
RELATIVE_XYZ_OF_OPPONENT: F64 = np.linalg.inv(OPPONENT_OF_XYZ) / WHITE[:, None]

# Weights and spreads s, in degrees, of the Gaussians of O1, O2, O3 (zhang1997scielab, table 1)
BLURS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((0.921, 0.0283), (0.105, 0.133), (-0.108, 4.336)),
    ((0.531, 0.0392), (0.330, 0.494)),
    ((0.488, 0.0536), (0.371, 0.386)),
)

LINEAR_BELOW = (6.0 / 29.0) ** 3  # of a relative tristimulus value: CIELAB is linear there, and goes on so below zero


@dataclass(frozen=True)
class Difference:
    """Summaries of a map of differences: their mean and 95th percentile, and the means of their parts in lightness L* and in a* and b*."""

    mean: float
    high: float
    lightness: float
    chroma: float


def scielab(reference: F32, shown: F32, degrees_per_sample: float) -> F32:
    """The difference ΔE at each sample, float32 (rows, columns); the threshold of seeing is about 1.

    Pictures: float32 (rows, columns, 3), linear RGB in which the display's white is (1, 1, 1). Values outside [0, 1] are taken as they are: light
    that no display can emit, but that differences to it can be told of.
    Raises QueryError for pictures of unequal sizes, values that are not finite, and angles that are not positive.
    """
    if reference.shape != shown.shape:
        raise QueryError(f"expected two pictures of one size, found {_size(reference)} and {_size(shown)} samples")
    delta = appearance(reference, degrees_per_sample) - appearance(shown, degrees_per_sample)
    return np.asarray(np.sqrt(np.einsum("ijk,ijk->ij", delta, delta)), np.float32)


def summary(reference: F32, shown: F32) -> Difference:
    """How two pictures differ of which ``appearance`` was taken, float32 (rows, columns, 3)."""
    delta = reference - shown
    squared = delta * delta
    chroma = squared[..., 1] + squared[..., 2]
    total = np.sqrt(squared[..., 0] + chroma)
    return Difference(_mean(total), float(np.percentile(total, 95.0)), _mean(np.abs(delta[..., 0])), _mean(np.sqrt(chroma)))


def appearance(picture: F32, degrees_per_sample: float) -> F32:
    """CIELAB of the blurred picture, float32 (rows, columns, 3): L*, a*, b* of each sample. Arguments and errors as in ``scielab``."""
    if picture.ndim != 3 or picture.shape[2] != 3 or not picture.size:
        raise QueryError(f"expected a picture of rows, columns and 3 colors, found an array of {picture.shape}")
    if not degrees_per_sample > 0.0 or not np.isfinite(degrees_per_sample):
        raise QueryError(f"expected a positive angle of a sample, in degrees, found {degrees_per_sample}")
    if not np.isfinite(picture).all():
        raise QueryError("a picture has values that are not finite, so no color difference can be told: replace them first")
    return cielab(blurred(picture @ OPPONENT_OF_RGB.T.astype(np.float32), degrees_per_sample) @ RELATIVE_XYZ_OF_OPPONENT.T.astype(np.float32))


def blurred(opponent: F32, degrees_per_sample: float) -> F32:
    """Opponent channels, float32 (rows, columns, 3), as the eye blurs them."""
    rows, columns = opponent.shape[:2]
    down, across = (np.arange(n) / (2.0 * n * degrees_per_sample) for n in (rows, columns))  # cycles per degree of the cosines
    seen = np.empty_like(opponent)
    for channel in range(3):
        spectrum = fft.dctn(opponent[..., channel], type=2)
        spectrum *= transfer(channel, down, across).astype(np.float32)
        seen[..., channel] = fft.idctn(spectrum, type=2, overwrite_x=True)
    return seen


def transfer(channel: int, down: F64, across: F64) -> F64:
    """By how much the blur of a channel (0, 1, 2) scales cosines of these frequencies in cycles per degree, float64 (down, across); 1 at 0."""
    total = sum(weight for weight, _ in BLURS[channel])
    found = np.zeros((len(down), len(across)))
    for weight, spread in BLURS[channel]:
        found += weight / total * np.exp(-((np.pi * spread * down[:, None]) ** 2)) * np.exp(-((np.pi * spread * across) ** 2))
    return found


def cielab(relative: npt.NDArray[np.floating]) -> F32:
    """L*, a*, b* (…, 3) of X, Y, Z (…, 3) relative to white (CIE 15)."""
    f = np.where(relative > LINEAR_BELOW, np.cbrt(relative), relative * relative.dtype.type(841.0 / 108.0) + relative.dtype.type(4.0 / 29.0))
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)], axis=-1).astype(np.float32)


def _mean(values: F32) -> float:
    return float(values.mean(dtype=np.float64))


def _size(picture: F32) -> str:
    return " x ".join(str(n) for n in picture.shape)
