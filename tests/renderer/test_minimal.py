"""The minimal path tracer, walk by walk, against the wavefront: the same numbers, the same formulas, none of the machinery."""

import dataclasses

import numpy as np
import pytest
from rendering import columns, record, settings_of, with_all_features
from scenes.catalogue import diffuse_box
from scenes.mixed import mixed

from renderer.film import Film
from renderer.integrators.minimal import MinimalPathTracer
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.settings import TraceSettings

WALKS = 600
DIVERGED = 0.02  # share of walks that may take another way: where rays graze edges, float32 and float64 meet different triangles


def lit_by_sky_only() -> dict:
    """The mixed scene without its own lights."""
    description = mixed()
    for name in ("lamp", "ball", "bulb"):
        description.pop(name)
    return description


def thin_lens() -> dict:
    description = mixed()
    description["sensor"] |= {"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 3.0, "near_clip": 0.5, "far_clip": 6.0}
    return description


CASES = {
    "diffuse box": (lambda: diffuse_box(None), {}),
    "mixed": (mixed, {}),
    "mixed, early roulette": (mixed, {"rr_depth": 1}),
    "mixed, Sobol": (mixed, {"sampler": "sobol"}),
    "direct light only": (mixed, {"max_depth": 2}),
    "sky": (lit_by_sky_only, {}),
    "thin lens": (thin_lens, {}),
}


def wavefront_radiance(scene: Scene, settings: TraceSettings, walks: np.ndarray) -> np.ndarray:
    """What each walk adds to the film: the sum of its paths."""
    paths = columns(record(scene, settings, walks)["paths"])
    total = np.zeros((len(walks), 3))
    row = np.argsort(walks)[np.searchsorted(np.sort(walks), paths["camera_walk"])]
    np.add.at(total, row, np.stack([paths[f"contribution_{c}"] for c in "rgb"], axis=1).astype(np.float64))
    return total


@pytest.mark.parametrize("name", CASES)
def test_walk_by_walk(name: str) -> None:
    make, changes = CASES[name]
    scene = load_scene(make())
    scene = scene if name == "diffuse box" else with_all_features(scene)
    settings = settings_of(scene, 8, **changes)
    walks = np.random.default_rng(5).choice(settings.walks, WALKS, replace=False).astype(np.uint64)
    expected = wavefront_radiance(scene, settings, walks)
    twin = MinimalPathTracer(scene, settings)
    found = np.array([twin.radiance(int(walk)) for walk in walks])
    same = np.isclose(found, expected, rtol=2e-3, atol=1e-5).all(axis=1)
    assert expected.any(axis=1).mean() > 0.2, "most walks should find light"
    assert (~same).mean() <= DIVERGED, f"{(~same).sum()} of {WALKS} walks differ, first: walk {walks[~same][0]}"
    difference = found[~same] - expected[~same]
    assert np.abs(difference.sum(axis=0)).max() <= 4 * np.sqrt((difference**2).sum(axis=0)).max() + 1e-9, "the walks that differ lean to one side"


def test_film_is_the_sum_of_walks(cornell: Scene) -> None:
    settings = dataclasses.replace(settings_of(cornell, 4), width=6, height=6)
    film = Film(6, 6)
    record(cornell, settings, film=film)
    twin = MinimalPathTracer(cornell, settings)
    total = np.zeros((36, 3))
    for walk in range(settings.walks):
        total[walk % 36] += twin.radiance(walk)
    assert np.isclose(film.image("path", 4).reshape(36, 3), total / 4, rtol=1e-2, atol=1e-4).all(axis=1).mean() > 0.9
