"""A scene that a person can turn: meshes as a page of their own, drawn by vtk.js, which the package ``trame-vtk`` ships in one file.

vtk.js reads a scene as nested objects (window, renderer, camera, actors) whose arrays are looked up by their hashes; that is written here
directly, so that equal scenes give equal files.
"""

import base64
import hashlib
import io
import json
import pathlib
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from queries.errors import QueryError

if TYPE_CHECKING:
    import pyvista

Point = tuple[float, float, float]
Color = tuple[float, float, float]  # sRGB, 0 … 1
MOST_BYTES = 15_000_000  # of a page: larger ones open slowly
_ICON = "https://kitware.github.io/vtk-js/icon/favicon-${t}x${t}.png"
_EPOCH = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Shape:
    """Surfaces or lines of one look. ``colors``: the name of a uint8 RGB array of the mesh's points or cells, which then replaces ``color``.

    ``shines``: it is as bright from wherever it is seen; lines always are.
    """

    mesh: "pyvista.PolyData"
    color: Color = (0.8, 0.8, 0.8)
    colors: str | None = None
    opacity: float = 1.0
    shines: bool = False


@dataclass(frozen=True)
class Eye:
    """Where a model is first seen from. ``angle``: degrees, of the whole height."""

    position: Point
    target: Point
    up: Point = (0.0, 1.0, 0.0)
    angle: float = 40.0


@dataclass(frozen=True)
class Model:
    """A model and what is to be said of it. ``picture``: a PNG that stands for it in print and where scripts do not run."""

    name: str
    caption: str
    alt: str
    shapes: Sequence[Shape]
    eye: Eye
    picture: pathlib.Path | None = None
    background: Color = (0.07, 0.075, 0.09)


def model_page(model: Model, title: str, frame: str) -> str:
    """The page of a model. ``frame``: HTML that goes before the end of its body and calls ``OfflineLocalView.load`` on ``pathspaceScene``.

    Raises ``QueryError`` where the viewer is missing or the model is too large.
    """
    page = _viewer()
    scene = base64.b64encode(scene_archive(model)).decode("ascii")
    if len(scene) > MOST_BYTES:
        raise QueryError(f"the model `{model.name}` has {len(scene) / 1e6:.0f} MB, more than {MOST_BYTES / 1e6:.0f} MB: draw fewer paths")
    page = page.replace("<title>VTK.js | Example - OfflineLocalView</title>", f"<title>{title}</title>").replace(_ICON, "data:,")
    head, tail = page.rsplit("</body>", 1)
    points = sum(shape.mesh.n_points for shape in model.shapes)
    return f'{head}<script>window.pathspaceScene = "{scene}"; window.pathspacePoints = {points};</script>\n{frame}\n</body>{tail}'


def _viewer() -> str:
    """The page of vtk.js, without a scene."""
    try:
        import trame_vtk
    except ImportError:
        raise QueryError("models that can be turned need the package `trame-vtk`: install it with `pip install trame-vtk`") from None
    file = pathlib.Path(trame_vtk.__file__).parent / "tools" / "static_viewer.html"
    try:
        return file.read_text("utf-8")
    except OSError as error:
        raise QueryError(f"the viewer of `trame-vtk` cannot be read ({error}): install it again") from None


def scene_archive(model: Model) -> bytes:
    """The scene as vtk.js reads it: a zip archive of one file, ``index.json``, with the ``scene`` and its arrays by their ``hashes``."""
    arrays: dict[str, Any] = {}
    actors = [_actor(i, shape, arrays) for i, shape in enumerate(model.shapes) if shape.mesh.n_points]
    eye = model.eye
    camera = {
        "parent": "renderer",
        "id": "camera",
        "type": "vtkCamera",
        "properties": {"focalPoint": list(eye.target), "position": list(eye.position), "viewUp": list(eye.up), "viewAngle": eye.angle},
    }
    renderer = {
        "parent": "window",
        "id": "renderer",
        "type": "vtkRenderer",
        "properties": {"background": list(model.background), "twoSidedLighting": True, "lightFollowCamera": True, "layer": 0, "interactive": True},
        "dependencies": [camera, *actors],
        "calls": [["setActiveCamera", ["instance:${camera}"]], *(["addViewProp", [f"instance:${{{actor['id']}}}"]] for actor in actors)],
    }
    window = {
        "parent": "0x0",
        "id": "window",
        "type": "vtkRenderWindow",
        "properties": {"numberOfLayers": 1},
        "dependencies": [renderer],
        "calls": [["addRenderer", ["instance:${renderer}"]]],
        "mtime": 1,
    }
    text = json.dumps({"hashes": arrays, "scene": window}, separators=(",", ":"))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(zipfile.ZipInfo("index.json", _EPOCH), text, zipfile.ZIP_DEFLATED, 9)
    return packed.getvalue()


