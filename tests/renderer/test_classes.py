"""Each class's energy is unbiased by itself: path and light tracer agree class by class, and every lobe with a render of that lobe alone."""

import pathlib

import numpy as np
import pytest
from classes import class_energies, spellings
from rendering import columns, record, replicate_images, settings_of, with_all_features
from scenes.light_paths import coated_scene, light_paths
from stats import assert_same_image, blocks, sidak, welch

from renderer.scene.load import load_scene

REPLICATES = 16
ENOUGH = 500  # rows of a class in each render, for its mean to be nearly normal
NAMES = ("paths", "words")  # the tables that classes are read from
LOBE_CLASSES = 48  # about how many classes the lobe tests compare in all
DELTA = ("RS", "TS", "Ts")


def seen_by_both(name: str) -> bool:
    """Whether neither end of a class hangs on delta lobes: those that the path tracer cannot join to a bulb, the light tracer not to a pinhole."""
    *events, emitter = name.split(" ")
    if not events:
        return emitter != "L:bulb"
    return events[0] not in DELTA and not (emitter == "L:bulb" and events[-1] in DELTA)


def test_path_and_light_tracer_agree_class_by_class() -> None:
    scene = with_all_features(load_scene(light_paths()))
    found = {}
    for method, samples in (("path", 160), ("light", 240)):
        settings = settings_of(scene, samples * REPLICATES, method, rr_depth=100)
        found[method] = class_energies(record(scene, settings, names=NAMES), scene, settings, REPLICATES)
    (path, path_rows), (light, light_rows) = found["path"], found["light"]
    names = [n for n in path if n in light and seen_by_both(n) and min(path_rows[n], light_rows[n]) >= ENOUGH]

    # classes of every kind are among them: direct, diffuse, glossy, caustics through glass and from coats
    assert {"L:lamp", "RD L:lamp", "RD L:bulb", "RD RD L:lamp", "RG L:lamp", "RD RG L:lamp", "RG RD L:lamp"} <= set(names)
    assert {"RD TS TS L:lamp", "RD RS L:lamp", "RD Ts L:lamp", "RD TG TG L:lamp", "TG TG RD L:lamp"} <= set(names)
    # what one tracer finds often, and both can see, the other finds too
    for rows, others in ((path_rows, light), (light_rows, path)):
        missing = [n for n, k in rows.items() if k >= ENOUGH and seen_by_both(n) and n not in others]
        assert not missing, f"classes that only one tracer finds: {missing}"

    p = {name: float(welch(path[name], light[name]).min()) for name in names}
    worst = min(p, key=p.__getitem__)
    ratio = path[worst].mean(axis=0) / light[worst].mean(axis=0)
    assert p[worst] > sidak(3 * len(p)), f"{worst}: p = {p[worst]:.1e}, path over light {ratio}; of {len(p)} classes"


@pytest.mark.parametrize("method", ["path", pytest.param("light", marks=pytest.mark.slow)])
@pytest.mark.parametrize(("type", "glossy"), [("plastic", "RS"), pytest.param("roughplastic", "RG", marks=pytest.mark.slow)])
def test_lobe_by_lobe(type: str, glossy: str, method: str) -> None:
    """The rows whose events are all of one lobe have the energy of a render in which the other lobe is black."""
    whole = with_all_features(load_scene(coated_scene(type)))
    settings = settings_of(whole, 96 * REPLICATES, method, rr_depth=100)
    energies, rows = class_energies(record(whole, settings, names=NAMES), whole, settings, REPLICATES)
    for lobe, other in (("RD", "specular_reflectance"), (glossy, "diffuse_reflectance")):
        alone = with_all_features(load_scene(coated_scene(type, **{other: 0.0})))
        expected, expected_rows = class_energies(record(alone, settings, names=NAMES), alone, settings, REPLICATES)
        pure = [n for n, k in rows.items() if set(n.split(" ")[:-1]) == {lobe} and k >= ENOUGH]
        found = {"RD": 6, "RG": 4, "RS": 1 if method == "path" else 0}[lobe]  # of RS-only classes, a pinhole sees none by light walks
        assert len(pure) >= found, f"{lobe}: {pure}"
        for name in pure:
            p = welch(energies[name], expected[name])
            assert p.min() > sidak(3 * LOBE_CLASSES), f"{name}: {energies[name].mean(axis=0)} is not {expected[name].mean(axis=0)}, p = {p.min():.1e}"
        impure = [n for n, k in expected_rows.items() if set(n.split(" ")[:-1]) - {lobe}]
        assert not impure, f"the black lobe has rows: {impure}"


@pytest.mark.parametrize("type", ["plastic", "roughplastic"])
def test_direct_diffuse_light_is_noise_free_of_the_other_lobe(type: str, tmp_path: pathlib.Path) -> None:
    """Pixel blocks too: direct light by the diffuse lobe, taken from the rows, against a render of that lobe alone."""
    whole = with_all_features(load_scene(coated_scene(type)))
    settings = settings_of(whole, 32 * REPLICATES, max_depth=2)
    tables = record(whole, settings, names=NAMES)
    spelled = spellings(tables, "path")
    paths = columns(tables["paths"])
    diffuse = np.array([spelled[int(w)] == ("RD",) for w in paths["camera_word"]])
    walk = paths["camera_walk"].astype(np.int64)[diffuse]
    images = np.zeros((REPLICATES, settings.walks_per_pass, 3))
    value = np.stack([paths[f"contribution_{c}"] for c in "rgb"], axis=1).astype(np.float64)[diffuse]
    chunk, pixel = walk // settings.walks_per_pass * REPLICATES // settings.passes, walk % settings.walks_per_pass
    np.add.at(images, (chunk, pixel), value * REPLICATES / settings.passes)
    alone = with_all_features(load_scene(coated_scene(type, specular_reflectance=0.0)))
    one, two = (replicate_images(alone, settings_of(alone, 32 * REPLICATES, max_depth=d), REPLICATES) for d in (1, 2))
    emitters = one.mean(axis=0)
    seen = blocks(np.asarray(emitters[None]), 8)[0].max(axis=-1) == 0  # blocks without a lamp in view
    assert seen.any()
    keep = np.repeat(np.repeat(seen, 8, axis=0), 8, axis=1)[None, :, :, None]
    assert_same_image(images.reshape(REPLICATES, 16, 16, 3) * keep, two * keep, tmp_path, tests=2)
