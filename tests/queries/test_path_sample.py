"""Samples of paths against plain Python: the paths that a selection has, and each one's vertices from the emitter to the camera."""

import contextlib
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from placed import EYE, INFINITE, PlacedRun, inside, make_placed_run
from recut import recut, shuffled, with_values
from splitmix import uniform
from synthetic import EMITTERS
from words import matches

from queries import Run, open_run
from queries.errors import QueryError
from queries.lpe.parser import parse
from queries.path_sample import PathSample, sample_paths
from queries.selection import Selection
from queries.shards import pieces
from renderer.tables import EMITTER, EMITTER_HIT, EMITTER_SAMPLE, FIRST_SCATTERING, LENS, LENS_SAMPLE, NO_OBJECT

ALL = 10**6
KINDS = [("path", False), ("path", True), ("light", False), ("both", False), ("both", True)]
EXTENT = 1e6  # of a run without surfaces: the radius of the sphere around (0, 0, 0) where light from infinity comes from
COLUMNS = ("start", "points", "event", "object", "owner", "path", "infinite", "contribution", "raster", "scale", "found")


def same(a: PathSample, b: PathSample) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name), equal_nan=name == "contribution") for name in COLUMNS)


@pytest.fixture(scope="module", params=KINDS, ids=lambda kind: kind[0] + "-lens" * kind[1])
def placed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> PlacedRun:
    method, lens = request.param
    return make_placed_run(tmp_path_factory.mktemp("placed") / "run", method, seed=17, walks=300, lens=lens)


@pytest.fixture(scope="module")
def run(placed: PlacedRun) -> Iterator[Run]:
    with open_run(placed.folder) as opened:
        yield opened


def owner(row: dict[str, Any], run: Run) -> tuple[int, int]:
    return row["camera_walk" if run.settings["method"] != "light" else "light_walk"], row["path"]


def names(sample: PathSample) -> list[tuple[int, int]]:
    return list(zip(sample.owner.tolist(), sample.path.tolist()))


# --- vertices -----------------------------------------------------------------------------------------------------


