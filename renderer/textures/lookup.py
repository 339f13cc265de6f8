"""Looking a texture up at (u, v), with Mitsuba's conventions.

Row 0 of a bitmap, its top, lies at v = 0, and pixel (x, y) has its center at ((x + 1/2) / width, (y + 1/2) / height).
"""

from typing import Any

import numpy as np

from renderer.kernel import kernel
from renderer.math.vec import HALF, ONE, Vec3, madd, scale
from renderer.textures.base import BITMAP, MIRROR, NEAREST, REPEAT, Textures

Index = Any  # a row of an array: an int in Python, any integer type inside kernels


@kernel
def wrap(i: int, size: int, mode: Index) -> int:
    """A pixel coordinate brought into 0 … size - 1."""
    if mode == REPEAT:
        return i % size
    if mode == MIRROR:
        i = i % (2 * size)
        return min(i, 2 * size - 1 - i)
    return min(max(i, 0), size - 1)


@kernel
def pixel(textures: Textures, index: Index, x: int, y: int) -> Vec3:
    """The pixel (x, y) of a bitmap, wrapped."""
    mode = textures.mode[index, 1]
    width = int(textures.size[index, 0])
    i = textures.first[index] + wrap(y, int(textures.size[index, 1]), mode) * width + wrap(x, width, mode)
    return (textures.pixels[i, 0], textures.pixels[i, 1], textures.pixels[i, 2])


@kernel
def bitmap(textures: Textures, index: Index, u: np.float32, v: np.float32) -> Vec3:
    """The color of a bitmap, the nearest pixel's or interpolated between four."""
    x = u * np.float32(textures.size[index, 0])
    y = v * np.float32(textures.size[index, 1])
    if textures.mode[index, 0] == NEAREST:
        return pixel(textures, index, int(np.floor(x)), int(np.floor(y)))

    # Bilinear: the four pixels whose centers surround the point
    x = x - HALF
    y = y - HALF
    floor_x = np.floor(x)
    floor_y = np.floor(y)
    i = int(floor_x)
    j = int(floor_y)
    fx = np.float32(x - floor_x)
    fy = np.float32(y - floor_y)
    top = madd(pixel(textures, index, i + 1, j), fx, scale(pixel(textures, index, i, j), ONE - fx))
    bottom = madd(pixel(textures, index, i + 1, j + 1), fx, scale(pixel(textures, index, i, j + 1), ONE - fx))
    return madd(bottom, fy, scale(top, ONE - fy))


@kernel
def checkerboard(textures: Textures, index: Index, u: np.float32, v: np.float32) -> Vec3:
    """The first color where both coordinates lie in the same half of their unit cell, else the second."""
    odd = ((u - np.floor(u)) > HALF) != ((v - np.floor(v)) > HALF)
    c = 1 if odd else 0
    return (textures.rgb[index, c, 0], textures.rgb[index, c, 1], textures.rgb[index, c, 2])


@kernel
def texture_rgb(textures: Textures | None, index: Index, constant: Vec3, u: np.float32, v: np.float32) -> Vec3:
    """The color of texture ``index`` at (u, v), or ``constant`` where the scene or the index (-1) has no texture."""
    if textures is None:
        return constant
    if index < 0:
        return constant
    m = textures.to_uv
    s = m[index, 0, 0] * u + m[index, 0, 1] * v + m[index, 0, 2]
    t = m[index, 1, 0] * u + m[index, 1, 1] * v + m[index, 1, 2]
    if textures.kind[index] == BITMAP:
        return bitmap(textures, index, s, t)
    return checkerboard(textures, index, s, t)