def _actor(number: int, shape: Shape, arrays: dict[str, Any]) -> dict[str, Any]:
    """One shape with its mapper and its look; lines are not shaded."""
    name = f"actor{number}"
    mesh = shape.mesh.triangulate() if len(shape.mesh.faces) and not shape.mesh.is_all_triangles else shape.mesh
    shaded = bool(len(mesh.faces)) and not shape.shines
    data: dict[str, Any] = {"points": _array(np.asarray(mesh.points, np.float32), "vtkPoints", "points", arrays)}
    for kind, cells in (("lines", mesh.lines), ("polys", mesh.faces)):
        if len(cells):
            data[kind] = _array(np.asarray(cells, np.uint32), "vtkCellArray", kind, arrays)
    data["fields"] = [] if shape.colors is None else [_colors(mesh, shape.colors, arrays)]
    colored = shape.colors is not None
    scalars = {"scalarVisibility": colored, "colorMode": 2 if colored else 0, "scalarMode": 0, "interpolateScalarsBeforeMapping": False}
    look: dict[str, Any] = {"color": list(shape.color), "diffuseColor": list(shape.color), "opacity": shape.opacity, "lineWidth": 1.0}
    look |= {"lighting": shaded, "ambient": 0.25 if shaded else 1.0, "diffuse": 0.75 if shaded else 0.0, "specular": 0.0}
    polydata = {"parent": f"{name}.mapper", "id": f"{name}.data", "type": "vtkPolyData", "properties": data}
    mapper = {
        "parent": name,
        "id": f"{name}.mapper",
        "type": "vtkMapper",
        "properties": scalars,
        "dependencies": [polydata],
        "calls": [["setInputData", [f"instance:${{{name}.data}}"]]],
    }
    return {
        "parent": "renderer",
        "id": name,
        "type": "vtkActor",
        "properties": {"visibility": True, "pickable": False, "forceTranslucent": shape.opacity < 1.0},
        "dependencies": [mapper, {"parent": name, "id": f"{name}.look", "type": "vtkProperty", "properties": look}],
        "calls": [["setMapper", [f"instance:${{{name}.mapper}}"]], ["setProperty", [f"instance:${{{name}.look}}"]]],
    }


def _colors(mesh: "pyvista.PolyData", name: str, arrays: dict[str, Any]) -> dict[str, Any]:
    """The mesh's colors, which belong to its points or to its cells."""
    location = "pointData" if name in mesh.point_data else "cellData"
    values = (mesh.point_data if location == "pointData" else mesh.cell_data)[name]
    return _array(np.asarray(values, np.uint8), "vtkDataArray", name, arrays) | {"location": location, "registration": "setScalars"}


_KINDS = {"float32": "Float32Array", "uint32": "Uint32Array", "uint8": "Uint8Array"}


def _array(values: npt.NDArray[Any], vtk: str, name: str, arrays: dict[str, Any]) -> dict[str, Any]:
    """Keep an array under its hash; what the scene says of it."""
    stored = np.ascontiguousarray(values).tobytes()
    key = f"{hashlib.sha256(stored).hexdigest()[:32]}_{values.size}{values.dtype.char}"
    kind = _KINDS[values.dtype.name]
    arrays[key] = {"hash": key, "type": kind, "vtk": vtk, "content": base64.b64encode(stored).decode("ascii")}
    components = values.shape[1] if values.ndim > 1 else 1
    return {"hash": key, "vtkClass": vtk, "name": name, "dataType": kind, "numberOfComponents": components, "size": int(values.size), "ranges": []}
