"""Primary samples: uniform, independent where they must be, nets where they promise it, and a pure function of seed and walk."""

import dataclasses

import numba
import numpy as np
import pytest
import scipy.stats
from rendering import replicate_images, settings_of
from stats import sidak

from renderer.samples import FIRST_BLOCK, SOBOL_DIMENSIONS, primary_samples, sample_pair, walk_samples
from renderer.scene.arrays import Scene
from renderer.settings import TraceSettings

PIXELS = 16
SOBOL = TraceSettings("path", 4, 4, 4096, 8, 5, seed=7, sampler="sobol", replicates=4)
INDEPENDENT = dataclasses.replace(SOBOL, sampler="independent")


@numba.njit
def draw(samples, walks, dimension):  # type: ignore[no-untyped-def]
    """The pair of one dimension for each walk, float32 (n, 2)."""
    out = np.empty((len(walks), 2), np.float32)
    for i in range(len(walks)):
        a, b = sample_pair(samples, walk_samples(samples, walks[i]), dimension)
        out[i, 0] = a
        out[i, 1] = b
    return out


def pairs(settings: TraceSettings, walks: np.ndarray, dimension: int) -> np.ndarray:
    return np.asarray(draw(primary_samples(settings), walks.astype(np.uint64), dimension))


def grid_p_value(points: np.ndarray, cells: int = 16) -> float:
    """P-value that points (n, 2) are uniform over the unit square."""
    counts, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=cells, range=[[0, 1], [0, 1]])
    return float(scipy.stats.chisquare(counts.ravel()).pvalue)


DIMENSIONS = (0, 1, 3, FIRST_BLOCK, FIRST_BLOCK + 3, SOBOL_DIMENSIONS - 1, SOBOL_DIMENSIONS, 100, 1019)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_pairs_are_uniform(dimension: int) -> None:
    points = pairs(INDEPENDENT, np.arange(2**16), dimension)
    assert points.min() >= 0
    assert points.max() < 1
    assert np.array_equal(points * 2.0**24, np.floor(points * 2.0**24))
    assert grid_p_value(points) > sidak(len(DIMENSIONS))


@pytest.mark.parametrize("settings", [INDEPENDENT, SOBOL], ids=lambda s: s.sampler)
def test_dimensions_and_neighbors_are_independent(settings: TraceSettings) -> None:
    """Joint uniformity: over dimensions of a walk, over neighboring pixels, over passes and over seeds.

    Sobol' points of one pixel are not independent of each other, so one point of each scramble is taken: a seed for each.
    """
    seeds = 256
    walks = np.arange(PIXELS * settings.replicates)
    drawn = {
        d: np.stack([pairs(dataclasses.replace(settings, seed=1000 + s), walks, d) for s in range(seeds)]) for d in (0, 1, 4, 6, 7, 11)
    }  # each (seeds, walks, 2)
    tests = {f"dimensions {a} and {b}": (drawn[a][..., 0], drawn[b][..., i]) for a, b in ((0, 1), (0, 4), (4, 6), (6, 7), (7, 11)) for i in (0, 1)}
    tests |= {f"dimension {d} itself": (drawn[d][..., 0], drawn[d][..., 1]) for d in drawn}
    tests |= {f"neighbors in {d}": (drawn[d][:, ::2, 0], drawn[d][:, 1::2, 0]) for d in drawn}
    tests |= {f"replicates in {d}": (drawn[d][:, :PIXELS, 0], drawn[d][:, PIXELS : 2 * PIXELS, 0]) for d in drawn}
    tests |= {f"seeds in {d}": (drawn[d][::2, :, 1], drawn[d][1::2, :, 1]) for d in drawn}
    p = {name: grid_p_value(np.stack([a.ravel(), b.ravel()], axis=1), 8) for name, (a, b) in tests.items()}
    worst = min(p, key=p.__getitem__)
    assert p[worst] > sidak(len(p)), f"{worst}: p = {p[worst]:.2e}"


@pytest.mark.parametrize("dimension", [0, 2, FIRST_BLOCK, FIRST_BLOCK + 2, SOBOL_DIMENSIONS - 1])
@pytest.mark.parametrize(("pixel", "replicate"), [(0, 0), (5, 1), (15, 3)])
def test_a_pixels_points_are_a_net(dimension: int, pixel: int, replicate: int) -> None:
    """Any 2^m points that begin at a multiple of 2^m have one point in every elementary interval of area 2^-m."""
    walks = (np.arange(1024) * SOBOL.replicates + replicate) * PIXELS + pixel
    points = pairs(SOBOL, walks, dimension).astype(np.float64)
    for m in (2, 4, 6, 10):
        for run in points.reshape(-1, 2**m, 2)[:4]:
            for a in range(m + 1):
                counts, _, _ = np.histogram2d(run[:, 0], run[:, 1], bins=[2**a, 2 ** (m - a)], range=[[0, 1], [0, 1]])
                assert (counts == 1).all(), f"2^{m} points, intervals 2^-{a} x 2^-{m - a}"


def test_replicates_are_independent() -> None:
    """The errors of two replicates are not correlated, so their scatter gives a standard error."""
    seeds = 100
    error = np.empty((SOBOL.replicates, seeds * PIXELS))
    for s in range(seeds):
        walks = np.arange(16 * SOBOL.replicates * PIXELS)
        points = pairs(dataclasses.replace(SOBOL, seed=s), walks, 4).reshape(16, SOBOL.replicates, PIXELS, 2)
        error[:, s * PIXELS : (s + 1) * PIXELS] = (np.sqrt(points[..., 0]) * (points[..., 1] > 0.3)).mean(axis=0) - 2 / 3 * 0.7
    p = [scipy.stats.pearsonr(error[a], error[b]).pvalue for a in range(4) for b in range(a)]
    assert min(p) > sidak(len(p))
    assert abs(error.mean()) < 5 * error.std() / np.sqrt(error.size)


@pytest.mark.parametrize("settings", [INDEPENDENT, SOBOL], ids=lambda s: s.sampler)
def test_numbers_are_a_function_of_the_walk(settings: TraceSettings) -> None:
    walks = np.random.default_rng(3).permutation(5000)
    for dimension in (0, 5, 40):
        assert np.array_equal(pairs(settings, walks, dimension), pairs(settings, np.arange(5000), dimension)[walks])
        assert not np.array_equal(pairs(settings, walks, dimension), pairs(dataclasses.replace(settings, seed=8), walks, dimension))


def test_sobol_beats_independent_samples(cornell: Scene) -> None:
    """At equal samples Sobol's mean squared error is at most 0.7 of independent sampling's, on the Cornell box."""
    reference = replicate_images(cornell, settings_of(cornell, 4096, seed=99, sampler="sobol"), 8).mean(axis=0)
    errors = {}
    for sampler in ("independent", "sobol"):
        images = [replicate_images(cornell, settings_of(cornell, 64, seed=s, sampler=sampler), 1)[0] for s in range(8)]
        errors[sampler] = float(np.mean((np.stack(images) - reference) ** 2))
    assert errors["sobol"] <= 0.7 * errors["independent"], errors
