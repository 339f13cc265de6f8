"""Shapes drawn on the film, on runs of the renderer: what the camera sees there is inside, what is hidden or elsewhere is not."""

import itertools
import pathlib
from typing import Any

import numpy as np
import pytest
import yaml
from matplotlib.path import Path
from region_scenes import CAMERA, mixed, quadric_hits, scene_of, triangle_hits
from running import run_job

from queries import Run, open_run
from queries.errors import QueryError
from queries.regions import Polygon, SceneGeometry, Stroke, region
from queries.regions.film import CONTACT

SCENE = pathlib.Path(__file__).parents[2] / "configs" / "scenes" / "spheres.yaml"
LOOKAT = {"lookat": {"origin": [0.3, 1.2, 4], "target": [0, 0.8, 0], "up": [0.1, 1, 0]}}
ROOM: dict[str, Any] = {
    "type": "scene",
    "sensor": {
        "type": "thinlens",
        "fov": 50,
        "aperture_radius": 0.15,
        "focus_distance": 3.5,
        "principal_point_offset_x": 0.1,
        "principal_point_offset_y": -0.05,
        "to_world": [LOOKAT],
        "film": {"type": "hdrfilm", "width": 48, "height": 32, "rfilter": {"type": "box"}},
    },
    "floor": {"type": "rectangle", "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": -90}}, {"scale": 3}], "bsdf": {"type": "diffuse"}},
    "wall": {"type": "rectangle", "to_world": [{"scale": 3}, {"translate": [0, 0, -2]}], "bsdf": {"type": "diffuse"}},
    "ball": {"type": "sphere", "center": [0.8, 0.5, 0], "radius": 0.5, "bsdf": {"type": "diffuse"}},
    "tube": {
        "type": "cylinder",
        "p0": [-1, 0, 0.4],
        "p1": [-0.8, 1.1, 0.2],
        "radius": 0.3,
        "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}},
    },
    "plate": {"type": "disk", "to_world": [{"scale": 0.5}, {"translate": [0, 1.3, 0.5]}], "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}}},
    "block": {"type": "cube", "to_world": [{"scale": 0.3}, {"translate": [0.1, 0.3, 1]}], "bsdf": {"type": "diffuse"}},
    "lamp": {
        "type": "rectangle",
        "to_world": [{"rotate": {"axis": [1, 0, 0], "angle": 90}}, {"translate": [0, 3, 0]}],
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 5}},
    },
}
RENDER = {"method": "path", "samples": 12, "seed": 3, "sampler": "independent", "max_depth": 5, "filter": "box"}


