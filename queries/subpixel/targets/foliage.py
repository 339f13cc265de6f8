"""Foliage: many small shapes of high contrast against the sky."""

import numpy as np

from queries.subpixel.targets.base import F32, F64, Raster, generator, paint, ribbons

SEED = 5
_LEAVES = 0.4  # for each pixel
_BRANCHES, _BLADES = 0.09, 11.0  # for each column of pixels
_TWIGS = 0.19  # of each branch, for each row of pixels
_POINTS = 16  # of branches and twigs
_LARGE = 240  # pixels: branches and blades are as long as the display is high, up to this
_HALF_LEAF: F64 = np.array([[0.0, 0.0], [0.22, 0.75], [0.5, 1.0], [0.8, 0.55], [1.0, 0.0]])  # along, aside
_GREENS: F64 = np.array([[0.05, 0.16, 0.02], [0.10, 0.30, 0.03], [0.22, 0.46, 0.06], [0.40, 0.55, 0.10], [0.46, 0.30, 0.06], [0.24, 0.10, 0.03]])
_SHARES = (0.28, 0.3, 0.2, 0.1, 0.07, 0.05)


def foliage(raster: Raster) -> F32:
    """Twigs and leaves that hang into the sky, and grass below."""
    rng = generator(SEED, raster)
    twigs, thickness = _twigs(rng, raster)
    bark = np.array([0.11, 0.065, 0.035]) * rng.uniform(0.4, 1.9, (len(twigs), 1))
    parts = [(ribbons(twigs, thickness), np.repeat(bark, twigs.shape[1] - 1, axis=0)), _leaves(rng, raster, twigs), _grass(rng, raster)]
    polygons = np.concatenate([np.concatenate([shape, np.repeat(shape[:, -1:], 5 - shape.shape[1], axis=1)], axis=1) for shape, _ in parts])
    colors = np.concatenate([color for _, color in parts])
    return paint(raster, polygons, np.clip(colors, 0.0, 1.0), lambda x, y: _sky(raster, x, y))


def _twigs(rng: np.random.Generator, raster: Raster) -> tuple[F64, F64]:
    """Where branches from the upper edge and the twigs on them run, (twigs, points, 2), and how thick they are, (twigs, points)."""
    tall = min(raster.height, _LARGE)
    branches, each = max(3, round(_BRANCHES * raster.width)), max(4, round(_TWIGS * tall))
    start = np.stack([(np.arange(branches) + rng.random(branches)) / branches * raster.width, np.full(branches, -2.0)], axis=1)
    path = _bent(rng, start, rng.uniform(0.5, 2.64, (branches, 1)), rng.uniform(0.025, 0.05, (branches, 1)) * tall)
    thickness = rng.uniform(0.7, 1.5, (branches, 1)) * np.linspace(1.0, 0.35, _POINTS)
    twigs = branches * each
    whose, where = np.repeat(np.arange(branches), each), rng.integers(1, _POINTS, twigs)
    heading = path[whose, where] - path[whose, where - 1]
    angle = np.arctan2(heading[:, 1], heading[:, 0]) + rng.choice([-1.0, 1.0], twigs) * rng.uniform(0.4, 1.1, twigs)
    fine = _bent(rng, path[whose, where], angle[:, None], rng.uniform(0.5, 1.5, (twigs, 1)))
    thin = np.minimum(thickness[whose, where], rng.uniform(0.25, 0.7, twigs))[:, None] * np.linspace(1.0, 0.3, _POINTS)
    return np.concatenate([path, fine]), np.concatenate([thickness, thin])


def _bent(rng: np.random.Generator, start: F64, angle: F64, step: F64) -> F64:
    """Curves from (curves, 2) that start out at an angle, (curves, 1), and wander: (curves, points, 2)."""
    angles = angle + np.cumsum(rng.normal(0.0, 0.17, (len(start), _POINTS - 1)), axis=1)
    moves = step[..., None] * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    return np.asarray(start[:, None] + np.concatenate([np.zeros((len(start), 1, 2)), np.cumsum(moves, axis=1)], axis=1))


