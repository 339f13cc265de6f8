"""Images against Mitsuba 3: the same scene in both programs, block by block and on the mean, with noise that would show a bias of 2 %.

Set ``DRJIT_LIBLLVM_PATH`` to use Mitsuba's LLVM variant; the scalar one gives the same images.
"""

import os
import pathlib
from collections.abc import Iterator
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from rendering import F64, replicate_images, settings_of, with_all_features
from scenes.catalogue import CATALOGUE, glass_and_mirror, plastics
from stats import assert_same_image

from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.scene.to_mitsuba import mitsuba_dict

REPLICATES = 16  # independent renders of each program: their scatter is the noise
DEPTHS = (1, 2, 3, 8)
TESTS = len(CATALOGUE) + len(DEPTHS) + 1  # comparisons that this file makes
BIAS = 0.02  # relative bias of the mean that must not pass

SPECIAL = ("diffuse_box", "thin_lens")  # scenes whose kernels know nothing but what is in them
SAMPLES = 32  # of a pixel in each of Mitsuba's replicates; ours are cheaper and take twice as many


@pytest.fixture(autouse=True)
def variant() -> Iterator[None]:
    before = mi.variant()
    mi.set_variant("llvm_ad_rgb" if os.environ.get("DRJIT_LIBLLVM_PATH") else "scalar_rgb")
    yield
    if before:
        mi.set_variant(before)


def mitsuba_images(scene: Scene, samples: int, **integrator: Any) -> F64:
    """Replicated images by Mitsuba, each with its own seed."""
    description = mitsuba_dict(scene.description)
    description["integrator"] |= integrator
    loaded = mi.load_dict(description)
    return np.stack([np.array(mi.render(loaded, spp=samples, seed=1000 + i), np.float64)[..., :3] for i in range(REPLICATES)])


def our_images(scene: Scene, samples: int, **changes: Any) -> F64:
    return replicate_images(scene, settings_of(scene, samples * REPLICATES, **changes), REPLICATES)


@pytest.mark.parametrize("name", CATALOGUE)
def test_same_image(name: str, tmp_path: pathlib.Path) -> None:
    scene = load_scene(CATALOGUE[name](tmp_path))
    ours = our_images(scene if name in SPECIAL else with_all_features(scene), 2 * SAMPLES)
    assert_same_image(ours, mitsuba_images(scene, SAMPLES), tmp_path, TESTS, bias=BIAS)


@pytest.mark.parametrize("max_depth", DEPTHS)
def test_depths_are_mitsubas(max_depth: int, tmp_path: pathlib.Path) -> None:
    """``max_depth`` counts segments: 1 shows emitters only, 2 adds direct light, through glass too."""
    scene = load_scene(glass_and_mirror(tmp_path))
    ours = our_images(with_all_features(scene), 32, max_depth=max_depth)
    assert_same_image(ours, mitsuba_images(scene, 16, max_depth=max_depth), tmp_path, TESTS)


def test_russian_roulette_is_unbiased(tmp_path: pathlib.Path) -> None:
    """Roulette from the first bounce on against Mitsuba without any."""
    scene = load_scene(plastics(tmp_path))
    ours = our_images(with_all_features(scene), 96, rr_depth=1)
    assert_same_image(ours, mitsuba_images(scene, 32, rr_depth=1000), tmp_path, TESTS)


def test_catalogue_uses_every_plugin(tmp_path: pathlib.Path) -> None:
    """The scenes name every shape, BSDF, texture, emitter and sensor that is supported."""
    from renderer.scene.bsdfs import BSDFS
    from renderer.scene.emitters import EMITTERS
    from renderer.scene.sensors import SENSORS
    from renderer.scene.shapes import SHAPES
    from renderer.scene.textures import TEXTURES

    def types(value: Any) -> set[str]:
        if not isinstance(value, dict):
            return set()
        return {value["type"]} | set().union(*map(types, value.values())) if "type" in value else set()

    used = set().union(*(types(make(tmp_path)) for make in CATALOGUE.values()))
    assert used >= {*SHAPES, *BSDFS, *EMITTERS, *SENSORS, *TEXTURES}
