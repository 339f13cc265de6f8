"""The tree of words (walk prefixes) of a run, ready to be folded over and looked up."""

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from queries.errors import RunError
from queries.kernels.words import fill_slots, find_rows, fold
from renderer.tables import CAMERA_ROOT, LIGHT_ROOT

I32 = npt.NDArray[np.int32]
U64 = npt.NDArray[np.uint64]
CAMERA, LIGHT = 0, 1  # rows of the two roots: the empty prefixes of camera walks and light walks
_ROOTS = 2


class WordTree:
    """All words, the two roots first.

    ``event``, ``object``: int32 (words), the last letter of each (0 for the roots); ``parent``: int32, the row of the prefix without it;
    ``depth``: int32, how many letters; ``order``: int32 (words - 2), all but the roots, parents before children;
    ``side``: int32, the root (``CAMERA`` or ``LIGHT``) that the word grows from.
    """

    def __init__(self, words: pa.Table) -> None:
        roots = np.array([CAMERA_ROOT, LIGHT_ROOT], np.uint64)
        self.keys: U64 = np.concatenate([roots, words["word"].to_numpy()])
        slots = 1 << max(4, int(2 * len(self.keys) - 1).bit_length())
        self._slot_key = np.zeros(slots, np.uint64)
        self._slot_row = np.full(slots, -1, np.int32)
        fill_slots(self.keys, self._slot_key, self._slot_row)
        self.event: I32 = np.concatenate([np.zeros(_ROOTS, np.int32), words["event"].to_numpy().astype(np.int32)])
        self.object: I32 = np.concatenate([np.zeros(_ROOTS, np.int32), words["object"].to_numpy().astype(np.int32)])
        self.parent: I32 = np.concatenate([np.arange(_ROOTS, dtype=np.int32), self.rows(words["parent"].to_numpy())])
        if (self.parent < 0).any():
            raise RunError("the catalogue `words` lacks the prefix of a word: run the job again with --resume")
        self.depth, self.side = self._levels()
        self.order: I32 = np.argsort(self.depth.astype(np.uint16), kind="stable").astype(np.int32)[_ROOTS:]  # 16 bits: a radix sort

    def __len__(self) -> int:
        """Number of words, the roots included."""
        return len(self.keys)

    def rows(self, keys: U64) -> I32:
        """The row of each key, int32; -1 for a key that the run does not know."""
        found = np.empty(len(keys), np.int32)
        find_rows(np.ascontiguousarray(keys, np.uint64), self._slot_key, self._slot_row, found)
        return found

    def fold(self, transitions: npt.NDArray[np.int32], symbol: I32, root: int, start: int) -> I32:
        """The state after each word that grows from ``root``, where ``start`` is the state; -1 for words of the other root. int32 (words)."""
        states = np.full(len(self), -1, np.int32)
        states[root] = start
        fold(self.order, self.parent, symbol, np.ascontiguousarray(transitions, np.int32), states)
        return states

    def _levels(self) -> tuple[I32, I32]:
        """Depth and root of each word, by doubling the distance that is looked back."""
        depth = (np.arange(len(self)) >= _ROOTS).astype(np.int32)
        above = self.parent.copy()
        while (above >= _ROOTS).any():
            depth += depth[above]
            above = above[above]
        return depth, above
