"""Paths matched by their words: distinct words are folded once, each path looks its own up.

The forward automaton runs over the tree of camera words, the backward automaton, whose states are sets of forward states, from the
last events over the tree of light words; a path is matched where its camera word's state is in its light word's set.
"""

import numpy as np
import numpy.typing as npt

from queries.kernels.match import match_both_words, match_camera_words
from queries.lpe import Expression
from queries.lpe.dfa import last_symbols, read_backward
from queries.lpe.limits import Work
from queries.lpe.nfa import bits
from queries.run import Run
from queries.shards import Piece
from queries.symbols import Ends, Symbols
from queries.word_tree import CAMERA, LIGHT, WordTree

I32 = npt.NDArray[np.int32]
Chosen = npt.NDArray[np.bool_]


class WordMatcher:
    """An expression without places, folded over a run's words. ``tables``: what it reads of a piece beside the paths."""

    tables: tuple[str, ...] = ()

    def __init__(self, run: Run, expression: Expression, symbols: Symbols) -> None:
        self._tree, self._ends, dfa = run.words, Ends(run, symbols), expression.dfa
        symbol = word_symbols(self._tree, symbols)
        start = int(dfa.transitions[0, symbols.camera[0]])
        self._states = self._tree.fold(dfa.transitions, symbol, CAMERA, start)
        self._light_states: npt.NDArray[np.int32] | None = None
        backward = read_backward(dfa, Work()) if run.light_words else last_symbols(dfa)
        after = np.array(backward.after, np.int32)[self._ends.symbols[:, 0]]
        self._accepted = np.zeros((dfa.states, len(backward.sets)), np.bool_)
        for number, states in enumerate(backward.sets):
            self._accepted[list(bits(states)), number] = True
        if run.light_words:
            starts, suffixes = np.unique(after, return_inverse=True)
            self._light_states = np.stack([self._tree.fold(backward.transitions, symbol, LIGHT, int(first)) for first in starts])
            after = suffixes.astype(np.int32).ravel()
        self._suffixes: I32 = after
        self._matched_words = None
        if self._light_states is None and len(after) == 1:
            # One kind of last event: the word alone decides. Row -1, of words that the run does not know, is the last
            self._matched_words = np.append((self._states >= 0) & self._accepted[self._states, after[0]], False)

    def select(self, piece: Piece, table: str) -> Chosen:
        """Whether each row is matched: bool (rows)."""
        words = word_rows(self._tree, piece, table, "camera")
        if self._matched_words is not None:
            return self._matched_words[words]
        matched, ends = np.empty(piece.rows(table), np.bool_), self._ends.codes(piece, table)
        if self._light_states is None:
            match_camera_words(words, ends, self._states, self._suffixes, self._accepted, matched)
        else:
            lights = word_rows(self._tree, piece, table, "light")
            match_both_words(words, lights, ends, self._states, self._suffixes, self._light_states, self._accepted, matched)
        return matched


def word_symbols(tree: WordTree, symbols: Symbols) -> I32:
    """The symbol of each word's last letter: int32 (words); 0 for the roots."""
    table = symbols.interactions(tree.event[2:], tree.object[2:])[:, :, 0]
    letters = np.zeros(len(tree), np.int32)
    letters[2:] = table[tree.event[2:], np.minimum(tree.object[2:], table.shape[1] - 1)]
    return letters


def word_rows(tree: WordTree, piece: Piece, table: str, side: str) -> I32:
    """The row of each path's camera word or light word in the tree: int32 (rows), or one for all where the run stores none."""
    if not piece.has(table, f"{side}_word"):
        return np.array([CAMERA if side == "camera" else LIGHT], np.int32)
    return piece.once(("words", table, side), lambda: tree.rows(piece.column(table, f"{side}_word")))
