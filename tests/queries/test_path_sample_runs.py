"""Samples of rendered runs: vertices that see each other and lie where the image shows them, and sums as the image's."""

import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import yaml
from running import run_job
from scenes.catalogue import thin_lens
from stats import one_sample, sidak

from queries import Run, open_run
from queries.images import image
from queries.path_sample import PathSample, sample_paths
from queries.selection import Selection
from renderer.tables import CAMERA_ROOT, EMITTER, EMITTER_HIT, LENS, LIGHT_ROOT, NO_OBJECT

SCENES = pathlib.Path(__file__).parents[2] / "configs" / "scenes"
ALL = 10**7
Vertices = list[tuple[int, int]]


def rendered(folder: pathlib.Path, scene: Any, **settings: Any) -> pathlib.Path:
    """A small run of a scene, box filtered."""
    keep = settings.pop("keep", "all")
    render = {"samples": 16, "seed": 3, "sampler": "independent", "max_depth": 6, "filter": "box"} | settings
    job = {"name": "sampled", "scene": scene, "render": render, "record": {"keep": keep}}
    (folder / "job.yaml").write_text(yaml.safe_dump(job, sort_keys=False))
    return run_job(folder / "job.yaml", out=folder / "run", threads=1).path


@pytest.fixture(scope="module", params=["spheres", "sky", "lens"])
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    if request.param != "lens":
        return str(SCENES / f"{request.param}.yaml")
    described = thin_lens(tmp_path_factory.mktemp("scene"))
    described["sensor"] |= {"near_clip": 0.01, "far_clip": 100.0}  # rays pass through what is nearer than `near_clip`
    return described


