"""What arrives at the vertices of walks, as trying every vertex in plain Python; and in rendered scenes."""

import pathlib
import random
from typing import Any

import numpy as np
import pytest
from placed import REGIONS, inside
from synthetic import OBJECTS
from walk_runs import HEIGHT, PASSES, WIDTH, WalkRun, make_walks
from words import dated, matches

from queries import Run, open_run
from queries.arrivals import Arrivals
from queries.errors import QueryError
from queries.lpe.parser import parse
from queries.regions import Polygon, region
from queries.selection import Selection
from queries.shards import map_shards
from renderer.tables import ESCAPED

KINDS = ("light", "camera", "lens")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, WalkRun]:
    folder = tmp_path_factory.mktemp("walks")
    made = {kind: make_walks(folder / kind, "light" if kind == "light" else "camera", seed, lens=kind == "lens") for seed, kind in enumerate(KINDS)}
    made["lamps"] = make_walks(folder / "lamps", "light", 9, emitters=(3, 4))
    return made


def chosen(run: Run, side: str, selection: Selection, threads: int = 1) -> np.ndarray:
    arrivals = Arrivals(run, selection, side)
    return np.concatenate(list(map_shards(run.files(*arrivals.tables), lambda found: np.concatenate([arrivals.select(p) for p in found]), threads)))


def check(found: WalkRun, kind: str, text: str) -> int:
    """Compare what is selected with what should be; how many rows that is."""
    tree = parse(text).tree
    if text.startswith("L"):
        expected = [bool(word) and matches(tree, dated_backward(word)) for word in found.words]
    else:
        expected = [bool(word) and matches(tree, word) for word in found.words]
    with open_run(found.folder) as run:
        selection = Selection.of(run, text)
        side = "light" if kind in ("light", "lamps") else "camera"
        assert chosen(run, side, selection, 3).tolist() == expected
    return sum(expected)


def dated_backward(word: tuple[Any, ...]) -> tuple[Any, ...]:
    return dated(word)[::-1]


TEXTS = [
    "C [LOB]", "C .* L", "C D [LOB]", "C D+ .", "C .* D [LOB]", "C D .* S .", "C .* 'floor' .* .", "C X@object:wall .* .", "C .* X@material:glass .",
    "C !'glass' {,3} .", "C .* . - C D .* .", "C .* D .* . & C .* S .* .", "C .* .@depth:2", "C .* X@depth:2 .* .", "C .* D@depth:1..2 X .",
    "L .* D C",
    "C@ball .* .", "C@!ball X .* .", "C .* X@ball .* .", "C X@ball .* .", "C .* X@ball .", "C .* X@crate X@ball .* .", "C .* X@floor .* .",
    "C .* X@crosses:ball .* .", "C X@crosses:crate .* .", "C .@crosses:crate .* .", "C .* X@crosses:ball .", "C .* .@crosses:ball",
    "C .* .@crosses:far_ball", "C .* X@!crosses:crate@ball .* .", "C .* .@ball", "C@eye .* X .", "C .* [LOB]@!ball",
]  # fmt: skip


NOWHERE = {("light", "C@eye .* X ."), ("camera", "C@ball .* ."), ("lens", "C@ball .* .")}  # only the camera is at the eye, and only there


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("text", TEXTS)
def test_expressions(runs: dict[str, WalkRun], kind: str, text: str) -> None:
    found = check(runs[kind], kind, text)
    assert found < sum(bool(word) for word in runs[kind].words) or (kind != "light" and text in ("C .* L", "L .* C"))
    assert (found == 0) == ((kind, text) in NOWHERE)


LIGHTS = ["C .* .@light:lamp", "C .* .@light:lamp_light", "C .* O", "C D* B", "C X .@object:wall", "C .* 'lamp'", "C .* B@crosses:far_ball"]


@pytest.mark.parametrize("text", LIGHTS)
def test_emitters(runs: dict[str, WalkRun], text: str) -> None:
    """By the object of a walk's first vertex; the sky and the spot, which are no objects, by whether they are at infinity."""
    assert 0 < check(runs["light"], "light", text) < len(runs["light"].rows)


