"""Camera walks that carried nothing are recorded by their place on the film: with the walks of paths, they are all that were traced."""

import numpy as np
import pytest
from rendering import columns, record, settings_of, with_all_features
from scenes.mixed import mixed

from renderer.film import Film
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene


@pytest.fixture(scope="module")
def scene() -> Scene:
    return with_all_features(load_scene(mixed()))


@pytest.mark.parametrize("keep", [1.0, 0.3])
def test_lit_and_unlit_walks_are_all(scene: Scene, keep: float) -> None:
    settings = settings_of(scene, 4, rr_depth=3, keep=keep)
    tables = record(scene, settings, tile=1000)
    lit, unlit = np.unique(tables["paths"]["camera_walk"].to_numpy()), columns(tables["unlit"])
    walk = unlit["camera_walk"]
    assert len(walk) > 10
    assert (np.diff(walk.astype(np.int64)) > 0).all()
    assert not np.isin(walk, lit).any()
    recorded = np.unique(tables["camera_vertices"]["walk"].to_numpy())
    assert np.array_equal(np.union1d(lit, walk), recorded)
    if keep == 1.0:
        assert len(lit) + len(walk) == settings.walks
    pixel = walk.astype(np.int64) % settings.walks_per_pass
    assert np.array_equal(np.floor(unlit["raster_x"]), pixel % settings.width)
    assert np.array_equal(np.floor(unlit["raster_y"]), pixel // settings.width)


def test_the_film_s_weights_are_those_of_recorded_places(scene: Scene) -> None:
    """The film adds every walk's weight, lit or not, and the tables have the places of all."""
    settings = settings_of(scene, 2, rr_depth=3, filter="tent")
    film = Film(settings.width, settings.height, "tent")
    tables = record(scene, settings, film=film)
    paths, unlit = columns(tables["paths"]), columns(tables["unlit"])
    first = np.append(True, paths["camera_walk"][1:] != paths["camera_walk"][:-1])
    x, y = (np.append(paths[name][first], unlit[name]).astype(np.float64) for name in ("raster_x", "raster_y"))
    across = np.maximum(0.0, 1.0 - np.abs(x - 0.5 - np.arange(settings.width)[:, None]))
    down = np.maximum(0.0, 1.0 - np.abs(y - 0.5 - np.arange(settings.height)[:, None]))
    np.testing.assert_allclose(film.sums[..., 3], down @ across.T, rtol=1e-4)


def test_light_walks_have_no_such_table(scene: Scene) -> None:
    assert "unlit" not in record(scene, settings_of(scene, 1, "light"))
