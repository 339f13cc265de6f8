"""What an analysis of subpixel filters finds: for each display the kernels, the filtered image and what it lost, and how the methods compare."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.subpixel.description import SubpixelDescription
from queries.subpixel.reasons import Reason
from renderer.filters.subpixel.derive import Kernels
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.windowed_sinc import Fit

F32 = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Display:
    """One display: its kernels and their analytic fits, one for each subpixel, and the input as it shows it.

    ``lattice``: float32 (rows, columns), unclipped drive of every position by the chosen method; ``standard``: the same by the box of each pixel.
    ``clipped``: the share of subpixels of ``lattice`` outside [0, 1].
    """

    layout: Layout
    kernels: Kernels
    fits: tuple[Fit, ...]
    lattice: F32
    standard: F32
    clipped: float


@dataclass(frozen=True, eq=False)
class Analysis:
    """The whole of it. ``source``: what was shown; ``size``: width and height of the displays, pixels; ``seconds``: of each stage, by name.

    ``scores`` (``queries.subpixel.evaluate``), ``methods`` by layout and ``layouts`` (``queries.subpixel.preference``), and ``reasons``, why
    the optimal filter loses where it does, are there where methods were compared.
    """

    name: str
    source: Literal["run", "image"]
    description: SubpixelDescription
    displays: tuple[Display, ...]
    size: tuple[int, int]
    scores: pa.Table | None = None
    methods: Mapping[str, pa.Table] = field(default_factory=dict)
    layouts: pa.Table | None = None
    reasons: tuple[Reason, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
