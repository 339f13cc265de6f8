"""Many straight segments on a stage, with colors that fade along them, swapped from frame to frame."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pyvista

    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
U8 = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.floating[Any]]


class SegmentLayer:
    """Lines on a stage, replaced by every ``show``. Colors are not shaded: they mean something. ``width``: pixels."""

    def __init__(self, stage: "Stage", width: float) -> None:
        self._stage, self._width = stage, width
        self._actor: Any = None

    def show(self, begin: Floats, end: Floats, colors: U8, opacity: Floats) -> None:
        """Show segments (s, 3): ``colors`` uint8 (s, 3) sRGB, ``opacity`` (s, 2), 0 … 1, at each one's two ends."""
        if not len(begin):
            if self._actor is not None:
                self._actor.SetVisibility(False)
            return
        mesh = segment_mesh(begin, end)
        rgba = np.empty((2 * len(begin), 4), np.uint8)
        rgba[:, :3] = np.repeat(colors, 2, axis=0)
        rgba[:, 3] = np.rint(255 * np.clip(opacity, 0, 1)).reshape(-1)
        mesh.point_data["color"] = rgba
        if self._actor is None:
            self._actor = self._stage.add(mesh, scalars="color", rgba=True, lighting=False, line_width=self._width, show_scalar_bar=False)
            self._actor.ForceTranslucentOn()  # else the first frame would decide for all whether there is any opacity
        else:
            self._actor.mapper.dataset = mesh
            self._actor.SetVisibility(True)


def segment_mesh(begin: Floats, end: Floats) -> "pyvista.PolyData":
    """Segments (s, 3) as lines of two points each."""
    import pyvista

    count = len(begin)
    points = np.stack([begin, end], axis=1).reshape(-1, 3).astype(np.float32)
    lines = np.column_stack([np.full(count, 2), np.arange(2 * count).reshape(-1, 2)])
    return pyvista.PolyData(points, lines=lines.reshape(-1))
