"""Time of flight: what frames show is exactly what light passes in their time; waves from infinity are in phase; pictures say what they are."""

import itertools

import numpy as np
import pytest
from pydantic import ValidationError

from queries import Run
from queries.luminance import luminance_of
from queries.path_sample import PathSample, sample_paths
from queries.selection import Selection
from renderer.tables import EMITTER, LENS, NO_OBJECT
from viz.cameras import job_pose
from viz.flight import bent, flight, windows
from viz.look import Look
from viz.stage import Stage
from viz.tools.base import Drawn
from viz.tools.time_of_flight import TimeOfFlight

CENTER, RADIUS = np.array([0.5, 0.0, 0.0]), 3.0


def sample_of(polylines: list[np.ndarray], infinite: bool = False) -> PathSample:
    counts = [len(line) for line in polylines]
    n, m = len(counts), sum(counts)
    event = np.full(m, 8, np.uint8)
    start = np.concatenate([[0], np.cumsum(counts)])
    event[start[:-1]], event[start[1:] - 1] = EMITTER, LENS
    ones = np.ones((n, 3), np.float32)
    return PathSample(
        start, np.concatenate(polylines).astype(np.float32), event, np.full(m, NO_OBJECT, np.int32), np.arange(n), np.zeros(n, np.int32),
        np.full(n, infinite), ones, ones[:, :2], np.ones(n), n,
    )  # fmt: skip


@pytest.fixture
def sample() -> PathSample:
    random = np.random.default_rng(4)
    lines = [random.normal(size=(count, 3)) for count in random.integers(2, 9, 300)]
    lines.append(lines[0][[0, 1, 1, 0]])  # light that stays where it is for a while
    return sample_of(lines)


def travelled(line: np.ndarray, low: float, high: float) -> float:
    """The length of a polyline between two lengths along it, step by step."""
    at, found = 0.0, 0.0
    for a, b in itertools.pairwise(line):
        length = float(np.linalg.norm(b.astype(np.float64) - a))
        found += max(0.0, min(high, at + length) - max(low, at))
        at += length
    return found


def test_a_frame_shows_exactly_what_light_passes(sample: PathSample) -> None:
    light = flight(sample, CENTER, RADIUS)
    for low, high in ((0.0, 0.7), (1.3, 2.9), (4.0, 4.01), (50.0, 60.0)):
        rows, part = light.between(low, high)
        drawn = np.linalg.norm(part.end - part.begin, axis=1)
        np.testing.assert_allclose(drawn, part.arrives - part.leaves, atol=1e-12)
        each = np.bincount(part.path, drawn, len(sample))
        expected = [travelled(sample.points[a:b], low, high) for a, b in itertools.pairwise(sample.start)]
        np.testing.assert_allclose(each, expected, atol=1e-6)
        assert (part.leaves >= low).all()
        assert (part.arrives <= high).all()
        # On their segments
        np.testing.assert_allclose(np.linalg.norm(part.begin - light.begin[rows], axis=1), part.leaves - light.leaves[rows], atol=1e-12)
    assert not len(rows)


def test_consecutive_windows_show_each_length_once(sample: PathSample) -> None:
    light = flight(sample, CENTER, RADIUS)
    end = float(light.arrival.max())
    spans = list(windows(0.0, end, end / 16, 16))
    parts = [light.between(*span)[1] for span in spans]
    drawn = sum(np.bincount(part.path, np.linalg.norm(part.end - part.begin, axis=1), len(sample)) for part in parts)
    whole = [np.linalg.norm(np.diff(sample.points[a:b].astype(np.float64), axis=0), axis=1).sum() for a, b in itertools.pairwise(sample.start)]
    np.testing.assert_allclose(drawn, whole, rtol=1e-9)
    np.testing.assert_allclose(light.arrival, whole, rtol=1e-9)
    # Pieces do not overlap: sorted by time, each of a path begins where the one before it ended
    path, leaves, arrives = (np.concatenate([getattr(part, name) for part in parts]) for name in ("path", "leaves", "arrives"))
    order = np.lexsort((leaves, path))
    same = path[order][1:] == path[order][:-1]
    np.testing.assert_allclose(leaves[order][1:][same], arrives[order][:-1][same], atol=1e-9)
    assert spans[0][0] == 0
    assert spans[-1][1] == pytest.approx(end)
    assert list(windows(1.0, 9.0, 2.0, 1)) == [(1.0, 3.0)]


def test_light_begins_at_its_emitter(sample: PathSample) -> None:
    light = flight(sample, CENTER, RADIUS)
    _, part = light.between(0.0, 1e-3)
    assert len(part) == len(sample)
    np.testing.assert_array_equal(part.begin, sample.points[sample.start[:-1]].astype(np.float64))
    assert (part.bounce == 0).all()
    assert (part.leaves == 0).all()
    assert light.departure.max() < light.arrival.max()


def test_a_plane_wave_is_in_phase() -> None:
    random = np.random.default_rng(2)
    way = np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
    first = CENTER + random.uniform(-1, 1, (200, 3))
    begin = first - random.uniform(1, 30, (200, 1)) * way  # wherever the sample has them
    camera = np.array([2.0, 0.5, 0.0])
    light = flight(sample_of([np.stack([a, b, camera]) for a, b in zip(begin, first)], infinite=True), CENTER, RADIUS)
    for length in (0.0, 0.4, 1.9):
        _, part = light.between(length, length + 1e-6)
        front = part.begin[part.bounce == 0]
        assert len(front) == 200 or length > 0.4
        np.testing.assert_allclose((front - CENTER) @ way, length - RADIUS, atol=2e-5)
    np.testing.assert_allclose(light.arrives[light.bounce == 0], RADIUS + (first - CENTER) @ way, atol=2e-5)


