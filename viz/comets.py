"""Particles with trails that fade: where each has been over its last steps, and a small cone that points where it goes."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from viz.segments import SegmentLayer, segment_mesh

if TYPE_CHECKING:
    import pyvista

    from queries.flow import Tracks
    from viz.stage import Stage

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
_SIDES = 6  # of cones
_HEAD = 1 / 9  # of the trail: the length of a cone
_BREADTH = 0.3  # of a cone's length: its radius


class Comets:
    """Particles on a stage. ``tracks``: where they go; ``colors``: uint8 (n, steps + 1, 3), along their ways; ``width`` of trails, pixels."""

    def __init__(self, stage: "Stage", tracks: "Tracks", colors: U8, width: float) -> None:
        self._stage, self._tracks, self._colors = stage, tracks, colors
        self._trails = SegmentLayer(stage, width)
        self._heads: Any = None

    def show(self, age: npt.NDArray[np.integer[Any]], trail: int) -> None:
        """Show each particle at the step ``age`` (n,) of its way, with its last ``trail`` steps; when it is through, its trail fades."""
        last = self._tracks.count.astype(np.int64) - 1
        path, step = self._segments(np.asarray(age, np.int64), last, trail)
        points = self._tracks.points
        ends = np.stack([step, step + 1], axis=1)
        opacity = np.clip(1 - (np.asarray(age, np.int64)[path, None] - ends) / trail, 0, 1) ** 1.5
        self._trails.show(points[path, step], points[path, step + 1], self._colors[path, step], opacity)
        self._show_heads(np.flatnonzero((age <= last) & (age > 0)), np.asarray(age, np.int64), trail)

    def mesh(self, anisotropy: F32, fluence: F32) -> "pyvista.PolyData":
        """All ways as lines; what light is like where each particle starts."""
        last = self._tracks.count.astype(np.int64) - 1
        path, step = self._segments(last, last, int(last.max(initial=1)))
        points = self._tracks.points
        found = segment_mesh(points[path, step], points[path, step + 1])
        found.point_data["travelled"] = np.stack([step, step + 1], axis=1).reshape(-1) * self._tracks.step
        found.cell_data["particle"] = path
        found.cell_data["anisotropy"], found.cell_data["fluence"] = anisotropy[path], fluence[path]
        found.cell_data["color"] = self._colors[path, step]
        return found

    def _segments(self, age: I64, last: I64, trail: int) -> tuple[I64, I64]:
        """The steps that trails consist of: which particle's, and from which position on."""
        first, end = np.maximum(age - trail, 0), np.minimum(age, last)
        count = np.maximum(end - first, 0)
        path = np.repeat(np.arange(len(age)), count)
        step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + first[path]
        return path, step

    def _show_heads(self, particles: I64, age: I64, trail: int) -> None:
        if self._heads is not None:
            self._heads.SetVisibility(bool(len(particles)))
        if not len(particles):
            return
        tips, before = self._tracks.points[particles, age[particles]], self._tracks.points[particles, age[particles] - 1]
        mesh = _cones(tips, tips - before, self._tracks.step * trail * _HEAD)
        mesh.cell_data["color"] = np.repeat(self._colors[particles, age[particles]], 2 * _SIDES, axis=0)
        if self._heads is None:
            self._heads = self._stage.add(mesh, scalars="color", rgb=True, lighting=False)
        else:
            self._heads.mapper.dataset = mesh


def _cones(tips: F64, ways: F64, length: float) -> "pyvista.PolyData":
    """Closed cones with these tips (n, 3), that point along ``ways``."""
    import pyvista

    axis = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    beside = np.where(np.abs(axis[:, :1]) > 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    u = np.cross(beside, axis)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(axis, u)
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    base = tips - length / 2 * axis
    rim = base[:, None] + _BREADTH * length * (np.cos(angle)[:, None] * u[:, None] + np.sin(angle)[:, None] * v[:, None])
    points = np.concatenate([(tips + length / 2 * axis)[:, None], base[:, None], rim], axis=1)
    here, after = 2 + np.arange(_SIDES), 2 + (np.arange(_SIDES) + 1) % _SIDES
    side = np.stack([np.zeros(_SIDES, np.int64), here, after], axis=1)
    bottom = np.stack([np.ones(_SIDES, np.int64), after, here], axis=1)
    faces = np.concatenate([side, bottom]) + (len(points[0]) * np.arange(len(tips)))[:, None, None]
    cells = np.concatenate([np.full((*faces.shape[:2], 1), 3), faces], axis=2)
    return pyvista.PolyData(points.reshape(-1, 3).astype(np.float32), cells.reshape(-1))
