"""What a run writes: shards, films, catalogues, images."""

import itertools
import json
import pathlib

import numpy as np
import OpenImageIO as oiio
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_job import SHARDS, write_job

from pipeline.catalogues import merged_words
from pipeline.errors import RunFolderError
from pipeline.film_sum import lit_rows
from pipeline.images import read_exr, tone_map, write_exr, write_png
from pipeline.prepare import prepare_job
from pipeline.run_folder import RunFolder
from pipeline.shards import LARGEST, SMALLEST, plan_shards
from pipeline.stages import run_job
from renderer.film import Film
from renderer.tables import CAMERA_ROOT, EVENTS, TECHNIQUES, WORDS
from renderer.trace import Tracer


def read(path: pathlib.Path) -> pa.Table:
    return pa.ipc.open_file(path).read_all()


# --- shards -------------------------------------------------------------------------------------------------------


@settings(deadline=None, derandomize=True)
@given(st.integers(1, 2**31))
def test_shards_cover_all_walks_once(walks: int) -> None:
    shards = plan_shards(walks)
    assert shards[0].first == 0
    assert all(a.first + a.count == b.first for a, b in itertools.pairwise(shards))
    assert shards[-1].first + shards[-1].count == walks
    assert all(SMALLEST <= shard.count <= LARGEST for shard in shards[:-1])
    assert [shard.index for shard in shards] == list(range(len(shards)))


# --- the film -----------------------------------------------------------------------------------------------------


