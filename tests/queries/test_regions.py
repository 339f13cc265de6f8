"""Balls and boxes against their definitions, segments against dense samples of their points; larger regions against smaller ones."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from region_scenes import mixed, scene_of

from queries.errors import QueryError
from queries.regions import Box, Grown, Inside, Polygon, Region, Sphere, Stroke, Surface, Union

NOWHERE = np.full(10**6, 65535, np.uint16)
SCENE = scene_of({"block": trimesh.creation.box((1, 2, 0.5))}, {"ball": np.hstack([0.7 * np.eye(3), [[1], [0.5], [0]]])})
BOXES = [
    Box((0.1, -0.2, 0.3), (1.0, 0.6, 1.4)),
    Box((0.1, -0.2, 0.3), (1.0, 0.6, 1.4), (1, 2, -0.5), 40),
    Box((0, 0, 0), (2, 0.1, 1), (0, 0, 3), 90),
]
SPHERES = [Sphere((0.2, -0.1, 0.4), 0.8), Sphere((5, 5, 5), 7.5)]


def some_points(count: int = 4000, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 0.8, (count, 3)).astype(np.float32)


def rotation(axis: tuple[float, float, float], degrees: float) -> np.ndarray:
    """By quaternions, where the region uses Rodrigues' formula."""
    return trimesh.transformations.quaternion_matrix(trimesh.transformations.quaternion_about_axis(np.radians(degrees), axis))[:3, :3]


@pytest.mark.parametrize("ball", SPHERES)
def test_balls_hold_what_is_near_their_center(ball: Sphere) -> None:
    points = some_points() if ball.radius < 1 else some_points() * 6
    expected = np.linalg.norm(points.astype(np.float64) - ball.center, axis=1) <= ball.radius
    assert mixed(expected)
    assert (ball.contains(SCENE, points, NOWHERE[: len(points)]) == expected).all()


@pytest.mark.parametrize("box", BOXES)
def test_boxes_hold_what_the_inverse_transform_puts_into_the_unit_box(box: Box) -> None:
    points = some_points()
    to_world = np.eye(4)
    to_world[:3, :3] = rotation(box.axis, box.angle) @ np.diag(box.size)
    to_world[:3, 3] = box.center
    unit = trimesh.transform_points(points.astype(np.float64), np.linalg.inv(to_world))
    expected = np.all(np.abs(unit) <= 0.5, axis=1)
    assert mixed(expected)
    assert (box.contains(SCENE, points, NOWHERE[: len(points)]) == expected).all()


def test_borders_belong_to_regions() -> None:
    border = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1]], np.float32)
    for solid in (Sphere((0, 0, 0), 1), Box((0, 0, 0), (2, 2, 2))):
        assert solid.contains(SCENE, border, NOWHERE[:3]).all()
        assert not solid.contains(SCENE, border * np.float32(1.000001), NOWHERE[:3]).any()
        assert solid.crosses(SCENE, border, border * 3).all()
        assert not solid.crosses(SCENE, border * np.float32(1.000001), border * 3).any()


@pytest.mark.parametrize("solid", [*SPHERES[:1], *BOXES], ids=lambda solid: type(solid).__name__)
def test_segments_cross_where_one_of_their_points_is_inside(solid: Sphere | Box) -> None:
    """Dense samples of a segment: one inside means that it crosses; and where it crosses, one is inside but for the samples' distance."""
    start, end = 2 * some_points(2000, 2), 2 * some_points(2000, 3)
    steps = np.linspace(0, 1, 1001)
    found = solid.crosses(SCENE, start, end)
    gap = float(np.linalg.norm(end - start, axis=1).max() / 1000)
    if isinstance(solid, Sphere):
        wider: Region = Sphere(solid.center, solid.radius + gap)
    else:
        x, y, z = solid.size
        wider = Box(solid.center, (x + 2 * gap, y + 2 * gap, z + 2 * gap), solid.axis, solid.angle)
    samples = (start[:, None] + steps[:, None] * (end - start)[:, None]).astype(np.float32).reshape(-1, 3)
    inside, nearly = (one.contains(SCENE, samples, np.zeros(len(samples), np.uint16)).reshape(-1, 1001).any(axis=1) for one in (solid, wider))
    assert mixed(found)
    assert mixed(inside)
    assert (found >= inside).all()
    assert (found <= nearly).all()
    ends = solid.contains(SCENE, start, NOWHERE[: len(start)]) | solid.contains(SCENE, end, NOWHERE[: len(end)])
    assert mixed(ends, 10)
    assert mixed(found & ~ends, 10)


@pytest.mark.parametrize("solid", [*SPHERES, *BOXES], ids=lambda solid: type(solid).__name__)
def test_a_segment_of_no_length_crosses_where_its_point_is_inside(solid: Region) -> None:
    points = some_points()
    expected = solid.contains(SCENE, points, NOWHERE[: len(points)])
    assert expected.any()
    assert (solid.crosses(SCENE, points, points) == expected).all()


def test_no_points_are_no_answers() -> None:
    nothing = np.empty((0, 3), np.float32)
    for one in (SPHERES[0], BOXES[1], Surface("block"), Inside("block"), Inside("ball").enlarged(2), Stroke(((50, 50),), 4)):
        assert one.contains(SCENE, nothing, NOWHERE[:0]).shape == (0,)
        assert one.crosses(SCENE, nothing, nothing).shape == (0,)


