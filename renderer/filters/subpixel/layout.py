"""Display layouts: which primary stands where, in one period of a display (thesis 4.3.4, 4.3.5).

A layout is a grid of positions, of which each holds the center of a subpixel or nothing (a *virtual* position). One dimension is enough for
displays whose subpixels are as high as a pixel: their pattern has a single row, a position is a pixel high, and rows do not influence each other.
"""

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

PRIMARIES = ("R", "G", "B", "W")
INACTIVE = -1  # a position that holds no subpixel

# RGB to Y' C1 C2, the opponent space of the derivation (Eq. 4.2), and RGBW to the same (Eq. 4.12). Columns are primaries.
OPPONENT_RGB: F64 = np.array([[0.23, 0.73, 0.06], [0.20, -0.31, 0.11], [0.23, 0.66, -0.89]])
OPPONENT_RGBW: F64 = np.array([[0.15, 0.47, 0.04, 0.37], [0.13, -0.20, 0.07, 0.0], [0.14, 0.43, -0.57, 0.0]])


@dataclass(frozen=True, eq=False)
class Layout:
    """One period of a display.

    ``pattern``: int64 (rows, columns), the primary at each position, an index into ``primaries`` or ``INACTIVE``. ``cells``: how many positions
    a pixel is wide and high. ``origin``: where the center of the first position lies, right of and below the corner of a pixel, in positions.
    ``extent``: width and height of each primary's subpixels, in positions. ``opponent``: float64 (3, primaries), Y' C1 C2 of each primary.

    Raises ValueError where these do not fit together.
    """

    name: str
    primaries: tuple[str, ...]
    pattern: I64
    cells: tuple[int, int]
    origin: tuple[float, float]
    extent: tuple[tuple[int, int], ...]
    opponent: F64

    def __post_init__(self) -> None:
        """Check that the parts fit together."""
        known = range(INACTIVE, len(self.primaries))
        if self.pattern.ndim != 2 or not self.pattern.size or not np.isin(self.pattern, known).all():
            raise ValueError(f"{self.name}: expected a rectangle of primaries {', '.join(self.primaries)} and empty positions")
        missing = [name for i, name in enumerate(self.primaries) if not (self.pattern == i).any()]
        if missing:
            raise ValueError(f"{self.name}: the pattern has no {', '.join(missing)}")
        if self.primaries[:3] != PRIMARIES[:3] or self.primaries not in (PRIMARIES[:3], PRIMARIES):
            raise ValueError(f"{self.name}: expected the primaries R, G, B, and perhaps W, found {', '.join(self.primaries)}")
        rows, columns = self.pattern.shape
        width, height = self.cells
        if width < 1 or height < 1 or columns % width or rows % height:
            raise ValueError(f"{self.name}: a period of {columns} x {rows} positions holds no whole pixels of {width} x {height}")
        if not np.isfinite(self.origin).all():
            raise ValueError(f"{self.name}: expected a finite origin, found {self.origin}")
        if self.opponent.shape != (3, len(self.primaries)) or not np.isfinite(self.opponent).all():
            raise ValueError(f"{self.name}: expected an opponent matrix of 3 rows and {len(self.primaries)} finite columns")
        if len(self.primaries) > 3 and not (self.opponent[0, :3].sum() > 0 and self.opponent[0, 3] > 0):
            raise ValueError(f"{self.name}: expected an opponent matrix in which W has a luminance, and R, G and B together have one")
        if len(self.extent) != len(self.primaries) or min(min(size) for size in self.extent) < 1:
            raise ValueError(f"{self.name}: expected a width and a height of each primary, 1 or more")

    @property
    def one_dimensional(self) -> bool:
        """Whether rows of pixels are alike and each is one position high, so that filters run along them alone."""
        return len(self.pattern) == 1

    @property
    def period(self) -> int:
        """P: how many positions a period has, virtual ones included."""
        return int(self.pattern.size)

    @functools.cached_property
    def active(self) -> I64:
        """The positions that hold a subpixel, int64 (subpixels, 2): row and column in the pattern, in reading order."""
        return np.argwhere(self.pattern != INACTIVE)

    @functools.cached_property
    def active_primaries(self) -> I64:
        """q: the primary of each subpixel of ``active``, int64."""
        return self.pattern[self.active[:, 0], self.active[:, 1]]

    @functools.cached_property
    def spacing(self) -> F64:
        """s_k = P / n_q(k) of each subpixel of ``active``: by how much brighter than its primary's mean a lit position is."""
        counts = np.bincount(self.active_primaries, minlength=len(self.primaries))
        return np.asarray(self.period / counts[self.active_primaries], np.float64)

    @property
    def white_share(self) -> float:
        """κ: the light of W in units of the light of R, G and B together (0.56 for the published matrix); 0 without W."""
        if len(self.primaries) < 4:
            return 0.0
        return float(self.opponent[0, 3] / self.opponent[0, :3].sum())

    def signal(self, rgb: npt.NDArray[np.floating]) -> npt.NDArray[np.floating]:
        """The image signal γ of linear colors, (…, 3): for R, G, B itself, (…, 3); with W, (…, 4).

        What is white in a color, min(R, G, B), is W's; W emits κ of it, so κ of it is taken from R, G and B, which keeps the color. A W that is
        brighter than R, G and B together needs but 1 / κ of it.
        """
        if len(self.primaries) < 4:
            return rgb
        white = rgb.min(axis=-1, keepdims=True) / rgb.dtype.type(max(1.0, self.white_share))
        return np.concatenate([rgb - rgb.dtype.type(self.white_share) * white, white], axis=-1)

    def light(self) -> F64:
        """The linear color that each primary adds where it is on everywhere, float64 (primaries, 3)."""
        return np.vstack([np.eye(3), np.full((len(self.primaries) - 3, 3), self.white_share)])


def stripe(name: str, order: str) -> Layout:
    """A stripe of three primaries, each one position wide, such as ``RGB``."""
    pattern = np.array([[PRIMARIES.index(letter) for letter in order]])
    return Layout(name, PRIMARIES[:3], pattern, (3, 1), (0.5, 0.5), ((1, 1),) * 3, OPPONENT_RGB)
