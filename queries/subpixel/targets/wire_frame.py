"""A wire frame: thin straight lines in all directions, ever closer toward a horizon."""

import numpy as np

from queries.subpixel.targets.base import F32, F64, Raster, paint, ribbons

_PLANE_ACROSS, _PLANE_AWAY = 56, 44  # lines, at 72 rows of pixels
_TORUS = (44, 18)  # points around, and around the tube, at as many
_EYE = 1.5  # above the plane
_BACKGROUND: F64 = np.array([0.006, 0.008, 0.014])


def wire_frame(raster: Raster) -> F32:
    """A rolling plane in perspective and a torus above it; lines that are near are drawn over those that are far."""
    parts = [_plane(raster), _torus(raster)]
    points = np.concatenate([segment for segment, _ in parts])
    colors = np.concatenate([color for _, color in parts])

    # Project: what is as tall as it is far away fills 0.95 of the height; a segment that reaches behind the eye is left out
    points, colors = points[points[..., 2].min(axis=1) > 0.3], colors[points[..., 2].min(axis=1) > 0.3]
    away = points[..., 2:]
    scale = 0.95 * raster.height
    flat = np.array([0.5 * raster.width, 0.36 * raster.height]) + scale * points[..., :2] * (1.0, -1.0) / away
    order = np.argsort(-away.mean(axis=(1, 2)), kind="stable")
    near = np.clip(2.2 / away[order][..., 0], 0.0, 1.0)
    faded = colors[order] * np.clip(0.35 + near.mean(axis=1, keepdims=True), 0.0, 1.0)
    width = 0.2 + 0.3 * near

    # Square ends, so that lines close at corners
    along = np.diff(flat[order], axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-9)
    ends = flat[order] + along * np.array([[-0.5], [0.5]]) * width[..., None]
    return paint(raster, ribbons(ends, width), faded, lambda x, y: _night(raster, x, y))


def _plane(raster: Raster) -> tuple[F64, F64]:
    """Segments (count, 2, 3) of a plane with waves on it, x to the right, y up, z away from the eye, and their colors."""
    far = 22.0
    half = max(6.0, 4.0 * raster.width / raster.height)
    x = np.linspace(-half, half, round(_PLANE_ACROSS * half / 6.0 * _detail(raster)) + 1)
    z = 0.9 * (far / 0.9) ** np.linspace(0.0, 1.0, round(_PLANE_AWAY * _detail(raster)))
    grid_x, grid_z = np.meshgrid(x, z)
    grid_y = -_EYE + 0.16 * np.sin(1.3 * grid_x + 0.6) * np.cos(1.1 * grid_z)
    grid = np.stack([grid_x, grid_y, grid_z], axis=2)
    lines = [_segments(grid, 0), _segments(grid, 1)]
    colors = [np.tile([0.95, 0.95, 0.95], (len(lines[0]), 1)), np.tile([0.10, 0.65, 0.95], (len(lines[1]), 1))]
    return np.concatenate(lines), np.concatenate(colors)


def _torus(raster: Raster) -> tuple[F64, F64]:
    """Segments (count, 2, 3) of a torus, and their colors: a circle of hues."""
    around, tube = (np.linspace(0.0, 2.0 * np.pi, round(n * _detail(raster)) + 1) for n in _TORUS)
    u, v = np.meshgrid(around, tube)
    ring = 1.0 + 0.42 * np.cos(v)
    x, y, z = ring * np.cos(u), 0.42 * np.sin(v), ring * np.sin(u)
    tilt = 0.85
    y, z = np.cos(tilt) * y + np.sin(tilt) * z, -np.sin(tilt) * y + np.cos(tilt) * z
    grid = np.stack([x, y - 0.05, z + 3.4], axis=2)
    lines = np.concatenate([_segments(grid, 0), _segments(grid, 1)])
    hue = np.concatenate([_middle(u, 0), _middle(u, 1)])
    colors = 0.5 + 0.5 * np.cos(hue[:, None] - np.array([0.0, 2.0, 4.0]) * np.pi / 3.0)
    colors[len(_middle(u, 0)) :] = 0.25 * colors[len(_middle(u, 0)) :] + 0.75
    return lines, colors


def _detail(raster: Raster) -> float:
    """How many times as many lines fit as at 72 rows of pixels."""
    return max(0.5, raster.height / 72)


def _segments(grid: F64, axis: int) -> F64:
    """The segments between neighbors of a grid (rows, columns, 3) along an axis, (count, 2, 3)."""
    first, second = (grid[:-1], grid[1:]) if axis == 0 else (grid[:, :-1], grid[:, 1:])
    return np.stack([first.reshape(-1, 3), second.reshape(-1, 3)], axis=1)


def _middle(values: F64, axis: int) -> F64:
    """The first of both values of every segment."""
    return (values[:-1] if axis == 0 else values[:, :-1]).reshape(-1)


def _night(raster: Raster, x: F64, y: F64) -> F64:
    """Near black, and a little lighter at the lower edge."""
    light = 1.0 + 2.0 * y / raster.height + 0.0 * x
    return light[..., None] * _BACKGROUND
