"""Textures of a description as rows of the texture table; constant ones are plain colors."""

import pathlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from renderer.errors import SceneError
from renderer.scene.description import Node, listing, nearest
from renderer.scene.reader import Reader
from renderer.scene.spectra import COLORS, Rgb, color
from renderer.textures.base import BILINEAR, BITMAP, CHECKERBOARD, CLAMP, MIRROR, NEAREST, REPEAT, Textures
from renderer.textures.bitmap import load_bitmap

if TYPE_CHECKING:
    from renderer.scene.context import Context

FILTERS = {"nearest": NEAREST, "bilinear": BILINEAR}
WRAPS = {"repeat": REPEAT, "mirror": MIRROR, "clamp": CLAMP}
TEXTURES = ("bitmap", "checkerboard")


class Slot(NamedTuple):
    """A color that may be textured: the constant (a texture's mean), and the texture's row or -1."""

    rgb: Rgb
    texture: int


class Row(NamedTuple):
    """One texture before it is packed."""

    kind: int
    to_uv: npt.NDArray[np.float64]
    rgb: tuple[Rgb, Rgb]
    pixels: npt.NDArray[np.float32]  # (height, width, 3), of zero size where there are none
    mode: tuple[int, int]

    def mean(self) -> Rgb:
        """The texture's mean color."""
        r, g, b = np.mean(self.rgb, axis=0) if self.kind == CHECKERBOARD else self.pixels.mean(axis=(0, 1), dtype=np.float64)
        return (float(r), float(g), float(b))


class TextureTable:
    """The rows of all textures; a node that is used twice is one row."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.of_node: dict[int, tuple[Node, int]] = {}  # by the node's id; it is kept, so that no other node gets that id
        self.images: dict[tuple[pathlib.Path, bool], npt.NDArray[np.float32]] = {}

    def row(self, node: Node, context: "Context") -> int:
        """The row of a bitmap or checkerboard."""
        if id(node) not in self.of_node:
            reader = Reader(node)
            self.rows.append(self.bitmap(reader, context) if node.plugin == "bitmap" else checkerboard(reader))
            reader.finish()
            self.of_node[id(node)] = (node, len(self.rows) - 1)
        return self.of_node[id(node)][1]

    def bitmap(self, reader: Reader, context: "Context") -> Row:
        """An image file; ``raw`` says that its values are already linear."""
        path, _ = context.paths.file(reader)
        raw = reader.flag("raw", False)
        mode = FILTERS[reader.choice("filter_type", "bilinear", tuple(FILTERS))], WRAPS[reader.choice("wrap_mode", "repeat", tuple(WRAPS))]
        reader.ignore("format", "accel")
        black = (0.0, 0.0, 0.0)
        try:
            pixels = self.image(path, raw)
        except SceneError as error:
            raise reader.error(str(error), "filename") from None
        return Row(BITMAP, to_uv(reader), (black, black), pixels, mode)

    def image(self, path: pathlib.Path, raw: bool) -> npt.NDArray[np.float32]:
        """The pixels of an image file, read once."""
        if (path, raw) not in self.images:
            self.images[path, raw] = load_bitmap(path, raw)
        return self.images[path, raw]

    def pack(self) -> Textures | None:
        """The texture table as kernels read it; None where there are no textures."""
        if not self.rows:
            return None
        images: dict[int, int] = {}
        pixels: list[npt.NDArray[np.float32]] = []
        first: list[int] = []
        total = 0
        for row in self.rows:
            if id(row.pixels) not in images:
                images[id(row.pixels)] = total
                pixels.append(row.pixels.reshape(-1, 3))
                total += len(pixels[-1])
            first.append(images[id(row.pixels)])
        return Textures(
            np.array([row.kind for row in self.rows], np.int32),
            np.array([row.to_uv for row in self.rows], np.float32),
            np.array([row.rgb for row in self.rows], np.float32),
            np.array(first, np.int64),
            np.array([row.pixels.shape[1::-1] for row in self.rows], np.int32),
            np.array([row.mode for row in self.rows], np.int32),
            np.ascontiguousarray(np.concatenate(pixels), np.float32),
        )


def checkerboard(reader: Reader) -> Row:
    """Two colors in squares of half a unit of (u, v)."""
    colors = color(reader, "color0", 0.4, bounded=False), color(reader, "color1", 0.2, bounded=False)
    return Row(CHECKERBOARD, to_uv(reader), colors, np.zeros((0, 0, 3), np.float32), (NEAREST, REPEAT))


def to_uv(reader: Reader) -> npt.NDArray[np.float64]:
    """The map of (u, v), (2, 3): the matrix's upper left 2 x 2 part and its offset."""
    m = reader.transform("to_uv")
    return np.asarray(m[np.ix_([0, 1], [0, 1, 3])])


def slot(reader: Reader, name: str, default: Rgb | float, context: "Context", bounded: bool = True) -> Slot:
    """A property that is a constant color or a texture."""
    value = reader.node_or_number(name, (default, default, default) if isinstance(default, int | float) else default)
    assert value is not None
    if isinstance(value.data, Node) and value.data.plugin in TEXTURES:
        row = context.textures.row(value.data, context)
        return Slot(context.textures.rows[row].mean(), row)
    if isinstance(value.data, Node) and value.data.plugin not in COLORS:
        raise unsupported_texture(reader, name, value.data.plugin)
    return Slot(color(reader, name, default, bounded), -1)


def unsupported_texture(reader: Reader, name: str, plugin: str) -> SceneError:
    """The error for a texture that is not supported."""
    known: Sequence[str] = (*TEXTURES, *COLORS)
    return reader.error(f"{name!r}: the texture {plugin!r} is not supported{nearest(plugin, known)}; supported: {listing(known)}", name)
