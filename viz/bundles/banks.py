"""Lines lit as Banks does it: of all normals across a line, the one that reflects most light counts (banks1994, zockler1996)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from viz.bundles.curves import CHUNK, for_chunks

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
U8 = npt.NDArray[np.uint8]
_TINY = np.float32(1e-30)


@dataclass(frozen=True)
class Lighting:
    """How lines are lit: a headlight a little above and beside the eye.

    ``ambient``, ``diffuse``: shares of the color; ``specular``: of white. Most lines have a normal that faces the light: the diffuse term is raised
    to a power (here 4), lest all of a bundle be equally bright. The highlight's exponent is 32.
    """

    ambient: float = 0.28
    diffuse: float = 0.72
    specular: float = 0.22
    beside: float = -0.45  # where the light is, to the right of the eye, as a share of the way to it
    above: float = 0.6

    def toward(self, axes: F64) -> F32:
        """The unit direction to the light, for a picture whose axes (3, 3) are these in the world: to the right, up, and where the eye looks."""
        right, up, forward = axes
        light = self.beside * right + self.above * up - forward
        unit: F32 = (light / np.linalg.norm(light)).astype(np.float32)
        return unit


def shade(curves: F32, colors: F32, eye: F64, light: F32, lighting: Lighting, out: U8, threads: int | None = None) -> None:
    """The colors of curves (s, points, 3), of 2 points or more, as seen from ``eye`` (3) in light from the direction ``light`` (3).

    ``colors``: float32 (s, 3) sRGB, the diffuse reflectance of each curve; ``out``: uint8 (s, points, 3 or 4), the opacity of which is kept.
    Tangents are differences of neighboring points.
    """
    base = np.ascontiguousarray(colors.T, np.float32)

    def work(first: int) -> None:
        rows = slice(first, first + CHUNK)
        p = np.ascontiguousarray(curves[rows].transpose(2, 1, 0))
        diffuse, specular = _reflected(p, eye.astype(np.float32), light)
        diffuse *= np.float32(lighting.diffuse)
        diffuse += np.float32(lighting.ambient)
        specular *= np.float32(lighting.specular)
        for k in range(3):
            value = diffuse * base[k, rows]
            value += specular
            np.minimum(value, 1, out=value)
            value *= 255
            value += np.float32(0.5)
            out[rows, :, k] = value.T  # rounds to the nearest: the half was added

    for_chunks(work, len(curves), threads)


def _reflected(p: F32, eye: F32, light: F32) -> tuple[F32, F32]:
    """The diffuse and the specular term, float32 (points, s) each, of points (3, points, s): most of what any normal gives."""
    t = np.empty_like(p)
    np.subtract(p[:, 2:], p[:, :-2], out=t[:, 1:-1])
    np.subtract(p[:, 1], p[:, 0], out=t[:, 0])
    np.subtract(p[:, -1], p[:, -2], out=t[:, -1])
    v = eye[:, None, None] - p
    lt = light[0] * t[0] + light[1] * t[1] + light[2] * t[2]
    vt = v[0] * t[0] + v[1] * t[1] + v[2] * t[2]
    tt = t[0] * t[0] + t[1] * t[1] + t[2] * t[2]
    vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    tt += _TINY
    vv += _TINY
    # Cosines with the tangent, then the angles across it
    root = np.sqrt(tt)
    lt /= root
    root *= np.sqrt(vv)
    vt /= root
    across_light = np.maximum(1 - lt * lt, 0)
    across_view = np.maximum(1 - vt * vt, 0)
    specular = np.sqrt(across_light * across_view)
    specular -= lt * vt
    np.maximum(specular, 0, out=specular)
    for _ in range(5):
        specular *= specular
    across_light *= across_light  # (sin)^4
    return across_light, specular
