"""The film against a sum in plain numpy, for every reconstruction filter."""

import numpy as np
import pytest

from renderer.film import Film
from renderer.filters import FILTERS

WIDTH, HEIGHT = 7, 5
RNG = np.random.default_rng(11)


def samples(n: int, margin: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Film positions and colors; the first ones lie on the film's and pixels' very edges."""
    raster = np.stack([RNG.uniform(margin, WIDTH - margin, n), RNG.uniform(margin, HEIGHT - margin, n)], axis=1).astype(np.float32)
    if margin == 0:
        edge = np.nextafter(np.float32([WIDTH, HEIGHT]), np.float32(0))
        raster[:4] = [(0, 0), edge, (3, 2), (edge[0], 0)]
    return raster, RNG.uniform(0, 2, (n, 3)).astype(np.float32)


def plain_sums(name: str, raster: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Every sample to every pixel, weighted by the filter itself."""
    sums = np.zeros((HEIGHT, WIDTH, 4))
    weighted = np.concatenate([value, np.ones((len(value), 1))], axis=1).astype(np.float64)
    if name == "box":
        np.add.at(sums, (raster[:, 1].astype(int), raster[:, 0].astype(int)), weighted)
        return sums
    weight = FILTERS[name].weight
    wx = weight(np.arange(WIDTH)[None, :] + 0.5 - raster[:, :1].astype(np.float64))
    wy = weight(np.arange(HEIGHT)[None, :] + 0.5 - raster[:, 1:].astype(np.float64))
    return np.einsum("ny,nx,nc->yxc", wy, wx, weighted)


@pytest.mark.parametrize("name", FILTERS)
def test_sums(name: str) -> None:
    raster, value = samples(500)
    film = Film(WIDTH, HEIGHT, name)
    film.add(raster, value, 400)
    np.testing.assert_allclose(film.sums, plain_sums(name, raster[:400], value[:400]), rtol=1e-4, atol=2e-4)


@pytest.mark.parametrize("name", FILTERS)
def test_films_merge_and_clear(name: str) -> None:
    raster, value = samples(200)
    whole, first, second = (Film(WIDTH, HEIGHT, name) for _ in range(3))
    whole.add(raster, value, 200)
    first.add(raster[:90], value[:90], 90)
    second.add(raster[90:], value[90:], 110)
    first.merge(second.sums)
    np.testing.assert_allclose(first.sums, whole.sums, rtol=1e-12, atol=1e-12)
    first.clear()
    assert not first.sums.any()


@pytest.mark.parametrize("name", FILTERS)
def test_a_uniform_picture_stays_uniform(name: str) -> None:
    """Camera walks divide by the weights that reached a pixel, so edges and negative lobes leave a uniform picture as it is."""
    raster, value = samples(40 * WIDTH * HEIGHT)
    value[:] = 0.75
    film = Film(WIDTH, HEIGHT, name)
    film.add(raster, value, len(raster))
    np.testing.assert_allclose(film.image("path", 40), 0.75, rtol=1e-5)


@pytest.mark.parametrize("name", FILTERS)
def test_light_walks_keep_their_energy(name: str) -> None:
    """Light walks divide by the filter's integral: what lands far from the edges is spread, and its sum stays."""
    film = Film(WIDTH, HEIGHT, name)
    grid = (np.arange(64) + 0.5) / 64  # one pixel's positions evenly, since a filter's weights sum to its integral only on average
    raster = np.stack(np.meshgrid(3 + grid, 2 + grid), axis=-1).reshape(-1, 2).astype(np.float32)
    value = np.full((len(raster), 3), 2.0, np.float32)
    film.add(raster, value, len(raster))
    expected = 2.0 * len(raster) / 8
    if FILTERS[name].radius <= 2:
        np.testing.assert_allclose(film.image("light", 8).sum(axis=(0, 1)), expected, rtol=2e-3)
    black = Film(WIDTH, HEIGHT, name).image("path", 1)
    assert not black.any()
