"""A volume of colored, translucent matter on a stage, cast by rays on the processor."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from queries.voxels import Grid
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]
_UNIT = 0.1  # of the longest side: the thickness that opacities are given for
_STEPS = 2  # samples of a ray within a voxel
# VTK's caster leaps over blocks of voxels that hide nothing, and then loses light on the rays that did: no voxel hides nothing
_FAINTEST = 1  # of 255
_HAZE = 0.002  # what that hides, along a tenth of the longest side: nobody sees it


def add_volume(stage: "Stage", grid: "Grid", colors: U8, strength: F32, opacity: float) -> Any:
    """Add a volume to a stage; returns its actor.

    ``colors``: uint8 (nx, ny, nz, 3), sRGB, at the voxels' centers; ``strength``: float32 (nx, ny, nz), 0 … 1. Matter of strength 1 hides the share
    ``opacity`` of what is behind a tenth of the grid's longest side of it.

    The mapper is VTK's for the processor, told to take as many samples each time (left alone it adapts to how long a picture takes).
    """
    from pyvista.plotting.mapper import FixedPointVolumeRayCastMapper
    from pyvista.plotting.volume import Volume
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkVolumeProperty

    from viz.stage import OVERSAMPLING

    mapper = FixedPointVolumeRayCastMapper()
    mapper.dataset = _image(grid, colors, strength)
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetSampleDistance(float(grid.cell.min()) / _STEPS)
    mapper.SetImageSampleDistance(float(stage.oversampling or OVERSAMPLING))  # one ray for each pixel of the picture

    thickness = vtkPiecewiseFunction()
    thickness.AddPoint(_FAINTEST, _HAZE)
    thickness.AddPoint(255, min(opacity, 0.999))
    look = vtkVolumeProperty()
    look.IndependentComponentsOff()  # red, green, blue, strength
    look.SetScalarOpacity(thickness)
    look.SetScalarOpacityUnitDistance(_UNIT * float((grid.cell * grid.shape).max()))
    look.SetInterpolationTypeToLinear()
    look.ShadeOff()

    volume: Any = Volume()  # type: ignore[no-untyped-call]
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    stage.plotter.renderer.AddVolume(volume)
    return volume


def _image(grid: "Grid", colors: U8, strength: F32) -> Any:
    """The voxels' centers as VTK's image, with one more beyond each face, of no strength, so that the volume ends where the grid does."""
    import pyvista

    shape = np.array(grid.shape)
    values = np.zeros((*(shape + 2), 4), np.uint8)
    inside = values[1:-1, 1:-1, 1:-1]
    inside[..., :3], inside[..., 3] = colors, np.rint(255 * np.clip(strength, 0, 1))
    values[..., 3] = np.maximum(values[..., 3], _FAINTEST)
    for axis in range(3):
        # Colors do not fade at the faces, strengths do
        first, last = (slice(None),) * axis + (0,), (slice(None),) * axis + (-1,)
        second, before = (slice(None),) * axis + (1,), (slice(None),) * axis + (-2,)
        values[first][..., :3], values[last][..., :3] = values[second][..., :3], values[before][..., :3]
    image = pyvista.ImageData(dimensions=tuple((shape + 2).tolist()), spacing=tuple(grid.cell), origin=tuple(np.array(grid.low) - grid.cell / 2))
    image.point_data["color"] = np.ascontiguousarray(values.transpose(2, 1, 0, 3)).reshape(-1, 4)
    return image