# --- larger regions -----------------------------------------------------------------------------------------------

number = st.floats(-2, 2, width=32)
positive = st.floats(0.015625, 2, width=32)
point = st.tuples(number, number, number)
pixel = st.tuples(st.floats(20, 80), st.floats(20, 80))
axis = point.filter(lambda axis: max(map(abs, axis)) > 1e-3)
regions = st.one_of(
    st.builds(Sphere, point, positive),
    st.builds(Box, point, st.tuples(positive, positive, positive), axis, st.floats(-360, 360)),
    st.builds(Stroke, st.lists(pixel, min_size=1, max_size=5).map(tuple), st.floats(0.1, 20)),
    st.builds(lambda loop: Polygon((tuple(loop),)), st.lists(pixel, min_size=3, max_size=6)),
    st.sampled_from([Surface("block"), Surface("ball"), Inside("block"), Inside("ball")]),
)


@settings(max_examples=150, deadline=None)
@given(regions, st.floats(1, 4), st.floats(1, 2), st.integers(0, 1000))
def test_a_larger_region_contains_the_smaller_one(inner: Region, factor: float, further: float, seed: int) -> None:
    generator = np.random.default_rng(seed)
    points = generator.uniform(-2, 2, (300, 3)).astype(np.float32)
    points[200:, 2] = 2 + abs(points[200:, 2])  # before the camera
    end = generator.uniform(-2, 2, (300, 3)).astype(np.float32)
    objects = generator.choice(np.array([0, 1, 65535], np.uint16), 300)
    outer = inner.enlarged(factor)
    for small, large in ((inner, outer), (outer, outer.enlarged(further))):
        assert (small.contains(SCENE, points, objects) <= large.contains(SCENE, points, objects)).all()
        assert (small.crosses(SCENE, points, end) <= large.crosses(SCENE, points, end)).all()
        assert large.describe()
        large.check(SCENE)


@pytest.mark.parametrize("inner", [SPHERES[0], BOXES[1], Surface("ball"), Inside("ball"), Inside("block")], ids=lambda inner: type(inner).__name__)
def test_a_larger_region_is_larger(inner: Region) -> None:
    points = some_points(20_000, 5)
    objects = NOWHERE[: len(points)]
    small, large = (one.contains(SCENE, points, objects) for one in (inner, inner.enlarged()))
    assert mixed(large & ~small, 100)
    assert mixed(large, 100)


def test_a_solid_grows_in_length_about_its_center() -> None:
    points = some_points(20_000, 6)
    grown = Inside("ball").enlarged(1.5)
    expected = np.linalg.norm(points.astype(np.float64) - (1, 0.5, 0), axis=1) <= 1.5 * 0.7
    assert mixed(expected)
    assert (grown.contains(SCENE, points, NOWHERE[: len(points)]) == expected).all()
    assert Sphere((1, 2, 3), 2).enlarged() == Sphere((1, 2, 3), 3)
    assert Box((1, 2, 3), (2, 4, 8), (0, 1, 0), 10).enlarged(2) == Box((1, 2, 3), (4, 8, 16), (0, 1, 0), 10)


def test_around_a_flat_object_there_is_space() -> None:
    floor = trimesh.Trimesh([[0, 0, 0], [4, 0, 0], [4, 0, 2], [0, 0, 2]], [[0, 1, 2], [0, 2, 3]])
    scene = scene_of({"floor": floor, "above": trimesh.creation.box((1, 1, 1))})
    grown = Surface("floor").enlarged(1.5)
    assert isinstance(grown, Union)
    points = np.array([[2, 0, 1], [2, 0.9, 1], [2, 1.1, 1], [-0.9, 0, 1], [-1.1, 0, 1]], np.float32)
    assert grown.contains(scene, points, NOWHERE[:5]).tolist() == [True, True, False, True, False]
    assert Surface("floor").contains(scene, points, np.array([0, 1, 0, 65535, 1], np.uint16)).tolist() == [True, False, True, False, False]


@pytest.mark.parametrize("factor", [0.5, 0, -1, float("nan"), float("inf"), 1e9, True, "2"])
def test_regions_do_not_shrink(factor: float) -> None:
    drawn = Stroke(((1, 1),), 2), Polygon((((0, 0), (1, 0), (0, 1)),))
    for one in (SPHERES[0], BOXES[0], Surface("ball"), Inside("ball"), Grown(Inside("ball"), 2), *drawn):
        with pytest.raises(QueryError, match="grows by a factor of 1"):
            one.enlarged(factor)


def test_unknown_objects_are_named_with_the_nearest_known_one() -> None:
    points = some_points(3)
    for one in (Surface("bal"), Inside("bal"), Surface("bal").enlarged(), Inside("bal").enlarged()):
        asks = (lambda one: one.check(SCENE), lambda one: one.contains(SCENE, points, NOWHERE[:3]), lambda one: one.crosses(SCENE, points, points))
        for ask in asks:
            with pytest.raises(QueryError, match="no object `bal`: did you mean `ball`"):
                ask(one)
        one.check()
