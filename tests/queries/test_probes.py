"""Light at probes against closed forms: points, furnaces, skies; and the sums that must agree exactly."""

import pathlib
from typing import Any

import numpy as np
import pytest
from metered import BLACK, assert_scatter, ceiling_lamp, floor, gray, point_light, trace

from queries import open_run
from queries.clusters import clusters
from queries.errors import QueryError
from queries.kernels.luminance import LUMINANCE
from queries.probes import Incident, Probe, incident
from queries.selection import Selection

ALL = Selection()


def total(found: Incident) -> np.ndarray:
    return (found.radiance * found.projected[:, None, None]).sum(axis=(0, 1))


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A lamp over a gray floor, beside a point light; 4 shards."""
    objects = {"floor": floor(1.5, bsdf=gray(0.5)), "lamp": ceiling_lamp(0.3, 2.0, 5.0), "bulb": point_light([1.0, 1.0, 0.5], [1.0, 2.0, 3.0])}
    return trace(tmp_path_factory.mktemp("room"), objects, samples=64, max_depth=4)


@pytest.fixture(scope="module")
def bulb(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A point light alone in a black box."""
    box = {"type": "cube", "to_world": [{"scale": 2.0}], "bsdf": {"type": "twosided", "bsdf": BLACK}}
    return trace(tmp_path_factory.mktemp("bulb"), {"box": box, "bulb": point_light([0.0, 0.0, 0.0], [2.0, 1.0, 4.0])}, samples=64, max_depth=2)