def _leaves(rng: np.random.Generator, raster: Raster, twigs: F64) -> tuple[F64, F64]:
    """Leaves on twigs, each of a bright and a dim half, (halves, 5, 2), and their colors."""
    count = round(_LEAVES * raster.area)
    whose, where = rng.integers(0, len(twigs), count), rng.integers(2, _POINTS, count)
    stem = twigs[whose, where] + rng.normal(0.0, 0.5, (count, 2))
    heading = twigs[whose, where] - twigs[whose, where - 1]
    angle = np.arctan2(heading[:, 1], heading[:, 0]) + rng.normal(0.0, 1.0, count)
    length = rng.uniform(0.7, 3.6, count)
    aside = length * rng.uniform(0.1, 0.32, count)
    along, across = np.stack([np.cos(angle), np.sin(angle)], axis=1), np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    halves = [
        stem[:, None] + _HALF_LEAF[:, :1] * (length[:, None] * along)[:, None] + side * _HALF_LEAF[:, 1:] * (aside[:, None] * across)[:, None]
        for side in (1.0, -1.0)
    ]

    # Lit from above on the right; those behind are in the shade of others
    depth = np.linspace(0.25, 1.0, count)
    green = _GREENS[rng.choice(len(_GREENS), count, p=_SHARES)] * rng.uniform(0.6, 1.4, (count, 1)) * depth[:, None]
    facing = 0.5 + 0.5 * (across @ np.array([0.6, -0.8]))
    colors = np.stack([green * (0.55 + 1.1 * facing[:, None]), green * (1.65 - 1.1 * facing[:, None])], axis=1)
    return np.stack(halves, axis=1).reshape(-1, 5, 2), colors.reshape(-1, 3)


def _grass(rng: np.random.Generator, raster: Raster) -> tuple[F64, F64]:
    """Blades that bend from the lower edge, (quadrilaterals, 4, 2), and their colors."""
    count, points = round(_BLADES * raster.width), 11
    depth = np.linspace(0.0, 1.0, count)  # from back to front
    root = np.stack([rng.uniform(-0.05, 1.05, count) * raster.width, raster.height * (0.98 + 0.08 * depth)], axis=1)
    t = np.linspace(0.0, 1.0, points)
    tall = rng.uniform(0.1, 0.42, count)[:, None] * min(raster.height, _LARGE)
    lean = rng.normal(0.0, 0.35, count)[:, None] * tall
    path = np.stack([root[:, :1] + lean * t**2, root[:, 1:] - tall * (t - 0.25 * np.abs(lean / tall) * t**3)], axis=2)
    width = rng.uniform(0.25, 1.1, (count, 1)) * (0.4 + 0.6 * depth[:, None]) * (1.0 - 0.92 * t**1.5)
    dry = rng.random((count, 1)) < 0.12
    color = np.where(dry, np.array([0.55, 0.42, 0.16]), np.array([0.16, 0.36, 0.05])) * rng.uniform(0.35, 1.5, (count, 1))
    shade = (0.35 + 0.65 * depth[:, None]) * (0.25 + t[1:])
    return ribbons(path, width), (color[:, None] * shade[..., None]).reshape(-1, 3)


def _sky(raster: Raster, x: F64, y: F64) -> F64:
    """Blue above, white near the horizon, and below, between the roots, dark."""
    haze = np.clip(y / raster.height, 0.0, 1.0) + 0.12 * x / raster.width
    sky = np.stack([0.30 + 0.62 * haze, 0.50 + 0.42 * haze, 0.86 + 0.10 * haze], axis=-1)
    ground = np.clip((y / raster.height - 0.86) / 0.08, 0.0, 1.0)[..., None]
    return np.asarray(sky * (1.0 - ground) + ground * np.array([0.02, 0.04, 0.01]))
