"""A scene from a YAML file that holds the dictionary of ``mi.load_dict``; lines are kept for errors."""

import pathlib
from typing import Any

import yaml

from renderer.errors import SceneError
from renderer.scene.description import MAX_DEPTH, Node, Value
from renderer.scene.from_dict import TRANSFORMS, numbers, reference, transform_from_data

WORDS: dict[str, Any] = {"true": True, "True": True, "false": False, "False": False, "null": None, "~": None, "": None}
MOST_NODES = 1_000_000  # aliases of aliases would grow without end


class YamlReader:
    """The conversion of one file's YAML nodes."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.count = 0

    def place(self, item: yaml.Node) -> str:
        """Where a YAML node stands, ``file:line``."""
        return f"{self.name}:{item.start_mark.line + 1}"

    def enter(self, item: yaml.Node, depth: int) -> None:
        """Bound the depth and the size of what is read."""
        self.count += 1
        if depth > MAX_DEPTH:
            raise SceneError(f"values are nested more than {MAX_DEPTH} deep", self.place(item))
        if self.count > MOST_NODES:
            raise SceneError(f"the file has more than {MOST_NODES} values", self.place(item))

    def entries(self, item: yaml.MappingNode) -> dict[str, yaml.Node]:
        """The keys and nodes of a mapping; a key that stands twice is an error."""
        found: dict[str, yaml.Node] = {}
        for key, value in item.value:
            if not isinstance(key, yaml.ScalarNode):
                raise SceneError("keys must be strings", self.place(key))
            if key.value in found:
                raise SceneError(f"the key {key.value!r} stands twice; first at {self.place(found[key.value])}", self.place(key))
            found[key.value] = value
        return found

    def data(self, item: yaml.Node, depth: int) -> Any:
        """A YAML node as plain Python data. Plain scalars that read as numbers are numbers, ``1e-3`` too."""
        self.enter(item, depth)
        if isinstance(item, yaml.MappingNode):
            return {key: self.data(value, depth + 1) for key, value in self.entries(item).items()}
        if isinstance(item, yaml.SequenceNode):
            return [self.data(value, depth + 1) for value in item.value]
        text = item.value
        if not isinstance(item, yaml.ScalarNode) or item.style is not None:
            return text
        if text in WORDS:
            return WORDS[text]
        if any(c.isdigit() for c in text) or text.lower().lstrip("+-.") in ("inf", "nan"):
            for kind in (int, float):
                try:
                    return kind(text.replace(".inf", "inf").replace(".nan", "nan").replace(".NaN", "nan"))
                except ValueError:
                    continue
        return text

    def node(self, item: yaml.Node, name: str, depth: int) -> Node:
        """A mapping with a ``type`` as a node."""
        self.enter(item, depth)
        if not isinstance(item, yaml.MappingNode):
            raise SceneError("expected an object: a mapping with a 'type'", self.place(item))
        entries = self.entries(item)
        if "type" not in entries:
            raise SceneError("an object needs a 'type', the name of its plugin", self.place(item))
        plugin = self.data(entries["type"], depth + 1)
        identifier = self.data(entries["id"], depth + 1) if "id" in entries else name
        for what, value in (("type", plugin), ("id", identifier)):
            if not isinstance(value, str):
                raise SceneError(f"'{what}' must be a string, not {value!r:.60}", self.place(entries[what]))
        node = Node(plugin, identifier, self.place(item), named="id" in entries or depth == 1)
        for key, value in entries.items():
            if key not in ("type", "id"):
                node.properties[key] = self.value(key, value, depth + 1)
        return node

    def value(self, key: str, item: yaml.Node, depth: int) -> Value:
        """One property."""
        place = self.place(item)
        if key in TRANSFORMS:
            return Value(transform_from_data(self.data(item, depth), place), place)
        if isinstance(item, yaml.MappingNode):
            entries = self.entries(item)
            if "type" in entries and entries["type"].value == "ref":
                return reference(self.data(item, depth), place)
            return Value(self.node(item, key, depth), place)
        data = self.data(item, depth)
        if data is None:
            raise SceneError(f"{key!r} has no value", place)
        return Value(numbers(data, place) if isinstance(data, list) else data, place)


def node_from_yaml(text: str, name: str) -> Node:
    """The tree of a YAML text; ``name`` is what places call the file."""
    try:
        item = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise SceneError(f"this is not YAML: {error.problem or error.context}", f"{name}:{mark.line + 1}" if mark else name) from None
    except yaml.YAMLError as error:
        raise SceneError(f"this is not YAML: {str(error).splitlines()[0]}", name) from None
    except RecursionError:
        raise SceneError(f"values are nested more than {MAX_DEPTH} deep", name) from None
    if item is None:
        raise SceneError("the file is empty; expected a mapping with 'type: scene'", name)
    return YamlReader(name).node(item, "scene", 0)


def read_yaml(path: pathlib.Path) -> Node:
    """The tree of a YAML file."""
    try:
        return node_from_yaml(path.read_text(encoding="utf-8"), str(path))
    except OSError as error:
        raise SceneError(f"cannot read the file: {error.strerror}", str(path)) from None
    except UnicodeDecodeError:
        raise SceneError("this is not text (expected YAML in UTF-8)", str(path)) from None
