"""Fluence in voxels: lengths by brute force, and light fields that are known in closed form."""

import itertools
import json
import pathlib
from typing import Any

import numpy as np
import pytest
from region_scenes import scene_of
from trimesh.creation import box as box_mesh

from queries import Run, open_run
from queries.arrivals import Arrivals
from queries.errors import QueryError
from queries.fluence import fluence
from queries.kernels.grid import clip_lengths
from queries.kernels.grid import deposit as deposit_kernel
from queries.selection import Selection
from queries.shards import Piece, map_shards
from queries.voxels import Grid, deposit

UNIT = Grid((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (4, 4, 4))


def lengths_in(grid: Grid, start: np.ndarray, end: np.ndarray, slabs: int = 1) -> np.ndarray:
    """The length of all segments in each voxel, by the kernel."""
    start, end = (np.array(points, np.float32).reshape(-1, 3) for points in (start, end))
    sums, planes = np.zeros((int(np.prod(grid.shape)), 4)), np.linspace(0, grid.shape[0], slabs + 1).astype(int)
    values = np.tile(np.array([1.0, 2.0, -1.0, 0.0]), (len(start), 1))
    for first, last in itertools.pairwise(planes):
        deposit_kernel(start, end, values, np.array(grid.low), grid.cell, np.array(grid.shape), int(first), int(last), sums)
    np.testing.assert_array_equal(sums[:, 1], 2 * sums[:, 0])
    np.testing.assert_array_equal(sums[:, 2], -sums[:, 0])
    assert not sums[:, 3].any()
    found: np.ndarray = sums[:, 0].reshape(grid.shape)
    return found


def brute_lengths(grid: Grid, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The same by clipping each segment against each voxel."""
    start, end = (np.array(points, np.float32).reshape(-1, 3) for points in (start, end))
    found = np.zeros(grid.shape)
    for voxel in np.ndindex(grid.shape):
        low = np.array(grid.low) + np.array(voxel) * grid.cell
        parts = np.empty(len(start))
        clip_lengths(start, end, low, low + grid.cell, parts)
        found[voxel] = parts.sum()
    return found


def test_clipped_lengths() -> None:
    """By sampling, and by hand."""
    generator = np.random.default_rng(1)
    start, end = generator.uniform(-1, 2, (2, 300, 3)).astype(np.float32)
    low, high, found = np.array([0.0, 0.2, -0.5]), np.array([1.0, 0.9, 0.5]), np.empty(300)
    clip_lengths(start, end, low, high, found)
    steps = (np.arange(20000) + 0.5) / 20000
    for a, b, length in zip(start.astype(float), end.astype(float), found):
        points = a + steps[:, None] * (b - a)
        inside = ((points >= low) & (points <= high)).all(axis=1).mean()
        assert abs(inside * np.linalg.norm(b - a) - length) < 4e-4
    assert (found > 0).sum() > 50
    assert (found == 0).sum() > 50


@pytest.mark.parametrize("shape", [(4, 4, 4), (1, 7, 3), (8, 1, 1), (5, 6, 2)])
@pytest.mark.parametrize("slabs", [1, 3])
def test_lengths_in_voxels(shape: tuple[int, int, int], slabs: int) -> None:
    grid = Grid((-0.3, 0.1, 0.2), (1.0, 0.8, 1.1), shape)
    start, end = np.random.default_rng(2).uniform(-1, 2, (2, 200, 3))
    np.testing.assert_allclose(lengths_in(grid, start, end, slabs), brute_lengths(grid, start, end), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("slabs", [1, 2, 4])
def test_segments_along_the_axes(axis: int, slabs: int) -> None:
    """Within voxels each gets its own part; on a border of voxels one side gets all, at the grid's own borders too."""
    for place in (0.0, 0.25, 0.375, 0.5, 1.0):
        for backward in (False, True):
            ends = np.full((2, 3), place)
            ends[:, axis] = -0.5, 0.625
            start, end = ends[::-1] if backward else ends
            found = np.moveaxis(lengths_in(UNIT, start, end, slabs), axis, 0)
            np.testing.assert_allclose(found.sum(axis=(1, 2)), [0.25, 0.25, 0.125, 0], rtol=1e-14)
            assert np.count_nonzero(found) == 3
    assert not lengths_in(UNIT, [1.01, 0.5, 0.5], [1.01, 0.5, 2.0]).any()


def test_diagonals() -> None:
    """Through corners of voxels, either way: eight voxels on the way get what lies in them, no others more than rounding."""
    for start, end in (([0, 0, 0], [1, 1, 1]), ([1, 1, 1], [0, 0, 0]), ([-1, -1, -1], [2, 2, 2])):
        for slabs in (1, 4):
            found = lengths_in(UNIT, start, end, slabs)
            np.testing.assert_allclose(found, np.sqrt(3) / 4 * np.einsum("ij,jk->ijk", np.eye(4), np.eye(4)), atol=1e-15)


def test_segments_of_no_length_and_beside_the_grid() -> None:
    nothing = [([0.5, 0.5, 0.5],) * 2, ([2, 2, 2],) * 2, ([2, 2, 2], [3, 1.5, 2]), ([-1, 0.5, 0.5], [0, 0.5, 0.5])]
    nothing += [([0.5, 2.5, 0.5], [2.5, 0.5, 0.5])]
    nothing += [([np.nan, 0, 0], [1, 1, 1]), ([0.5, 0.5, 0.5], [np.inf, 0.5, 0.5])]
    for start, end in nothing:
        assert not lengths_in(UNIT, np.array(start), np.array(end)).any(), (start, end)
    within = lengths_in(UNIT, [0.3, 0.3, 0.3], [0.4, 0.35, 0.3])
    assert within[1, 1, 1] == within.sum() == pytest.approx(np.hypot(0.1, 0.05), rel=1e-6)


def test_far_ends_and_small_slopes() -> None:
    """What is known of a segment is known to rounding of its ends: the voxels' lengths are the clipped length, whatever its slope."""
    generator = np.random.default_rng(3)
    start, end = generator.uniform(0, 1, (2, 500, 3))
    end[:250] += generator.normal(size=(250, 3)) * 1e6
    end[250:, 1] = start[250:, 1] + 1e-7
    found, clipped = lengths_in(UNIT, start, end, 4), np.empty(500)
    clip_lengths(start.astype(np.float32), end.astype(np.float32), np.zeros(3), np.ones(3), clipped)
    np.testing.assert_allclose(found.sum(), clipped.sum(), rtol=1e-9)


def test_a_turned_grid_has_turned_sums() -> None:
    """Axes exchanged or mirrored: the same lengths, exchanged or mirrored."""
    start, end = np.random.default_rng(4).uniform(-0.2, 1.2, (2, 400, 3))
    found = lengths_in(UNIT, start, end)
    np.testing.assert_allclose(lengths_in(UNIT, start[:, [1, 2, 0]], end[:, [1, 2, 0]]), found.transpose(1, 2, 0), atol=1e-12)
    np.testing.assert_allclose(lengths_in(UNIT, end, start), found, atol=1e-12)
    mirrored = [np.float32(1) - points.astype(np.float32) for points in (start, end)]
    np.testing.assert_allclose(lengths_in(UNIT, *mirrored), found[::-1, ::-1, ::-1], atol=2e-5)  # 1 - x is rounded once more


def test_grids_around_scenes() -> None:
    mesh = box_mesh((4, 2, 1))
    mesh.apply_translation((1, 2, 3))
    grid = Grid.around(scene_of({"box": mesh}), 32)
    assert grid.shape == (32, 17, 9)
    np.testing.assert_allclose(grid.cell, grid.cell[0])
    assert (np.array(grid.low) < (-1, 1, 2.5)).all()
    assert (np.array(grid.high) > (3, 3, 3.5)).all()
    np.testing.assert_allclose(grid.high[0] - grid.low[0], 4, rtol=1e-4)
    assert grid.volume == pytest.approx(0.125**3, rel=1e-4)
    np.testing.assert_allclose(grid.centers(0)[[0, -1]], (-1 + 0.0625, 3 - 0.0625), atol=1e-3)
    assert Grid.around(scene_of({"box": mesh}), 1).shape == (1, 1, 1)
    for longest in (0, 257):
        with pytest.raises(QueryError, match="1 to 256"):
            Grid.around(scene_of({"box": mesh}), longest)
    with pytest.raises(QueryError, match="no surfaces"):
        Grid.around(scene_of(), 8)
    with pytest.raises(QueryError, match="`low` is below"):
        Grid((0, 0, 0), (1, 0, 1), (1, 1, 1))
    with pytest.raises(QueryError, match="1 to 256 voxels along each"):
        Grid((0, 0, 0), (1, 1, 1), (1, 0, 1))


# --- rendered light fields ----------------------------------------------------------------------------------------

CAMERA = {"type": "perspective", "fov": 60, "to_world": [{"lookat": {"origin": [0.3, 0.2, 0.1], "target": [-1, 0, -1], "up": [0, 1, 0]}}]}
FILM = {"film": {"type": "hdrfilm", "width": 64, "height": 64, "rfilter": {"type": "box"}}}
KD, LE = np.array([0.3, 0.5, 0.6]), np.array([2.0, 1.0, 0.5])


def color(values: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(value) for value in values]}


def walls(kind: str) -> dict[str, Any]:
    """A closed room that shines and reflects alike everywhere."""
    body = {"type": kind, "flip_normals": True, "to_world": [{"scale": 1.5}], "bsdf": {"type": "diffuse", "reflectance": color(KD)}}
    return {"walls": body | {"emitter": {"type": "area", "radiance": color(LE)}}}


SCENES = {
    "sphere": walls("sphere"),
    "cube": walls("cube"),
    "point": {"lamp": {"type": "point", "position": [0.1, 0.2, -0.1], "intensity": color((1, 2, 4))}, "speck": {
        "type": "rectangle", "to_world": [{"scale": 1e-3}, {"translate": [0, 9, 0]}], "bsdf": {"type": "diffuse"}}},
    "sky": {"sky": {"type": "constant", "radiance": color(LE)}, "speck": {
        "type": "sphere", "to_world": [{"scale": 1e-3}, {"translate": [1, 1, 1]}], "bsdf": {"type": "diffuse"}}, "other": {
        "type": "sphere", "to_world": [{"scale": 1e-3}, {"translate": [-1, -1, -1]}], "bsdf": {"type": "diffuse"}}},
}  # fmt: skip


@pytest.fixture(scope="module")
def lit(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Folders of rendered runs, by scene and method, each made when first asked for."""
    from running import run_job

    made: dict[tuple[str, str], pathlib.Path] = {}

    def folder(name: str, method: str = "light") -> pathlib.Path:
        if (name, method) not in made:
            place = tmp_path_factory.mktemp(f"{name}-{method}")
            scene = {"type": "scene", "sensor": CAMERA | FILM, **SCENES[name]}
            render = {"method": method, "resolution": [64, 64], "samples": 8, "max_depth": 40, "seed": 5, "sampler": "independent", "filter": "box"}
            (place / "job.yaml").write_text(json.dumps({"name": name, "scene": scene, "render": render}))
            made[name, method] = run_job(place / "job.yaml", out=place / "run", threads=1).path
        return made[name, method]

    return folder


def total_of_walks(run: Run, grid: Grid) -> np.ndarray:
    """What each walk adds to the total, walks x throughput x clipped length: float64 (walks, 3)."""
    arrivals = Arrivals(run, Selection())
    sums = np.zeros((run.settings["passes"] * run.settings["width"] * run.settings["height"], 3))

    def add(pieces: Any) -> None:
        for piece in pieces:
            rows = np.flatnonzero(arrivals.select(piece))
            lengths = np.empty(len(rows))
            clip_lengths(*arrivals.segments(piece, rows), np.array(grid.low), np.array(grid.high), lengths)
            walk = piece.column(arrivals.table, "walk")[rows]
            for k, channel in enumerate("rgb"):
                np.add.at(sums[:, k], walk, lengths * piece.column(arrivals.table, f"throughput_{channel}")[rows])

    list(map_shards(run.files(arrivals.table), add, 1))
    return sums


CUBE = Grid((-0.7, -0.6, -0.8), (0.8, 0.7, 0.6), (6, 5, 7))


@pytest.mark.parametrize("name", ["sphere", "cube", "sky"])
def test_uniform_light(lit: Any, name: str) -> None:
    """Where radiance is the same everywhere, from everywhere, fluence is 4 pi times it: closed rooms, and under a sky."""
    radiance = LE if name == "sky" else LE / (1 - KD)
    with open_run(lit(name)) as run:
        found = fluence(run, Selection(), CUBE)
        walks = total_of_walks(run, CUBE)
    volume = float(np.prod(np.array(CUBE.high) - CUBE.low))
    np.testing.assert_allclose(found.total, walks.mean(axis=0), rtol=1e-6)
    np.testing.assert_allclose(found.total, found.clipped, rtol=1e-12)
    error = walks.std(axis=0, ddof=1) / np.sqrt(len(walks))
    assert (np.abs(found.total - 4 * np.pi * radiance * volume) < 4 * error).all()
    assert (error < 0.02 * found.total).all()

    # voxel by voxel: their scatter is that of noise, and no side is darker than another
    ratio = found.values[..., 1] / (4 * np.pi * radiance[1])
    scatter = ratio.std(ddof=1)
    for axis in range(3):
        halves = np.array_split(ratio, 2, axis=axis)
        assert all(abs(half.mean() - 1) < 5 * scatter / np.sqrt(half.size) + 4 * error[1] / found.total[1] for half in halves)
    assert scatter < 0.2


def test_a_point_light(lit: Any) -> None:
    """In a vacuum fluence is power / (4 pi r²): over shells of voxels, and what a ball of radius R holds is power x R."""
    intensity = np.array([1.0, 2.0, 4.0])
    center = np.array([0.1, 0.2, -0.1])
    grid = Grid(tuple(center - 1), tuple(center + 1), (40, 40, 40))
    with open_run(lit("point")) as run:
        found = fluence(run, Selection(), grid)
    x, y, z = np.meshgrid(*(grid.centers(axis) - center[axis] for axis in range(3)), indexing="ij")
    squared = x * x + y * y + z * z
    for inner, outer in ((0.3, 0.5), (0.5, 0.7), (0.7, 0.95)):
        shell = (squared >= inner**2) & (squared < outer**2)
        expected = intensity * (1 / squared[shell]).sum()
        # every ray crosses the shell by the same length, but for voxels cut at its border
        np.testing.assert_allclose(found.values[shell].sum(axis=0), expected, rtol=5e-3)
    directions = np.random.default_rng(6).normal(size=(100_000, 3))
    to_wall = 1 / np.abs(directions / np.linalg.norm(directions, axis=1, keepdims=True)).max(axis=1)
    error = to_wall.std() / to_wall.mean() * np.hypot(1 / np.sqrt(2**15), 1 / np.sqrt(100_000))
    np.testing.assert_allclose(found.total, 4 * np.pi * intensity * to_wall.mean(), rtol=4 * error)


def test_selected_light(lit: Any) -> None:
    """Straight light and the rest are all light; bounce by bounce the closed room's fluence falls by the reflectance."""
    with open_run(lit("sphere")) as run:
        parts = [fluence(run, Selection.of(run, text), CUBE) for text in (None, "C L", "C X L", "C X X+ L")]
        nothing = fluence(run, Selection.of(run, "C T L"), CUBE)
    everything, direct, once, later = parts
    np.testing.assert_allclose(direct.total + once.total + later.total, everything.total, rtol=1e-12)
    np.testing.assert_allclose(direct.values + once.values + later.values, everything.values, rtol=1e-5)
    np.testing.assert_allclose(once.total / direct.total, KD, rtol=0.03)
    assert direct.segments + once.segments + later.segments == everything.segments
    assert nothing.segments == 0
    assert not nothing.values.any()


def test_importance(lit: Any) -> None:
    """Camera walks: every one leaves with an importance of 1, which falls by the reflectance at each bounce."""
    with open_run(lit("sphere", "path")) as run:
        found = fluence(run, Selection.of(run, "C L"), Grid((-2, -2, -2), (2, 2, 2), (8, 8, 8)), "camera")
        rows = run.tables["camera_vertices"]
        first = rows["depth"].to_numpy() == 1
        ends = np.stack([rows[axis].to_numpy()[first] for axis in "xyz"], axis=1).astype(np.float64)
    expected = np.linalg.norm(ends - np.float32([0.3, 0.2, 0.1]), axis=1).mean()
    np.testing.assert_allclose(found.total, expected, rtol=1e-5)


def test_any_number_of_threads(lit: Any) -> None:
    with open_run(lit("cube")) as run:
        found = [fluence(run, Selection(), Grid.around(run.geometry, 40), threads=threads) for threads in (1, 2, 5)]
    assert found[0].values.any()
    assert all(other.values.tobytes() == found[0].values.tobytes() and (other.total == found[0].total).all() for other in found[1:])


def test_other_quantities(lit: Any) -> None:
    """Any numbers may be carried: flux times direction sums to the way that flux goes, here on balance nowhere."""

    def vectors(piece: Piece, rows: Any, start: Any, end: Any) -> np.ndarray:
        way = (end - start).astype(np.float64)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        flux = piece.column("light_vertices", "throughput_g")[rows, None]
        return np.concatenate([flux * way, flux], axis=1)

    with open_run(lit("cube")) as run:
        arrivals = Arrivals(run, Selection())
        found = deposit(run, arrivals, CUBE, 4, vectors)
        alone = fluence(run, Selection(), CUBE)
        with pytest.raises(QueryError, match="1 to 4 channels"):
            deposit(run, arrivals, CUBE, 5, vectors)
    assert found.sums.shape == (6, 5, 7, 4)
    np.testing.assert_allclose(found.sums[..., 3] * arrivals.per_walk / CUBE.volume, alone.values[..., 1], rtol=1e-6)
    np.testing.assert_allclose(found.total, found.clipped, rtol=1e-9, atol=1e-9 * found.total[3])
    assert (np.abs(found.total[:3]) < 0.02 * found.total[3]).all()
