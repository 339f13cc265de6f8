"""Hair: curved strands far thinner than a pixel, lit so that they shine in bands."""

import numpy as np

from queries.subpixel.targets.base import F32, F64, Raster, generator, paint, ribbons

SEED = 3
_STRANDS = 0.075  # for each pixel
_LENGTH = 60.0  # pixels
_POINTS = 44
_COLORS: F64 = np.array([[0.06, 0.03, 0.015], [0.17, 0.08, 0.035], [0.38, 0.15, 0.05], [0.62, 0.40, 0.17], [0.88, 0.74, 0.48], [0.55, 0.53, 0.52]])
_SHARES = (0.2, 0.22, 0.18, 0.18, 0.14, 0.08)


def hair(raster: Raster) -> F32:
    """Strands that follow a common flow, with curls of their own, from back to front."""
    rng = generator(SEED, raster)
    count = max(100, round(_STRANDS * raster.area))
    path = _paths(rng, raster, count)
    t = np.linspace(0.0, 1.0, _POINTS)
    width = (0.2 + 0.7 * rng.random((count, 1)) ** 1.6) * np.minimum(1.0, 8.0 * np.minimum(t + 0.03, 1.02 - t))

    # Dark behind, and a shine where strands turn to the light
    depth = np.linspace(0.0, 1.0, count)[:, None]
    pieces = 0.5 * (path[:, 1:] + path[:, :-1])
    shine = np.cos(0.115 * pieces[..., 1] - 0.03 * pieces[..., 0] + rng.normal(0.0, 0.45, (count, 1))) ** 8
    turn = np.diff(path, axis=1)
    lit = (0.25 + 0.75 * depth) * (0.55 + 0.45 * np.abs(turn[..., 1]) / np.maximum(np.linalg.norm(turn, axis=2), 1e-12))
    base = _COLORS[rng.choice(len(_COLORS), count, p=_SHARES)] * rng.uniform(0.7, 1.3, (count, 1)) * rng.uniform(0.92, 1.08, (count, 3))
    colors = base[:, None] * lit[..., None] + (0.4 * depth * shine)[..., None] * (0.35 + 0.65 * base[:, None])
    return paint(raster, ribbons(path, width), np.clip(colors, 0.0, 1.0).reshape(-1, 3), lambda x, y: _background(raster, x, y))


def _paths(rng: np.random.Generator, raster: Raster, count: int) -> F64:
    """Where the strands run, (count, points, 2), pixels."""
    position = rng.uniform((-0.1, -0.6), (1.1, 0.9), (count, 2)) * (raster.width, raster.height)
    position[:, 1] = np.maximum(position[:, 1], -0.5 * _LENGTH)
    stray = np.where(rng.random(count) < 0.12, rng.normal(0.0, 0.9, count), rng.normal(0.0, 0.1, count))
    curl, pace, phase = rng.uniform(0.05, 0.4, count), rng.uniform(0.1, 0.5, count), rng.uniform(0.0, 2.0 * np.pi, count)
    step = _LENGTH / (_POINTS - 1) * rng.uniform(0.6, 1.3, count)
    path = [position]
    for i in range(_POINTS - 1):
        x, y = path[-1].T
        flow = 1.25 + 0.55 * np.sin(0.045 * x + 0.03 * y) + 0.25 * np.sin(0.11 * y - 0.06 * x + 1.0)
        angle = flow + stray + curl * np.sin(pace * (i * 28.0 / _POINTS) + phase)
        path.append(path[-1] + step[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.stack(path, axis=1)


def _background(raster: Raster, x: F64, y: F64) -> F64:
    """From dark on the left to light on the right, a little warmer below."""
    light = 0.02 + 0.88 * (x / raster.width) ** 2.2 + 0.0 * y
    warm = 0.08 * y / raster.height
    return np.stack([light, light * (1.0 - 0.5 * warm), light * (1.0 - warm)], axis=-1)
