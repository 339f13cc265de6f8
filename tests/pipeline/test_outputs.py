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
from tiny_job import SCENE, SHARDS, write_job

from pipeline import rankings
from pipeline.catalogues import merged_words
from pipeline.config import Rank
from pipeline.errors import RunFolderError
from pipeline.film_sum import lit_rows
from pipeline.images import read_exr, tone_map, write_exr, write_layers, write_png
from pipeline.prepare import prepare_job
from pipeline.run_folder import RunFolder
from pipeline.shards import LARGEST, SMALLEST, plan_shards
from pipeline.stages import run_job
from queries import Run, open_run
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


def test_layers_of_one_exr(tmp_path: pathlib.Path) -> None:
    random = np.random.default_rng(3)
    layers = {name: random.random((5, 7, 3), np.float32) for name in ("", "direct", "b.c")}
    for name in ("a", "b"):
        write_layers(tmp_path / f"{name}.exr", layers, {"direct": "C D L"})
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    spec, pixels = source.spec(), source.read_image(oiio.FLOAT)
    for name, image in layers.items():
        channels = [spec.channelnames.index(f"{name}.{channel}" if name else channel) for channel in "RGB"]
        assert np.array_equal(pixels[..., channels], image)
    assert spec.get_string_attribute("pathspace:direct") == "C D L"
    assert np.array_equal(read_exr(tmp_path / "a.exr"), layers[""])


# --- AOVs ---------------------------------------------------------------------------------------------------------

AOVS = {
    "seen": "C L",
    "direct": "C D L",
    "rest": "C .* L - C D? L",
    "shadow": "shadows; C D .@blocker:block",
    "near": "C X@middle .* L",
    "open": "unoccluded; C D L",
}
MIDDLE = {"middle": {"sphere": {"center": [0, 0.5, 0], "radius": 1.2}}}


