"""Colors of a description: rgb, srgb, uniform spectra and plain numbers, all as linear RGB."""

import math

from renderer.scene.description import Node, Value
from renderer.scene.reader import Reader, shown

Rgb = tuple[float, float, float]
COLORS = ("rgb", "srgb", "uniform", "spectrum", "d65")


def color(reader: Reader, name: str, default: Rgb | float, bounded: bool) -> Rgb:
    """A constant color; ``bounded`` ones (reflectances) stay within 0 and 1, all are finite and not negative."""
    value = reader.node_or_number(name, (default, default, default) if isinstance(default, int | float) else default)
    assert value is not None
    return constant(reader, name, value, bounded)


def constant(reader: Reader, name: str, value: Value, bounded: bool) -> Rgb:
    """The color that a property's value stands for."""
    data = value.data
    if isinstance(data, Node):
        if data.plugin not in COLORS:
            raise reader.error(f"{name!r} must be a constant here: a number or {{type: rgb, value: …}}, not {shown(data)}", name)
        inner = Reader(data)
        rgb = node_color(inner)
        inner.finish()
    else:
        rgb = numbers(reader, name, data)
    if not all(math.isfinite(c) and c >= 0 for c in rgb):
        raise reader.error(f"{name!r} must be finite and not negative; it is {rgb}", name)
    if bounded and max(rgb) > 1:
        raise reader.error(f"{name!r} must be between 0 and 1, since a surface cannot reflect more than it receives; it is {rgb}", name)
    return rgb


def node_color(reader: Reader) -> Rgb:
    """The color of an rgb, srgb, uniform, spectrum or d65 node."""
    plugin = reader.node.plugin
    if plugin in ("rgb", "srgb"):
        key = "color" if plugin == "srgb" and reader.has("color") else "value"
        return numbers(reader, key, reader.value(key))
    if plugin == "d65":
        grey = reader.number("scale", 1.0)
        return (grey, grey, grey)
    grey = reader.number("value", 1.0)
    return (grey, grey, grey)


def numbers(reader: Reader, name: str, data: object) -> Rgb:
    """One number (grey) or three."""
    if isinstance(data, int | float) and not isinstance(data, bool):
        return (float(data), float(data), float(data))
    if isinstance(data, list | tuple) and len(data) == 3:
        return (float(data[0]), float(data[1]), float(data[2]))
    raise reader.error(f"{name!r} must be a number or three numbers (red, green, blue), not {shown(data)}", name)
