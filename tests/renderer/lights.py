"""One scene with an emitter of every kind, for tests of sampling: each is asked for by its row."""

import numpy as np

from renderer.emitters import base
from renderer.emitters.base import Emitters
from renderer.emitters.envmap import build_environment
from renderer.shapes.base import CYLINDER, DISK, SPHERE, Geometry, Quadrics
from renderer.shapes.bounds import quadric_offsets, triangle_offsets

F32 = np.float32
ROWS = ("rectangle", "mesh", "sphere", "disk", "cylinder", "inside", "point", "spot", "directional", "constant")
RADIANCE = np.array([1.0, 2.0, 3.0], F32)
CUTOFF, BEAM = 1 - np.cos(np.radians(40)), 1 - np.cos(np.radians(25))
CENTER, RADIUS = np.array([0.2, 0.1, -0.3]), 6.0  # the sphere around the scene

# A box whose six faces have unequal areas, as triangles with outward normals
BOX = np.array([0.3, 0.5, 0.8])
CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float) * BOX + (0.5, -0.4, 3.0)
FACES = np.array([
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip
RECTANGLE = (np.array([-1.0, -0.8, 1.5]), np.array([1.8, 0.1, 0.5]), np.array([0.2, 1.5, -0.3]))  # corner, edges; shines down


def rotation(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    n = np.array(axis) / np.linalg.norm(axis)
    k = np.cross(np.eye(3), -n)
    a = np.radians(degrees)
    return np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k


def affine(linear: np.ndarray, offset: tuple[float, float, float]) -> np.ndarray:
    m = np.eye(4)
    m[:3, :3] = linear
    m[:3, 3] = offset
    return m


TURN = rotation((1, 2, 3), 70)
QUADRICS = {
    "sphere": (SPHERE, affine(TURN * 0.9, (0.3, 0.2, 2.2)), False),
    "disk": (DISK, affine(rotation((1, 0.2, 0), 165) * 1.1, (0.3, 0.2, 1.6)), False),
    "cylinder": (CYLINDER, affine(TURN @ np.diag([0.6, 0.6, 1.4]), (0.4, 1.3, 1.0)), False),
    "inside": (SPHERE, affine(TURN * 1.7, (0.3, 0.2, 0.4)), True),
}


def build(environment: bool = False) -> tuple[Emitters, Geometry]:
    """The emitters of ROWS (the last an environment map where asked for), and the geometry that they stand on."""
    c, a, b = RECTANGLE
    corners = np.concatenate([CORNERS[FACES], [(c, c + b, c + a + b), (c, c + a + b, c + a)]]).astype(F32)
    p0, e1, e2 = corners[:, 0].copy(), corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ng = np.cross(e1.astype(float), e2.astype(float))
    areas = np.linalg.norm(ng, axis=1) / 2
    ng /= np.linalg.norm(ng, axis=1, keepdims=True)
    matrices = np.stack([m for _, m, _ in QUADRICS.values()])
    quadrics = Quadrics(
        np.array([k for k, _, _ in QUADRICS.values()], np.int32),
        np.ascontiguousarray(matrices[:, :3]),
        np.ascontiguousarray(np.linalg.inv(matrices)[:, :3]),
        np.array([f for _, _, f in QUADRICS.values()], np.uint8),
    )
    nt = len(p0)
    offset = np.concatenate([triangle_offsets(p0, e1, e2), quadric_offsets(quadrics.to_world)])
    owner = np.concatenate([np.full(12, 1), np.full(2, 0), np.arange(2, 6)]).astype(np.int32)
    geometry = Geometry(p0, e1, e2, ng.astype(F32), offset, owner, None, None, quadrics)

    kinds = [base.AREA_RECTANGLE, base.AREA_MESH, base.AREA_SPHERE, base.AREA_DISK, base.AREA_CYLINDER, base.AREA_SPHERE]
    kinds += [base.POINT, base.SPOT, base.DIRECTIONAL, base.ENVMAP if environment else base.CONSTANT]
    n = len(kinds)
    scalar, frame = np.zeros((n, 3), F32), np.zeros((n, 12), F32)
    scalar[:6, base.AREA] = [areas[12:].sum(), areas[:12].sum(), 4 * np.pi * 0.81, np.pi * 1.21, 2 * np.pi * 0.6 * 1.4, 4 * np.pi * 2.89]
    scalar[7, base.CUTOFF], scalar[7, base.BEAM] = CUTOFF, BEAM
    frame[0] = np.concatenate([c, a, b, ng[12]])
    light = affine(rotation((1, 0.1, 0), 170), (0.4, -0.2, 2.0))[:3].ravel()
    frame[6:9] = light
    primitive = np.zeros((n, 3), np.int32)
    primitive[:6, :2] = [(12, 2), (0, 12), (nt, 1), (nt + 1, 1), (nt + 2, 1), (nt + 3, 1)]
    cdf = np.concatenate([[0], np.cumsum(areas[:12]) / areas[:12].sum()]).astype(F32)
    sky = build_environment(sky_pixels(), rotation((0.3, 1, 0.2), 50))  # unused by a constant sky; one type, one compilation
    emitters = Emitters(
        np.array(kinds, np.int32), np.arange(n, dtype=np.int32), np.tile(RADIANCE, (n, 1)), np.full(n, -1, np.int32), frame, scalar, primitive,
        cdf, np.array([*CENTER, RADIUS], F32), np.int32(n - 1), True, True, True, sky,
    )  # fmt: skip
    return emitters, geometry


def sky_pixels() -> np.ndarray:
    """A map with a bright spot, a dark band and a black row, (12, 16, 3)."""
    pixels = np.random.default_rng(11).uniform(0.2, 1.0, (12, 16, 3)).astype(F32)
    pixels[3, 5] *= 40
    pixels[6:8] = 0
    pixels[9:11, 3:9] = 0
    return pixels
