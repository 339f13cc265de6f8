"""Displays that tests draw figures of, and how they look at what was drawn."""

import functools
import pathlib

import numpy as np
import numpy.typing as npt
from PIL import Image

from queries.subpixel.analysis import Display
from queries.subpixel.description import SubpixelDescription
from renderer.filters.subpixel.derive import derive
from renderer.filters.subpixel.windowed_sinc import fit

DESCRIPTION = SubpixelDescription(layouts=["rgb_stripe", "rgbg", "rgbw"])
NEAR = DESCRIPTION.model_copy(update={"distance": 23.0})


@functools.cache
def display(name: str) -> Display:
    """A display with a random picture on 32 x 24 pixels, beside the same a little blurred."""
    layout = DESCRIPTION.displays()[name]
    kernels = derive(layout, DESCRIPTION.viewing, DESCRIPTION.sensitivity.sensitivity())
    random = np.random.default_rng(5)
    lattice = random.random((24 * layout.cells[1], 32 * layout.cells[0]), np.float32)
    standard = np.asarray(0.9 * lattice + 0.05, np.float32)
    return Display(layout, kernels, fit(kernels), lattice, standard, 0.25)


def pixels(file: pathlib.Path) -> npt.NDArray[np.uint8]:
    return np.asarray(Image.open(file).convert("RGB"))


def has_color(picture: npt.NDArray[np.uint8], color: str) -> int:
    """How many pixels have a color, #rrggbb."""
    wanted = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)])
    return int((np.abs(picture.astype(int) - wanted).max(axis=2) <= 2).sum())
