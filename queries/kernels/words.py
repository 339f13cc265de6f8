"""Words of paths by their keys: an open-addressing table, and folds over the tree of words.

Keys are hashes already, so their low bits choose the slot.
"""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

I32 = npt.NDArray[np.int32]
U64 = npt.NDArray[np.uint64]
EMPTY = np.int32(-1)


@kernel
def fill_slots(keys: U64, slot_key: U64, slot_row: I32) -> None:
    """Put distinct keys into slots (a power of two of them, more than there are keys), all of which hold row -1 before."""
    mask = np.uint64(len(slot_key) - 1)
    for row in range(len(keys)):
        slot = keys[row] & mask
        while slot_row[slot] != EMPTY:
            slot = (slot + np.uint64(1)) & mask
        slot_key[slot] = keys[row]
        slot_row[slot] = row


@kernel
def find_rows(keys: U64, slot_key: U64, slot_row: I32, rows: I32) -> None:
    """The row of each key; -1 for a key that is not there."""
    mask = np.uint64(len(slot_key) - 1)
    for i in range(len(keys)):
        key = keys[i]
        slot = key & mask
        while slot_row[slot] != EMPTY and slot_key[slot] != key:
            slot = (slot + np.uint64(1)) & mask
        rows[i] = slot_row[slot]


@kernel
def fold(order: I32, parent: I32, symbol: I32, transitions: npt.NDArray[np.int32], states: I32) -> None:
    """The state after each word, parents first: ``states`` holds those of the roots, -1 elsewhere. A parent without a state passes that on."""
    for i in range(len(order)):
        word = order[i]
        before = states[parent[word]]
        states[word] = transitions[before, symbol[word]] if before >= 0 else EMPTY
