"""Filters of pixels and subpixels as the tables that the elliptical weighted average reads, and scenes that have one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from renderer.filters.reconstruction import ReconstructionFilter
from renderer.filters.subpixel.filter import SubpixelFilter
from renderer.filters.subpixel.layout import PRIMARIES, Layout
from renderer.scene.arrays import Scene, SceneArrays
from renderer.textures.base import BITMAP, Ewa, Memory, Textures
from renderer.textures.pyramid import pyramid

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

DEVIATION = 0.5  # of the Gaussian of a pixel, pixels
GAUSSIAN_REACH = 3 * DEVIATION  # where it ends, lowered so that it ends at zero
PIXEL_STEP = 1 / 4  # how large a cell of the texture may be, pixels: half the Gaussian's deviation
SUBPIXEL_STEP = 1 / 5  # rather more than half a subpixel of a stripe
ENTRIES = 1024  # of a table
PARTS = 16  # of an entry, for its integral
MOST_SLOTS = 1 << 22  # pixels that a tracer remembers
CHANNELS = 3


# --- tables -------------------------------------------------------------------------------------------------------


def running_integral(filter: ReconstructionFilter, reach: float) -> F32:
    """The integral of a filter from 0 to x, for x at ``ENTRIES`` + 1 distances up to ``reach`` pixels."""
    x: F64 = (np.arange(ENTRIES * PARTS, dtype=np.float64) + 0.5) * (reach / (ENTRIES * PARTS))
    pieces = np.where(x <= filter.radius, filter.weight(x), 0.0).reshape(ENTRIES, PARTS).sum(axis=1) * (reach / (ENTRIES * PARTS))
    return np.concatenate([[0.0], np.cumsum(pieces)]).astype(np.float32)


def by_distance(filter: ReconstructionFilter, reach: float) -> F32:
    """A filter at ``ENTRIES`` + 1 distances up to ``reach`` pixels; zero from its radius on, as tables go on with their last entry."""
    x = np.linspace(0.0, reach, ENTRIES + 1)
    return np.where(x < filter.radius, filter.weight(x), 0.0).astype(np.float32)


def distinct(tables: Sequence[F32]) -> tuple[F32, npt.NDArray[np.int32]]:
    """Equal tables once, (filters, entries), and which of them each was, int32."""
    found, which = np.unique(np.stack(tables), axis=0, return_inverse=True)
    return found, which.reshape(-1).astype(np.int32)


def gaussian() -> ReconstructionFilter:
    """The filter of a pixel without a display: standard deviation ``DEVIATION``, up to ``GAUSSIAN_REACH``, round."""
    end = np.exp(-0.5 * (GAUSSIAN_REACH / DEVIATION) ** 2)

    def weight(x: F64) -> F64:
        return np.asarray(np.maximum(0.0, np.exp(-0.5 * (x / DEVIATION) ** 2) - end), np.float64)

    return ReconstructionFilter("gaussian", GAUSSIAN_REACH, weight)


# --- what the kernels read ----------------------------------------------------------------------------------------


def ewa_filter(textures: Textures, subpixels: SubpixelFilter | None = None) -> Ewa:
    """The filter of a scene's bitmaps: a Gaussian of the pixel, or where ``subpixels`` are given the three filters of each pixel's subpixels.

    Raises ValueError for displays whose pixels are no triples of R, G and B.
    """
    levels = pyramid(textures)
    if subpixels is None:
        one = gaussian()
        table, first = by_distance(one, one.radius)[None], np.zeros((1, 1, CHANNELS), np.int32)
        reach = np.array([1.0, 1.0], np.float32) * np.float32(one.radius)
        return Ewa(table, None, reach, np.concatenate([-reach, reach]), None, first, first, np.float32(PIXEL_STEP), levels, None)

    # Each filter once, and where in a period which of them stands
    which = triples(subpixels.layout)
    rows, columns, _ = which.shape
    pixel = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)[:, :, None, :] + 0.5
    centers = subpixels.centers()[which] - pixel
    reach_x, reach_y = subpixels.radius
    low, high = centers.reshape(-1, 2).min(axis=0), centers.reshape(-1, 2).max(axis=0)
    if subpixels.down is None:
        across, of_across = distinct([by_distance(one, reach_x) for one in subpixels.across])
        down, of_down = None, of_across
    else:
        across, of_across = distinct([running_integral(one, reach_x) for one in subpixels.across])
        down, of_down = distinct([running_integral(one, reach_y) for one in subpixels.down])
    return Ewa(
        across,
        down,
        np.array([reach_x, reach_y], np.float32),
        np.array([low[0] - reach_x, low[1] - reach_y, high[0] + reach_x, high[1] + reach_y], np.float32),
        centers.astype(np.float32),
        of_across[which],
        of_down[which],
        np.float32(SUBPIXEL_STEP),
        levels,
        None,
    )


def triples(layout: Layout) -> I64:
    """Which subpixel of ``layout.active`` is R, G and B of each pixel of a period, int64 (rows, columns, 3).

    Raises ValueError where a pixel is no such triple: a pixel of the film has three values, one for each.
    """
    instead = "filter the run's samples for it instead (`analysis: {subpixel: …}`), with the texture filter 'point'"
    if len(layout.primaries) > CHANNELS:
        raise ValueError(f"the display {layout.name!r} has white subpixels, for which a film of R, G and B has no value: {instead}")
    rows, columns = layout.pattern.shape
    cells = np.array(layout.cells)
    which = np.full((rows // cells[1], columns // cells[0], CHANNELS), -1, np.int64)
    count = np.zeros(which.shape, np.int64)
    places = np.floor((layout.active[:, ::-1] + np.array(layout.origin)) / cells).astype(np.int64)
    for i, ((x, y), primary) in enumerate(zip(places, layout.active_primaries, strict=True)):
        which[y, x, primary] = i
        count[y, x, primary] += 1
    wrong = np.argwhere((count != 1).any(axis=-1))
    if len(wrong):
        y, x = wrong[0]
        found = ", ".join(f"{n} {PRIMARIES[i]}" for i, n in enumerate(count[y, x]) if n)
        raise ValueError(f"the display {layout.name!r} has a pixel of {found}, but a pixel of the film has one value each for R, G and B: {instead}")
    return which


# --- scenes -------------------------------------------------------------------------------------------------------


def with_ewa(scene: Scene, subpixels: SubpixelFilter | None = None) -> Scene:
    """The scene with ``ewa_filter`` of its bitmaps; a scene without bitmaps is left as it is, with a warning.

    Raises ValueError as ``ewa_filter`` does.
    """
    textures = scene.arrays.textures
    if subpixels is not None:
        triples(subpixels.layout)
    if textures is None or not (textures.kind == BITMAP).any():
        note = "the texture filter 'ewa' changes nothing: the scene has no bitmaps on its surfaces"
        return replace(scene, warnings=(*scene.warnings, note))
    return replace(scene, arrays=scene.arrays._replace(ewa=ewa_filter(textures, subpixels)))


def without_ewa(scene: Scene) -> Scene:
    """The scene with bitmaps that are read at points."""
    return replace(scene, arrays=scene.arrays._replace(ewa=None))


def with_memory(arrays: SceneArrays) -> SceneArrays:
    """The same arrays with a memory for one thread: with a pinhole, all samples of a pixel that meet a triangle have one color.

    Its pages are the system's until a pixel that shows a bitmap is written to: 28 bytes for each of them.
    """
    sensor = arrays.sensor
    if arrays.ewa is None or sensor.lens_radius is not None:
        return arrays
    slots = min(int(sensor.width) * int(sensor.height), MOST_SLOTS)
    memory = Memory(np.int64(sensor.width), np.zeros((slots, 2), np.int64), np.zeros((slots, CHANNELS), np.float32))
    return arrays._replace(ewa=arrays.ewa._replace(memory=memory))
