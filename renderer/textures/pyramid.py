"""Bitmaps at falling sizes, so that large footprints cost no more than small ones (williams1983)."""

import numpy as np
import numpy.typing as npt

from renderer.textures.base import BITMAP, Pyramid, Textures

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]


def halved(image: F64, axis: int) -> F64:
    """An image, (height, width, 3), of half as many pixels along an axis, rounded up: each is the mean over the share of the axis that it covers."""
    size = image.shape[axis]
    if size == 1:
        return image
    half = (size + 1) // 2

    # Differences of the running integral, which is linear within a pixel
    lines = np.moveaxis(image, axis, 0)
    integral = np.concatenate([np.zeros((1, *lines.shape[1:])), np.cumsum(lines, axis=0)])
    edges = np.arange(half + 1) * (size / half)
    below = np.minimum(edges.astype(np.int64), size - 1)
    share = (edges - below)[:, None, None]
    at_edges = integral[below] * (1.0 - share) + integral[below + 1] * share
    return np.moveaxis(np.diff(at_edges, axis=0) * (half / size), 0, axis)


def levels_of(image: F32) -> list[F32]:
    """All levels above a bitmap, (height, width, 3), down to a single pixel."""
    levels = []
    current = image.astype(np.float64)
    while max(current.shape[:2]) > 1:
        current = halved(halved(current, 0), 1)
        levels.append(current.astype(np.float32))
    return levels


def pyramid(textures: Textures) -> Pyramid:
    """The levels of all bitmaps of a scene; bitmaps that share their pixels share their levels."""
    bitmaps = np.flatnonzero(textures.kind == BITMAP)
    images: dict[tuple[int, int, int], list[F32]] = {}
    starts: dict[tuple[int, int, int], list[int]] = {}
    total = len(textures.pixels)
    for i in bitmaps:
        first, (width, height) = int(textures.first[i]), map(int, textures.size[i])
        if (first, width, height) not in images:
            made = levels_of(textures.pixels[first : first + width * height].reshape(height, width, 3))
            sizes = [level.shape[0] * level.shape[1] for level in made]
            images[first, width, height] = made
            starts[first, width, height] = [first, *(total + np.cumsum([0, *sizes])[:-1]).tolist()]
            total += sum(sizes)

    # One row for each texture
    count = 1 + max((len(made) for made in images.values()), default=0)
    top = np.zeros(len(textures.kind), np.int32)
    first_pixel = np.repeat(textures.first[:, None], count, axis=1)
    size = np.repeat(textures.size[:, None], count, axis=1)
    for i in bitmaps:
        key = (int(textures.first[i]), int(textures.size[i, 0]), int(textures.size[i, 1]))
        top[i] = len(images[key])
        first_pixel[i, : top[i] + 1] = starts[key]
        size[i, 1 : top[i] + 1] = np.array([level.shape[1::-1] for level in images[key]], np.int32).reshape(-1, 2)
    pixels = np.concatenate([textures.pixels, *(level.reshape(-1, 3) for made in images.values() for level in made)])
    return Pyramid(top, np.ascontiguousarray(first_pixel, np.int64), np.ascontiguousarray(size, np.int32), np.ascontiguousarray(pixels, np.float32))
