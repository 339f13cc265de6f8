"""Files for other programs, read back: VTP by VTK, glTF against its specification and by trimesh."""

import json
import pathlib
import struct
from typing import Any

import numpy as np
import pytest
import pyvista
import trimesh

from queries.errors import QueryError
from queries.srgb import to_linear
from viz.bundles.polylines import polyline_mesh
from viz.exports import write_gltf, write_vtp

SIZES = {5126: 4, 5125: 4, 5123: 2}
TYPES = {5126: "<f4", 5125: "<u4", 5123: "<u2"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@pytest.fixture
def mesh() -> pyvista.PolyData:
    generator = np.random.default_rng(1)
    curves = generator.normal(size=(7, 5, 3)).astype(np.float32)
    found = polyline_mesh(curves, generator.integers(0, 256, (7, 5, 4)).astype(np.uint8))
    found.cell_data["path_id"] = np.arange(7, dtype=np.int32) * 3
    found.cell_data["walk"] = np.arange(7, dtype=np.int64) + 5_000_000_000
    found.cell_data["contribution"] = generator.normal(size=(7, 3)).astype(np.float32)
    found.add_field_data(["C<RD>L", "C<TS>L"], "classes")
    return found


def read_glb(file: pathlib.Path) -> tuple[dict[str, Any], list[np.ndarray]]:
    """The document, and the array behind each accessor; checks what the specification says of the container and of accessors."""
    data = file.read_bytes()
    magic, version, total = struct.unpack("<4sII", data[:12])
    assert (magic, version, total) == (b"glTF", 2, len(data))
    length, kind = struct.unpack("<I4s", data[12:20])
    assert kind == b"JSON"
    assert length % 4 == 0
    document = json.loads(data[20 : 20 + length])
    size, kind = struct.unpack("<I4s", data[20 + length : 28 + length])
    assert kind == b"BIN\0"
    assert size % 4 == 0
    assert size == document["buffers"][0]["byteLength"] == len(data) - 28 - length
    buffer, arrays = data[28 + length :], []
    for accessor in document["accessors"]:
        view = document["bufferViews"][accessor["bufferView"]]
        width = WIDTHS[accessor["type"]]
        assert view["byteOffset"] % 4 == 0
        assert SIZES[accessor["componentType"]] * width % 4 == 0  # rows of vertex attributes begin at multiples of 4
        assert view["byteLength"] == accessor["count"] * width * SIZES[accessor["componentType"]]
        part = buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        arrays.append(np.frombuffer(part, TYPES[accessor["componentType"]]).reshape(accessor["count"], width))
    return document, arrays


def test_lines_and_their_attributes_come_back_from_gltf(mesh: pyvista.PolyData, tmp_path: pathlib.Path) -> None:
    write_gltf(tmp_path / "lines.glb", {"bundles": mesh})
    document, arrays = read_glb(tmp_path / "lines.glb")
    (primitive,) = document["meshes"][0]["primitives"]
    assert primitive["mode"] == 1
    found = {name: arrays[i] for name, i in primitive["attributes"].items()}
    assert set(found) == {"POSITION", "COLOR_0", "_PATH_ID", "_WALK", "_CONTRIBUTION"}
    assert np.array_equal(found["POSITION"], mesh.points)
    position = document["accessors"][primitive["attributes"]["POSITION"]]
    assert np.array_equal(np.array(position["min"], np.float32), mesh.points.min(0))
    assert np.array_equal(np.array(position["max"], np.float32), mesh.points.max(0))
    # Pairs of neighbors along each line
    pairs = arrays[primitive["indices"]].reshape(-1, 2)
    assert document["accessors"][primitive["indices"]]["componentType"] == 5125
    assert np.array_equal(pairs, np.array([[5 * i + k, 5 * i + k + 1] for i in range(7) for k in range(4)]))
    # Cells' arrays at each vertex; large numbers in two parts
    assert np.array_equal(found["_PATH_ID"][:, 0], np.repeat(np.arange(7) * 3, 5))
    walk = found["_WALK"].astype(np.int64)
    assert np.array_equal(walk[:, 0] * 2**24 + walk[:, 1], np.repeat(np.arange(7) + 5_000_000_000, 5))
    assert np.array_equal(found["_CONTRIBUTION"], np.repeat(mesh.cell_data["contribution"], 5, axis=0))
    # sRGB becomes linear
    color = document["accessors"][primitive["attributes"]["COLOR_0"]]
    assert (color["componentType"], color["normalized"], color["type"]) == (5123, True, "VEC4")
    assert np.abs(found["COLOR_0"][:, :3] / 65535 - to_linear(mesh.point_data["color"][:, :3] / 255)).max() < 1e-5
    assert np.array_equal(found["COLOR_0"][:, 3], mesh.point_data["color"][:, 3].astype(int) * 257)
    assert document["materials"][primitive["material"]]["alphaMode"] == "BLEND"
    assert document["extensionsUsed"] == ["KHR_materials_unlit"]
    assert document["meshes"][0]["extras"] == {"classes": ["C<RD>L", "C<TS>L"]}


def test_another_program_reads_the_lines(mesh: pyvista.PolyData, tmp_path: pathlib.Path) -> None:
    write_gltf(tmp_path / "lines.glb", {"bundles": mesh})
    loaded = trimesh.load(tmp_path / "lines.glb")
    (lines,) = loaded.geometry.values()
    assert np.allclose(lines.bounds, np.stack([mesh.points.min(0), mesh.points.max(0)]))


def test_faces_and_points_are_written_too(tmp_path: pathlib.Path) -> None:
    ball = pyvista.Sphere(theta_resolution=8, phi_resolution=6)
    ball.cell_data["irradiance"] = np.arange(ball.n_cells, dtype=np.float32)
    cloud = pyvista.PolyData(np.random.default_rng(2).normal(size=(9, 3)).astype(np.float32))
    cloud.clear_data()
    cloud.DeleteCells()
    write_gltf(tmp_path / "both.glb", {"ball": ball, "cloud": cloud})
    document, arrays = read_glb(tmp_path / "both.glb")
    primitives = [mesh["primitives"] for mesh in document["meshes"]]
    assert [[p["mode"] for p in found] for found in primitives] == [[4], [0]]
    faces = primitives[0][0]
    corners = arrays[faces["attributes"]["POSITION"]][arrays[faces["indices"]][:, 0]].reshape(-1, 3, 3)
    assert np.array_equal(corners, ball.points[ball.regular_faces])
    assert np.array_equal(arrays[faces["attributes"]["_IRRADIANCE"]][::3, 0], ball.cell_data["irradiance"])
    surface = trimesh.load(tmp_path / "both.glb").geometry["ball"]
    assert surface.area == pytest.approx(ball.area, rel=1e-5)


def test_nothing_is_a_valid_file_too(tmp_path: pathlib.Path) -> None:
    write_gltf(tmp_path / "nothing.glb", {"bundles": pyvista.PolyData()})
    data = (tmp_path / "nothing.glb").read_bytes()
    document = json.loads(data[20:])
    assert struct.unpack("<I", data[8:12])[0] == len(data)
    assert document["asset"]["version"] == "2.0"
    assert not {"meshes", "nodes", "accessors", "buffers"} & set(document)  # the specification wants none of them empty


def test_vtp_keeps_everything(mesh: pyvista.PolyData, tmp_path: pathlib.Path) -> None:
    write_vtp(tmp_path / "deep" / "lines.vtp", mesh)
    found = pyvista.read(tmp_path / "deep" / "lines.vtp")
    assert np.array_equal(found.points, mesh.points)
    assert np.array_equal(found.lines, mesh.lines)
    for name in ("path_id", "walk", "contribution"):
        assert np.array_equal(found.cell_data[name], mesh.cell_data[name])
    assert np.array_equal(found.point_data["color"], mesh.point_data["color"])
    assert list(found.field_data["classes"]) == ["C<RD>L", "C<TS>L"]
    assert b"compressor=" in (tmp_path / "deep" / "lines.vtp").read_bytes()[:1000]


def test_files_are_the_same_each_time(mesh: pyvista.PolyData, tmp_path: pathlib.Path) -> None:
    for write, suffix in ((lambda file: write_vtp(file, mesh), "vtp"), (lambda file: write_gltf(file, {"m": mesh}), "glb")):
        write(tmp_path / f"a.{suffix}")
        write(tmp_path / f"b.{suffix}")
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_what_cannot_be_written_is_refused(mesh: pyvista.PolyData, tmp_path: pathlib.Path) -> None:
    with pytest.raises(QueryError, match=r"\.vtp"):
        write_vtp(tmp_path / "lines.txt", mesh)
    with pytest.raises(QueryError, match=r"\.glb"):
        write_gltf(tmp_path / "lines.gltf", {"m": mesh})
    with pytest.raises(QueryError, match="triangulate"):
        write_gltf(tmp_path / "box.glb", {"m": pyvista.Box(quads=True)})