def random_expression(generator: random.Random, place: str) -> str:
    """An expression of a few parts, mostly one that some arrival matches."""
    atoms = ["D", "S", "G", "X", "R", "T", ".", "<RD>", "'floor'", "!'glass'"]
    atoms += ["X@object:wall", "X@ball", "X@!crate", "X@crosses:ball", "X@depth:2..3"]

    def part(nested: bool) -> str:
        if nested and generator.random() < 0.3:
            return "(" + " | ".join(" ".join(part(False) for _ in range(generator.randint(1, 2))) for _ in range(2)) + ")"
        return generator.choice(atoms)

    inner = " ".join(part(True) + generator.choice(["", "*", "*", "+", "?", "{1,2}"]) for _ in range(generator.randint(1, 3)))
    return f"{generator.choice(['C', 'C', f'C@{place}', 'C@!ball'])} {inner} {generator.choice(['[LOB]', '.', 'L', '[LOB]@!ball'])}"


@pytest.mark.parametrize("kind", KINDS)
def test_random_expressions(runs: dict[str, WalkRun], kind: str) -> None:
    generator = random.Random(5)
    counts = [check(runs[kind], kind, random_expression(generator, "crate" if kind == "light" else "eye")) for _ in range(20)]
    assert sum(count > 0 for count in counts) >= 14


@pytest.mark.parametrize("kind", KINDS)
def test_everything_that_arrives(runs: dict[str, WalkRun], kind: str) -> None:
    with open_run(runs[kind].folder) as run:
        side = "light" if kind == "light" else "camera"
        assert chosen(run, side, Selection()).tolist() == [row["depth"] > 0 for row in runs[kind].rows]
        assert Arrivals(run, Selection(), side).per_walk == 1 / (WIDTH * HEIGHT * PASSES)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["ball", "floor", "crate"])
def test_regions_of_selections(runs: dict[str, WalkRun], kind: str, name: str) -> None:
    """Some vertex so far, this one included, lies in the region."""
    found, side = runs[kind], "light" if kind == "light" else "camera"
    with open_run(found.folder) as run:
        expected = [row["depth"] > 0 and name in reached for row, reached in zip(found.rows, found.reached)]
        assert chosen(run, side, Selection.of(run, region=name)).tolist() == expected
        tree = parse("C X .* .").tree
        both = [wanted and matches(tree, word) for wanted, word in zip(expected, found.words)]
        assert chosen(run, side, Selection.of(run, "C X .* .", region=name)).tolist() == both
    assert 0 < sum(both) < sum(expected) < len(expected)


