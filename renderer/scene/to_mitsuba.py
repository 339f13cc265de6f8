"""The same scene for Mitsuba 3: tests and benchmarks render it by both programs. Mitsuba is imported only when called."""

import pathlib
from typing import Any

import numpy as np

from renderer.scene.from_dict import TRANSFORMS, node_from_dict
from renderer.scene.meshes import read_mesh
from renderer.scene.paths import Paths
from renderer.scene.reader import Reader


def mitsuba_dict(description: dict[str, Any]) -> dict[str, Any]:
    """``Scene.description`` as ``mi.load_dict`` takes it, in the variant that is set.

    Transforms become Mitsuba's objects; ``mesh`` shapes, which Mitsuba has no plugin for, become its mesh objects.
    """
    top = {key: value for key, value in description.items() if isinstance(value, dict)}
    return {"type": "scene", **{safe(key): converted(value, top) for key, value in top.items()}}


def converted(description: dict[str, Any], top: dict[str, Any]) -> Any:
    """One object of the dictionary; ``top`` holds what references name."""
    import mitsuba as mi

    if description["type"] == "mesh":
        return mesh_object(description, top)
    found: dict[str, Any] = {}
    for key, value in description.items():
        if key in TRANSFORMS:
            found[key] = mi.ScalarTransform4f(np.array(value, np.float64))
        elif isinstance(value, dict):
            found[safe(key)] = {"type": "ref", "id": safe(value["id"])} if value["type"] == "ref" else converted(value, top)
        else:
            found[key] = value
    return found


def safe(name: str) -> str:
    """A name without dots, which have a meaning in Mitsuba's keys."""
    return name.replace(".", "_")


def mesh_object(description: dict[str, Any], top: dict[str, Any]) -> Any:
    """A Mitsuba mesh with the triangles that our own reader gives, its BSDF and its emitter."""
    import mitsuba as mi

    node = node_from_dict({key: value for key, value in description.items() if not isinstance(value, dict)})
    mesh = read_mesh(Reader(node), Paths([pathlib.Path.cwd()]))
    properties = mi.Properties()
    for key, value in description.items():
        if isinstance(value, dict):
            properties[key] = mi.load_dict(converted(top[value["id"]] if value["type"] == "ref" else value, top))
    faces = mesh.faces[:, [0, 2, 1]] if mesh.flip else mesh.faces
    made = mi.Mesh("mesh", len(mesh.positions), len(faces), properties, mesh.normals is not None, mesh.uvs is not None)
    parameters = mi.traverse(made)
    parameters["vertex_positions"] = mesh.positions.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    if mesh.normals is not None:
        parameters["vertex_normals"] = mesh.normals.astype(np.float32).ravel()
    if mesh.uvs is not None:
        parameters["vertex_texcoords"] = mesh.uvs.astype(np.float32).ravel()
    parameters.update()
    return made
