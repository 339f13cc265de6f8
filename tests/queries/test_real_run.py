"""Runs of the renderer: the same answers as from trying every path, and images as the film's."""

import collections
import pathlib

import numpy as np
import pytest
from running import run_job
from words import matches

from queries import Run, open_run
from queries.images import aov_image, image
from queries.lpe import compile
from queries.lpe.parser import parse
from queries.lpe.syntax import PathEvent
from renderer.tables import CAMERA_ROOT, LIGHT_ROOT

SCENE = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "spheres.yaml"


@pytest.fixture(scope="module", params=[("path", "box"), ("light", "box"), ("path", "gaussian")], ids="-".join)
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    method, filter = request.param
    place = tmp_path_factory.mktemp("real")
    render = f"method: {method}, filter: {filter}, resolution: [20, 16], samples: 12, seed: 3, sampler: independent, max_depth: 7"
    (place / "job.yaml").write_text(f"name: spheres\nscene: {SCENE}\nrender: {{{render}}}\n")
    return run_job(place / "job.yaml", out=place / "run", threads=1).path


def words_of(run: Run) -> list[tuple[PathEvent, ...]]:
    """The word of every path, spelled letter by letter from the tables."""
    rows = {name: {row[key]: row for row in run.tables[name].to_pylist()} for name, key in KEYS.items()}

    def letters(word: int | None, root: int) -> list[PathEvent]:
        spelled = []
        while word is not None and word != root:
            row = rows["words"][word]
            event, thing = rows["events"][row["event"]], rows["objects"][row["object"]]
            spelled.append(PathEvent(event["type"], event["scattering"], (thing["name"], thing["material"], event["lobe"])))
            word = row["parent"]
        return spelled

    words = []
    for path in run.tables["paths"].to_pylist():
        emitter = rows["emitters"][path["emitter"]]
        owner = rows["objects"].get(emitter["object"])
        end = PathEvent(emitter["symbol"], None, (emitter["name"], *([owner["name"], owner["material"]] if owner else [])))
        camera, light = letters(path.get("camera_word"), CAMERA_ROOT), letters(path.get("light_word"), LIGHT_ROOT)
        words.append((PathEvent("C", None), *reversed(camera), *light, end))
    return words


KEYS = {"words": "word", "events": "key", "objects": "object", "emitters": "emitter"}
EXPRESSIONS = ["CDL", "C.*L", "CD.*S.*L", "C<RD><T.>+L", "C[^D]*D.*L", "CD{2,}L", "C.*L - CDL", "C.*<R.'diffuse'>.*L & C.*S.*L"]


@pytest.fixture(scope="module")
def spelled(folder: pathlib.Path) -> dict[tuple[PathEvent, ...], int]:
    """The distinct words of the run's paths, and how many paths have each."""
    with open_run(folder) as run:
        return collections.Counter(words_of(run))


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_expressions(folder: pathlib.Path, spelled: dict[tuple[PathEvent, ...], int], text: str) -> None:
    with open_run(folder) as run:
        tree = parse(text).tree
        expected = sum(count for word, count in spelled.items() if matches(tree, word))
        sql = compile(text).sql(columns="count(*)")
        assert run.connection.execute(sql).fetchone() == (expected,)
        assert expected > 0


def test_the_image_of_the_paths_is_the_film_s(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        film = np.load(folder / "film" / "sum.npy")
        weights = film[..., 3:] if run.settings["method"] == "path" else run.settings["passes"]
        expected = film[..., :3] / weights
        found = image(run)
    assert expected.max() > 0
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * expected.max())


def test_layers_sum_to_the_image(folder: pathlib.Path) -> None:
    layers = [aov_image(folder, text).astype(np.float64) for text in ("C.", "CD.", "CD.+.", "C[^D].*.")]
    whole = image(folder)
    np.testing.assert_allclose(sum(layers), whole, rtol=1e-5, atol=1e-6 * whole.max())