def test_a_camera_that_looks_away_from_the_wave_sees_it_before_zero() -> None:
    outside = CENTER - [2 * RADIUS, 0, 0]
    light = flight(sample_of([np.stack([outside - [1, 0, 0], outside])], infinite=True), CENTER, RADIUS)
    assert light.arrival == pytest.approx([-RADIUS], abs=1e-5)
    assert light.leaves == pytest.approx(light.arrives)


def test_bent_segments_keep_their_ends_and_times(sample: PathSample) -> None:
    straight = flight(sample, CENTER, RADIUS)
    curves = bent(straight, sample, 0.8, 9)
    assert len(curves) == 8 * len(straight)
    ends = {name: getattr(curves, name).reshape(len(straight), 8, -1) for name in ("begin", "end", "leaves", "arrives")}
    np.testing.assert_allclose(ends["begin"][:, 0], straight.begin, atol=1e-6)
    np.testing.assert_allclose(ends["end"][:, -1], straight.end, atol=1e-6)
    np.testing.assert_array_equal(ends["end"][:, :-1], ends["begin"][:, 1:])
    np.testing.assert_allclose(ends["leaves"][:, 0, 0], straight.leaves, atol=1e-12)
    np.testing.assert_allclose(ends["arrives"][:, -1, 0], straight.arrives, atol=1e-12)
    np.testing.assert_allclose(curves.departure, straight.departure, atol=1e-12)
    # Some curves leave the straight way
    middle = (straight.begin + straight.end) / 2
    assert np.linalg.norm(ends["end"][:, 3] - middle, axis=1).max() > 0.1


# --- the tool -----------------------------------------------------------------------------------------------------


def drawn_with(run: Run, tool: TimeOfFlight, pick: int | None = None) -> tuple[Drawn, list[np.ndarray]]:
    with Stage(run, Look(), (120, 90)) as stage:
        drawn = tool.draw(run, stage)
        pictures = []
        for i in [pick] if pick is not None else range(len(drawn.frames) or 1):
            if drawn.frames:
                drawn.frames[i]()
            pictures.append(stage.picture(job_pose(run)))
    return drawn, pictures


def test_frames(spheres_run: Run) -> None:
    tool = TimeOfFlight(most=300, frames=4, seed=1)
    drawn, pictures = drawn_with(spheres_run, tool)
    assert len(drawn.frames) == len(drawn.frame_notes) == 4
    assert len({picture.tobytes() for picture in pictures}) == 4
    assert drawn.figures["paths_drawn"] == 300
    # The same pixels again, whatever was shown before
    np.testing.assert_array_equal(pictures[2], drawn_with(spheres_run, tool, 2)[1][0])
    mesh = drawn.meshes["paths"]
    lengths = np.linalg.norm(np.diff(mesh.points.reshape(-1, 2, 3).astype(np.float64), axis=1)[:, 0], axis=1)
    assert lengths.sum() == pytest.approx(drawn.figures["drawn_length_world_units"], rel=1e-5)
    np.testing.assert_allclose(np.diff(mesh.point_data["travelled"].reshape(-1, 2), axis=1)[:, 0], lengths, atol=1e-5)


@pytest.mark.parametrize("choose", ["uniform", "contribution"])
def test_half_of_the_light_has_arrived_at_the_median(spheres_run: Run, choose: str) -> None:
    tool = TimeOfFlight.model_validate({"most": 100_000, "choose": choose, "frames": 1})
    drawn, _ = drawn_with(spheres_run, tool)
    sample = sample_paths(spheres_run, Selection(), 100_000)
    light = luminance_of(sample.contribution)
    lengths = [np.linalg.norm(np.diff(sample.points[a:b], axis=0), axis=1).sum() for a, b in itertools.pairwise(sample.start)]
    median = float(drawn.figures["median_arrival_world_units"])
    early = light[np.array(lengths) <= median * (1 + 1e-6)].sum() / light.sum()
    assert early == pytest.approx(0.5, abs=light.max() / light.sum() + 1e-3)


def test_late_frames_are_empty_and_still_pictures(spheres_run: Run) -> None:
    _, (late,) = drawn_with(spheres_run, TimeOfFlight(most=50, frames=3, times=(1000.0, 1001.0)), 1)
    _, (bare,) = drawn_with(spheres_run, TimeOfFlight(most=50, frames=1, times=(1000.0, 1001.0)))
    np.testing.assert_array_equal(late, bare)


@pytest.mark.parametrize("color", ["bounce", "chrominance", "object"])
def test_colors(spheres_run: Run, color: str) -> None:
    settings = {"most": 200, "frames": 1, "color": color, "times": (0.5, 2.5), "window": 2.0, "fade": False, "expression": "C D L"}
    drawn, (picture,) = drawn_with(spheres_run, TimeOfFlight.model_validate(settings))
    assert picture.std() > 0
    assert "CDL" in drawn.caption
    names = [name for name, _ in drawn.legend]
    assert names == {"bounce": ["from the emitter", "after 1 interaction"], "chrominance": []}.get(color, names)
    if color == "object":
        assert "from light" in names
        assert "from glass" not in names


def test_a_selection_without_paths(spheres_run: Run) -> None:
    with Stage(spheres_run, Look(), (60, 40)) as stage:
        drawn = TimeOfFlight(expression="C <TD> L").draw(spheres_run, stage)
    assert drawn.empty
    assert "no light path" in drawn.caption


@pytest.mark.parametrize("bad", [{"times": (2.0, 1.0)}, {"times": (0.0, 1.0), "window": 2.0}, {"frames": 0}, {"amount": 1.5}, {"color": "red"}])
def test_bad_settings(bad: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        TimeOfFlight.model_validate(bad)