def horizon(start: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Where a ray leaves the sphere around the origin."""
    start, way = start.astype(float), way / np.linalg.norm(way)
    along = start @ way
    return np.array(start + (np.sqrt(along**2 - start @ start + EXTENT**2) - along) * way)


def chain(row: dict[str, Any], vertices: dict[tuple[str, int, int], dict[str, Any]]) -> list[tuple[int, int, tuple[float, float, float]]]:
    """Event, object and point of each vertex of a path, the emitter first."""

    def place(vertex: dict[str, Any]) -> tuple[float, float, float]:
        return vertex["x"], vertex["y"], vertex["z"]

    technique = row["technique"]
    endpoint = row["endpoint_x"], row["endpoint_y"], row["endpoint_z"]
    camera_count = row["camera_depth"] - (technique == EMITTER_HIT) if technique != LENS_SAMPLE else 0
    middle = []
    for depth in range(1, row["light_depth"] + 1 if technique not in (EMITTER_HIT, EMITTER_SAMPLE) else 1):
        vertex = vertices["light", row["light_walk"], depth]
        middle.append((row["light_event"] if depth == row["light_depth"] else vertex["event"], vertex["object"], place(vertex)))
    for depth in range(camera_count, 0, -1):
        vertex = vertices["camera", row["camera_walk"], depth]
        last = depth == camera_count and technique != EMITTER_HIT
        middle.append((row["camera_event"] if last else vertex["event"], vertex["object"], place(vertex)))
    lens = vertices.get(("camera", row["camera_walk"], 0))
    eye = endpoint if technique == LENS_SAMPLE else EYE if lens is None else place(lens)
    here = technique in (EMITTER_HIT, EMITTER_SAMPLE)
    source = endpoint if here else place(vertices["light", row["light_walk"], 0])
    if INFINITE[row["emitter"]]:
        start = np.array(middle[0][2] if middle else eye)
        source = tuple(horizon(start, np.array(source) if here else np.array(source) - start).tolist())
    thing = EMITTERS[row["emitter"]][1]
    return [(EMITTER, NO_OBJECT if thing is None else thing, source), *middle, (LENS, NO_OBJECT, eye)]


def test_vertices_are_those_of_plain_python(placed: PlacedRun, run: Run) -> None:
    vertices = {(side, row["walk"], row["depth"]): row for side in ("camera", "light") for row in rows_of(run, f"{side}_vertices")}
    rows = sorted(placed.rows["paths"], key=lambda row: owner(row, run))
    sample = sample_paths(run, Selection(), ALL)
    assert len(sample) == sample.found == len(rows) > 300
    assert names(sample) == [owner(row, run) for row in rows]
    assert sample.infinite.any()
    assert not sample.infinite.all()
    for i, row in enumerate(rows):
        expected, here = chain(row, vertices), slice(sample.start[i], sample.start[i + 1])
        assert sample.event[here].tolist() == [event for event, _, _ in expected]
        assert sample.object[here].tolist() == [thing for _, thing, _ in expected]
        points = np.array([point for _, _, point in expected], np.float32)
        assert sample.infinite[i] == INFINITE[row["emitter"]]
        first = 1 if sample.infinite[i] else 0
        assert np.array_equal(sample.points[here][first:], points[first:])
        assert np.linalg.norm(sample.points[here][0] - points[0]) <= (0.3 if first else 0)  # a few roundings of 1e6
        assert sample.contribution[i].tolist() == [row[f"contribution_{c}"] for c in "rgb"]
        assert np.allclose(sample.raster[i], [row["raster_x"], row["raster_y"]])


def rows_of(run: Run, table: str) -> list[dict[str, Any]]:
    return run.tables[table].to_pylist() if table in run.tables else []


def test_parts_of_a_sample(run: Run) -> None:
    sample = sample_paths(run, Selection(), 50)
    part = sample.take(np.array([7, 3, 40]))
    for at, i in enumerate((7, 3, 40)):
        for name in ("points", "event", "object"):
            expected = getattr(sample, name)[sample.start[i] : sample.start[i + 1]]
            expected = getattr(sample, name)[sample.start[i] : sample.start[i + 1]]
            assert np.array_equal(getattr(part, name)[part.start[at] : part.start[at + 1]], expected)
    assert names(part) == [names(sample)[i] for i in (7, 3, 40)]
    assert len(part) == 3
    assert len(sample.take(np.zeros(0, np.int64)).points) == 0


# --- which paths --------------------------------------------------------------------------------------------------

SELECTIONS = [
    ("C .* L", None, None),
    ("C D+ <L.'lamp_light'>", None, None),
    ("C .* X@region:ball .* [LOB]", None, None),
    ("noclamp; C .* L", None, None),
    (None, "crate", None),
    (None, "floor", None),
    (None, None, (1.5, 0.25, 5.1, 3.0)),
    ("C .{2,} [LOB]", "ball", (0.0, 1.0, 4.0, 5.0)),
]


@pytest.mark.parametrize(("expression", "region", "film"), SELECTIONS)
def test_the_paths_of_a_selection(placed: PlacedRun, run: Run, expression: str | None, region: str | None, film: Any) -> None:
    vertices = {(side, row["walk"], row["depth"]): row for side in ("camera", "light") for row in rows_of(run, f"{side}_vertices")}
    tree = parse(expression).tree if expression else None
    expected = set()
    for row, word in zip(placed.rows["paths"], placed.words["paths"]):
        chosen = tree is None or matches(tree, word)
        if region:
            things = run.tables["objects"]["name"].to_pylist()
            chosen &= any(inside(region, point, things[thing]) for event, thing, point in chain(row, vertices) if event >= FIRST_SCATTERING)
        if film:
            x, y = np.float32(row["raster_x"]), np.float32(row["raster_y"])
            chosen &= bool(film[0] <= float(x) < film[2] and film[1] <= float(y) < film[3])
        if chosen:
            expected.add(owner(row, run))
    selection = Selection.of(run, expression, region, film)
    found = sample_paths(run, selection, ALL)
    assert 0 < len(expected) <= len(placed.rows["paths"])
    assert set(names(found)) == expected
    assert found.found == len(expected)
    few = sample_paths(run, selection, 5, "contribution", seed=3)
    assert set(names(few)) <= expected
    assert len(few) == min(5, len(expected))
    assert few.found == len(expected)


def test_nothing_selected(run: Run) -> None:
    for by in ("uniform", "contribution"):
        sample = sample_paths(run, Selection.of(run, film=(100, 100, 101, 101)), 10, by)
        assert len(sample) == sample.found == len(sample.points) == 0
        assert sample.start.tolist() == [0]


# --- one sample, however the run is cut ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def forms(placed: PlacedRun, run: Run, tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Run]]:
    """The run, cut and ordered otherwise."""
    folder = tmp_path_factory.mktemp("forms")
    vertices = [name for name in ("camera_vertices", "light_vertices") if name in run.tables]
    recut(placed.folder, folder / "one", cuts=[0])
    recut(placed.folder, folder / "seven", cuts=[0, 12, 14, 100, 170, 172, 250])
    recut(placed.folder, folder / "batches", batches={"paths": 17, vertices[0]: 31})
    recut(placed.folder, folder / "tiles", tile=20)
    recut(placed.folder, folder / "shuffled", change={"paths": shuffled(3)})
    with contextlib.ExitStack() as stack:
        found = {form.name: stack.enter_context(open_run(form)) for form in sorted(folder.iterdir())}
        assert [len(list(pieces(files, 0))) for files in found["tiles"].files("paths", *vertices)] == [5, 5, 5]
        yield found


@pytest.mark.parametrize("by", ["uniform", "contribution"])
def test_threads_shards_and_the_order_of_rows_do_not_matter(run: Run, forms: dict[str, Run], by: str) -> None:
    for selection in (Selection(), Selection.of(run, film=(1, 1, 5, 4)), Selection.of(run, "C .* [LOB]", "ball")):
        for most in (1, 40, ALL):
            expected = sample_paths(run, selection, most, by, seed=5, threads=1)
            assert same(expected, sample_paths(run, selection, most, by, seed=5, threads=2))
            assert names(expected) == sorted(names(expected))
            for name, form in forms.items():
                assert same(expected, sample_paths(form, selection, most, by, seed=5)), name
    other = sample_paths(run, Selection(), 40, by, seed=6)
    assert names(other) != names(sample_paths(run, Selection(), 40, by, seed=5))


# --- values -------------------------------------------------------------------------------------------------------


def test_scales(placed: PlacedRun, run: Run, tmp_path: pathlib.Path) -> None:
    every = sample_paths(run, Selection(), ALL)
    some = sample_paths(run, Selection(), 40)
    assert (every.scale == 1).all()
    assert (some.scale == every.found / 40).all()
    assert (sample_paths(run, Selection(), ALL, "contribution").scale == 1).all()
    most = every.found - 60
    bright = sample_paths(run, Selection(), most, "contribution")
    weight = bright.contribution.astype(float) @ [0.2126, 0.7152, 0.0722]
    # The threshold is the priority of the path that comes next; a path's luminance is estimated as that, or as what it is where that is more
    further = sample_paths(run, Selection(), most + 1, "contribution")
    ((owner, path),) = set(names(further)) - set(names(bright))
    contribution = further.contribution[names(further).index((owner, path))]
    threshold = contribution.astype(float) @ [0.2126, 0.7152, 0.0722] / uniform(0, owner, path)
    assert np.allclose(bright.scale * weight, np.maximum(weight, threshold), rtol=1e-12)
    assert (weight > threshold).any()
    assert (weight < threshold).any()
    with open_run(recut(placed.folder, tmp_path / "kept", keep=0.25)) as kept:
        for by, full in (("uniform", some), ("contribution", bright)):
            part = sample_paths(kept, Selection(), len(full), by)
            assert names(part) == names(full)
            assert np.array_equal(part.scale, 4 * full.scale)
            assert part.found == full.found


def test_paths_without_light_are_paths_but_weigh_nothing(placed: PlacedRun, run: Run, tmp_path: pathlib.Path) -> None:
    def dark(table: pa.Table) -> pa.Table:
        for c in "rgb":
            table = with_values(f"contribution_{c}", lambda n: slice(0, n, 3), 0.0)(table)
        return with_values("contribution_g", lambda n: slice(1, n, 3), np.nan)(table)

    with open_run(recut(placed.folder, tmp_path / "dark", change={"paths": dark})) as changed:
        every = sample_paths(changed, Selection(), ALL)
        assert len(every) == every.found == len(placed.rows["paths"])
        bright = sample_paths(changed, Selection(), ALL, "contribution")
        assert bright.found == every.found
        assert np.isfinite(bright.contribution).all()
        assert (bright.contribution > 0).all()
        assert np.isfinite(bright.scale).all()
        light = np.isfinite(every.contribution).all(axis=1) & (every.contribution > 0).all(axis=1)
        assert 0.3 < light.mean() < 0.37
        assert len(bright) == np.count_nonzero(light)


# --- refusals -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("most", [0, -1, True, 2.5, "9"])
def test_numbers_that_cannot_be_drawn(run: Run, most: Any) -> None:
    with pytest.raises(QueryError, match="whole number of 1 or more"):
        sample_paths(run, Selection(), most)


def test_refusals(placed: PlacedRun, run: Run, tmp_path: pathlib.Path) -> None:
    with pytest.raises(QueryError, match="uniform or contribution, found 'size'"):
        sample_paths(run, Selection(), 3, "size")
    for prefix in ("shadows", "unoccluded", "nothruput"):
        with pytest.raises(QueryError, match=f"`{prefix};` says what an image counts.*expected an expression without it"):
            sample_paths(run, Selection.of(run, f"{prefix}; C .* L"), 3)
    with open_run(recut(placed.folder, tmp_path / "none", keep=0.0)) as none, pytest.raises(QueryError, match="recorded no paths"):
        sample_paths(none, Selection(), 3)
    side = "light" if run.settings["method"] == "light" else "camera"
    with open_run(placed.folder) as opened:
        del opened.tables[f"{side}_vertices"]
        with pytest.raises(QueryError, match=f"did not record the vertices of {side} walks"):
            sample_paths(opened, Selection(), 3)
    lost = recut(placed.folder, tmp_path / "lost", change={f"{side}_vertices": lambda table: table.slice(0, 20)})
    with open_run(lost) as opened, pytest.raises(QueryError, match=f"vertices of {side} walks that are not there"):
        sample_paths(opened, Selection(), ALL)
