"""The light vector against closed forms: a parallel beam, a point light, light from all sides; tolerances come from the number of segments."""

import pathlib
from typing import Any

import numpy as np
import pytest
from metered import floor, gray, point_light, trace

from queries import Run, open_run
from queries.arrivals import Arrivals
from queries.flow import Flow, flow
from queries.kernels.luminance import LUMINANCE
from queries.selection import Selection
from queries.shards import pieces
from queries.voxels import Grid

ALL = Selection()
SUN = np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)


@pytest.fixture(scope="module")
def sun_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Parallel light on a gray floor."""
    sun = {"type": "directional", "direction": SUN.tolist(), "irradiance": {"type": "rgb", "value": [2.0, 3.0, 1.0]}}
    return trace(tmp_path_factory.mktemp("sun"), {"floor": floor(1.0, bsdf=gray(0.5)), "sun": sun}, samples=8, max_depth=3)


@pytest.fixture(scope="module")
def point_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A point light in the middle of nothing, but for a floor far below."""
    objects = {"floor": floor(6.0, -6.0), "lamp": point_light([0.0, 0.0, 0.0], [5.0, 5.0, 5.0])}
    return trace(tmp_path_factory.mktemp("point"), objects, samples=48, max_depth=2)


@pytest.fixture(scope="module")
def furnace(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """The inside of a gray box whose walls glow: light of each order is alike from all sides."""
    glow = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    box = {"type": "cube", "flip_normals": True, "bsdf": gray(0.5), "emitter": glow}
    return trace(tmp_path_factory.mktemp("furnace"), {"box": box}, origin=(0, 0, 0.9), target=(0, 0, -1), fov=90, samples=16, max_depth=4, rr_depth=8)


def error_of(found: Flow) -> np.ndarray:
    """No less than one standard error of a voxel's fluence: no segment in it is longer than its diagonal."""
    cell = found.grid.cell
    return found.fluence * np.sqrt(np.linalg.norm(cell) / cell.mean() / np.maximum(found.samples, 1e-9))


def test_a_parallel_beam(sun_run: pathlib.Path) -> None:
    with open_run(sun_run) as run:
        found = flow(run, Selection.of(run, "C L"), Grid((-0.4, 0.05, -0.4), (0.4, 0.85, 0.4), (4, 4, 4)))
    length = np.linalg.norm(found.vectors, axis=3)
    assert (found.samples > 20).all()
    np.testing.assert_allclose(found.vectors / length[..., None], np.broadcast_to(SUN, found.vectors.shape), atol=2e-6)
    np.testing.assert_allclose(found.anisotropy, 1, atol=1e-6)
    # A beam's fluence is its irradiance on a plane across it
    expected = np.dot([2.0, 3.0, 1.0], LUMINANCE)
    z = (found.fluence - expected) / error_of(found)
    assert 0.05 < np.sqrt(np.mean(z**2)) < 1.2
    np.testing.assert_allclose(found.rgb[..., 0] / found.rgb[..., 2], 2.0, rtol=1e-5)
    assert found.directed_share(0.99) == pytest.approx(1)


def radial(grid: Grid, intensity: float, steps: int = 6) -> np.ndarray:
    """The means of intensity x position / distance³ over voxels: (nx, ny, nz, 3)."""
    part = (np.arange(steps) + 0.5) / steps - 0.5
    axes = [(grid.centers(axis)[:, None] + part * grid.cell[axis]).ravel() for axis in range(3)]
    place = np.stack(np.meshgrid(*axes, indexing="ij"), axis=3)
    values = intensity * place / np.linalg.norm(place, axis=3, keepdims=True) ** 3
    nx, ny, nz = grid.shape
    return values.reshape(nx, steps, ny, steps, nz, steps, 3).mean(axis=(1, 3, 5))


def outflow(vectors: np.ndarray, grid: Grid, low: int, high: int) -> float:
    """The net flux out of the voxels low … high - 1 along each axis, by the means of the voxels on both sides of each face."""
    total = 0.0
    for axis in range(3):
        area = grid.volume / grid.cell[axis]
        along = np.moveaxis(vectors[..., axis], axis, 0)[:, low:high, low:high]
        total += area * float((along[high - 1] + along[high] - along[low] - along[low - 1]).sum()) / 2
    return total


def test_a_point_light(point_run: pathlib.Path) -> None:
    grid = Grid((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5), (25, 25, 25))
    with open_run(point_run) as run:
        found = flow(run, ALL, grid)
    expected = radial(grid, 5.0)
    x, y, z = np.meshgrid(*(grid.centers(axis) for axis in range(3)), indexing="ij")
    away = x**2 + y**2 + z**2 > 0.25
    # |vector| = Phi / (4 pi r²), along the radius
    z = (np.linalg.norm(found.vectors, axis=3) - np.linalg.norm(expected, axis=3))[away] / error_of(found)[away]
    assert abs(z).max() < 5
    assert 0.4 < np.sqrt(np.mean(z**2)) < 1.2
    assert abs(z.mean()) < 5 / np.sqrt(len(z)) * np.sqrt(np.mean(z**2))
    cosine = np.einsum("ij,ij->i", found.vectors[away], expected[away]) / np.linalg.norm(found.vectors, axis=3)[away]
    assert (cosine / np.linalg.norm(expected, axis=3)[away]).min() > 0.99
    # Gauss: what flows out is what the source brings, and nothing flows out of a box without one
    flux = 4 * np.pi * 5.0
    walks = 64 * 64 * 48
    assert outflow(expected, grid, 5, 20) == pytest.approx(flux, rel=0.005)  # of planes between voxels
    assert outflow(found.vectors, grid, 5, 20) == pytest.approx(outflow(expected, grid, 5, 20), rel=5 / np.sqrt(walks))
    assert abs(outflow(found.vectors, grid, 15, 24) - outflow(expected, grid, 15, 24)) < flux * 5 / np.sqrt(walks)
    assert abs(outflow(expected, grid, 15, 24)) < 0.005 * flux


def test_light_from_all_sides_has_no_direction(furnace: pathlib.Path) -> None:
    with open_run(furnace) as run:
        found = flow(run, ALL, Grid((-0.8, -0.8, -0.8), (0.8, 0.8, 0.8), (8, 8, 8)))
        beams = flow(run, Selection.of(run, "C L"), Grid((-0.999, -0.2, -0.2), (0.999, 0.2, 0.2), (1, 1, 1)))
    assert (found.samples > 50).all()
    # Three times samples x anisotropy² is nearly chi-square of three degrees of freedom (segments of all lengths weigh a little more)
    statistic = 3 * found.samples * found.anisotropy**2
    assert 2.0 < statistic.mean() < 5.0
    assert found.directed_share(0.0) < 0.2
    assert found.directed_share(0.3) == 0
    assert np.linalg.norm(found.total_vector) / found.total < 4 / np.sqrt(found.segments)
    # Radiance is L and each of two bounces halves it (the fourth segment leads to the lens); the fluence is 4 pi times as much
    assert found.fluence.mean() == pytest.approx(4 * np.pi * (1 + 0.5 + 0.25), rel=0.02)
    assert beams.fluence.mean() == pytest.approx(4 * np.pi, rel=0.03)


def sums(run: Run, low: Any, high: Any) -> tuple[float, np.ndarray]:
    """Flux x length, and flux x length x direction, of all segments within a box, by sampling each finely: no grid, no clipping."""
    arrivals, total, vector = Arrivals(run, ALL), 0.0, np.zeros(3)
    for shard, files in enumerate(run.files(*arrivals.tables)):
        for piece in pieces(files, shard):
            rows = np.flatnonzero(arrivals.select(piece))
            start, end = (points.astype(np.float64) for points in arrivals.segments(piece, rows))
            flux = np.stack([piece.column(arrivals.table, f"throughput_{c}")[rows] for c in "rgb"], axis=1) @ np.array(LUMINANCE) * arrivals.per_walk
            share = np.zeros(len(rows))
            for t in (np.arange(400) + 0.5) / 400:
                at = start + t * (end - start)
                share += ((at >= low) & (at <= high)).all(axis=1) / 400
            total += float((flux * share * np.linalg.norm(end - start, axis=1)).sum())
            vector += ((flux * share)[:, None] * (end - start)).sum(axis=0)
    return total, vector


def test_totals_are_sums_over_segments_on_any_number_of_threads(sun_run: pathlib.Path) -> None:
    low, high = (-1.2, -0.1, -0.9), (0.7, 1.1, 0.9)
    with open_run(sun_run) as run:
        found = [flow(run, ALL, Grid(low, high, (19, 6, 9)), threads=threads) for threads in (1, 3)]
        total, vector = sums(run, low, high)
    for name in ("vectors", "fluence", "rgb", "samples", "total_vector"):
        assert np.array_equal(getattr(found[0], name), getattr(found[1], name))
    assert found[0].total == pytest.approx(total, rel=2e-3)
    np.testing.assert_allclose(found[0].total_vector, vector, rtol=2e-3, atol=2e-3 * total)
    assert found[0].total == pytest.approx(float(found[0].fluence.sum()) * found[0].grid.volume, rel=1e-5)


def test_a_selection_without_light(sun_run: pathlib.Path) -> None:
    with open_run(sun_run) as run:
        found = flow(run, Selection.of(run, "C S L"), Grid((-1, -1, -1), (1, 1, 1), (4, 4, 4)))
    assert (found.total, found.segments, found.directed_share(0.0), len(found.seeds(10, 0.0))) == (0, 0, 0, 0)
    assert (found.anisotropy == 0).all()
