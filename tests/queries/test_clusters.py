"""Arrows at a probe: what they add up to, what they are called, where they begin."""

import pathlib

import numpy as np
import pytest
from metered import BLACK, ceiling_lamp, floor, gray, point_light, trace

from queries import open_run
from queries.clusters import Clusters, clusters
from queries.errors import QueryError
from queries.kernels.luminance import LUMINANCE
from queries.probes import Probe, incident
from queries.selection import Selection

ALL = Selection()
PROBE = Probe((0.0, 0.5, 0.0), 0.3)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A lamp and a shade beside it over a gray floor with a small block, a point light; 4 shards."""
    place = [{"scale": 0.2}, {"translate": [0.7, 0.2, 0]}]
    shade = [{"scale": 0.3}, {"rotate": {"axis": [0, 1, 0], "angle": 90}}, {"translate": [-0.4, 1.9, 0]}]
    objects = {
        "floor": floor(1.5, bsdf=gray(0.5)),
        "lamp": ceiling_lamp(0.3, 2.0, 5.0),
        "shade": {"type": "rectangle", "to_world": shade, "bsdf": {"type": "twosided", "bsdf": gray(0.9)}},
        "block": {"type": "cube", "to_world": place, "bsdf": gray(0.8)},
        "bulb": point_light([1.0, 1.0, 0.5], [0.1, 0.2, 0.3]),
    }
    return trace(tmp_path_factory.mktemp("room"), objects, samples=64, max_depth=5)


def first(found: Clusters) -> dict[str, object]:
    return {arrow.label: arrow for arrow in found.arrows if arrow.level == 1}


def test_shares_add_up_with_what_is_dropped(room: pathlib.Path) -> None:
    with open_run(room) as run:
        whole = incident(run, ALL, PROBE)
        for threshold in (0.0, 0.01, 0.2):
            found = clusters(run, ALL, PROBE, threshold=threshold)
            assert sum(arrow.share for arrow in found.arrows) + found.dropped == pytest.approx(1, abs=1e-12)
            assert all(arrow.share >= threshold for arrow in found.arrows)
            assert found.arrows == tuple(sorted(found.arrows, key=lambda arrow: -arrow.share))
            np.testing.assert_allclose(found.value, whole.value, rtol=1e-10)
            assert found.value_error == pytest.approx(whole.value_error, rel=1e-6)
            assert found.count == whole.count
        assert found.dropped > 0
        everything = clusters(run, ALL, PROBE, threshold=0.0)
        assert everything.dropped == 0
        assert set(first(everything)) == {
            "emitter lamp", "emitter bulb", "diffuse reflection by floor", "diffuse reflection by shade", "diffuse reflection by block",
        }  # fmt: skip
        np.testing.assert_allclose(sum(arrow.value for arrow in everything.arrows), whole.value, rtol=1e-10)
        assert sum(arrow.count for arrow in everything.arrows) == whole.count


@pytest.mark.parametrize("probe", [PROBE, Probe((0.1, 0.0, 0.2), 0.2, (0, 1, 0))])
def test_arrows_are_what_expressions_select(room: pathlib.Path, probe: Probe) -> None:
    with open_run(room) as run:
        found = first(clusters(run, ALL, probe, threshold=0.0))
        for label, text in (
            ("emitter lamp", "C L@light:lamp"),
            ("emitter bulb", "C L@light:bulb"),
            ("diffuse reflection by block", "C D@object:block . * L"),
        ):
            part = incident(run, Selection.of(run, text), probe)
            arrow = found[label]
            assert arrow.count == part.count > 0
            np.testing.assert_allclose(arrow.value, part.value, rtol=1e-10)
            assert arrow.error == pytest.approx(part.value_error, rel=1e-6)
            assert arrow.value @ LUMINANCE == pytest.approx(arrow.share * sum(a.value @ LUMINANCE for a in found.values()), rel=1e-9)


def test_groups_merge_their_members(room: pathlib.Path) -> None:
    with open_run(room) as run:
        apart = first(clusters(run, ALL, PROBE, threshold=0.0))
        joined = first(clusters(run, ALL, PROBE, {"the lamp": ["lamp", "shade"]}, threshold=0.0))
        assert set(apart) - set(joined) == {"emitter lamp", "diffuse reflection by shade"}
        assert set(joined) - set(apart) == {"the lamp"}
        group, members = joined["the lamp"], [apart["emitter lamp"], apart["diffuse reflection by shade"]]
        np.testing.assert_allclose(group.value, sum(member.value for member in members), rtol=1e-10)
        assert group.count == sum(member.count for member in members)
        assert (group.objects, group.event) == (("lamp", "shade"), "")
        weights = [member.value @ LUMINANCE for member in members]
        np.testing.assert_allclose(group.mean_start, np.average([m.mean_start for m in members], axis=0, weights=weights), rtol=1e-8, atol=1e-8)


def test_arrows_begin_at_real_vertices_and_end_in_the_probe(room: pathlib.Path) -> None:
    with open_run(room) as run:
        found = clusters(run, ALL, PROBE, threshold=0.0, history=2)
        table = run.tables["light_vertices"]
        points = np.stack([table[axis].to_numpy() for axis in "xyz"], axis=1)
        for arrow in found.arrows:
            distance = np.linalg.norm(points - arrow.start, axis=1)
            assert distance.min() == 0
            if arrow.objects and arrow.level == 1 and arrow.event == "emitter":
                mine = points[(table["depth"].to_numpy() == 0) & (table["object"].to_numpy() == run.geometry.object_id(arrow.objects[0]))]
                assert np.linalg.norm(mine - arrow.mean_start, axis=1).min() <= np.linalg.norm(arrow.start - arrow.mean_start)
            if arrow.level == 1:
                assert np.linalg.norm(arrow.end - PROBE.position) < PROBE.radius
        bulb = first(found)["emitter bulb"]
        np.testing.assert_allclose(bulb.start, (1.0, 1.0, 0.5), atol=1e-6)
        assert first(found)["emitter lamp"].start[1] == pytest.approx(2.0, abs=1e-5)
        np.testing.assert_allclose(first(found)["emitter lamp"].end, PROBE.position, atol=0.1)


def test_history_is_a_tree(room: pathlib.Path) -> None:
    with open_run(room) as run:
        found = clusters(run, ALL, PROBE, threshold=0.0, history=3)
        assert {arrow.level for arrow in found.arrows} == {1, 2, 3}
        for i, arrow in enumerate(found.arrows):
            children = [child for child in found.arrows if child.parent == i]
            assert all(child.level == arrow.level + 1 and found.arrows.index(child) > i for child in children)
            if arrow.level < 3 and arrow.event != "emitter":
                np.testing.assert_allclose(sum(child.value for child in children), arrow.value, rtol=1e-9)
                starts = np.average([child.end for child in children], axis=0, weights=[child.share for child in children])
                np.testing.assert_allclose(starts, arrow.mean_start, rtol=1e-6, atol=1e-6)
            else:
                assert not children
        text = "C D@object:floor L@light:lamp"
        by_floor = next(i for i, arrow in enumerate(found.arrows) if arrow.label == "diffuse reflection by floor")
        lamp = next(arrow for arrow in found.arrows if arrow.parent == by_floor and arrow.label == "emitter lamp")
        np.testing.assert_allclose(lamp.value, incident(run, Selection.of(run, text), PROBE).value, rtol=1e-10)
        fewer = clusters(run, ALL, PROBE, threshold=0.02, history=3)
        assert all(arrow.parent >= 0 for arrow in fewer.arrows if arrow.level > 1)
        assert len(fewer.arrows) < len(found.arrows)


def test_threads_do_not_change_a_bit(room: pathlib.Path) -> None:
    with open_run(room) as run:
        assert len(run.shard_files) > 1
        one, two = (clusters(run, ALL, PROBE, history=2, threads=threads) for threads in (1, 2))
        assert len(one.arrows) == len(two.arrows) > 5
        for a, b in zip(one.arrows, two.arrows):
            assert (a.label, a.parent, a.share, a.error, a.count) == (b.label, b.parent, b.share, b.error, b.count)
            for name in ("start", "mean_start", "end", "value"):
                assert getattr(a, name).tobytes() == getattr(b, name).tobytes()


def test_no_light_is_no_arrow(room: pathlib.Path) -> None:
    with open_run(room) as run:
        found = clusters(run, Selection.of(run, "C S L"), PROBE, history=2)
        assert found.arrows == ()
        assert (found.count, found.dropped, found.value_error) == (0, 0.0, 0.0)


def test_a_sky_and_a_sun_are_told_by_what_is_known(tmp_path: pathlib.Path) -> None:
    objects = {
        "floor": floor(1.0, bsdf=gray(0.5)),
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 0.5}},
        "spot": point_light([0.0, 0.8, 0.0], 1.0),
    }
    with open_run(trace(tmp_path, objects, samples=8, max_depth=3)) as run:
        found = first(clusters(run, ALL, Probe((0.0, 0.3, 0.0), 0.2), threshold=0.0))
        assert set(found) == {"emitter sky", "emitter spot", "diffuse reflection by floor"}
        np.testing.assert_allclose(found["emitter spot"].start, (0, 0.8, 0), atol=1e-6)
        direct = incident(run, Selection.of(run, "C B"), Probe((0.0, 0.3, 0.0), 0.2))
        np.testing.assert_allclose(found["emitter sky"].value, direct.value, rtol=1e-10)


def test_importance_comes_from_the_camera(tmp_path: pathlib.Path) -> None:
    objects = {"floor": floor(1.5, bsdf=gray(0.5)), "lamp": ceiling_lamp(0.3, 2.0, 5.0), "wall": {"type": "rectangle", "bsdf": BLACK}}
    with open_run(trace(tmp_path, objects, method="path", samples=8, max_depth=4)) as run:
        found = first(clusters(run, ALL, Probe((0.0, 0.5, 1.0), 0.3), side="camera", threshold=0.0, history=2))
        np.testing.assert_allclose(found["camera"].start, run.geometry.camera.origin, atol=1e-5)
        assert "diffuse reflection by floor" in found


def test_what_cannot_be_grouped_is_refused(room: pathlib.Path) -> None:
    with open_run(room) as run:
        with pytest.raises(QueryError, match="no object `lmap`: did you mean `lamp`"):
            clusters(run, ALL, PROBE, {"a": ["lmap"]})
        with pytest.raises(QueryError, match="`lamp` in `a` and in `b`"):
            clusters(run, ALL, PROBE, {"a": ["lamp"], "b": ["shade", "lamp"]})
        for given in ({"threshold": 1.0}, {"threshold": -0.1}, {"history": 0}, {"history": 4}):
            with pytest.raises(QueryError, match="threshold of 0 or more"):
                clusters(run, ALL, PROBE, **given)  # type: ignore[arg-type]
