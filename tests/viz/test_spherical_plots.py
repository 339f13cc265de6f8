"""Spherical plots: their integral is what the probe measures, their shape and color are the light's."""

import pathlib

import numpy as np
import pytest
from furnace import BLOCK, BLOCK_SIDE, RADIANCE
from pydantic import ValidationError

from queries import open_run
from queries.kernels.luminance import LUMINANCE
from queries.probes import Probe, incident
from queries.selection import Selection
from viz.cameras import job_pose
from viz.colors import chrominance
from viz.directions import low_pass
from viz.glyphs import radial_surface
from viz.stage import Stage
from viz.tools.base import Drawn
from viz.tools.probe import SphericalPlot

SPACE = {"position": [-0.6, 0.3, -0.2], "radius": 0.4}
FLOOR = {"position": [-0.5, -1.5, 0.3], "radius": 0.4, "normal": [0, 1, 0]}


def draw(folder: pathlib.Path, *probes: dict[str, object], **given: object) -> tuple[Drawn, np.ndarray]:
    """What the tool says, and the picture."""
    with open_run(folder) as run, Stage(run, size=(160, 120)) as stage:
        return SphericalPlot.model_validate({"probes": list(probes), **given}).draw(run, stage), stage.picture(job_pose(run))


def told(folder: pathlib.Path, *probes: dict[str, object], **given: object) -> Drawn:
    """What the tool says."""
    with open_run(folder) as run, Stage(run, size=(160, 120)) as stage:
        return SphericalPlot.model_validate({"probes": list(probes), **given}).draw(run, stage)


def grid(probe: Probe, bands: int = 16, sectors: int = 32) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions, weights and standard basis of a probe's cells, without any light: (bands, sectors, 3), (bands,), (3, 3)."""
    from queries.probes import Incident

    empty = Incident(probe, np.zeros((bands, sectors, 3)), np.zeros((bands, sectors)), np.zeros(3), 0.0, 0)
    return empty.directions, empty.projected, empty.axes


# --- numbers ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("smooth", [0.0, 6.0, 25.0])
@pytest.mark.parametrize(("probe", "name", "share"), [(SPACE, "fluence", 4 * np.pi), (FLOOR, "irradiance", np.pi)])
def test_the_plot_s_integral_is_what_the_probe_measures(
    furnace: pathlib.Path, probe: dict[str, object], name: str, share: float, smooth: float
) -> None:
    drawn = told(furnace, probe, smooth=smooth, resolution=24)
    points = drawn.meshes["probe_1"].point_data
    total = (points["radiance"].astype(np.float64) * points["solid_angle"][:, None]).sum(axis=0)
    with open_run(furnace) as run:
        measured = incident(run, Selection(), Probe(tuple(probe["position"]), 0.4, probe.get("normal") and (0.0, 1.0, 0.0)), 24)
    np.testing.assert_allclose(total, measured.value, rtol=1e-5)
    assert drawn.figures[f"probe_1_{name}"] == pytest.approx(measured.value @ LUMINANCE, rel=1e-12)
    error = drawn.figures["probe_1_standard_error"]
    assert 0 < error < 0.05 * share * RADIANCE @ LUMINANCE
    assert abs(total @ LUMINANCE - share * RADIANCE @ LUMINANCE) < 4 * error


def test_distances_are_radiance(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, size=0.7, resolution=16)
    mesh = drawn.meshes["probe_1"]
    distance = np.linalg.norm(np.asarray(mesh.points, np.float64) - SPACE["position"], axis=1)
    cells = mesh.point_data["solid_angle"] > 0
    assert cells.sum() == 16 * 32
    assert distance[cells].max() == pytest.approx(0.7, rel=1e-5)
    luminance = mesh.point_data["luminance"].astype(np.float64)
    np.testing.assert_allclose(distance[cells], 0.7 * (luminance / luminance.max())[cells], rtol=1e-4)
    assert drawn.figures["probe_1_largest_radiance"] == pytest.approx(luminance.max(), rel=1e-6)
    squeezed = told(furnace, SPACE, size=0.7, resolution=16, power=0.5)
    other = np.linalg.norm(np.asarray(squeezed.meshes["probe_1"].points, np.float64) - SPACE["position"], axis=1)
    np.testing.assert_allclose(other[cells], 0.7 * np.sqrt(luminance / luminance.max())[cells], rtol=1e-4)
    assert "to the power 0.5" in squeezed.caption
    assert "to the power" not in drawn.caption