@pytest.fixture(scope="module", params=["spheres", "room", "pinhole"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    place = tmp_path_factory.mktemp(request.param)
    render = RENDER | ({"resolution": [40, 40]} if request.param == "spheres" else {})
    pinhole = {key: value for key, value in ROOM["sensor"].items() if key not in ("aperture_radius", "focus_distance")} | {"type": "perspective"}
    scene = {"spheres": str(SCENE), "room": ROOM, "pinhole": ROOM | {"sensor": pinhole}}[request.param]
    (place / "job.yaml").write_text(yaml.safe_dump({"name": "film", "scene": scene, "render": render}, sort_keys=False))
    return run_job(place / "job.yaml", out=place / "run", threads=1).path


def vertices(run: Run) -> dict[str, np.ndarray]:
    """The vertices on surfaces, each with the film position of its walk."""
    paths, rows = run.tables["paths"], run.tables["camera_vertices"]
    column = {name: rows[name].to_numpy() for name in ("walk", "depth", "object", "x", "y", "z")}
    walk, first = np.unique(paths["camera_walk"].to_numpy(), return_index=True)
    at = np.minimum(np.searchsorted(walk, column["walk"]), len(walk) - 1)
    kept = (walk[at] == column["walk"]) & (column["object"] != 65535) & (column["depth"] > 0)
    raster = np.stack([paths[name].to_numpy()[first] for name in ("raster_x", "raster_y")], axis=1)
    points = np.stack([column[axis] for axis in "xyz"], axis=1)
    return {"depth": column["depth"][kept], "object": column["object"][kept], "points": points[kept], "raster": raster[at[kept]]}


def shape(run: Run) -> Polygon:
    """A polygon that is not convex, over the middle of the film."""
    width, height = run.settings["width"], run.settings["height"]
    star = [(0.1, 0.15), (0.5, 0.3), (0.95, 0.1), (0.7, 0.55), (0.85, 0.95), (0.45, 0.6), (0.2, 0.97), (0.25, 0.5)]
    found = region({"polygon": [[x * width, y * height] for x, y in star]})
    assert isinstance(found, Polygon)
    return found


def hidden(scene: SceneGeometry, points: np.ndarray, contact: float) -> np.ndarray:
    """Whether something lies between points and the camera, not within a share ``contact`` of the way, by trying every triangle and every quadric."""
    caster, origin = scene.caster, scene.camera.origin
    d = points - origin
    o = np.broadcast_to(origin, d.shape)
    t = [triangle_hits(caster.corners, o, d)]
    t += [quadric_hits(kind, matrix, o, d) for kind, matrix in zip(caster.kinds, caster.to_world, strict=True)]
    return np.any([((part > 1e-3) & (part < 1 - contact)).any(axis=1) for part in t], axis=0)


def test_first_vertices_project_where_their_walks_began(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        scene, found = SceneGeometry(run), vertices(run)
        lens = run.manifest["camera"]["lens_radius"]
    first = found["depth"] == 1
    x, y, before = scene.camera.project(found["points"][first])
    distance = np.hypot(x - found["raster"][first, 0], y - found["raster"][first, 1])
    assert first.sum() > 1000
    assert before.all()
    if lens is None:
        assert distance.max() < 1e-3
    else:
        # A point at depth z is blurred over a disk on the film, of radius proportional to |1 / z - 1 / focus|.
        camera = run.manifest["camera"]
        depth = (found["points"][first] - scene.camera.origin) @ scene.camera.optical_axis
        pixels = max(camera["width"] / camera["tan_x"], camera["height"] / camera["tan_y"]) / 2
        blur = pixels * lens * np.abs(1 / depth - 1 / camera["focus"])
        assert (distance <= blur + 1e-3).all()
        assert distance.max() > 0.5
        assert (distance > 0.5 * blur).mean() > 0.5


@pytest.mark.parametrize("folder", ["spheres", "pinhole"], indirect=True)  # through a lens, what is out of focus is seen elsewhere too
def test_what_the_camera_sees_in_the_shape_is_inside(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        scene, found, drawn = SceneGeometry(run), vertices(run), shape(run)
    first = found["depth"] == 1
    expected = Path(drawn.loops[0]).contains_points(found["raster"][first])
    assert mixed(expected, 1000)
    assert (drawn.contains(scene, found["points"][first], found["object"][first]) == expected).all()


def test_what_is_hidden_is_not_inside(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        scene, found, drawn = SceneGeometry(run), vertices(run), shape(run)
    later = found["depth"] > 1
    points, objects = found["points"][later], found["object"][later]
    x, y, before = scene.camera.project(points)
    here = before & Path(drawn.loops[0]).contains_points(np.stack([x, y], axis=1))
    behind, surely = hidden(scene, points, CONTACT / 3), hidden(scene, points, CONTACT * 3)
    clear = behind == surely  # not at a silhouette, where the last bits of a ray decide
    assert clear.mean() > 0.998
    assert mixed(here & behind, 100)
    assert mixed(here & ~behind, 100)
    assert (drawn.contains(scene, points, objects) == (here & ~behind))[clear].all()
    assert not drawn.contains(scene, points, np.full(len(points), 65535, np.uint16)).any()  # on no surface


def test_rays_meet_what_trying_every_surface_says(folder: pathlib.Path) -> None:
    with open_run(folder) as run:
        scene, found = SceneGeometry(run), vertices(run)
    generator = np.random.default_rng(1)
    o = (found["points"][:1500] + generator.normal(0, 0.1, (1500, 3))).astype(np.float32)
    d = generator.normal(size=(1500, 3)).astype(np.float32)
    caster = scene.caster
    curved = [quadric_hits(kind, matrix, o, d) for kind, matrix in zip(caster.kinds, caster.to_world, strict=True)]
    every = np.concatenate([triangle_hits(caster.corners, o, d), *(np.where(both > 0, both, np.inf).min(axis=1)[:, None] for both in curved)], axis=1)
    every[every <= 0] = np.inf
    nearest, primitive = every.min(axis=1), every.argmin(axis=1)
    far = np.full(1500, 1e30, np.float32)
    objects, distance = scene.closest(o, d, far)
    met = np.isfinite(nearest)
    assert mixed(met)
    assert ((objects != 65535) == met).all()
    assert (objects[met] == scene._owner()[primitive[met]]).mean() > 0.995  # two surfaces may lie in one place
    np.testing.assert_allclose(distance[met], nearest[met], rtol=1e-4, atol=1e-5)
    half = np.where(met, nearest / 2, 1e6).astype(np.float32)
    assert not scene.occluded(o, d, half).any()
    assert (scene.occluded(o, d, 4 * half) == met).all()


def test_segments_cross_where_they_touch_what_is_seen(folder: pathlib.Path) -> None:
    """A segment from a vertex that is inside crosses; one that stays off all surfaces does not; one through a surface does where that is inside."""
    with open_run(folder) as run:
        scene, found, drawn = SceneGeometry(run), vertices(run), shape(run)
    points, objects = found["points"], found["object"]
    inside = drawn.contains(scene, points, objects)
    last = np.flatnonzero((found["depth"][:-1] + 1 == found["depth"][1:]) & (found["depth"][:-1] >= 1))
    start, end = points[last], points[last + 1]
    expected = inside[last] | inside[last + 1]
    assert mixed(expected, 500)
    assert (drawn.crosses(scene, start, end) == expected).mean() > 0.999  # but for the last bit at the shape's border and at edges
    assert (drawn.crosses(scene, start, end) >= expected).all()

    # Segments in free space, and the same ones prolonged through the surfaces at their ends
    middle, d = (start + end) / 2, end - start
    free = np.linalg.norm(d, axis=1) > 0.2
    middle, d, expected = middle[free], d[free], expected[free]
    assert not drawn.crosses(scene, middle - d / 4, middle + d / 4).any()
    through = drawn.crosses(scene, middle - d * 0.55, middle + d * 0.55)
    assert mixed(through, 300)
    assert (through >= expected).all()


def test_a_polygon_may_cut_itself() -> None:
    """Even-odd: the middle of a pentagram is outside; so are points seen through it."""
    turn = np.radians(90 + 144 * np.arange(5))
    drawn = Polygon((tuple((50 + 40 * np.cos(a), 50 - 40 * np.sin(a)) for a in turn),))
    raster = np.array([[50, 50], [50, 15], [50, 85], [20, 40], [2, 2]], np.float64)
    inside = np.zeros(5, np.bool_)
    drawn.draw(raster, inside)
    assert inside.tolist() == [False, True, False, True, False]


def test_strokes_are_near_their_polyline() -> None:
    raster = np.random.default_rng(1).uniform(0, 100, (3000, 2))
    line = [(10, 10), (80, 30), (80, 30), (40, 90)]
    drawn = Stroke(tuple(line), 7)
    steps = np.linspace(0, 1, 4001)[:, None]
    dense = np.concatenate([np.array(a) + steps * (np.array(b) - a) for a, b in itertools.pairwise(line)])
    nearest = np.sqrt([np.min(np.sum((dense - place) ** 2, axis=1)) for place in raster])
    inside = np.zeros(len(raster), np.bool_)
    drawn.draw(raster, inside)
    assert mixed(inside, 500)
    sure = np.abs(nearest - 7) > 1e-3
    assert (inside == (nearest <= 7))[sure].all()
    dot = np.zeros(3, np.bool_)
    Stroke(((5, 5),), 2).draw(np.array([[5, 7], [6, 6], [7.1, 5]]), dot)
    assert dot.tolist() == [True, True, False]


def test_what_is_behind_the_camera_is_not_seen() -> None:
    ball = np.hstack([0.5 * np.eye(3), [[0], [0], [3]]])
    scene = scene_of({}, {"ball": ball, "back": ball * [[1, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, -1]]})
    points = np.array([[0, 0, 2.5], [0, 0, 3.5], [0, 0, -2.5], [0, 0, 0], [0, 0, 0.005]], np.float32)
    drawn = region({"stroke": {"points": [[50, 50]], "radius": 5}})
    assert drawn.contains(scene, points, np.zeros(5, np.uint16)).tolist() == [True, False, False, False, False]
    assert drawn.crosses(scene, points[[2, 2, 0, 1]], points[[3, 0, 0, 1]]).tolist() == [False, True, True, False]


def test_a_run_without_a_camera_or_surfaces_says_so() -> None:
    drawn = region({"stroke": {"points": [[50, 50]], "radius": 5}})
    point, nothing = np.zeros((1, 3), np.float32), np.zeros(1, np.uint16)
    with pytest.raises(QueryError, match="does not say where its camera is"):
        drawn.contains(scene_of(camera=None), point, nothing)
    with pytest.raises(QueryError, match="camera cannot be read"):
        drawn.check(scene_of(camera={key: value for key, value in CAMERA.items() if key != "tan_x"}))
    scene = scene_of()
    scene._tables.pop("triangles")
    with pytest.raises(QueryError, match="does not store the surfaces"):
        drawn.check(scene)
    drawn.check()
