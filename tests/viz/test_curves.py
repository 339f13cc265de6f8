"""Curves of bundles: what never changes (thesis 8.1 and 8.2)."""

import numpy as np
import pytest
from bundled_paths import permuted, random_sample
from hypothesis import given, settings
from hypothesis import strategies as st

from viz.bundles import Influence, bundled, influence, vertex_codes

U = np.linspace(0, 1, 24)


def codes(sample, by=("event", "object")):
    return vertex_codes(sample, by, np.zeros(8, np.int64))


def lerp(a: np.ndarray, b: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(1 - u) a + u b in float32: (s, points, 3)."""
    u = u.astype(np.float32)[None, :, None]
    return (np.float32(1) - u) * a[:, None] + u * b[:, None]


@pytest.mark.parametrize("flatten", [False, True])
@pytest.mark.parametrize("points", [3, 24])
def test_no_amount_gives_the_straight_segments_back_bit_for_bit(flatten: bool, points: int) -> None:
    sample = random_sample(3000, seed=1)
    paths = bundled(sample, codes(sample), 0.0, points, flatten)
    begin, end = sample.points[paths.segments.begin], sample.points[paths.segments.begin + 1]
    assert np.array_equal(paths.curves, lerp(begin, end, np.linspace(0, 1, points)))


@settings(deadline=None, max_examples=30)
@given(st.floats(0, 1), st.integers(0, 1000), st.integers(3, 40))
def test_end_points_stay_for_every_amount(amount: float, seed: int, points: int) -> None:
    sample = random_sample(40, seed)
    paths = bundled(sample, codes(sample), amount, points)
    assert np.array_equal(paths.curves[:, 0], sample.points[paths.segments.begin])
    assert np.array_equal(paths.curves[:, -1], sample.points[paths.segments.begin + 1])


@settings(deadline=None, max_examples=30)
@given(st.floats(0, 1), st.integers(0, 1000))
def test_flattened_paths_keep_their_own_ends_and_stay_connected(amount: float, seed: int) -> None:
    sample = random_sample(40, seed)
    paths = bundled(sample, codes(sample), amount, 24, flatten=True)
    path = paths.segments.path
    first, last = (np.concatenate(ends) for ends in (([True], path[1:] != path[:-1]), (path[1:] != path[:-1], [True])))
    assert np.array_equal(paths.curves[first, 0], sample.points[sample.start[:-1]])
    assert np.array_equal(paths.curves[last, -1], sample.points[sample.start[1:] - 1])
    # The end of each segment is where the next begins, to the bit
    inside = np.flatnonzero(~last)
    assert np.array_equal(paths.curves[inside, -1], paths.curves[inside + 1, 0])


def test_curves_are_the_formula() -> None:
    sample, amount = random_sample(300, seed=2), 0.7
    paths = bundled(sample, codes(sample), amount)
    x0, x1 = (sample.points[paths.segments.begin + k].astype(np.float64) for k in (0, 1))
    c0, c1 = paths.axes.begin[paths.segments.bundle], paths.axes.end[paths.segments.bundle]
    way = (c1 - c0) / np.linalg.norm(c1 - c0, axis=1, keepdims=True)
    feet = [c0 + ((x - c0) * way).sum(1, keepdims=True) * way for x in (x0, x1)]
    u = U[None, :, None]
    t = amount * (0.5 + 0.5 * np.cos(2 * np.pi * u - np.pi))
    x, target = ((1 - u) * a[:, None] + u * b[:, None] for a, b in ((x0, x1), feet))
    assert np.abs(paths.curves - ((1 - t) * x + t * target)).max() < 1e-5


def test_with_the_whole_amount_the_middle_lies_on_the_axis() -> None:
    sample = random_sample(300, seed=3)
    paths = bundled(sample, codes(sample), 1.0, 25)
    middle, bundle = paths.curves[:, 12].astype(np.float64), paths.segments.bundle
    assert np.linalg.norm(np.cross(middle - paths.axes.begin[bundle], paths.axes.way[bundle]), axis=1).max() < 5e-6


def test_a_bundle_of_one_segment_is_straight() -> None:
    sample = random_sample(1, seed=4, longest=2)
    paths = bundled(sample, codes(sample), 1.0)
    assert np.abs(paths.curves - lerp(sample.points[:1], sample.points[1:2], U)).max() < 1e-6


@pytest.mark.parametrize("flatten", [False, True])
def test_the_order_of_rows_does_not_matter(flatten: bool) -> None:
    sample = random_sample(2500, seed=5)
    shuffled, order = permuted(sample, seed=6)
    first, second = (bundled(s, codes(s), 0.8, 24, flatten) for s in (sample, shuffled))
    rows = np.argsort(np.argsort(order, kind="stable")[first.segments.path], kind="stable")
    assert np.array_equal(first.curves[rows], second.curves)


def test_a_curve_depends_on_its_bundle_and_itself_alone() -> None:
    sample = random_sample(2500, seed=7)
    whole = bundled(sample, codes(sample), 0.8)
    # Paths of one segment have bundles of their own (emitter to camera): all others may go
    short = np.flatnonzero(np.diff(sample.start) == 2)
    alone = sample.take(short)
    assert len(short) > 100
    assert np.array_equal(whole.curves[np.isin(whole.segments.path, short)], bundled(alone, codes(alone), 0.8).curves)
    # Moving a vertex changes its own bundles, and no other
    moved = sample.points.copy()
    moved[1] += 10
    changed = bundled(sample.__class__(**{**vars(sample), "points": moved}), codes(sample), 0.8)
    touched = set(whole.segments.bundle[(whole.segments.begin == 0) | (whole.segments.begin == 1)].tolist())
    others = ~np.isin(whole.segments.bundle, list(touched))
    assert others.any()
    assert np.array_equal(whole.curves[others], changed.curves[others])
    assert not np.array_equal(whole.curves[~others], changed.curves[~others])


def test_some_segments_can_be_left_out() -> None:
    sample = random_sample(100, seed=8)
    whole = bundled(sample, codes(sample), 0.8, flatten=True)
    keep = np.arange(len(whole.segments)) % 3 == 1
    part = bundled(sample, codes(sample), 0.8, flatten=True, keep=keep)
    assert np.array_equal(part.curves, whole.curves[keep])
    assert np.array_equal(part.segments.bundle, whole.segments.bundle[keep])


@given(st.floats(0, 1), st.floats(0, 1))
def test_influence_is_between_nothing_and_the_amount(u: float, amount: float) -> None:
    found = {kind: float(influence(np.array([u]), amount, kind)[0]) for kind in Influence}
    assert all(0 <= t <= np.float32(amount) for t in found.values())
    assert found[Influence.INNER] == np.float32(amount)
    assert found[Influence.FIRST if u >= 0.5 else Influence.LAST] == np.float32(amount)
    assert found[Influence.FIRST if u <= 0.5 else Influence.LAST] == found[Influence.BOTH]


def test_influence_vanishes_at_the_ends_exactly_and_is_whole_in_the_middle() -> None:
    assert influence(np.array([0, 0.5, 1]), 0.8).tolist() == [0, np.float32(0.8), 0]
    assert influence(np.array([0, 1]), 0.8, Influence.FIRST).tolist() == [0, np.float32(0.8)]
    assert influence(np.array([0, 1]), 0.8, Influence.LAST).tolist() == [np.float32(0.8), 0]


def test_no_paths_give_no_curves() -> None:
    sample = random_sample(0, seed=0)
    assert bundled(sample, codes(sample), 0.8, flatten=True).curves.shape == (0, 24, 3)
