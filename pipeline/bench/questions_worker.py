"""The process that asks a recorded run questions, on request, and says how long each took."""

import pathlib
import re
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from pipeline.bench.probe import own_peak_bytes
from pipeline.bench.timing import timed
from pipeline.bench.worker import serve
from pipeline.config import Rank
from pipeline.rankings import ranked
from queries.images import aov_image, select
from queries.luminance import luminance_of
from queries.run import Run, open_run
from queries.shards import map_shards
from queries.word_tree import CAMERA, WordTree


def asker(path: pathlib.Path, threads: int) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """Open a run; a function that answers one question.

    ``{expression}``: the image of what it matches; ``{rank}``: a ranking; ``{regex}``: the image of the paths whose words match; all give
    ``{wall, cpu}``. ``{count}``: how many paths an expression matches; ``{peak}``: the most memory that this process has held.
    """
    run = open_run(path, threads=threads)
    spelled: list[list[str]] = []

    def answer(request: Mapping[str, Any]) -> dict[str, Any]:
        if request.get("peak"):
            return {"peak_bytes": own_peak_bytes()}
        if request.get("count"):
            return {"matched": select(run, {"asked": request["count"]}, threads)["asked"].rows}
        if request.get("regex"):
            spelled.append(spelled.pop() if spelled else spell(run.words, run))
            with timed() as watch:
                matched = regex_image(run, spelled[0], request["regex"])[1]
            return {"wall": watch.timing.wall, "cpu": watch.timing.cpu, "matched": matched}
        with timed() as watch:
            if request.get("rank"):
                light = ranked(run, Rank.model_validate(request["rank"]), threads).num_rows
            else:
                light = float(luminance_of(aov_image(run, run.compile(request["expression"]), threads).mean(axis=(0, 1))))
        return {"wall": watch.timing.wall, "cpu": watch.timing.cpu, "answer": light}

    return answer


def spell(words: WordTree, run: Run) -> list[str]:
    """Every camera word as text: two letters for each interaction, event and scattering type. Not timed: others would have to keep it, too."""
    letters = {row["key"]: row["type"] + (row["scattering"] or "x") for row in run.tables["events"].to_pylist()}
    texts = [""] * len(words)
    for word in words.order.tolist():
        if words.side[word] == CAMERA:
            texts[word] = texts[words.parent[word]] + letters[int(words.event[word])]
    return texts


def regex_image(run: Run, texts: list[str], pattern: str) -> tuple[npt.NDArray[np.float64], int]:
    """What one would write without this library: match the word of every path, then sum by pixel (box filter). Paths that hit or sample `L`."""
    width, height = run.settings["width"], run.settings["height"]
    match = re.compile(pattern).fullmatch
    image, matched = np.zeros((3, height * width)), 0
    for pieces in map_shards(run.shard_files, list, 1):
        for piece in pieces:
            rows = run.words.rows(piece.column("paths", "camera_word")).tolist()
            found = np.array([match(f"C{texts[row]}L") is not None for row in rows])
            pixel = piece.column("paths", "raster_y").astype(np.int64) * width + piece.column("paths", "raster_x").astype(np.int64)
            for channel, name in enumerate("rgb"):
                light = piece.column("paths", f"contribution_{name}")[found]
                image[channel] += np.bincount(pixel[found], light, height * width)
            matched += int(np.count_nonzero(found))
    return image.T.reshape(height, width, 3) / run.settings["passes"], matched


if __name__ == "__main__":
    _, folder, count = sys.argv
    serve(lambda: asker(pathlib.Path(folder), int(count)))