@pytest.fixture(scope="module")
def sky(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Constant light from everywhere, on two small balls that say how large the scene is."""
    balls = {f"ball{i}": {"type": "sphere", "center": [x, 0, 0], "radius": 0.02, "bsdf": BLACK} for i, x in enumerate((-1.0, 1.0))}
    light = {"type": "constant", "radiance": {"type": "rgb", "value": [1.0, 0.5, 2.0]}}
    return trace(tmp_path_factory.mktemp("sky"), {**balls, "sky": light}, samples=64, max_depth=2)


@pytest.mark.parametrize("place", [(0.9, 0.0, 0.0), (0.3, -0.7, 0.5)])
def test_fluence_and_direction_of_a_point_light(bulb: pathlib.Path, place: tuple[float, float, float]) -> None:
    with open_run(bulb) as run:
        found = incident(run, ALL, Probe(place, 0.1))
        squared = float(np.square(place).sum())
        expected = (1 + 0.1**2 / squared / 5) / squared  # the mean of 1 / distance² over the ball, to second order
        assert found.quantity == "fluence"
        assert abs(found.value @ LUMINANCE - expected * ((2.0, 1.0, 4.0) @ np.array(LUMINANCE))) < 4 * found.value_error
        assert 0 < found.value_error < 0.06 * (found.value @ LUMINANCE)  # some 800 chords
        np.testing.assert_allclose(found.value, found.value[1] * np.array([2, 1, 4]), rtol=1e-6)
        bright = found.radiance[..., 1] > 0
        toward = -np.array(place) / np.sqrt(squared)
        assert (found.directions[bright] @ toward > np.cos(0.35)).all()  # the ball's half angle and a cell's
        np.testing.assert_allclose(total(found), found.value, rtol=1e-12)


def test_light_that_begins_inside_counts_by_its_length_there(bulb: pathlib.Path) -> None:
    """Each walk's part in the ball is as long as the radius: exact, without noise."""
    with open_run(bulb) as run:
        found = incident(run, ALL, Probe((0.0, 0.0, 0.0), 0.5))
        assert found.value[1] == pytest.approx(3 / 0.5**2, rel=1e-5)
        assert found.count == 64 * 64 * 64
        assert_scatter(found.radiance[..., 1], np.full(found.error.shape, 3 / 0.5**2 / (4 * np.pi)), found.error / (np.array([2, 1, 4]) @ LUMINANCE))


def test_light_that_ends_inside_counts_by_its_length_there(bulb: pathlib.Path) -> None:
    """Half of a ball on the box's wall lies beyond it: the inner half alone brings flux."""
    with open_run(bulb) as run:
        found = incident(run, ALL, Probe((2.0, 0.0, 0.0), 0.2))
        draw = np.random.default_rng(1).uniform(-0.2, 0.2, (400_000, 3))
        draw = draw[((draw**2).sum(axis=1) < 0.04) & (draw[:, 0] < 0)] + (2, 0, 0)
        assert abs(found.value[1] - 0.5 * (1 / (draw**2).sum(axis=1)).mean()) < 4 * found.value_error


def test_a_disk_and_the_cosine_law(bulb: pathlib.Path) -> None:
    with open_run(bulb) as run:
        place, normal = np.array([0.8, 0.0, 0.3]), np.array([-1.0, 2.0, 0.5])
        normal[1] = 0.4
        for sign in (1, -1):
            found = incident(run, ALL, Probe(tuple(place), 0.08, tuple(sign * normal)))
            cosine = -(place @ normal) * sign / np.linalg.norm(place) / np.linalg.norm(normal)
            assert found.quantity == "irradiance"
            if cosine < 0:
                assert found.count == 0
                continue
            expected = cosine / (place @ place)
            assert abs(found.value[1] / expected - 1) < 4 * found.value_error / (found.value @ LUMINANCE) + 0.01  # the disk's own extent: radius²
            np.testing.assert_allclose(total(found), found.value, rtol=1e-12)


def test_a_disk_on_the_wall_meets_light_that_ends_there(bulb: pathlib.Path) -> None:
    with open_run(bulb) as run:
        for sign in (-1, 1):
            found = incident(run, ALL, Probe((sign * 2.0, 0.3, 0.0), 0.2, (-sign, 0, 0)))
            assert abs(found.value[1] - 2 / (4 + 0.09) ** 1.5) < 4 * found.value_error + 0.002
            assert found.count > 500
            assert incident(run, ALL, Probe((sign * 2.0, 0.3, 0.0), 0.2, (sign, 0, 0))).count == 0


def test_a_constant_sky(sky: pathlib.Path) -> None:
    """The same radiance in all cells, 4 pi of it as fluence, pi of it on a disk that faces anywhere."""
    radiance = np.array([1.0, 0.5, 2.0])
    with open_run(sky) as run:
        ball = incident(run, ALL, Probe((0.0, 0.1, 0.0), 0.3), resolution=6)
        np.testing.assert_allclose(ball.value, 4 * np.pi * radiance, rtol=4 * ball.value_error / (ball.value @ LUMINANCE) + 1e-3)
        assert_scatter(ball.radiance @ LUMINANCE, np.full(ball.error.shape, radiance @ LUMINANCE), ball.error)
        for normal in ((0.0, 1.0, 0.0), (0.3, -0.5, -2.0)):
            disk = incident(run, ALL, Probe((0.0, 0.1, 0.0), 0.3, normal), resolution=6)
            np.testing.assert_allclose(disk.value, np.pi * radiance, rtol=4 * disk.value_error / (disk.value @ LUMINANCE) + 1e-3)
            assert_scatter(disk.radiance @ LUMINANCE, np.full(disk.error.shape, radiance @ LUMINANCE), disk.error)
            assert (disk.directions @ np.array(normal) > 0).all()


def test_the_inside_of_a_furnace(tmp_path: pathlib.Path) -> None:
    glow = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    box = {"type": "cube", "flip_normals": True, "bsdf": gray(0.5), "emitter": glow}
    with open_run(trace(tmp_path, {"box": box}, origin=(0, 0, 0.9), target=(0, 0, -1), samples=16, max_depth=4)) as run:
        gathered = 1 + 0.5 + 0.25
        for probe, expected in (
            (Probe((0.2, 0.1, 0.0), 0.4), 4 * np.pi),
            (Probe((0.0, -1.0, 0.3), 0.3, (0, 1, 0)), np.pi),
            (Probe((0.1, 0.2, 0), 0.3, (1, 2, 3)), np.pi),
        ):
            found = incident(run, ALL, probe)
            assert abs(found.value[1] - expected * gathered) < 4 * found.value_error
            assert found.value_error < 0.04 * found.value[1]
            direct = incident(run, Selection.of(run, "C L"), probe)
            assert abs(direct.value[1] - expected) < 4 * direct.value_error


def test_cells_share_the_sphere_equally(room: pathlib.Path) -> None:
    with open_run(room) as run:
        ball, disk = (incident(run, ALL, Probe((0, 0.5, 0), 0.2, normal), resolution=8) for normal in (None, (0.0, 2.0, 0.0)))
        assert ball.radiance.shape == (8, 16, 3)
        assert disk.radiance.shape == (4, 16, 3)
        assert ball.solid_angle == pytest.approx(4 * np.pi / 128)
        assert disk.solid_angle == pytest.approx(2 * np.pi / 64)
        assert ball.projected.sum() * 16 == pytest.approx(4 * np.pi)
        assert disk.projected.sum() * 16 == pytest.approx(np.pi)
        np.testing.assert_allclose(disk.axes @ disk.axes.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(disk.axes[2], (0, 1, 0), atol=1e-12)
        for found in (ball, disk):
            corners = found.corners()
            assert corners.shape == (found.radiance.shape[0] + 1, 17, 3)
            np.testing.assert_allclose(np.linalg.norm(corners, axis=2), 1, atol=1e-6)
            np.testing.assert_array_equal(corners[:, 0], corners[:, -1])
            middle = corners[:-1, :-1] + corners[1:, 1:] + corners[1:, :-1] + corners[:-1, 1:]
            middle /= np.linalg.norm(middle, axis=2, keepdims=True)
            assert (np.einsum("ijk,ijk->ij", middle, found.directions) > 0.97).all()


def test_parts_add_up_and_shadows_are_dark(room: pathlib.Path) -> None:
    with open_run(room) as run:
        probe = Probe((0.0, 0.6, 0.1), 0.25)
        whole = incident(run, ALL, probe)
        parts = [incident(run, Selection.of(run, text), probe) for text in ("C L", "C D L", "C D D . * L")]
        np.testing.assert_allclose(sum(part.value for part in parts), whole.value, rtol=1e-9)
        assert sum(part.count for part in parts) == whole.count
        below = incident(run, ALL, Probe((0.0, -0.6, 0.1), 0.25))
        assert below.count == 0
        assert not below.value.any()
        assert below.value_error == 0


def test_threads_do_not_change_a_bit(room: pathlib.Path) -> None:
    with open_run(room) as run:
        assert len(run.shard_files) > 1
        one, two = (incident(run, ALL, Probe((0.0, 0.6, 0.1), 0.25), threads=threads) for threads in (1, 2))
        assert one.radiance.tobytes() == two.radiance.tobytes()
        assert one.error.tobytes() == two.error.tobytes()


def test_importance_at_a_probe(tmp_path: pathlib.Path) -> None:
    """Importance straight from the camera: a ball before it that holds the whole view catches every walk."""
    objects = {"floor": floor(1.5, bsdf=gray(0.5)), "lamp": ceiling_lamp(0.2, 1.0, 5.0)}
    with open_run(trace(tmp_path, objects, origin=(0, 0.5, 4), target=(0, 0.5, 0), fov=20, method="path", samples=2, max_depth=2)) as run:
        found = incident(run, Selection.of(run, "C L"), Probe((0, 0.5, 3), 0.5), side="camera")
        assert found.count == 2 * 64 * 64
        bright = found.radiance[..., 1] > 0
        assert (found.directions[bright] @ np.array([0, 0, 1.0]) > 0.85).all()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"position": (0, 0, 0), "radius": 0.0}, "radius above 0"),
        ({"position": (0, float("nan"), 0), "radius": 1.0}, "at a point"),
        ({"position": (0, 0, 0), "radius": 1.0, "normal": (0, 0, 0)}, "as a direction"),
    ],
)
def test_bad_probes_are_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(QueryError, match=words):
        Probe(**given)


def test_bad_resolutions_are_refused(room: pathlib.Path) -> None:
    with open_run(room) as run, pytest.raises(QueryError, match="resolution of 2 to 512"):
        incident(run, ALL, Probe((0, 1, 0), 0.1), resolution=1)


def test_probes_beyond_the_light_that_is_traced_are_refused(sky: pathlib.Path, bulb: pathlib.Path) -> None:
    """The sky is sent into the ball around the surfaces alone: beyond it, its fluence of 4 pi would be found as nearly nothing."""
    with open_run(sky) as run:
        for probe in (Probe((0.0, 1.5, 0.0), 0.3), Probe((0.0, 0.9, 0.0), 0.3), Probe((0.0, 1.5, 0.0), 0.3, (0.0, 1.0, 0.0))):
            for measure in (incident, clusters):
                with pytest.raises(QueryError, match="where all light is known"):
                    measure(run, ALL, probe)
        assert incident(run, ALL, Probe((0.0, 0.6, 0.0), 0.3)).count
    # What leaves a scene whose lights are in it is followed far beyond its surfaces, but not without end
    with open_run(bulb) as run, pytest.raises(QueryError, match="where all light is known"):
        incident(run, ALL, Probe((0.0, 20.0, 0.0), 0.3))