@pytest.fixture(scope="module", params=["path", "light"])
def run(request: pytest.FixtureRequest, scene: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    size = {"resolution": [24, 16]} if isinstance(scene, str) else {}  # else the scene's
    samples = 16 if request.param == "path" else 64
    with open_run(rendered(tmp_path_factory.mktemp("run"), scene, method=request.param, samples=samples, **size)) as opened:
        yield opened


@pytest.fixture(scope="module")
def sample(run: Run) -> PathSample:
    found = sample_paths(run, Selection(), 1500)
    assert len(found) == 1500 < found.found
    return found


# --- vertices -----------------------------------------------------------------------------------------------------


def test_vertices_see_each_other(run: Run, sample: PathSample) -> None:
    inner = np.ones(len(sample.points), np.bool_)
    inner[sample.start[1:] - 1] = False
    begin = np.flatnonzero(inner)
    start, end = sample.points[begin].astype(float), sample.points[begin + 1].astype(float)
    step = end - start
    length = np.linalg.norm(step, axis=1)
    assert (length > 0).all()
    # A little off both ends: points of surfaces are rounded
    off = 1e-3 * run.geometry.extent / np.maximum(length, 1e-3 * run.geometry.extent) * 0.4
    blocked = run.geometry.occluded((start + off[:, None] * step).astype(np.float32), step.astype(np.float32), (1 - 2 * off).astype(np.float32))
    assert np.count_nonzero(blocked) <= 1e-3 * len(blocked)  # rays that graze
    # Were points of different paths joined, much would be hidden
    other = np.roll(end, 7, axis=0) - start
    assert run.geometry.occluded((start + 0.01 * other).astype(np.float32), other.astype(np.float32), np.full(len(start), 0.98)).mean() > 0.02


def test_vertices_lie_on_their_objects(run: Run, sample: PathSample) -> None:
    names = run.geometry.object_names
    near = 1e-4 * run.geometry.extent
    assert set(np.unique(sample.object)) <= {*range(len(names)), NO_OBJECT}
    assert (sample.object[sample.start[1:] - 1] == NO_OBJECT).all()
    assert (sample.object[sample.start[:-1]][sample.infinite] == NO_OBJECT).all()
    for thing in set(np.unique(sample.object)) - {NO_OBJECT}:
        low, high = run.geometry.object_bounds(names[thing])
        points = sample.points[sample.object == thing]
        assert ((points >= low - near) & (points <= high + near)).all(), names[thing]


def test_the_camera_sees_them_at_their_place_on_the_film(run: Run, sample: PathSample) -> None:
    camera, described = run.geometry.camera, run.manifest["camera"]
    lens, seen = sample.points[sample.start[1:] - 1].astype(float), sample.points[sample.start[1:] - 2].astype(float)
    offset, axis = lens - camera.origin, camera.optical_axis
    if described["lens_radius"]:
        assert 0.9 * described["lens_radius"] < np.linalg.norm(offset, axis=1).max() <= described["lens_radius"] * 1.0001
        assert np.abs(offset @ axis).max() < 1e-5
        # What the lens sees of a point is sharp on the plane of focus
        seen = lens + (seen - lens) * (described["focus"] / ((seen - lens) @ axis))[:, None]
    else:
        assert np.abs(offset).max() < 1e-5
    x, y, before = camera.project(seen.astype(np.float32))
    assert before.all()
    assert np.abs(np.stack([x, y], axis=1) - sample.raster).max() < 0.01


def test_light_from_infinity_comes_from_a_sphere_around_the_scene(run: Run, sample: PathSample) -> None:
    kinds = run.tables["emitters"]["infinite"].to_pylist()
    assert sample.infinite.all() == all(kinds) == ("sky" in str(run.manifest["job"]["scene"]))
    assert sample.infinite.any() == any(kinds)
    low, high = run.geometry.caster.bounds
    distance = np.linalg.norm(sample.points[sample.start[:-1]][sample.infinite] - (low + high) / 2, axis=1)
    assert np.allclose(distance, run.geometry.extent, rtol=1e-5)


def test_events_are_those_of_the_words(run: Run, sample: PathSample) -> None:
    tree = {row["word"]: (row["parent"], row["event"], row["object"]) for row in run.tables["words"].to_pylist()}

    def letters(word: int | None, root: int) -> Vertices:
        """The interactions of a walk, the last first."""
        spelled = []
        while word is not None and word != root:
            word, event, thing = tree[word]
            spelled.append((event, thing))
        return spelled

    key = "camera_walk" if run.settings["method"] == "path" else "light_walk"
    rows = {(row[key], row["path"]): row for row in run.tables["paths"].select([key, "path", WORDS[key], "technique"]).to_pylist()}
    hits = 0
    for i, name in enumerate(zip(sample.owner.tolist(), sample.path.tolist())):
        row, here = rows[name], slice(sample.start[i], sample.start[i + 1])
        middle = letters(row.get("light_word"), LIGHT_ROOT)[::-1] + letters(row.get("camera_word"), CAMERA_ROOT)
        assert list(zip(sample.event[here].tolist(), sample.object[here].tolist()))[1:-1] == middle
        assert (sample.event[here][0], sample.event[here][-1]) == (EMITTER, LENS)
        hits += row["technique"] == EMITTER_HIT
    assert (hits > 0) == (key == "camera_walk")


WORDS = {"camera_walk": "camera_word", "light_walk": "light_word"}


# --- sums ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("by", ["uniform", "contribution"])
def test_sums_estimate_the_image(run: Run, by: str) -> None:
    exact = image(run).sum(axis=(0, 1), dtype=float) * run.settings["passes"]
    every = sample_paths(run, Selection(), ALL, by)
    assert np.allclose(every.scale @ every.contribution, exact, rtol=1e-4)
    estimates = np.stack([found.scale @ found.contribution for found in (sample_paths(run, Selection(), 300, by, seed) for seed in range(40))])
    assert (one_sample(estimates, exact) > sidak(3 * 12)).all()
    if by == "contribution":
        # No more variance than a sum of equal rows drawn one less times has (duffield2007): of luminance, to which the channels are close
        luminance = estimates @ [0.2126, 0.7152, 0.0722]
        assert luminance.std() < 1.3 * (exact @ [0.2126, 0.7152, 0.0722]) / np.sqrt(299)


def test_a_share_of_the_walks_estimates_the_whole_image(tmp_path: pathlib.Path) -> None:
    with open_run(rendered(tmp_path, str(SCENES / "spheres.yaml"), keep=0.3, resolution=[24, 16])) as run:
        whole = np.load(run.path / "film" / "sum.npy")[..., :3].sum(axis=(0, 1))
        every = sample_paths(run, Selection(), ALL)
        assert (every.scale == 1 / 0.3).all()
        # Walks are kept or not by themselves: the variance of their sums
        _, walk = np.unique(every.owner, return_inverse=True)
        for channel in range(3):
            sums = np.bincount(walk, every.contribution[:, channel].astype(float))
            error = np.sqrt((1 - 0.3) * np.sum(sums**2)) / 0.3
            assert 0 < abs(every.scale @ every.contribution[:, channel] - whole[channel]) < 3.5 * error < 0.5 * whole[channel]
