"""Typed access to a node's properties, with errors that name the property, its place and what was expected.

A reader notes every name that is asked for; ``finish`` refuses what nobody asked for, as Mitsuba does.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from renderer.errors import SceneError
from renderer.scene.description import Node, Value, listing, nearest
from renderer.scene.transforms import F64

MISSING = object()
IDENTITY: F64 = np.eye(4)


def shown(data: Any) -> str:
    """A value as it stands in an error message."""
    if isinstance(data, Node):
        return f"a {data.plugin!r} object"
    text = repr(data.tolist() if isinstance(data, np.ndarray) else data)
    return text if len(text) <= 60 else text[:57] + "..."


class Reader:
    """The properties of one node."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.asked: dict[str, None] = {}

    def error(self, message: str, name: str = "") -> SceneError:
        """An error about the node, or about one of its properties."""
        value = self.node.properties.get(name)
        return SceneError(f"{self.node.plugin}: {message}", value.place if value else self.node.place)

    def has(self, name: str) -> bool:
        """Whether the description gives this property."""
        self.asked[name] = None
        return name in self.node.properties

    def value(self, name: str, default: Any = MISSING) -> Any:
        """The raw data of a property."""
        if self.has(name):
            return self.node.properties[name].data
        if default is MISSING:
            raise self.error(f"the property {name!r} is missing")
        return default

    def number(self, name: str, default: Any = MISSING, low: float = -math.inf, high: float = math.inf, above: float = -math.inf) -> float:
        """A finite number with low <= number <= high and number > above."""
        data = self.value(name, default)
        if isinstance(data, bool) or not isinstance(data, int | float):
            raise self.error(f"{name!r} must be a number, not {shown(data)}", name)
        named = ((f"at least {low:g}", low), (f"at most {high:g}", high), (f"more than {above:g}", above))
        bounds = [text for text, given in named if math.isfinite(given)]
        if not math.isfinite(data) or not low <= data <= high or not data > above:
            raise self.error(f"{name!r} must be a finite number{', ' + ' and '.join(bounds) if bounds else ''}; it is {data!r}", name)
        return float(data)

    def integer(self, name: str, default: Any = MISSING, low: int | None = None, high: int | None = None) -> int:
        """A whole number within bounds."""
        data = self.value(name, default)
        if isinstance(data, bool) or not isinstance(data, int):
            raise self.error(f"{name!r} must be a whole number, not {shown(data)}", name)
        if (low is not None and data < low) or (high is not None and data > high):
            raise self.error(f"{name!r} must be {'at least ' + str(low) if high is None else f'from {low} to {high}'}; it is {data}", name)
        return data

    def flag(self, name: str, default: Any = MISSING) -> bool:
        """True or false."""
        data = self.value(name, default)
        if not isinstance(data, bool):
            raise self.error(f"{name!r} must be true or false, not {shown(data)}", name)
        return data

    def text(self, name: str, default: Any = MISSING) -> str:
        """A string."""
        data = self.value(name, default)
        if not isinstance(data, str):
            raise self.error(f"{name!r} must be a string, not {shown(data)}", name)
        return data

    def choice(self, name: str, default: str, known: Sequence[str]) -> str:
        """One of a few words."""
        data = self.text(name, default)
        if data not in known:
            raise self.error(f"{name!r} must be one of {listing(known)}; it is {data!r}{nearest(data, known)}", name)
        return data

    def vector(self, name: str, default: Any = MISSING) -> tuple[float, float, float]:
        """Three finite numbers."""
        data = self.value(name, default)
        good = isinstance(data, list | tuple) and len(data) == 3 and all(isinstance(x, int | float) and not isinstance(x, bool) for x in data)
        if not good or not all(math.isfinite(x) for x in data):
            raise self.error(f"{name!r} must be three finite numbers, not {shown(data)}", name)
        return (float(data[0]), float(data[1]), float(data[2]))

    def transform(self, name: str) -> F64:
        """An affine, invertible transform, (4, 4); the identity where the description has none."""
        data = self.value(name, IDENTITY)
        if not isinstance(data, np.ndarray):
            raise self.error(f"{name!r} must be a transform, not {shown(data)}", name)
        if not np.isfinite(data).all():
            raise self.error(f"{name!r} has entries that are not finite (a zero axis, or a look-at along its own up vector?)", name)
        if not np.allclose(data[3], (0, 0, 0, 1)):
            raise self.error(f"{name!r} must be affine: its last row must be 0 0 0 1, not {shown(data[3])}", name)
        singular = np.linalg.svd(data[:3, :3], compute_uv=False)
        if not singular[0] > 0 or singular[-1] < 1e-12 * singular[0] or singular[-1] < 1e-30:
            raise self.error(f"{name!r} cannot be inverted: it flattens space (is a scale zero?)", name)
        return data

    def node_or_number(self, name: str, default: Any = MISSING) -> Value | None:
        """A property that is a node or a plain value, with its place; None where the default is None."""
        data = self.value(name, default)
        return None if data is None else Value(data, self.node.properties[name].place if name in self.node.properties else self.node.place)

    def children(self, plugins: Sequence[str], what: str, most: int = 1) -> list[Node]:
        """The nested nodes among some plugins, whatever their property names; more than ``most`` are an error."""
        found = [(key, child) for key, child in self.node.children() if child.plugin in plugins]
        for key, _ in found:
            self.asked[key] = None
        if len(found) > most:
            raise self.error(f"at most {most} {what} can stand here, not {len(found)}", found[most][0])
        return [child for _, child in found]

    def ignore(self, *names: str) -> None:
        """Accept properties that have no effect on the picture."""
        for name in names:
            self.asked[name] = None

    def finish(self, children: Sequence[str] = ()) -> None:
        """Refuse every property that was not asked for; ``children`` are the plugins that can be nested here."""
        for name, value in self.node.properties.items():
            if name not in self.asked:
                known = sorted(n for n in self.asked if n not in dict(self.node.children()) or n in self.node.properties)
                if isinstance(value.data, Node) and not nearest(name, known):
                    inner = value.data
                    fine = f"{nearest(inner.plugin, children)}; supported here: {listing(children)}" if children else ""
                    raise SceneError(f"{self.node.plugin}: a nested {inner.plugin!r} ({name}) is not supported{fine}", inner.place)
                raise self.error(f"unknown property {name!r}{nearest(name, known) or '; known: ' + listing(known)}", name)