def test_points_lie_where_light_comes_from(furnace: pathlib.Path) -> None:
    """Light straight from the block comes from within the cone around it, and colors are those of its emission."""
    position = np.array([-0.9, -0.5, 0.2])
    drawn = told(furnace, {"position": position.tolist(), "radius": 0.05}, expression="C L@object:block", resolution=32, smooth=0)
    points = drawn.meshes["probe_1"].point_data
    lit = points["solid_angle"] * points["luminance"] > 0
    assert lit.sum() >= 3
    ways = np.asarray(drawn.meshes["probe_1"].points, np.float64)[lit] - position
    cosine = ways @ (np.array(BLOCK) - position) / np.linalg.norm(ways, axis=1) / np.linalg.norm(np.array(BLOCK) - position)
    reach = np.degrees(np.arcsin((np.sqrt(3) * BLOCK_SIDE / 2 + 0.05) / np.linalg.norm(np.array(BLOCK) - position)))
    cell = np.degrees(np.sqrt(4 * np.pi / (32 * 64))) * 1.5
    assert np.degrees(np.arccos(cosine)).max() < reach + cell
    expected = np.rint(255 * chrominance(np.array([[2.0, 1.0, 0.5]])))[0]
    assert np.abs(points["color"][lit].astype(int) - expected).max() <= 2


@pytest.mark.parametrize("scale", ["together", "each"])
def test_scale_of_several_probes(furnace: pathlib.Path, scale: str) -> None:
    drawn = told(furnace, SPACE, FLOOR, scale=scale, size=0.5, resolution=16)
    peaks = [drawn.figures[f"probe_{i}_largest_radiance"] for i in (1, 2)]
    for i, (probe, peak) in enumerate(zip((SPACE, FLOOR), peaks), start=1):
        mesh = drawn.meshes[f"probe_{i}"]
        points = np.asarray(mesh.points, np.float64)[mesh.point_data["solid_angle"] > 0]
        farthest = np.linalg.norm(points - probe["position"], axis=1).max()
        assert farthest == pytest.approx(0.5 * (1 if scale == "each" else peak / max(peaks)), rel=1e-4)
    assert peaks[0] != peaks[1]
    assert [line.partition(":")[0] for line, _ in drawn.legend] == ["probe 1", "probe 2"]
    assert drawn.legend[0][1] != drawn.legend[1][1]
    assert "fluence" in drawn.legend[0][0]
    assert "irradiance" in drawn.legend[1][0]


# --- the low pass -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [3.0, 15.0, 45.0])
@pytest.mark.parametrize("normal", [None, (0.0, 0.0, 1.0)])
def test_low_pass_keeps_integrals_and_constants(normal: tuple[float, float, float] | None, degrees: float) -> None:
    directions, weights, _ = grid(Probe((0.0, 0.0, 0.0), 1.0, normal))
    values = np.random.default_rng(3).exponential(size=(*directions.shape[:2], 3))
    found = low_pass(values, directions, weights, degrees)
    np.testing.assert_allclose((found * weights[:, None, None]).sum(axis=(0, 1)), (values * weights[:, None, None]).sum(axis=(0, 1)), rtol=1e-10)
    np.testing.assert_allclose(low_pass(np.full_like(values, 2.5), directions, weights, degrees), 2.5, rtol=1e-10)
    assert found.min() >= 0
    assert found.std() < values.std()


def test_low_pass_is_as_wide_as_it_says() -> None:
    """The mean square of the angle under a Gaussian in the plane is twice its variance; for 8° the sphere is flat to a percent."""
    directions, weights, _ = grid(Probe((0.0, 0.0, 0.0), 1.0), 128, 256)
    spike = np.zeros((128, 256, 1))
    spike[60, 17] = 1.0
    found = low_pass(spike, directions, weights, 8.0)[..., 0]
    assert np.unravel_index(found.argmax(), found.shape) == (60, 17)
    angle = np.degrees(np.arccos(np.clip(directions @ directions[60, 17].astype(np.float64), -1, 1)))
    assert np.sqrt((found * angle**2).sum() / found.sum() / 2) == pytest.approx(8.0, rel=0.02)