def test_image_is_the_film_of_one_trace(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """Shards and their sum change nothing but the order of additions."""
    prepared = prepare_job(write_job(tmp_path))
    chosen = prepared.settings
    film = Film(chosen.width, chosen.height, chosen.filter)
    Tracer(prepared.scene, chosen).trace((0, chosen.walks), None, film)
    np.testing.assert_allclose(read_exr(tiny_run / "images/beauty.exr"), film.image(chosen.method, chosen.passes), rtol=1e-5)
    np.testing.assert_allclose(np.load(tiny_run / "film/sum.npy"), film.sums, rtol=1e-12)


def test_unrecorded_run_has_the_same_image(tiny_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = run_job(write_job(tmp_path, record={"keep": "none"}, aovs={}), out=tmp_path / "run").path
    assert (run / "film/sum.npy").read_bytes() == (tiny_run / "film/sum.npy").read_bytes()
    assert np.array_equal(read_exr(run / "images/beauty.exr"), read_exr(tiny_run / "images/beauty.exr"))
    assert not list((run / "tables").glob("*/*.arrow"))
    assert json.loads((run / "manifest.json").read_bytes())["stats"]["bytes"] == 0


def test_light_tracing_runs_end_to_end(tmp_path: pathlib.Path) -> None:
    run = run_job(write_job(tmp_path, render={"method": "light", "samples": 8}), out=tmp_path / "run").path
    rows = json.loads((run / "manifest.json").read_bytes())["rows"]
    assert rows["light_vertices"] > 0
    assert rows["paths"] > 0
    assert rows["camera_vertices"] == 0
    assert read_exr(run / "images/beauty.exr").max() > 0


@pytest.mark.parametrize("aovs", [{}, {"seen": "C L", "direct": "C D L"}], ids=["", "aovs"])
@pytest.mark.parametrize("method", ["path", "light"])
def test_run_in_which_nothing_scatters(method: str, aovs: dict[str, str], tmp_path: pathlib.Path) -> None:
    """No walk has a word: the camera sees emitters alone."""
    small = {"method": method, "max_depth": 1, "samples": 2, "resolution": [16, 16], "filter": "box"}
    run = run_job(write_job(tmp_path, render=small, aovs=aovs), out=tmp_path / "run").path
    rows = json.loads((run / "manifest.json").read_bytes())["rows"]
    assert rows["words"] == 0
    assert rows["paths"] > 0
    pictures = {name: read_exr(run / f"images/{name}.exr") for name in ("beauty", *aovs)}
    assert pictures["beauty"].max() > 0
    if aovs:
        assert np.allclose(pictures["seen"], pictures["beauty"])
        assert not pictures["direct"].any()


def test_lit_rows() -> None:
    film = np.zeros((5, 3, 4))
    assert lit_rows(film) == (0, 0)
    film[1, 2, 3] = film[3, 0, 0] = -1
    assert lit_rows(film) == (1, 4)


# --- tables -------------------------------------------------------------------------------------------------------


def test_rows_are_in_order_over_all_shards(tiny_run: pathlib.Path) -> None:
    files = sorted((tiny_run / "tables/camera_vertices").glob("*.arrow"))
    assert [file.name for file in files] == [f"{i:05d}.arrow" for i in range(SHARDS)]
    rows = pa.concat_tables([read(file) for file in files])
    key = rows["walk"].to_numpy().astype(np.int64) * 256 + rows["depth"].to_numpy()
    assert np.all(np.diff(key) > 0)
    assert np.array_equal(np.unique(rows["walk"].to_numpy()), np.arange(64 * 64 * 64))


def test_words_are_merged_over_shards(tiny_run: pathlib.Path) -> None:
    words = read(tiny_run / "tables/words.arrow")
    parts = pa.concat_tables([read(file) for file in sorted((tiny_run / "words").glob("*.arrow"))])
    assert words.schema == WORDS.schema(tuple(c.name for c in WORDS.columns))
    distinct = set(zip(*(parts[name].to_pylist() for name in words.schema.names)))
    assert list(zip(*(words[name].to_pylist() for name in words.schema.names))) == sorted(distinct)
    used = set(read(tiny_run / "tables/paths/00000.arrow")["camera_word"].to_pylist())
    assert used - {CAMERA_ROOT} <= set(words["word"].to_pylist())


def test_colliding_words_are_found(tmp_path: pathlib.Path) -> None:
    folder = RunFolder(tmp_path)
    shards = plan_shards(2 * SMALLEST)
    schema = WORDS.schema(tuple(c.name for c in WORDS.columns))
    folder.table("words", shards[0]).parent.mkdir()
    for shard, thing in zip(shards, (1, 2)):
        table = pa.table({"word": [5, 7 + thing], "parent": [1, 1], "event": [8, 8], "object": [thing, 3]}, schema=schema)
        with pa.ipc.new_file(folder.table("words", shard), schema) as writer:
            writer.write_table(table)
    with pytest.raises(RunFolderError, match="share the word 0x5"):
        merged_words(folder, shards)


def test_catalogues(tiny_run: pathlib.Path) -> None:
    tables = tiny_run / "tables"
    assert read(tables / "events.arrow")["key"].to_pylist() == [event.key for event in EVENTS]
    assert read(tables / "techniques.arrow")["name"].to_pylist() == list(TECHNIQUES)
    objects = read(tables / "objects.arrow").to_pylist()
    assert [row["name"] for row in objects] == ["floor", "block", "lamp"]
    assert objects[1]["area"] == pytest.approx(6 * 0.8**2, rel=1e-5)
    assert [round(objects[1][f"max_{axis}"], 5) for axis in "xyz"] == [0.4, 0.8, 0.4]
    emitters = read(tables / "emitters.arrow").to_pylist()
    assert emitters == [{"emitter": 0, "name": "lamp", "kind": "area", "object": 2, "infinite": False, "symbol": "L"}]
    triangles = read(tables / "triangles.arrow")
    assert triangles.num_rows == 2 + 12 + 2
    corners = np.stack([triangles[name].to_numpy() for name in triangles.schema.names[2:]], axis=1).reshape(-1, 3, 3)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    per_object = np.bincount(triangles["object"].to_numpy(), areas)
    np.testing.assert_allclose(per_object, [row["area"] for row in objects], rtol=1e-5)
    run = read(tables / "run.arrow").to_pylist()[0]
    assert (run["method"], run["width"], run["passes"], run["seed"], run["walks"]) == ("path", 64, 64, 3, 64**3)
    assert json.loads(run["camera"])["width"] == 64
    assert json.loads(run["scene"])["type"] == "scene"


# --- images -------------------------------------------------------------------------------------------------------


def test_exr_is_linear_with_names_and_metadata(tmp_path: pathlib.Path) -> None:
    image = np.random.default_rng(1).random((5, 7, 3), np.float32) * 100
    for name in ("a", "b"):
        write_exr(tmp_path / f"{name}.exr", image, {"job": "tiny", "seed": str(2**60), "version": "0.1.0"})
    assert np.array_equal(read_exr(tmp_path / "a.exr"), image)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert tuple(spec.channelnames) == ("R", "G", "B")
    assert spec.format == oiio.FLOAT
    assert spec.get_string_attribute("pathspace:job") == "tiny"
    assert spec.get_string_attribute("pathspace:seed") == str(2**60)
    assert spec.get_string_attribute("Software") == "pathspace 0.1.0"


def test_tone_map_is_the_srgb_curve() -> None:
    linear = np.array([[[0.0, 0.0031308, 0.18], [0.5, 1.0, 7.0], [np.nan, np.inf, -1.0]]], np.float32)
    assert tone_map(linear).tolist() == [[[0, 10, 118], [188, 255, 255], [0, 255, 0]]]
    assert tone_map(linear, exposure=1.0)[0, 0, 2] == tone_map(2 * linear)[0, 0, 2] == 162


def test_png_reads_back(tmp_path: pathlib.Path) -> None:
    image = np.random.default_rng(2).random((4, 6, 3), np.float32)
    write_png(tmp_path / "a.png", image)
    source = oiio.ImageInput.open(str(tmp_path / "a.png"))
    assert np.array_equal(source.read_image(oiio.UINT8), tone_map(image))


def test_unwritable_image_is_an_error(tmp_path: pathlib.Path) -> None:
    with pytest.raises(RunFolderError, match="cannot be written"):
        write_exr(tmp_path / "nowhere" / "a.exr", np.zeros((2, 2, 3), np.float32), {})


def test_lock_ends_with_the_block(tmp_path: pathlib.Path) -> None:
    folder = RunFolder(tmp_path / "run")
    with folder.locked():
        pass
    with folder.locked(), pytest.raises(RunFolderError, match="another run"), folder.locked():
        pass
