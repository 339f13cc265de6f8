"""A scene from the dictionary that ``mi.load_dict`` takes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from renderer.errors import SceneError
from renderer.scene.description import MAX_DEPTH, Node, Reference, Value
from renderer.scene.matrices import matrix_of, matrix_of_steps

TRANSFORMS = ("to_world", "to_uv")


def node_from_dict(data: Mapping[str, Any], name: str = "scene", place: str = "scene", depth: int = 0) -> Node:
    """The tree of a dictionary; places are paths of keys, as in ``scene.floor.bsdf``."""
    if depth > MAX_DEPTH:
        raise SceneError(f"objects are nested more than {MAX_DEPTH} deep", place)
    plugin = data.get("type")
    if not isinstance(plugin, str):
        raise SceneError("an object needs a 'type', the name of its plugin" if plugin is None else f"'type' must be a string, not {plugin!r}", place)
    identifier = data.get("id", name)
    if not isinstance(identifier, str):
        raise SceneError(f"'id' must be a string, not {identifier!r}", place)
    node = Node(plugin, identifier, place, named="id" in data or depth == 1)
    for key, value in data.items():
        if not isinstance(key, str):
            raise SceneError(f"keys must be strings, not {key!r}", place)
        if key not in ("type", "id"):
            node.properties[key] = value_from_data(key, value, f"{place}.{key}", depth + 1)
    return node


def value_from_data(key: str, value: Any, place: str, depth: int) -> Value:
    """One property of a dictionary."""
    if isinstance(value, Mapping):
        if value.get("type") == "ref":
            return reference(value, place)
        return Value(node_from_dict(value, key, place, depth), place)
    if key in TRANSFORMS:
        return Value(transform_from_data(value, place), place)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, list | tuple):
        return Value(numbers(value, place), place)
    if isinstance(value, bool | int | float | str):
        return Value(value, place)
    raise SceneError(f"cannot use {value!r:.60} (a {type(value).__name__}) as a property; expected a number, string, list or object", place)


def reference(value: Mapping[str, Any], place: str) -> Value:
    """The object ``{type: ref, id: …}``."""
    if set(value) != {"type", "id"} or not isinstance(value["id"], str):
        raise SceneError("a reference is written {type: ref, id: …} and has nothing else", place)
    return Value(Reference(value["id"]), place)


def numbers(value: Any, place: str) -> list[float]:
    """A list of numbers."""
    bad = [x for x in value if isinstance(x, bool) or not isinstance(x, int | float | np.number)]
    if bad:
        raise SceneError(f"expected a list of numbers, found {bad[0]!r:.60} in it", place)
    return [x.item() if isinstance(x, np.number) else x for x in value]


def transform_from_data(value: Any, place: str) -> Any:
    """A 4 x 4 matrix (nested or flat list, array or transform object), or a list of operations, the first applied first."""
    if hasattr(value, "matrix"):
        value = np.asarray(value.matrix, np.float64)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        value = [value]
    if not isinstance(value, list | tuple):
        raise SceneError(f"a transform is a 4 x 4 matrix or a list of operations, not {value!r:.60}", place)
    if value and all(isinstance(step, Mapping) for step in value):
        return matrix_of_steps(value, place)
    return matrix_of(value, place)
