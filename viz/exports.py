"""What was drawn as files for other programs: VTP (ParaView) and binary glTF 2.0."""

import json
import pathlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError
from queries.srgb import to_linear

if TYPE_CHECKING:
    import pyvista

Array = npt.NDArray[Any]
F32 = npt.NDArray[np.float32]
I64 = npt.NDArray[np.int64]

_POINTS, _LINES, _TRIANGLES = 0, 1, 4  # glTF's modes
_FLOAT, _UINT32, _UINT16 = 5126, 5125, 5123  # and types of components
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
_EXACT = 1 << 24  # integers below this are exact in float32, the only type of attributes of our own
_MOST_BYTES = (1 << 32) - 1  # of a .glb file
_COLOR = "color"  # the array that is COLOR_0


def write_vtp(path: str | pathlib.Path, mesh: "pyvista.PolyData") -> None:
    """Write a mesh with all its arrays as VTK XML, binary and compressed. The file's name ends in .vtp."""
    file = _prepared(path, ".vtp")
    mesh.save(str(file), binary=True)


def write_gltf(path: str | pathlib.Path, meshes: "Mapping[str, pyvista.PolyData]") -> None:
    """Write meshes as one binary glTF 2.0 file (.glb), a node for each.

    Lines become LINES, faces TRIANGLES, lone points POINTS. Arrays of points and cells become vertex attributes of the same names in capitals, behind
    an underscore (`path_id`: _PATH_ID), float32: whole numbers of 2^24 and more, which it cannot hold, as pairs (number div 2^24, number mod 2^24).
    The array `base_color`, or else `color` (uint8, sRGB), becomes COLOR_0, linear, as glTF has it. Strings of a mesh's field data are its ``extras``.
    Raises ``QueryError`` for faces that are no triangles, and beyond 4 GiB, the most that the format can hold.
    """
    file = _prepared(path, ".glb")
    document = _Document()
    for name, mesh in meshes.items():
        document.add(name, mesh)
    document.write(file)


def _prepared(path: str | pathlib.Path, suffix: str) -> pathlib.Path:
    file = pathlib.Path(path)
    if file.suffix.lower() != suffix:
        raise QueryError(f"expected the name of a {suffix} file, found `{file}`")
    file.parent.mkdir(parents=True, exist_ok=True)
    return file


@dataclass
class _Document:
    """A glTF document and the buffer behind it."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)

    def add(self, name: str, mesh: "pyvista.PolyData") -> None:
        """A mesh: one primitive for its lines, one for its faces; points alone where it has neither."""
        primitives = [self._primitive(mesh, *found) for found in _primitives(mesh)]
        if primitives:
            extras = {key: [str(value) for value in array] for key, array in mesh.field_data.items() if np.asarray(array).dtype.kind in "US"}
            self.meshes.append({"name": name, "primitives": primitives} | ({"extras": extras} if extras else {}))

    def _primitive(self, mesh: "pyvista.PolyData", mode: int, vertices: I64, cells: I64, indices: I64) -> dict[str, Any]:
        """``vertices``: the mesh's point of each vertex; ``cells``: its cell; ``indices``: into the two."""
        attributes = {"POSITION": self._accessor(np.asarray(mesh.points, np.float32)[vertices], bounds=True)}
        opaque = True
        given = {name: np.asarray(values)[vertices] for name, values in mesh.point_data.items()}
        given |= {name: np.asarray(values)[cells] for name, values in mesh.cell_data.items() if name not in given and len(cells)}
        shown = _COLOR if _COLOR in given and given[_COLOR].dtype == np.uint8 else None
        if shown is not None:
            rgba = _linear(given[shown])
            opaque = bool((rgba[:, 3] == 0xFFFF).all())
            attributes["COLOR_0"] = self._accessor(rgba, normalized=True)
        for name, values in given.items():
            if name != _COLOR and not name.startswith("vtk") and values.dtype.kind in "iufb" and (values.ndim == 1 or values.shape[1] <= 4):
                attributes["_" + "".join(c if c.isalnum() else "_" for c in name.upper())] = self._accessor(_plain(values))
        lit = mode == _TRIANGLES
        material: dict[str, Any] = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}, "doubleSided": True}
        material |= {} if opaque else {"alphaMode": "BLEND"}
        material |= {} if lit else {"extensions": {"KHR_materials_unlit": {}}}
        self.materials.append(material)
        found = {"attributes": attributes, "mode": mode, "material": len(self.materials) - 1}
        return found if mode == _POINTS else found | {"indices": self._accessor(indices.astype(np.uint32), indices=True)}

    def _accessor(self, values: Array, bounds: bool = False, normalized: bool = False, indices: bool = False) -> int:
        """Store an array of 4-byte-aligned rows, and describe it."""
        values = np.ascontiguousarray(values)
        data = values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
        self.views.append(
            {"buffer": 0, "byteOffset": self.size, "byteLength": len(data), "target": _INDEX_BUFFER if indices else _VERTEX_BUFFER}
        )
        self.parts.append(data + bytes(-len(data) % 4))
        self.size += len(self.parts[-1])
        width = 1 if values.ndim == 1 else values.shape[1]
        kind = {"f": _FLOAT, "u": _UINT32 if values.dtype.itemsize == 4 else _UINT16}[values.dtype.kind]
        accessor: dict[str, Any] = {"bufferView": len(self.views) - 1, "componentType": kind, "count": len(values), "type": _TYPES[width]}
        accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()} if bounds else {}
        self.accessors.append(accessor | ({"normalized": True} if normalized else {}))
        return len(self.accessors) - 1

    def write(self, file: pathlib.Path) -> None:
        """The file: a header, the document, the buffer."""
        document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "Pathspace"}, "scene": 0}
        nodes = [{"mesh": i, "name": mesh["name"]} for i, mesh in enumerate(self.meshes)]
        document["scenes"] = [{"nodes": list(range(len(nodes)))} if nodes else {}]
        if nodes:
            document |= {"nodes": nodes, "meshes": self.meshes, "materials": self.materials, "accessors": self.accessors}
            document |= {"bufferViews": self.views, "buffers": [{"byteLength": self.size}]}
        if any("extensions" in material for material in self.materials):
            document["extensionsUsed"] = ["KHR_materials_unlit"]
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + (8 + self.size if self.size else 0)
        if total > _MOST_BYTES:
            raise QueryError(f"`{file}` would have {total / 2**30:.1f} GiB, glTF holds at most 4: draw fewer paths or points, or export as VTP")
        with file.open("wb") as out:
            out.write(struct.pack("<4sII", b"glTF", 2, total))
            out.write(struct.pack("<I4s", len(text), b"JSON") + text)
            if self.size:
                out.write(struct.pack("<I4s", self.size, b"BIN\0"))
                out.writelines(self.parts)


