"""Curves as meshes that share memory with their arrays."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pyvista
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import VTK_INT, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]
numpy_to_vtk: Any = numpy_support.numpy_to_vtk
COLOR = "color"  # the points' colors, as seen


def polyline_mesh(curves: F32, colors: U8) -> pyvista.PolyData:
    """One line for each curve (s, points, 3); ``colors`` uint8 (s, points, 3 or 4), as the points' array ``color``. Nothing is copied.

    Cells are counted in 32 bits: at most 2^31 points.
    """
    count, points = curves.shape[:2]
    mesh = pyvista.PolyData()
    held = vtkPoints()
    held.SetData(numpy_to_vtk(curves.reshape(-1, 3)))
    mesh.SetPoints(held)
    cells = vtkCellArray()
    offsets = np.arange(0, count * points + 1, points, dtype=np.int32)
    cells.SetData(numpy_to_vtk(offsets, array_type=VTK_INT), numpy_to_vtk(np.arange(count * points, dtype=np.int32), array_type=VTK_INT))
    mesh.SetLines(cells)
    array = numpy_to_vtk(colors.reshape(-1, colors.shape[2]))
    array.SetName(COLOR)
    mesh.GetPointData().AddArray(array)
    return mesh


def recolored(mesh: Any) -> None:
    """Tell VTK that the array behind ``color`` has changed."""
    mesh.GetPointData().GetArray(COLOR).Modified()
    mesh.Modified()
