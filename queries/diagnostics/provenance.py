"""Where a path came from, spelled from its words: the events and objects that it meets, as an expression and in words."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from queries.lpe.class_words import describe_class
from queries.lpe.descriptors import class_expression
from queries.run import Run
from queries.word_tree import CAMERA, LIGHT


@dataclass(frozen=True)
class PathProvenance:
    """One path, from the camera outward: its letters (``RD``, …), an expression that selects such paths, and what it meets."""

    letters: tuple[str, ...]
    expression: str
    words: str
    objects: tuple[str, ...]
    emitter: str


class Provenance:
    """Spells the paths of one run."""

    def __init__(self, run: Run) -> None:
        self._words = run.words
        self._known: dict[tuple[Any, ...], PathProvenance] = {}
        self._events = {row["key"]: f"{row['type']}{row['scattering'] or ''}" for row in run.tables["events"].to_pylist()}
        self._objects = {row["object"]: row["name"] for row in run.tables["objects"].to_pylist()}
        self._emitters = {row["emitter"]: row for row in run.tables["emitters"].to_pylist()}

    def of(self, path: Mapping[str, Any]) -> PathProvenance:
        """A path by its columns ``emitter``, and ``camera_word`` and ``light_word`` where the run stores them. Each kind is spelled once."""
        key = path["emitter"], path.get("camera_word"), path.get("light_word")
        if key not in self._known:
            self._known[key] = self._spell(path)
        return self._known[key]

    def _spell(self, path: Mapping[str, Any]) -> PathProvenance:
        camera = self._spelled(path.get("camera_word"), CAMERA)[::-1]
        met = [*camera, *self._spelled(path.get("light_word"), LIGHT)]
        emitter = self._emitters[int(path["emitter"])]
        owner = None if emitter["object"] is None else self._objects[emitter["object"]]
        letters = ("C", *(self._events[event] for event, _ in met), emitter["symbol"])
        objects = tuple(self._objects.get(thing, "") for _, thing in met)
        source = emitter["name"] or owner
        words = describe_class(letters, [None, *objects, source])
        return PathProvenance(letters, class_expression(letters), words, objects, source or "")

    def _spelled(self, word: Any, root: int) -> list[tuple[int, int]]:
        """Events and objects of a word, the last letter first."""
        if word is None:
            return []
        tree, spelled = self._words, []
        row = int(tree.rows([word])[0])  # type: ignore[arg-type]
        while row != root:
            spelled.append((int(tree.event[row]), int(tree.object[row])))
            row = int(tree.parent[row])
        return spelled
