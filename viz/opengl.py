"""Off-screen OpenGL: which kind of window this machine can make, and what to install where it can make none.

VTK loads its libraries when the first window is made, complains on the terminal about each kind that is not there, and crashes where none is.
So the kinds are tried here first, without a sound.
"""

import contextlib
import ctypes
import functools
import os
import sys
from collections.abc import Iterator
from typing import Any

from viz.errors import DrawingError

_CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"  # the environment's word for it
_WINDOWS = {
    "vtkEGLRenderWindow": ("libEGL.so.1", "libEGL.so"),
    "vtkOSOpenGLRenderWindow": ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"),
}
_ADVICE = (
    "install the packages `libegl1` and `libgl1-mesa-dri` (Debian, Ubuntu), or `mesa-libEGL` and `mesa-dri-drivers` (Fedora, Red Hat), "
    "which draw in software where there is no graphics card"
)


def new_plotter(size: tuple[int, int]) -> Any:
    """An off-screen ``pyvista.Plotter`` without lights. Raises ``DrawingError`` where this machine can draw nothing."""
    window = off_screen_window()
    import pyvista

    with _chosen(window):
        plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="none")
    plotter.disable_anti_aliasing()
    return plotter


@functools.cache
def off_screen_window() -> str | None:
    """The kind of window that needs no screen here; none: VTK's own choice. Raises ``DrawingError`` where there is none."""
    if not sys.platform.startswith("linux"):
        return None
    complaints = []
    for window, libraries in _WINDOWS.items():
        complaint = _missing(libraries) or _failing(window, libraries[0])
        if complaint is None:
            return window
        complaints.append(complaint)
    raise DrawingError(f"no picture can be drawn on this machine, since {' and '.join(complaints)}: {_ADVICE}")


def renderer_name(plotter: Any) -> str:
    """Who draws: OpenGL's renderer and version, as in "llvmpipe (LLVM 15.0.6, 256 bits), 4.5 (Core Profile) Mesa 22.3.6"."""
    plotter.ren_win.Render()
    lines = dict(line.split(":", 1) for line in plotter.ren_win.ReportCapabilities().splitlines() if ":" in line)
    return ", ".join(lines.get(f"OpenGL {what} string", "unknown").strip() for what in ("renderer", "version"))


def _missing(libraries: tuple[str, ...]) -> str | None:
    """What is wrong where none of these libraries can be loaded."""
    for library in libraries:
        with contextlib.suppress(OSError):
            ctypes.CDLL(library)
            return None
    return f"{libraries[0]} cannot be loaded"


def _failing(window: str, library: str) -> str | None:
    """What is wrong where such a window cannot draw."""
    from vtkmodules import vtkRenderingOpenGL2

    with _silent():
        supported = getattr(vtkRenderingOpenGL2, window)().SupportsOpenGL()
    return None if supported else f"{library} finds nothing to draw with"


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """VTK keeps its complaints to itself."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)


@contextlib.contextmanager
def _chosen(window: str | None) -> Iterator[None]:
    """VTK makes windows of this kind; later ones, which may be meant for a screen, are its own choice again."""
    before = os.environ.get(_CHOICE)
    if window is not None:
        os.environ[_CHOICE] = window
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(_CHOICE, None)
        else:
            os.environ[_CHOICE] = before