def test_no_low_pass() -> None:
    directions, weights, _ = grid(Probe((0.0, 0.0, 0.0), 1.0))
    values = np.random.default_rng(4).exponential(size=(*directions.shape[:2], 3))
    np.testing.assert_array_equal(low_pass(values, directions, weights, 0.0), values)
    np.testing.assert_allclose(low_pass(values, directions, weights, 0.1), values, rtol=1e-10)


# --- the mesh -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("normal", [None, (0.0, 0.6, -0.8)])
def test_a_constant_is_a_sphere_or_half_of_one(normal: tuple[float, float, float] | None) -> None:
    directions, _, axes = grid(Probe((0.0, 0.0, 0.0), 1.0, normal), 64, 128)
    mesh = radial_surface(np.array([1.0, 2.0, 3.0]), directions, np.full(directions.shape[:2], 2.0), closed=normal is None)
    a, b, c = (mesh.points[mesh.triangles[:, k]].astype(np.float64) - (1, 2, 3) for k in range(3))
    # Cones from the center: outward triangles all count positive
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    assert volumes.min() > -1e-6
    assert volumes.sum() == pytest.approx(4 / 3 * np.pi * 8 * (1 if normal is None else 0.5), rel=0.01)
    np.testing.assert_allclose(np.linalg.norm(mesh.points - (1, 2, 3), axis=1), 2.0, rtol=1e-5)
    edges = np.sort(np.concatenate([mesh.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    _, sides = np.unique(edges, axis=0, return_counts=True)
    assert (sides == 1).sum() == (0 if normal is None else 128)
    assert sides.max() == 2
    outward = np.einsum("ij,ij->i", mesh.normals, (mesh.points - (1, 2, 3)) / 2)
    assert outward.min() > (0.99 if normal is None else 0.9)
    if normal is not None:
        rim = mesh.points[-128:] - (1, 2, 3)
        np.testing.assert_allclose(rim @ axes[2], 0, atol=1e-5)


# --- always -------------------------------------------------------------------------------------------------------


def test_no_light_is_said(furnace: pathlib.Path) -> None:
    drawn = told(furnace, SPACE, expression="C S L")
    assert drawn.empty
    assert "No light" in drawn.caption
    assert "the sphere of radius 0.4 around (-0.6, 0.3, -0.2)" in drawn.caption


def test_a_probe_in_the_dark_has_its_ring(furnace: pathlib.Path) -> None:
    """Inside the block nothing arrives: the other probe is drawn, and the picture goes on."""
    drawn = told(furnace, {"position": list(BLOCK), "radius": 0.05}, SPACE)
    assert set(drawn.meshes) == {"marker_1", "marker_2", "probe_2"}
    assert drawn.figures["probe_1_segments"] == 0
    assert not drawn.empty


def test_pictures_are_the_same_each_time(furnace: pathlib.Path) -> None:
    (one, first), (other, second) = draw(furnace, SPACE, FLOOR), draw(furnace, SPACE, FLOOR)
    np.testing.assert_array_equal(first, second)
    assert first.std() > 1
    assert (one.caption, one.legend, one.figures) == (other.caption, other.legend, other.figures)
    for name, mesh in one.meshes.items():
        np.testing.assert_array_equal(mesh.points, other.meshes[name].points)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"probes": []}, "at least 1"),
        ({"probes": [{"position": [0, 0, float("nan")]}]}, "finite|number"),
        ({"probes": [{"position": [0, 0]}]}, "missing|required"),
        ({"probes": [{"position": [0, 0, 0], "radius": 0.0}]}, "above 0"),
        ({"probes": [{"position": [0, 0, 0], "normal": [0, 0, 0]}]}, r"not \(0, 0, 0\)"),
        ({"probes": [SPACE], "resolution": 7}, "greater than or equal to 8"),
        ({"probes": [SPACE], "resolution": 129}, "less than or equal to 128"),
        ({"probes": [SPACE], "smooth": -1.0}, "greater than or equal to 0"),
        ({"probes": [SPACE], "power": 0.0}, "greater than 0"),
        ({"probes": [SPACE], "size": -1.0}, "above 0"),
    ],
)
def test_refusals(given: dict[str, object], expected: str) -> None:
    with pytest.raises(ValidationError, match=expected):
        SphericalPlot.model_validate(given)
