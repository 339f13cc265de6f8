"""What the inspector knows of each pixel, as a script: a page that was opened from a disk may run scripts, but not read files."""

import base64
import json
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from queries.pixel_classes import SLOTS, WHOLE, PixelClasses
from viz.report.tables import short_words

F32 = npt.NDArray[np.float32]


def write_pixels(
    file: pathlib.Path, image: F32, block: int, found: PixelClasses | None, colors: Sequence[str], pictures: Sequence[Mapping[str, str]]
) -> None:
    """Write ``window.pathspacePixels``: radiance of each cell, its classes and their shares, names and colors of classes, pictures to look at.

    ``image``: linear radiance, float32 (height, width, 3), averaged over cells of ``block`` pixels to a side; ``pictures``: label and file of each.
    """
    height, width, _ = image.shape
    radiance = cell_means(image, block)
    data: dict[str, Any] = {
        "width": width,
        "height": height,
        "block": block,
        "columns": radiance.shape[1],
        "rows": radiance.shape[0],
        "slots": SLOTS,
        "whole": WHOLE,
        "pictures": list(pictures),
        "radiance": _packed(radiance, "<f4"),
        "names": [],
    }
    if found is not None:
        named = zip(found.named, colors, strict=True)
        words = [short_words(name.description, name.expression) for name in found.named]
        data["names"] = [
            {"expression": name.expression, "description": said, "color": color, "share": round(name.share, 6)}
            for said, (name, color) in zip(words, named, strict=True)
        ]
        data |= {"classes": _packed(found.classes, "u1"), "parts": _packed(found.parts, "<u2")}
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(f"window.pathspacePixels = {json.dumps(data, ensure_ascii=True, separators=(',', ':'))};\n", "ascii")


def cell_means(image: F32, block: int) -> F32:
    """Mean radiance of cells of ``block`` pixels to a side, float32 (rows, columns, 3); those at the right and the lower edge may be smaller."""
    if block == 1:
        return image
    height, width, _ = image.shape
    y, x = np.arange(0, height, block), np.arange(0, width, block)
    sums = np.add.reduceat(np.add.reduceat(image.astype(np.float64), y, axis=0), x, axis=1)
    sizes = np.minimum(block, height - y)[:, None] * np.minimum(block, width - x)[None, :]
    means: F32 = (sums / sizes[..., None]).astype(np.float32)
    return means


def class_colors(count: int) -> list[str]:
    """Colors that are told apart as long as there are few: Okabe and Ito's and their like first, then hues a golden angle apart."""
    first = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#b8a800", "#7a5195", "#8c564b", "#17a2a2", "#9aa0a6", "#ef5675")
    return [first[i] if i < len(first) else _hue(i) for i in range(count)]


def _hue(i: int) -> str:
    import colorsys

    rgb = colorsys.hls_to_rgb((i * 0.381966) % 1.0, 0.42 + 0.12 * (i % 3), 0.5)
    return "#" + "".join(f"{round(255 * value):02x}" for value in rgb)


def _packed(values: npt.NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode("ascii")
