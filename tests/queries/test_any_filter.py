"""Any reconstruction filter after rendering: the images that rendering with it would have made."""

import json
import pathlib

import numpy as np
import pytest
from running import run_job, shared_kernels
from synthetic import make_run

from pipeline.prepare import prepare_job
from queries import open_run
from queries.errors import QueryError
from queries.film import covered
from queries.images import aov_image, image, images, select
from renderer.film import Film
from renderer.filters import FILTERS, reconstruction_filter
from renderer.trace import Tracer

SCENE = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "spheres.yaml"
OTHERS = ("tent", "gaussian", "mitchell", "lanczos")


@pytest.fixture(scope="module", params=["path", "light"])
def box(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[pathlib.Path, pathlib.Path]:
    """A job with a box, and its run."""
    place = tmp_path_factory.mktemp("box")
    render = f"method: {request.param}, filter: box, resolution: [20, 16], samples: 6, seed: 3, sampler: independent, max_depth: 4"
    (place / "job.yaml").write_text(f"name: spheres\nscene: {SCENE}\nrender: {{{render}}}\n")
    return place / "job.yaml", run_job(place / "job.yaml", out=place / "run", threads=1).path


@pytest.fixture(scope="module")
def tracer(box: tuple[pathlib.Path, pathlib.Path]) -> Tracer:
    """What traces the run's walks anew."""
    job = prepare_job(box[0])
    with shared_kernels():
        return Tracer(job.scene, job.settings)


@pytest.mark.parametrize("filter", OTHERS)
def test_a_filter_after_rendering_is_that_filter_while_rendering(box: tuple[pathlib.Path, pathlib.Path], tracer: Tracer, filter: str) -> None:
    film = Film(20, 16, filter)
    tracer.trace((0, tracer.settings.walks), None, film)
    expected = film.sums[..., :3] / (film.sums[..., 3:] if tracer.settings.method == "path" else 6 * FILTERS[filter].integral ** 2)
    found = image(box[1], filter=filter)
    assert np.abs(found - image(box[1])).max() > 0.1 * expected.max()
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=2e-5 * expected.max())


def test_layers_sum_to_the_image_through_any_filter(box: tuple[pathlib.Path, pathlib.Path]) -> None:
    texts = ("C.", "CD.", "CD.+.", "C[^D].*.")
    with open_run(box[1]) as run:
        layers = images(run, {text: text for text in texts}, filter="mitchell", threads=2)
        whole = image(run, filter="mitchell")
        assert np.array_equal(layers["CD."], aov_image(run, "CD.", filter="mitchell", threads=1))
        assert np.array_equal(select(run, {"all": None}, filter="mitchell")["all"].image, whole)
        assert np.array_equal(image(run, filter="box"), image(run))
    np.testing.assert_allclose(sum(layer.astype(np.float64) for layer in layers.values()), whole, rtol=1e-5, atol=1e-6 * whole.max())


@pytest.mark.parametrize("filter", ["gaussian", "lanczos"])
def test_a_share_of_the_walks_is_divided_by_expected_weights(tmp_path: pathlib.Path, filter: str) -> None:
    made = make_run(tmp_path / "run", keep=0.5)
    one = reconstruction_filter(filter)
    across, down = (np.array([integral(one, i, size) for i in range(size)]) for size in (7, 5))
    sums = np.zeros((5, 7, 3))
    y, x = np.mgrid[:5, :7] + 0.5
    for row in made.rows:
        dx, dy = np.abs(row["raster_x"] - x), np.abs(row["raster_y"] - y)
        weight = one.weight(dx) * one.weight(dy) * (dx < one.radius) * (dy < one.radius)
        sums += weight[..., None] * np.array([row[f"contribution_{c}"] for c in "rgb"])
    expected = sums / (0.5 * 4 * np.outer(down, across))[..., None]
    np.testing.assert_allclose(image(made.folder, filter=filter), expected, rtol=1e-4, atol=1e-4 * expected.max())


def integral(one, pixel: int, size: int) -> float:
    """A filter's integral over a row of pixels, centered at one of them, by many midpoints."""
    t = (np.arange(size * 20_000) + 0.5) / 20_000 - (pixel + 0.5)
    return float((one.weight(t) * (np.abs(t) < one.radius)).sum() / 20_000)


@pytest.mark.parametrize("filter", ["tent", "catmullrom", "lanczos"])
def test_covered(filter: str) -> None:
    np.testing.assert_allclose(covered(FILTERS[filter], 9), [integral(FILTERS[filter], i, 9) for i in range(9)], rtol=1e-6)


def test_refusals(tmp_path: pathlib.Path) -> None:
    made = make_run(tmp_path / "run")
    with pytest.raises(QueryError, match="known are box, tent"):
        image(made.folder, filter="blackman")
    older = without_unlit(made.folder)
    assert image(older).any()
    assert image(older, filter="box").any()
    with pytest.raises(QueryError, match="Render it again"):
        image(older, filter="tent")


def without_unlit(folder: pathlib.Path) -> pathlib.Path:
    """The run as it was recorded before there was such a table."""
    for file in [*(folder / "shards").glob("*.json")]:
        record = json.loads(file.read_text())
        record["files"] = {name: known for name, known in record["files"].items() if "/unlit/" not in name}
        file.write_text(json.dumps(record))
    manifest = json.loads((folder / "manifest.json").read_text())
    del manifest["rows"]["unlit"]
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder
