"""Which bundle a segment belongs to, against a plain loop; and the axes of bundles."""

import numpy as np
import pytest
from bundled_paths import permuted, random_sample
from hypothesis import given, settings
from hypothesis import strategies as st

from queries.path_sample import PathSample
from viz.bundles import axes_of, segments_of, vertex_codes
from viz.bundles.axes import exact_means

MATERIALS = np.array([0, 1, 0, 2])


def by_loop(sample: PathSample, by: tuple[str, ...], normals: np.ndarray) -> list[tuple]:
    """The kinds of both ends of each segment, one path after the other."""
    kinds = []
    for a, b in zip(sample.start[:-1], sample.start[1:]):
        for row in range(a, b - 1):
            ends = []
            for v in (row, row + 1):
                thing = int(sample.object[v])
                known = {"event": int(sample.event[v]), "object": thing, "normal": int(normals[v])}
                known["material"] = int(MATERIALS[thing]) if thing < len(MATERIALS) else -1
                ends.append(tuple(known[name] for name in by))
            kinds.append(tuple(ends))
    return kinds


@pytest.mark.parametrize("by", [("event",), ("object",), ("event", "object"), ("material",), ("normal",), ("event", "object", "material", "normal")])
def test_segments_share_a_bundle_where_their_ends_are_of_the_same_kinds(by: tuple[str, ...]) -> None:
    sample = random_sample(200, seed=3)
    normals = np.random.default_rng(4).integers(0, 7, len(sample.event))
    segments = segments_of(sample.start, vertex_codes(sample, by, MATERIALS, normals))
    kinds = by_loop(sample, by, normals)
    assert len(segments) == len(kinds) > 200
    of_kind: dict[tuple, set[int]] = {}
    for kind, bundle in zip(kinds, segments.bundle.tolist()):
        of_kind.setdefault(kind, set()).add(bundle)
    assert all(len(bundles) == 1 for bundles in of_kind.values())
    assert len(of_kind) == segments.bundles == len({min(bundles) for bundles in of_kind.values()}) > 1


def test_segments_lead_from_each_vertex_to_the_next_of_its_path() -> None:
    sample = random_sample(50, seed=5)
    segments = segments_of(sample.start, vertex_codes(sample, ("object",), MATERIALS))
    assert np.array_equal(np.delete(np.arange(len(sample.event)), sample.start[1:] - 1), segments.begin)
    assert np.array_equal(np.searchsorted(sample.start, segments.begin, side="right") - 1, segments.path)


def test_without_paths_there_are_no_bundles() -> None:
    sample = random_sample(0, seed=0)
    segments = segments_of(sample.start, vertex_codes(sample, ("event", "object"), MATERIALS))
    assert (len(segments), segments.bundles) == (0, 0)


def test_an_axis_runs_between_the_mean_ends() -> None:
    generator = np.random.default_rng(6)
    begin, end = generator.normal(size=(2, 500, 3)).astype(np.float32)
    bundle = generator.integers(0, 7, 500).astype(np.int32)
    axes = axes_of(begin, end, bundle, 7)
    for k in range(7):
        rows = bundle == k
        assert axes.begin[k] == pytest.approx(begin[rows].mean(0, np.float64), abs=1e-9)
        assert axes.end[k] == pytest.approx(end[rows].mean(0, np.float64), abs=1e-9)
        assert axes.way[k] == pytest.approx((axes.end - axes.begin)[k] / np.linalg.norm((axes.end - axes.begin)[k]), abs=1e-12)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(1e-6, 1e6), st.integers(1, 300))
def test_means_have_the_same_bits_in_any_order_and_company(seed: int, scale: float, rows: int) -> None:
    generator = np.random.default_rng(seed)
    points = (scale * generator.normal(1, 1, (rows, 3))).astype(np.float32)
    group = generator.integers(0, 3, rows).astype(np.int32)
    means = exact_means(points, group, 3)
    order = generator.permutation(rows)
    assert np.array_equal(means, exact_means(points[order], group[order], 3))
    for k in np.unique(group):
        alone = points[group == k]
        assert np.array_equal(means[k], exact_means(alone, np.zeros(len(alone), np.int32), 1)[0])
        assert means[k] == pytest.approx(alone.mean(0, np.float64), abs=1e-7 * float(np.abs(alone).max()))


def test_projections_are_orthogonal_and_on_the_axis() -> None:
    generator = np.random.default_rng(7)
    begin, end = generator.normal(size=(2, 400, 3)).astype(np.float32)
    bundle = generator.integers(0, 5, 400).astype(np.int32)
    axes = axes_of(begin, end, bundle, 5)
    foot = axes.project(begin, bundle).astype(np.float64)
    assert np.abs(np.einsum("ij,ij->i", begin - foot, axes.way[bundle])).max() < 2e-6
    assert np.linalg.norm(np.cross(foot - axes.begin[bundle], axes.way[bundle]), axis=1).max() < 2e-6


def test_a_bundle_that_leads_nowhere_is_drawn_to_its_center() -> None:
    begin = np.array([[0, 0, 0], [2, 2, 2]], np.float32)
    axes = axes_of(begin, begin[::-1].copy(), np.zeros(2, np.int32), 1)
    assert np.array_equal(axes.way, [[0, 0, 0]])
    assert np.array_equal(axes.project(begin, np.zeros(2, np.int32)), np.ones((2, 3)))


def test_numbers_of_bundles_do_not_depend_on_the_order_of_paths() -> None:
    sample = random_sample(80, seed=8)
    shuffled, order = permuted(sample, seed=9)
    first, second = (segments_of(s.start, vertex_codes(s, ("event", "object"), MATERIALS)) for s in (sample, shuffled))
    rows = np.concatenate([np.flatnonzero(first.path == path) for path in order])
    assert np.array_equal(first.bundle[rows], second.bundle)
    assert len(np.unique(first.bundle)) > 10