@pytest.fixture(scope="module")
def aov_run(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("aovs")
    return run_job(write_job(folder, aovs=AOVS, regions=MIDDLE), out=folder / "run", threads=2).path


def test_aovs_as_layers(aov_run: pathlib.Path) -> None:
    source = oiio.ImageInput.open(str(aov_run / "images/layers.exr"))
    spec, pixels = source.spec(), source.read_image(oiio.FLOAT)
    assert len(spec.channelnames) == 3 * (1 + len(AOVS))
    for name, text in AOVS.items():
        layer = pixels[..., [spec.channelnames.index(f"{name}.{channel}") for channel in "RGB"]]
        assert layer.max() > 0
        assert np.array_equal(layer, read_exr(aov_run / f"images/{name}.exr"))
        assert spec.get_string_attribute(f"pathspace:expression:{name}") == text
    beauty = read_exr(aov_run / "images/layers.exr")
    assert np.array_equal(beauty, read_exr(aov_run / "images/beauty.exr"))
    parts = [read_exr(aov_run / f"images/{name}.exr").astype(np.float64) for name in ("seen", "direct", "rest")]
    np.testing.assert_allclose(sum(parts), beauty, rtol=1e-5, atol=1e-6)


def test_layers_have_the_same_bits_again(aov_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    """On another number of threads, and made anew after some files were lost."""
    again = run_job(write_job(tmp_path, aovs=AOVS, regions=MIDDLE), out=tmp_path / "run", threads=1).path
    names = [*AOVS, "layers"]
    assert all((again / f"images/{name}.exr").read_bytes() == (aov_run / f"images/{name}.exr").read_bytes() for name in names)
    kept = (again / "images/seen.exr").stat().st_mtime_ns
    for name in ("layers", "direct"):
        (again / f"images/{name}.exr").unlink()
    run_job(tmp_path / "tiny.yaml", out=again, resume=True, threads=2)
    assert all((again / f"images/{name}.exr").read_bytes() == (aov_run / f"images/{name}.exr").read_bytes() for name in names)
    assert (again / "images/seen.exr").stat().st_mtime_ns == kept


def test_aovs_follow_the_regions_of_the_job(aov_run: pathlib.Path, tmp_path: pathlib.Path) -> None:
    near = {"near": AOVS["near"]}
    run = run_job(write_job(tmp_path, aovs=near, regions=MIDDLE), out=tmp_path / "run").path
    before = read_exr(run / "images/near.exr")
    smaller = {"middle": {"sphere": {"center": [0, 0.5, 0], "radius": 0.6}}}
    run_job(write_job(tmp_path, aovs=near, regions=smaller), out=run, resume=True)
    after = read_exr(run / "images/near.exr")
    assert 0 < after.sum() < before.sum()


FACES = "013 032 467 475 045 051 237 276 026 064 157 173"
BOX = "OFF\n8 12 0\n" + "".join(f"{x} {y} {z}\n" for x in (-1, 1) for y in (0, 1) for z in (-1, 1)) + "".join(
    f"3 {' '.join(face)}\n" for face in FACES.split()
)  # fmt: skip


def test_what_a_job_makes_follows_the_mesh_of_a_region(tmp_path: pathlib.Path) -> None:
    (tmp_path / "box.off").write_text(BOX)
    job = write_job(tmp_path, aovs={"near": "C X@box .* L"}, regions={"box": {"mesh": "box.off"}}, rank={"near": {"region": "box"}})
    run = run_job(job, out=tmp_path / "run").path
    made = [run / "images/near.exr", run / "rankings/near.csv"]
    before = [file.read_bytes() for file in made]
    times = [file.stat().st_mtime_ns for file in made]
    run_job(job, out=run, resume=True)
    assert [file.stat().st_mtime_ns for file in made] == times
    (tmp_path / "box.off").write_text(BOX.replace("-1 0", "-0.2 0"))
    run_job(job, out=run, resume=True)
    assert all(file.read_bytes() != old for file, old in zip(made, before))


def test_rankings_go_on_where_they_were_interrupted(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = write_job(tmp_path, regions=MIDDLE, rank={name: {"region": "middle", "top": top} for name, top in (("one", 1), ("two", 2))})
    original = rankings.ranked

    def interrupted(run: Run, asked: Rank, threads: int | None) -> pa.Table:
        if asked.top == 2:
            raise KeyboardInterrupt
        return original(run, asked, threads)

    monkeypatch.setattr(rankings, "ranked", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_job(job, out=tmp_path / "run")
    monkeypatch.undo()
    written = (tmp_path / "run/rankings/one.csv").stat().st_mtime_ns
    run_job(job, out=tmp_path / "run", resume=True)
    assert (tmp_path / "run/rankings/one.csv").stat().st_mtime_ns == written
    assert (tmp_path / "run/rankings/two.csv").exists()


def test_unoccluded_light_is_that_of_the_scene_without_the_blocker(tmp_path: pathlib.Path) -> None:
    """Two runs of different seeds: blocks of pixels agree within their own noise, and where the shadow falls the block's light does not."""
    floor = {"floor": "C <R.>@object:floor L", "open": "unoccluded; C <R.>@object:floor L", "shadow": "shadows; C <R.>@object:floor .@blocker:block"}
    thrown = write_job(tmp_path, name="with", aovs=floor, render={"samples": 128, "filter": "box", "resolution": [32, 32], "max_depth": 3})
    with_block = run_job(thrown, out=tmp_path / "with").path
    scene = {key: value for key, value in SCENE.items() if key != "block"}
    clear = write_job(tmp_path, name="without", scene=scene, aovs={"floor": floor["floor"]},
                      render={"samples": 128, "filter": "box", "resolution": [32, 32], "max_depth": 3, "seed": 11})  # fmt: skip
    without = run_job(clear, out=tmp_path / "without").path
    seen = visible_floor(with_block)
    found, expected = (read_exr(run / f"images/{name}.exr").astype(np.float64)[..., 0] for run, name in ((with_block, "open"), (without, "floor")))
    direct, shadow = (read_exr(with_block / f"images/{name}.exr").astype(np.float64)[..., 0] for name in ("floor", "shadow"))
    z = {name: z_scores(image, expected, seen) for name, image in (("open", found), ("with shadow", direct), ("filled", direct + shadow))}
    assert len(z["open"]) >= 10
    together = {name: scores.sum() / np.sqrt(len(scores)) for name, scores in z.items()}
    assert max(np.abs(z["open"]).max(), np.abs(z["filled"]).max()) < 4.5
    assert max(abs(together["open"]), abs(together["filled"])) < 3.5
    assert together["with shadow"] < -6  # what the block keeps away can be seen at all


def visible_floor(run: pathlib.Path) -> np.ndarray:
    """Whether all camera walks of a pixel meet the floor first: bool (height, width)."""
    with open_run(run) as opened:
        text = """SELECT (walk % 1024)::INT AS pixel, bool_and(object = 0) AS all_floor FROM camera_vertices WHERE depth = 1 GROUP BY 1 ORDER BY 1"""
        found = opened.connection.execute(text).fetchnumpy()
    seen = np.zeros(1024, np.bool_)
    seen[found["pixel"]] = found["all_floor"].astype(np.bool_)
    return seen.reshape(32, 32)


def z_scores(a: np.ndarray, b: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """How far apart two noisy images are in blocks of 4 x 4 pixels, in standard errors of the difference, estimated from the block's pixels."""
    scores = []
    for y in range(0, 32, 4):
        for x in range(0, 32, 4):
            block = np.s_[y : y + 4, x : x + 4]
            if seen[block].all():
                difference = (a - b)[block]
                scores.append(difference.mean() / (difference.std(ddof=1) / np.sqrt(difference.size)))
    return np.array(scores)


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