def test_pixels_of_camera_walks(runs: dict[str, WalkRun]) -> None:
    found = runs["camera"]
    with open_run(found.folder) as run:
        for left, top, right, bottom in ((0, 0, WIDTH, HEIGHT), (2, 1, 5, 3), (2.5, 1.5, 3.5, 4.5), (2.6, 0, 3.4, 5)):
            pixels = [(row["walk"] % (WIDTH * HEIGHT) % WIDTH + 0.5, row["walk"] % (WIDTH * HEIGHT) // WIDTH + 0.5) for row in found.rows]
            expected = [row["depth"] > 0 and left <= x < right and top <= y < bottom for row, (x, y) in zip(found.rows, pixels)]
            assert chosen(run, "camera", Selection(film=(left, top, right, bottom))).tolist() == expected


@pytest.mark.parametrize("kind", KINDS)
def test_segments(runs: dict[str, WalkRun], kind: str) -> None:
    """From the vertex before, or from the eye; what escaped ends on a sphere around the scene."""
    found, side = runs[kind], "light" if kind == "light" else "camera"
    with open_run(found.folder) as run:
        arrivals = Arrivals(run, Selection(), side)

        def of(pieces: Any) -> tuple[np.ndarray, ...]:
            parts = [(piece, np.flatnonzero(arrivals.select(piece))) for piece in pieces]
            return tuple(np.concatenate(part) for part in zip(*(arrivals.segments(*part) for part in parts)))

        start, end = (np.concatenate(part) for part in zip(*map_shards(run.files(*arrivals.tables), of)))
        extent = run.geometry.extent
        eye = np.array(run.manifest["camera"]["to_world"])[:, 3]
    rows = [i for i, row in enumerate(found.rows) if row["depth"] > 0]
    assert len(rows) == len(start)
    places = np.array([[row[axis] for axis in "xyz"] for row in found.rows])
    walks = np.array([row["walk"] for row in found.rows])
    gone = np.array([found.rows[i]["event"] == ESCAPED for i in rows])
    before = np.array([places[i - 1] if i and walks[i - 1] == walks[i] else eye for i in rows])
    assert (start == before.astype(np.float32)).all()
    assert (end[~gone] == places[rows][~gone].astype(np.float32)).all()
    way = end[gone] - start[gone].astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(end[gone].astype(np.float64), axis=1), extent, rtol=1e-6)
    np.testing.assert_allclose(way / np.linalg.norm(way, axis=1, keepdims=True), places[rows][gone], atol=1e-5)
    assert gone.any()


REFUSED = [
    ("light", "C .* L@technique:hit", "technique"), ("light", "C .* L@s:2", "`s:`"), ("camera", "C .* L@blocker:wall", "blocker"),
    ("camera", "C .* L@light:lamp", "have met no light"), ("light", "unoccluded; C .* L", "unoccluded"),
    ("lamps", "C .* L@light:spot", "tells the emitters `spot`"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "text", "message"), REFUSED)
def test_refusals(runs: dict[str, WalkRun], kind: str, text: str, message: str) -> None:
    with open_run(runs[kind].folder) as run, pytest.raises(QueryError, match=message):
        Arrivals(run, Selection.of(run, text), "camera" if kind == "camera" else "light")


def test_walks_that_the_run_has_not(runs: dict[str, WalkRun]) -> None:
    with open_run(runs["camera"].folder) as run:
        with pytest.raises(QueryError, match="no light walks"):
            Arrivals(run, Selection())
        with pytest.raises(QueryError, match="expected walks"):
            Arrivals(run, Selection(), "both")


def test_emitters_that_need_not_be_told_apart(runs: dict[str, WalkRun]) -> None:
    assert check(runs["lamps"], "lamps", "C D* L") > 0
    with open_run(runs["lamps"].folder) as run:
        selection = Selection.of(run, "noclamp; C D* L")
        assert chosen(run, "light", selection).sum() == check(runs["lamps"], "lamps", "C D* L")


def test_regions_are_keys() -> None:
    """What pieces keep of regions is found again by equal ones alone."""
    described = [*REGIONS.values(), {"stroke": {"points": [[1, 2]], "radius": 3}}, {"polygon": [[0, 0], [1, 0], [0, 1]]}, {"mesh": "a.ply"}]
    found = [region(given) for given in described]
    assert len(set(found)) == len(found) == len({*found, *(region(given) for given in described)})
    assert inside("floor", (0, 0, 0), OBJECTS[0][0])


# --- a rendered scene ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cornell(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    from running import run_job

    place = tmp_path_factory.mktemp("cornell")
    scene = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "cornell.yaml"
    render = "method: light, resolution: [64, 64], samples: 4, seed: 2, sampler: independent, max_depth: 6, filter: box"
    (place / "job.yaml").write_text(f"name: cornell\nscene: {scene}\nrender: {{{render}}}\n")
    return run_job(place / "job.yaml", out=place / "run", threads=1).path


def test_the_lamp_s_power(cornell: pathlib.Path) -> None:
    """Straight light carries what the lamp emits, pi A Le in each of its walks."""
    with open_run(cornell) as run:
        rows = run.tables["light_vertices"]
        direct = chosen(run, "light", Selection.of(run, "C L"))
        assert (direct == (rows["depth"].to_numpy() == 1)).all()
        power = np.array([rows[f"throughput_{c}"].to_numpy()[direct].sum(dtype=np.float64) for c in "rgb"]) * Arrivals(run, Selection()).per_walk
        area = next(row["area"] for row in run.tables["objects"].to_pylist() if row["name"] == "light")
    np.testing.assert_allclose(power, np.pi * area * np.array([20.7, 10.9, 2.77]), rtol=1e-5)


def test_what_the_camera_sees_in_an_area(cornell: pathlib.Path) -> None:
    """Every vertex so far, one by one: projected by the camera, and nothing between the two."""
    left, top, right, bottom = film = (10.0, 20.0, 40.0, 60.0)
    with open_run(cornell) as run:
        found = chosen(run, "light", Selection(film=film))
        shape = Polygon((((left, top), (right, top), (right, bottom), (left, bottom)),))
        rows = run.tables["light_vertices"]
        depths, events, things = (rows[name].to_numpy() for name in ("depth", "event", "object"))
        points = np.stack([rows[axis].to_numpy() for axis in "xyz"], axis=1)
        seen = shape.contains(run.geometry, points, things.astype(np.int32))
    reached, expected = False, []
    for depth, event, there in zip(depths, events, seen):
        reached = (reached and depth > 1) or bool(there and event != ESCAPED and depth > 0)
        expected.append(reached and depth > 0)
    assert found.tolist() == expected
    assert 1000 < found.sum() < 0.8 * len(found)
