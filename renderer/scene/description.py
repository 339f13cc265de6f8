"""A scene description as a tree: what an XML file, a YAML file and a dictionary all become before compilation.

A node is one plugin with its properties; every value remembers its place, so that an error can name file and line.
"""

import difflib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from renderer.errors import SceneError

MAX_DEPTH = 48  # nesting of nodes, includes and lists; real scenes need fewer than ten


@dataclass(frozen=True)
class Reference:
    """The use of a node that is defined elsewhere."""

    id: str


@dataclass(frozen=True)
class Value:
    """A property: bool, int, float, str, list of numbers, 4 x 4 array, ``Node`` or ``Reference``, and where it stands."""

    data: Any
    place: str


@dataclass
class Node:
    """One plugin of a description, e.g. a shape. ``name`` is its id, or its key in the parent."""

    plugin: str
    name: str
    place: str
    properties: dict[str, Value] = field(default_factory=dict)
    named: bool = False  # True: it has an id, or stands at the top under a key, so that references can find it

    def children(self) -> Iterator[tuple[str, "Node"]]:
        """The nested nodes, by property name."""
        for key, value in self.properties.items():
            if isinstance(value.data, Node):
                yield key, value.data


def nearest(word: str, known: Iterable[str]) -> str:
    """A hint for an error message: the nearest known word, or nothing."""
    found = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f"; did you mean {found[0]!r}?" if found else ""


def listing(known: Iterable[str]) -> str:
    """Known words as they stand in an error message."""
    return ", ".join(known)


class Definitions:
    """All nodes of a description that a reference can name."""

    def __init__(self, root: Node) -> None:
        """Collect the named nodes below the root; a name that is defined twice is an error."""
        self.nodes: dict[str, Node] = {}
        self.aliases = {key: value.data.id for key, value in root.properties.items() if isinstance(value.data, Reference)}
        self._collect(root)

    def _collect(self, node: Node) -> None:
        for _, child in node.children():
            if child.named:
                first = self.nodes.setdefault(child.name, child)
                if first is not child:
                    raise SceneError(f"the id {child.name!r} is used twice; first at {first.place}", child.place)
            self._collect(child)

    def find(self, reference: Reference, place: str) -> Node:
        """The node that a reference names, through aliases."""
        seen: list[str] = []
        while reference.id in self.aliases and reference.id not in self.nodes:
            seen.append(reference.id)
            reference = Reference(self.aliases[reference.id])
            if reference.id in seen:
                raise SceneError(f"a cycle of references: {' -> '.join(map(repr, (*seen, reference.id)))}", place)
        if reference.id not in self.nodes:
            known = f"; known ids: {listing(sorted(self.nodes))}" if 0 < len(self.nodes) <= 20 else ""
            raise SceneError(f"nothing has the id {reference.id!r}{nearest(reference.id, self.nodes) or known}", place)
        return self.nodes[reference.id]


def resolve(root: Node) -> set[str]:
    """Put the node itself in place of each reference, and return the ids that were referenced.

    Shared nodes stay one object. A node that contains itself, directly or through others, is an error.
    """
    definitions = Definitions(root)
    used: set[str] = set()
    done: set[int] = set()

    def visit(node: Node, above: tuple[Node, ...]) -> None:
        if any(node is other for other in above):
            chain = " -> ".join(repr(n.name) for n in (*above[1:], node))
            raise SceneError(f"a cycle of references: {chain}", node.place)
        if id(node) in done:
            return
        for key, value in node.properties.items():
            data = value.data
            if isinstance(data, Reference):
                data = definitions.find(data, value.place)
                used.add(data.name)
                node.properties[key] = Value(data, value.place)
            if isinstance(data, Node):
                visit(data, (*above, node))
        done.add(id(node))

    visit(root, ())
    return used


def plain(root: Node, shared: set[str]) -> dict[str, Any]:
    """The resolved tree as a dictionary in ``mi.load_dict``'s vocabulary, transforms as 4 x 4 nested lists.

    Nodes that are shared stand first, at the top, under their ids.
    """
    top: dict[str, Any] = {"type": root.plugin}
    placed: dict[int, str] = {}

    def data(value: Any) -> Any:
        if isinstance(value, Node):
            if value.name in shared and value.named:
                hoist(value)
                return {"type": "ref", "id": placed[id(value)]}
            return node(value)
        return value.tolist() if isinstance(value, np.ndarray) else value

    def node(value: Node) -> dict[str, Any]:
        return {"type": value.plugin, **{key: data(v.data) for key, v in value.properties.items()}}

    def hoist(value: Node) -> None:
        if id(value) not in placed:
            key = value.name
            while key in top or key in placed.values():
                key += "_"
            placed[id(value)] = key
            top[key] = node(value)

    for _, child in root.children():
        hoist(child)
    return top
