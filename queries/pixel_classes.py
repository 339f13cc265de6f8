"""Which classes of paths make up each pixel: the shares of its luminance, small enough to look up while a mouse moves.

Paths count for the pixel that they fall on, as a film with a box filter counts them, whatever the run's own filter: shares say where light
comes from, and do not bleed into neighbors. Films of very many pixels are divided into blocks.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.classes import PathClasses
from queries.kernels.pixel_classes import NO_CLASS, cells_and_values, deposit, largest_shares
from queries.lpe.class_words import describe_class
from queries.lpe.descriptors import class_expression, descriptor
from queries.run import Run
from queries.shards import Piece, map_shards

F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
U16 = npt.NDArray[np.uint16]

WHOLE = 10_000  # parts of a share of 1: hundredths of a percent
SLOTS = 6  # classes that a cell lists
NAMED = 60  # classes that may be listed at all; the others are one
MOST_CELLS = 300_000
_LIGHT = ("raster_x", "raster_y", "contribution_r", "contribution_g", "contribution_b")

__all__ = ["NO_CLASS", "SLOTS", "WHOLE", "NamedClass", "PixelClasses", "pixel_classes"]


class NamedClass(NamedTuple):
    """A class of paths (objects not told apart): the expression that selects it, words, its high-level descriptor, its share 0 … 1 of the image."""

    expression: str
    description: str
    descriptor: str
    share: float


@dataclass(frozen=True)
class PixelClasses:
    """Shares of classes by cell of the film.

    ``block``: pixels to a side of a cell (1: cells are pixels; those at the right and the lower edge may be cut); ``named``: the classes, the largest
    first; ``count``: how many classes the run has; ``classes``: uint8 (rows, columns, SLOTS), indices into ``named``, the cell's largest share
    first, ``NO_CLASS`` in empty slots; ``parts``: uint16 (rows, columns, SLOTS + 1), of ``WHOLE``, the last of all other classes. They add up
    to ``WHOLE`` where there is light, else to 0.
    """

    block: int
    named: tuple[NamedClass, ...]
    count: int
    classes: U8
    parts: U16


def cell_size(width: int, height: int, most: int = MOST_CELLS) -> int:
    """Pixels to a side of the smallest square blocks of which a film has no more than ``most``."""
    block = max(1, math.isqrt(width * height // max(1, most)))
    while -(-width // block) * -(-height // block) > most:
        block += 1
    return block


def pixel_classes(run: Run, named: int = NAMED, most: int = MOST_CELLS, threads: int | None = None) -> PixelClasses:
    """The largest classes of each pixel of a run, or of each block where the film has more than ``most`` pixels: the same on any number of threads.

    ``named``: how many classes are told apart at most (below 255), those of most luminance. Three passes over the paths; memory: 8 bytes for each
    cell and named class. Raises ``QueryError`` for a run without paths, or of which only some shards are open.
    """
    run.require_paths("no pixel's classes can be told")
    run.require_whole()
    width, height = int(run.settings["width"]), int(run.settings["height"])
    block = cell_size(width, height, most)
    columns, rows = -(-width // block), -(-height // block)
    found = PathClasses(run, threads=threads or run.threads)
    energy = _energies(run, found, threads)
    order = np.lexsort((np.arange(len(found)), -energy))[: min(named, NO_CLASS - 1)]
    layers = np.full(len(found), len(order), np.uint8)
    layers[order] = np.arange(len(order), dtype=np.uint8)
    sums = _sums(run, found, layers, (rows, columns, block), len(order) + 1, threads)
    classes, parts = np.empty((rows * columns, SLOTS), np.uint8), np.empty((rows * columns, SLOTS + 1), np.uint16)
    largest_shares(sums, WHOLE, classes, parts)
    total = float(energy.sum()) or 1.0
    names = tuple(_named(found, int(number), float(energy[number]) / total) for number in order)
    return PixelClasses(block, names, len(found), classes.reshape(rows, columns, SLOTS), parts.reshape(rows, columns, SLOTS + 1))


def _named(found: PathClasses, number: int, share: float) -> NamedClass:
    letters = found.letters(number)
    return NamedClass(class_expression(letters), describe_class(letters), descriptor(letters), share)


def _energies(run: Run, found: PathClasses, threads: int | None) -> F64:
    """Luminance of each class, summed over its recorded paths: float64 (classes)."""

    def work(pieces: Iterator[Piece]) -> F64:
        sums = np.zeros(len(found))
        for piece in pieces:
            sums += np.bincount(found.of(piece), _cells(piece, 1, 1)[1], minlength=len(found))
        return sums

    total = np.zeros(len(found))
    for sums in map_shards(run.files("paths"), work, threads or run.threads):
        total += sums
    return total


def _sums(run: Run, found: PathClasses, layers: U8, grid: tuple[int, int, int], count: int, threads: int | None) -> F64:
    """Luminance by cell and layer: float64 (cells, count). Threads sort rows into cells, which are then summed in the shards' order."""
    rows, columns, block = grid

    def work(pieces: Iterator[Piece]) -> list[tuple[U8, I32, F64]]:
        return [(layers[found.of(piece)], *_cells(piece, block, columns)) for piece in pieces]

    sums = np.zeros((rows * columns, count))
    for parts in map_shards(run.files("paths"), work, threads or run.threads):
        for layer, cell, value in parts:
            deposit(cell, layer, value, sums)
    return sums


def _cells(piece: Piece, block: int, columns: int) -> tuple[I32, F64]:
    """The cell of each path, and its luminance."""
    x, y, r, g, b = (piece.column("paths", name) for name in _LIGHT)
    cell, value = np.empty(piece.rows("paths"), np.int32), np.empty(piece.rows("paths"))
    cells_and_values(x, y, r, g, b, block, columns, cell, value)
    return cell, value
