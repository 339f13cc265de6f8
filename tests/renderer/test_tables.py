"""The recorded tables: they sum to the film's image, their rows chain up and spell their words, their points can be rebuilt."""

import numpy as np
import pyarrow as pa
import pytest
from rendering import Tables, columns, record, settings_of, with_all_features
from scenes.mixed import mixed

from renderer.film import Film
from renderer.integrators.minimal import MinimalPathTracer
from renderer.scene.arrays import Scene
from renderer.scene.load import load_scene
from renderer.settings import TraceSettings
from renderer.shapes.surface import surface_at
from renderer.tables import (
    ABSORBED,
    CAMERA_ROOT,
    DEPTH_LIMIT,
    EMITTER,
    EMITTER_HIT,
    EMITTER_SAMPLE,
    ESCAPED,
    FIRST_SCATTERING,
    LENS,
    LENS_SAMPLE,
    LIGHT_ROOT,
    NO_OBJECT,
    ROULETTE,
    SPECULAR_REFLECTION,
)

COLUMNS = frozenset({"primitive", "u", "v"})
METHODS = ("path", "light")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return with_all_features(load_scene(mixed()))


def settings(scene: Scene, method: str, **changes: object) -> TraceSettings:
    return settings_of(scene, 16, method, rr_depth=3, columns=COLUMNS, occluded=True, **changes)


@pytest.fixture(scope="module", params=METHODS)
def run(request: pytest.FixtureRequest, scene: Scene) -> tuple[str, Tables, Film]:
    """Method, tables and film of a small render, in tiles that do not divide it evenly."""
    s = settings(scene, request.param)
    film = Film(s.width, s.height)
    return request.param, record(scene, s, film=film, tile=1000), film


def side(method: str) -> str:
    return "camera" if method == "path" else "light"


def vertices(method: str, tables: Tables) -> dict[str, np.ndarray]:
    return columns(tables[f"{side(method)}_vertices"])


def triples(table: dict[str, np.ndarray], prefix: str) -> np.ndarray:
    return np.stack([table[f"{prefix}_{c}"] for c in ("rgb" if prefix != "endpoint" else "xyz")], axis=1)


def test_image_from_paths_is_the_films(run: tuple[str, Tables, Film], scene: Scene) -> None:
    method, tables, film = run
    s = settings(scene, method)
    paths = columns(tables["paths"])
    image = np.zeros((s.height, s.width, 3))
    np.add.at(image, (paths["raster_y"].astype(int), paths["raster_x"].astype(int)), triples(paths, "contribution").astype(np.float64))
    expected = film.image(method, s.passes)
    assert expected.min() >= 0
    assert expected.mean() > 0.05
    np.testing.assert_allclose(image / s.passes, expected, rtol=1e-5, atol=1e-7)


def test_rows_are_in_order_and_chain_up(run: tuple[str, Tables, Film], scene: Scene) -> None:
    """Rows are sorted by walk, depths of a walk are contiguous, and only the last vertex of a walk has an end as its event."""
    method, tables, _ = run
    v = vertices(method, tables)
    begins = 1 if method == "path" else 0  # a pinhole is no vertex, a point on an emitter is
    starts = np.flatnonzero(np.append(True, v["walk"][1:] != v["walk"][:-1]))
    assert np.array_equal(v["walk"][starts], np.arange(settings(scene, method).walks) if method == "light" else np.unique(v["walk"]))
    assert np.all(np.diff(v["walk"].astype(np.int64)) >= 0)
    length = np.diff(np.append(starts, len(v["walk"])))
    assert np.array_equal(v["depth"], np.arange(len(v["walk"])) - np.repeat(starts, length) + begins)
    last = np.zeros(len(v["walk"]), bool)
    last[starts + length - 1] = True
    goes_on = (v["event"] >= FIRST_SCATTERING) | ((v["event"] == EMITTER) & (v["depth"] == 0))
    assert goes_on[~last].all()
    ends = {ABSORBED, ESCAPED, ROULETTE, DEPTH_LIMIT} | ({EMITTER} if method == "light" else set())
    assert set(v["event"][last]) <= ends
    assert {ABSORBED, ESCAPED, ROULETTE, DEPTH_LIMIT} <= set(v["event"]), "the scene should make every ending happen"
    assert LENS not in v["event"]
    assert method == "path" or np.array_equal(v["event"] == EMITTER, v["depth"] == 0)
    assert np.all((v["object"] == NO_OBJECT) >= (v["event"] == ESCAPED))
    p = columns(tables["paths"])
    key = p[f"{side(method)}_walk"].astype(np.int64) * 65536 + p["path"]
    assert np.all(np.diff(key) > 0)
    new = np.append(True, np.diff(p[f"{side(method)}_walk"].astype(np.int64)) > 0)
    assert np.array_equal(new, p["path"] == 0)


