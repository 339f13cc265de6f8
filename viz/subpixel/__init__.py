"""Subpixel filters as people see them: figures of kernels, spectra, methods and displays, each beside what thesis chapter 4 states."""

from typing import TYPE_CHECKING, Any

from viz.subpixel.figure import Agreement, Figure

if TYPE_CHECKING:
    from viz.subpixel.fits import FitRow, fit_rows
    from viz.subpixel.gallery import figures

__all__ = ["Agreement", "Figure", "FitRow", "figures", "fit_rows"]


def __getattr__(name: str) -> Any:
    """What needs the queries is imported when it is asked for."""
    if name in ("FitRow", "fit_rows"):
        from viz.subpixel import fits

        return getattr(fits, name)
    if name == "figures":
        from viz.subpixel.gallery import figures

        return figures
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
