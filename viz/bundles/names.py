"""Names of what is drawn: the class of each path, as an expression spells it, and what each bundle leads from and to."""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from queries.path_sample import PathSample
from renderer.tables import EMITTER, EVENTS, LENS, NO_OBJECT
from viz.bundles.assign import Segments

if TYPE_CHECKING:
    from queries.run import Run

I32 = npt.NDArray[np.int32]
_SPELLED = {event.key: f"<{event.type}{event.scattering}>" for event in EVENTS if event.scattering}
_LETTERS = "LOB"


def class_words(run: "Run", sample: PathSample) -> tuple[I32, list[str]]:
    """The class of each path, int32 (n), and how each class is spelled from the camera outward: `C<RD><TS>L`. Numbered by length, then by events."""
    length = np.diff(sample.start)
    if not len(length):
        return np.zeros(0, np.int32), []
    # One row of letters for each path, from the camera, and the emitter's letter in the first column
    path = np.repeat(np.arange(len(length)), length)
    place = sample.start[1:][path] - np.arange(sample.start[0], sample.start[-1])
    table = np.zeros((len(length), int(length.max()) + 2), np.uint8)
    table[:, 0] = np.minimum(length, 255)
    table[:, 1] = _emitter_letters(run, sample)
    table[path, place + 1] = sample.event
    rows = np.ascontiguousarray(table).view(np.dtype((np.void, table.shape[1]))).reshape(-1)
    distinct, numbers = np.unique(rows, return_inverse=True)
    words = []
    for row in distinct.view(np.uint8).reshape(len(distinct), -1).tolist():
        inner = "".join(_SPELLED.get(key, "") for key in row[2:])
        words.append(f"C{inner}{_LETTERS[row[1]]}")
    return numbers.reshape(-1).astype(np.int32), words


def _emitter_letters(run: "Run", sample: PathSample) -> npt.NDArray[np.uint8]:
    """Which of L, O and B stands for the emitter of each path: uint8 (n)."""
    of_object: dict[int | None, str] = {}
    for row in run.tables["emitters"].to_pylist():
        if not row.get("infinite"):
            of_object.setdefault(row["object"], row["symbol"])
    things = sample.object[sample.start[:-1]]
    letters = np.full(len(sample), _LETTERS.index(of_object.get(None, "L")), np.uint8)
    for thing, symbol in of_object.items():
        if thing is not None:
            letters[things == thing] = _LETTERS.index(symbol)
    letters[sample.infinite] = _LETTERS.index("B")
    return letters


def bundle_names(run: "Run", sample: PathSample, segments: Segments) -> list[str]:
    """What each bundle leads from and to: `emitter light to diffuse floor`, of the first of its segments where they differ; empty for none."""
    objects = dict(zip(run.tables["objects"]["object"].to_pylist(), run.tables["objects"]["name"].to_pylist()))
    lobes = {event.key: event.lobe.replace("_", " ") for event in EVENTS} | {EMITTER: "emitter", LENS: "camera"}
    present, first = np.unique(segments.bundle, return_index=True)

    def named(row: int) -> str:
        thing = int(sample.object[row])
        return " ".join(word for word in (lobes.get(int(sample.event[row]), ""), "" if thing == NO_OBJECT else objects.get(thing, "")) if word)

    names = [""] * segments.bundles
    for bundle, row in zip(present.tolist(), segments.begin[first].tolist()):
        names[bundle] = f"{named(row)} to {named(row + 1)}"
    return names