def _primitives(mesh: "pyvista.PolyData") -> list[tuple[int, I64, I64, I64]]:
    """What a mesh is made of: mode, points, cells and indices of each primitive, as ``_Document._primitive`` takes them.

    Each cell has vertices of its own, so that attributes of cells can be those of vertices.
    """
    from vtkmodules.util import numpy_support

    vtk_to_numpy: Any = numpy_support.vtk_to_numpy
    found = []
    first = mesh.GetNumberOfVerts()
    lines = mesh.GetLines()
    count = lines.GetNumberOfCells()
    if count:
        offsets, points = (vtk_to_numpy(array).astype(np.int64) for array in (lines.GetOffsetsArray(), lines.GetConnectivityArray()))
        cells = np.repeat(np.arange(count) + first, np.diff(offsets))
        inside = np.ones(len(points), np.bool_)  # vertices that another of the same line follows
        inside[offsets[1:][np.diff(offsets) > 0] - 1] = False
        begin = np.flatnonzero(inside)
        if len(begin):
            found.append((_LINES, points, cells, np.stack([begin, begin + 1], axis=1).reshape(-1)))
    if mesh.GetNumberOfPolys() or mesh.GetNumberOfStrips():
        first += count
        if mesh.GetNumberOfStrips() or not mesh.is_all_triangles:
            raise QueryError("glTF has triangles only: expected a mesh of triangles, as from `mesh.triangulate()`")
        points = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).astype(np.int64)
        found.append((_TRIANGLES, points, np.repeat(np.arange(len(points) // 3) + first, 3), np.arange(len(points))))
    if not found and mesh.n_points:
        found.append((_POINTS, np.arange(mesh.n_points), np.zeros(0, np.int64), np.zeros(0, np.int64)))
    return found


def _linear(colors: Array) -> npt.NDArray[np.uint16]:
    """Colors, sRGB uint8 (n, 3 or 4), as linear RGBA, uint16 (n, 4): of 8 bits, dark colors would lose their steps."""
    levels = np.rint(to_linear(np.arange(256) / 255) * 0xFFFF).astype(np.uint16)
    rgba = np.full((len(colors), 4), 0xFFFF, np.uint16)
    rgba[:, :3] = levels[colors[:, :3]]
    if colors.shape[1] == 4:
        rgba[:, 3] = colors[:, 3].astype(np.uint16) * np.uint16(257)
    return rgba


def _plain(values: Array) -> F32:
    """Numbers as float32, large whole numbers as pairs."""
    if values.dtype.kind in "iu" and values.ndim == 1 and np.abs(values.astype(np.float64)).max(initial=0) >= _EXACT:
        whole = values.astype(np.int64)
        return np.stack([whole // _EXACT, whole % _EXACT], axis=1).astype(np.float32)
    return np.nan_to_num(values.astype(np.float32))
