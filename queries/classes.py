"""Classes of paths: all paths of one signature (thesis 9.4.1), numbered by the run's own words.

A signature spells a path from the camera outward: C, event and scattering type of each interaction, then L, O or B. With objects, paths also
differ by the object of each interaction and by the emitter's name (its object's, where it has none). A path of two walks has the class of its
whole, wherever they met.
"""

import functools
from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from queries.errors import RunError
from queries.kernels.tries import LONGEST, NOTHING, SYMBOL_BITS, Trie, append_reversed, find_numbers, grow, insert_keys, number_keys
from queries.run import Run
from queries.shards import Piece, map_shards
from queries.word_tree import CAMERA, LIGHT, WordTree

I32 = npt.NDArray[np.int32]
U64 = npt.NDArray[np.uint64]
End: TypeAlias = tuple[str, str | None]  # L, O or B, and what the emitter is called
_OBJECTS = 1 << 16  # a letter is its spelling's number, times this, plus an object


class PathClasses:
    """The classes that occur in a run, numbered from 0: shorter paths first, the same numbers each time.

    ``lengths``: int32 (classes), letters of each class, C and L, O or B included.
    """

    def __init__(self, run: Run, with_objects: bool = False, tables: tuple[str, ...] = ("paths",), threads: int | None = None) -> None:
        """Number the classes of the paths of ``tables``. Raises RunError where paths have words that the run does not know."""
        self.with_objects = with_objects
        self._words: WordTree = run.words
        self._spellings, letters = _letters(run, self._words, with_objects)
        self._object_names: list[str] = run.tables["objects"]["name"].to_pylist()
        self._ends, self._end_of = _ends(run.tables["emitters"].to_pylist(), self._object_names, with_objects)
        self._camera = _Strings(self._words, letters, CAMERA)
        self._light = _Strings(self._words, letters, LIGHT)
        found = [self._collect(run, table, threads) for table in tables if table in run.tables]
        self._number(np.unique(np.concatenate([np.zeros(0, np.uint64), *found])))

    def __len__(self) -> int:
        """Number of classes."""
        return len(self.lengths)

    def of(self, piece: Piece, table: str = "paths") -> I32:
        """The class of each row: int32 (rows). Raises RunError for a path of a class that was not numbered."""
        numbers = np.empty(piece.rows(table), np.int32)
        find_numbers(self._keys(piece, table), self._slots, self._slot_number, numbers)
        if len(numbers) and numbers.min() < 0:
            raise RunError(f"a row of `{table}` is of a class that was not numbered: number the classes of that table too")
        return numbers

    def letters(self, number: int) -> list[str]:
        """The signature of a class, letter by letter from the camera: ``["C", "RD", "TS", "L"]``."""
        return ["C", *(self._spellings[letter // _OBJECTS] for letter in self._interactions(number)), self._end(number)[0]]

    def objects(self, number: int) -> list[str | None]:
        """A name for each letter: objects of interactions, then the emitter (its object's name where it has none). None where a class has none."""
        if not self.with_objects:
            return [None] * int(self.lengths[number])
        return [None, *(self._object_names[letter % _OBJECTS] for letter in self._interactions(number)), self._end(number)[1]]

    def _interactions(self, number: int) -> list[int]:
        """The letters between the camera and the emitter."""
        return self._camera.spell(int(self._class_node[number]))

    def _end(self, number: int) -> End:
        return self._ends[int(self._class_end[number])]

    def _keys(self, piece: Piece, table: str) -> U64:
        """A key of each row's camera string, light string and end: uint64 (rows)."""
        keys = np.zeros(piece.rows(table), np.uint64)
        for side, strings in (("camera_word", self._camera), ("light_word", self._light)):
            if piece.has(table, side):
                words = self._words.rows(piece.column(table, side))
                if len(words) and words.min() < 0:
                    raise RunError("the catalogue `words` lacks the word of a path: run the job again with --resume")
                keys *= np.uint64(strings.of_words)
                keys += strings.node_of_word[words].view(np.uint32)
        keys *= np.uint64(max(1, len(self._ends)))
        keys += self._end_of[piece.column(table, "emitter")].view(np.uint32)
        return keys

    def _collect(self, run: Run, table: str, threads: int | None) -> U64:
        """The distinct keys of a table, sorted."""

        def work(pieces: Iterator[Piece]) -> U64:
            distinct = _Keys()
            for piece in pieces:
                distinct.add(self._keys(piece, table))
            return distinct.sorted()

        parts = list(map_shards(run.shard_files, work, threads))
        return np.unique(np.concatenate([np.zeros(0, np.uint64), *parts]))

    def _number(self, keys: U64) -> None:
        """Number the classes of distinct keys, and keep which key has which class."""
        rest, ends = np.divmod(keys, np.uint64(max(1, len(self._ends))))
        heads, tails = rest.astype(np.int32), np.zeros(len(keys), np.int32)
        if self._light.of_words > 1:
            # Paths that use light walks: where no camera walk is stored, the camera's part of the key is 0, the empty string.
            heads, tails = (part.astype(np.int32) for part in np.divmod(rest, np.uint64(self._light.of_words)))
        nodes = self._camera.join(heads, tails, self._light)
        depth = self._camera.depths()[nodes]
        # One number for each distinct pair of string and end, by length first.
        order = np.lexsort((ends, nodes, depth))
        new = np.ones(len(keys), np.bool_)
        new[1:] = (np.diff(nodes[order]) != 0) | (np.diff(ends[order].astype(np.int64)) != 0)
        numbers = np.empty(len(keys), np.int32)
        numbers[order] = np.cumsum(new, dtype=np.int32) - np.int32(1)
        self._class_node: I32 = nodes[order][new]
        self._class_end: I32 = ends[order][new].astype(np.int32)
        self.lengths: I32 = depth[order][new] + np.int32(2)
        self._slots, self._slot_number = _slots(len(keys)), np.zeros(_size(len(keys)), np.int32)
        number_keys(keys, numbers, self._slots, self._slot_number)


def _letters(run: Run, words: WordTree, with_objects: bool) -> tuple[list[str], I32]:
    """How letters are spelled, and the letter of each word: int32 (words)."""
    spellings: list[str] = []
    of_event = np.zeros(256, np.int32)
    for event in run.tables["events"].to_pylist():
        spelling = event["type"] + (event["scattering"] or "")
        if spelling not in spellings:
            spellings.append(spelling)
        of_event[event["key"]] = spellings.index(spelling)
    letters = of_event[words.event] * np.int32(_OBJECTS)
    return spellings, letters + words.object if with_objects else letters


def _ends(emitters: list[dict[str, Any]], object_names: list[str], with_objects: bool) -> tuple[list[End], I32]:
    """What may stand at the end of paths, and which of it stands there for each emitter: int32, by the emitter's key."""
    of_key: dict[int, End] = {}
    for row in emitters:
        owner = None if row["object"] is None else object_names[row["object"]]
        of_key[row["emitter"]] = row["symbol"], (row["name"] or owner or None) if with_objects else None
    ends = list(dict.fromkeys(of_key.values()))
    numbers = np.zeros(1 + max(of_key, default=0), np.int32)
    for key, end in of_key.items():
        numbers[key] = ends.index(end)
    return ends, numbers


def _size(keys: int) -> int:
    """Slots for so many keys."""
    return 1 << max(4, int(2 * keys).bit_length())


def _slots(keys: int) -> U64:
    return np.full(_size(keys), NOTHING, np.uint64)


class _Keys:
    """A set of keys that grows as it is filled."""

    def __init__(self) -> None:
        self.slots, self.used = _slots(1 << 12), 0

    def add(self, keys: U64) -> None:
        """Put keys into the set."""
        done = 0
        while True:
            done, self.used = insert_keys(keys, done, self.slots, self.used)
            if done == len(keys):
                return
            old = self.sorted()
            self.slots = _slots(4 * len(old))
            _, self.used = insert_keys(old, 0, self.slots, 0)

    def sorted(self) -> U64:
        """All keys, ascending."""
        return np.sort(self.slots[self.slots != NOTHING])


class _Strings:
    """Distinct strings of letters, as nodes of a trie. ``node_of_word``: int32 (words), -1 for words of the other side; ``nodes``: how many."""

    def __init__(self, words: WordTree, letters: I32, side: int) -> None:
        self.trie = _empty_trie(int(np.count_nonzero(words.side == side)) + LONGEST)
        self.node_of_word = np.full(len(words), -1, np.int32)
        self.node_of_word[side] = 0
        self.nodes = grow(self.trie, 1, words.order, words.parent, letters, self.node_of_word)
        self.of_words = self.nodes  # nodes that words spell; later ones join two sides

    def join(self, heads: I32, tails: I32, other: "_Strings") -> I32:
        """The node of each string ``heads`` followed by one of the other side, read backward: int32. The trie grows as needed."""
        joined = np.empty(len(heads), np.int32)
        done = 0
        while True:
            done, self.nodes = append_reversed(self.trie, self.nodes, done, heads, tails, other.trie, joined)
            if done == len(heads):
                return joined
            self._make_room()

    def _make_room(self) -> None:
        """Move to arrays of twice the size."""
        old, nodes = self.trie, self.nodes
        self.trie = _empty_trie(2 * len(old.parent))
        self.trie.parent[:nodes], self.trie.symbol[:nodes] = old.parent[:nodes], old.symbol[:nodes]
        keys = (old.parent[1:nodes].astype(np.uint64) << SYMBOL_BITS) | old.symbol[1:nodes].astype(np.uint64)
        number_keys(keys, np.arange(1, nodes, dtype=np.int32), self.trie.slots, self.trie.slot_node)

    def depths(self) -> I32:
        """The length of each node's string, by doubling the distance that is looked back: int32 (nodes)."""
        depth = (np.arange(self.nodes) > 0).astype(np.int32)
        above = self.trie.parent[: self.nodes].copy()
        while above.any():
            depth += depth[above]
            above = above[above]
        return depth

    @functools.cached_property
    def _plain(self) -> tuple[list[int], list[int]]:
        """Parents and last letters as lists, which are quick to read one by one. The trie does not grow any more."""
        return self.trie.parent[: self.nodes].tolist(), self.trie.symbol[: self.nodes].tolist()

    def spell(self, node: int) -> list[int]:
        """The letters of a node's string."""
        parent, symbol = self._plain
        letters = []
        while node > 0:
            letters.append(symbol[node])
            node = parent[node]
        return letters[::-1]


def _empty_trie(room: int) -> Trie:
    return Trie(_slots(room), np.zeros(_size(room), np.int32), np.zeros(room, np.int32), np.zeros(room, np.int32))
