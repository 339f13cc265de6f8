"""Particles in fields that are known: circles, walls of darkness, crowds in proportion to light."""

import numpy as np
import pytest
from scipy import stats

from queries.flow import Flow
from queries.voxels import Grid

GRID = Grid((-1.0, -1.0, -0.5), (1.0, 1.0, 0.5), (40, 40, 20))


def field(vectors: np.ndarray, fluence: np.ndarray, samples: float = 1e6) -> Flow:
    shape = fluence.shape
    whole = np.broadcast_to(vectors, (*shape, 3)).astype(np.float32)
    many = np.full(shape, samples, np.float32)
    return Flow(GRID, whole, fluence.astype(np.float32), np.ones((*shape, 3), np.float32), many, float(fluence.sum()), np.zeros(3), 1)


def centers() -> np.ndarray:
    return np.stack(np.meshgrid(*(GRID.centers(axis) for axis in range(3)), indexing="ij"), axis=3)


def test_particles_go_in_circles() -> None:
    place = centers()
    around = np.stack([-place[..., 1], place[..., 0], 0 * place[..., 0]], axis=3)
    found = field(around, np.linalg.norm(around, axis=3))
    seeds = np.array([[0.5, 0.0, 0.0], [0.0, 0.8, 0.1], [-0.3, 0.0, -0.2]])
    length = 3.0
    tracks = found.tracks(seeds, length, 0.02, 0.5)
    radius = np.linalg.norm(tracks.points[..., :2], axis=2)
    np.testing.assert_allclose(radius, np.broadcast_to(np.linalg.norm(seeds[:, :2], axis=1)[:, None], radius.shape), rtol=2e-5)
    np.testing.assert_allclose(np.linalg.norm(np.diff(tracks.points, axis=1), axis=2), tracks.step, rtol=2e-4)  # chords
    assert (tracks.count == tracks.points.shape[1]).all()
    # Counterclockwise, by the length over the radius
    turned = np.unwrap(np.arctan2(tracks.points[..., 1], tracks.points[..., 0]), axis=1)
    np.testing.assert_allclose(turned[:, -1] - turned[:, 0], length / np.linalg.norm(seeds[:, :2], axis=1), rtol=1e-5)
    np.testing.assert_array_equal(tracks.points[..., 2], np.broadcast_to(seeds[:, 2:], radius.shape))


@pytest.mark.parametrize("stop", ["dark", "outside", "undirected", "doubtful"])
def test_particles_stop(stop: str) -> None:
    place = centers()
    beyond = place[..., 0] > 0.5
    fluence, vectors, samples = np.ones(place.shape[:3]), np.broadcast_to([1.0, 0.0, 0.0], place.shape).copy(), np.full(place.shape[:3], 1e6)
    if stop == "dark":
        vectors[beyond], fluence[beyond] = 0, 0
    elif stop == "undirected":
        vectors[beyond] *= 0.2
    elif stop == "doubtful":
        samples[beyond], vectors[...] = 4.0, [0.7, 0.0, 0.0]  # by chance it may be 0.81
    whole = field(vectors, fluence)
    whole = Flow(GRID, whole.vectors, whole.fluence, whole.rgb, samples.astype(np.float32), whole.total, whole.total_vector, 1)
    tracks = whole.tracks(np.array([[-0.5, 0.1, 0.2]]), 4.0, 0.01, 0.4)
    end = tracks.points[0, -1]
    wall = 1.0 if stop == "outside" else 0.5
    assert wall - GRID.cell[0] <= end[0] <= wall + GRID.cell[0]
    np.testing.assert_allclose(end[1:], [0.1, 0.2])
    assert tracks.count[0] == pytest.approx((end[0] + 0.5) / tracks.step + 1, abs=1e-6)
    np.testing.assert_array_equal(tracks.points[0, tracks.count[0] - 1 :], np.broadcast_to(end, tracks.points[0, tracks.count[0] - 1 :].shape))


def test_seeds_are_as_dense_as_light_with_a_direction() -> None:
    place = centers()
    fluence = 1.0 + (place[..., 0] > 0) * 2.0 + (place[..., 1] > 0)
    vectors = np.where((place[..., 2] > 0)[..., None], [0.0, 0.0, 0.1], [0.0, 0.0, 0.9]) * fluence[..., None]
    found = field(vectors, fluence)
    seeds = found.seeds(40_000, 0.5, seed=3)
    assert (seeds >= GRID.low).all()
    assert (seeds <= GRID.high).all()
    assert (seeds[:, 2] <= 0).all()
    assert found.directed_share(0.5) == pytest.approx(0.5)
    counts = np.histogram2d(seeds[:, 0], seeds[:, 1], bins=[[-1, 0, 1], [-1, 0, 1]])[0].ravel()
    shares = np.array([1.0, 2.0, 3.0, 4.0]) / 10
    assert abs(counts - 40_000 * shares).max() <= 5 * np.sqrt(40_000 * 0.25)
    inside = ((seeds - GRID.low) / GRID.cell) % 1
    assert all(stats.kstest(inside[:, axis], "uniform").pvalue > 1e-4 for axis in range(3))
    np.testing.assert_array_equal(seeds, found.seeds(40_000, 0.5, seed=3))
    assert not np.array_equal(seeds, found.seeds(40_000, 0.5, seed=4))