def spelled(words: dict[int, tuple[int, int, int]], word: int, root: int) -> list[tuple[int, int]]:
    """The events and objects of a word, first to last."""
    letters = []
    while word != root:
        parent, event, thing = words[word]
        letters.append((event, thing))
        word = parent
    return letters[::-1]


def test_words_spell_the_walks(run: tuple[str, Tables, Film], scene: Scene) -> None:
    """A path's word spells its walk's vertices up to the connection, and there the lobe that was evaluated, not the one that was sampled."""
    method, tables, _ = run
    w = columns(tables["words"])
    assert np.all(np.diff(w["word"].astype(object)) > 0)
    words = {int(a): (int(b), int(c), int(d)) for a, b, c, d in zip(w["word"], w["parent"], w["event"], w["object"])}
    root = CAMERA_ROOT if method == "path" else LIGHT_ROOT
    v = vertices(method, tables)
    walk_of: dict[int, list[tuple[int, int]]] = {}
    for walk, depth, event, thing in zip(v["walk"], v["depth"], v["event"], v["object"]):
        if depth > 0:
            walk_of.setdefault(int(walk), []).append((int(event), int(thing)))
    techniques = set()
    for table in ("paths", "occluded"):
        p = columns(tables[table])
        s = side(method)
        for walk, depth, event, word, technique, emitter in zip(
            p[f"{s}_walk"], p[f"{s}_depth"], p[f"{s}_event"], p[f"{s}_word"], p["technique"], p["emitter"]
        ):
            letters = spelled(words, int(word), root)
            seen = walk_of.get(int(walk), [])
            techniques.add(int(technique))
            if technique == EMITTER_HIT:
                assert event == EMITTER
                assert letters == seen[: depth - 1]
                thing = scene.emitters[emitter].object
                assert seen[depth - 1][1] == (thing if thing >= 0 else NO_OBJECT)
            elif depth == 0:
                assert event == EMITTER
                assert letters == []
            else:
                assert letters[:-1] == seen[: depth - 1]
                assert letters[-1] == (event, seen[depth - 1][1])
                assert event >= FIRST_SCATTERING
                assert event != SPECULAR_REFLECTION
    assert techniques == ({EMITTER_HIT, EMITTER_SAMPLE} if method == "path" else {LENS_SAMPLE})


