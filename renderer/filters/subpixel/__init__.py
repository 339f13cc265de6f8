"""Subpixel filters: layouts of displays, what the eye sees of errors, and the kernels that make errors least (thesis chapter 4)."""

from renderer.filters.subpixel.derive import Kernels, derive
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import Layout
from renderer.filters.subpixel.methods import METHODS, TITLES, subpixel_filter
from renderer.filters.subpixel.sensitivity import Sensitivity
from renderer.filters.subpixel.viewing import Viewing
from renderer.filters.subpixel.windowed_sinc import Fit, fit, windowed_sinc

__all__ = [
    "METHODS",
    "TITLES",
    "Fit",
    "Kernels",
    "Layout",
    "Sensitivity",
    "SubpixelFilter",
    "Viewing",
    "derive",
    "fit",
    "subpixel_filter",
    "windowed_sinc",
]