def test_stored_points_are_rebuilt(run: tuple[str, Tables, Film], scene: Scene) -> None:
    """The shading point comes back, bit for bit, from (primitive, u, v)."""
    method, tables, _ = run
    v = vertices(method, tables)
    on_surface = (v["depth"] > 0) & (v["event"] != ESCAPED)
    geometry = scene.arrays.geometry
    rows = np.flatnonzero(on_surface)[:: max(1, on_surface.sum() // 5000)]
    kinds = set()
    for i in rows:
        hit = surface_at(geometry, int(v["primitive"][i]), v["u"][i], v["v"][i])
        assert tuple(hit.p) == (v["x"][i], v["y"][i], v["z"][i])
        assert hit.object == v["object"][i]
        kinds.add(scene.objects[hit.object].shape)
    assert kinds >= {"rectangle", "cube", "sphere", "cylinder", "disk"}
    length = np.sqrt(v["x"] ** 2 + v["y"] ** 2 + v["z"] ** 2)[v["event"] == ESCAPED]
    np.testing.assert_allclose(length, 1, rtol=1e-5)


def test_values_are_sound(run: tuple[str, Tables, Film], scene: Scene) -> None:
    method, tables, _ = run
    s = settings(scene, method)
    for table in tables.values():
        for name in table.column_names:
            assert table[name].null_count == 0
            assert np.isfinite(table[name].to_numpy()).all()
    for name in ("paths", "occluded"):
        p = columns(tables[name])
        assert len(p["path"]) > 500, name
        assert (triples(p, "contribution") >= 0).all()
        assert (triples(p, "contribution").max(axis=1) > 0).all()
        assert p["emitter"].max() < len(scene.emitters)
        assert (p["raster_x"] >= 0).all()
        assert (p["raster_x"] < s.width).all()
        assert (p["raster_y"] >= 0).all()
        assert (p["raster_y"] < s.height).all()
        if method == "path":
            pixel = p["camera_walk"].astype(np.int64) % s.walks_per_pass
            assert np.array_equal(np.floor(p["raster_x"]), pixel % s.width)
            assert np.array_equal(np.floor(p["raster_y"]), pixel // s.width)
            assert (p["mis_weight"] > 0).all()
            assert (p["mis_weight"] <= 1).all()
        assert p[f"{side(method)}_depth"].max() <= s.max_depth - (p["technique"].max() != EMITTER_HIT and method == "light")
    v = vertices(method, tables)
    assert (triples(v, "throughput") >= 0).all()


def test_bytes(run: tuple[str, Tables, Film], scene: Scene) -> None:
    """At most 32 bytes a vertex and 56 a path, with the columns that are stored by default."""
    method, _, _ = run
    tables = record(scene, settings_of(scene, 1, method))
    v, p = tables[f"{side(method)}_vertices"], tables["paths"]

    def width(schema: pa.Schema) -> int:
        return sum(f.type.bit_width for f in schema) // 8

    assert width(v.schema) <= 32
    assert width(p.schema) <= 56
    assert set(tables) == {f"{side(method)}_vertices", "paths", "words"} | ({"unlit"} if method == "path" else set())


@pytest.mark.parametrize("run", ["path"], indirect=True)
def test_throughput_is_what_contributions_are_made_of(run: tuple[str, Tables, Film]) -> None:
    """What an emitter that is hit adds is the walk's throughput on arrival times its radiance and the weight."""
    method, tables, _ = run
    v, p = vertices(method, tables), columns(tables["paths"])
    row = {(int(w), int(d)): i for i, (w, d) in enumerate(zip(v["walk"], v["depth"]))}
    beta, c = triples(v, "throughput"), triples(p, "contribution")
    radiance = {}
    for i in np.flatnonzero(p["technique"] == EMITTER_HIT):
        b = beta[row[int(p["camera_walk"][i]), int(p["camera_depth"][i])]]
        if b.min() > 0:
            radiance.setdefault(int(p["emitter"][i]), []).append(c[i] / b / p["mis_weight"][i])
    assert len(radiance) >= 3
    for values in radiance.values():
        np.testing.assert_allclose(values, np.broadcast_to(np.median(values, axis=0), (len(values), 3)), rtol=1e-4)


def test_occluded_rows_are_blocked(run: tuple[str, Tables, Film], scene: Scene) -> None:
    """No occluded connection is a path, and its blocker is the first object on the way, found again by the minimal twin in float64."""
    method, tables, _ = run
    o, p = columns(tables["occluded"]), columns(tables["paths"])
    names = [f"{side(method)}_walk", f"{side(method)}_depth", f"{side(method)}_event", "technique", "emitter"]
    free = set(zip(*(p[n].tolist() for n in names)))
    assert not free & set(zip(*(o[n].tolist() for n in names))), "a connection is both free and blocked"

    v = vertices(method, tables)
    row = {(int(w), int(d)): i for i, (w, d) in enumerate(zip(v["walk"], v["depth"]))}
    twin = MinimalPathTracer(scene, settings(scene, "path"))
    wrong = total = 0
    for i in range(0, len(o["path"]), max(1, len(o["path"]) // 400)):
        k = row[int(o[names[0]][i]), int(o[names[1]][i])]
        start = np.array([v["x"][k], v["y"][k], v["z"][k]], np.float64)
        end = np.array([o["endpoint_x"][i], o["endpoint_y"][i], o["endpoint_z"][i]], np.float64)
        infinite = method == "path" and scene.emitters[o["emitter"][i]].infinite
        direction = end if infinite else end - start
        shift = 1e-4 * direction / np.linalg.norm(direction)
        primitive, _ = twin.closest(start + shift, direction, np.inf if infinite else 1.0)
        total += 1
        wrong += primitive < 0 or scene.arrays.geometry.object[primitive] != o["blocker"][i]
    assert total > 300
    assert wrong <= 0.01 * total, f"{wrong} of {total}"


def test_recording_changes_no_image(scene: Scene) -> None:
    """The film is the same whether nothing, everything, or also blocked connections are recorded."""
    films = []
    for keep, occluded, recorded in ((1.0, True, True), (1.0, False, True), (0.3, False, True), (0.0, False, False)):
        s = settings_of(scene, 8, keep=keep, occluded=occluded)
        film = Film(s.width, s.height)
        if recorded:
            record(scene, s, film=film)
        else:
            from renderer.trace import Tracer

            Tracer(scene, s).trace((0, s.walks), None, film)
        films.append(film.sums)
    for other in films[1:]:
        assert np.array_equal(films[0], other)
