"""Strings of letters as nodes of a trie, edges found by hashing; and sets of keys that number what occurs.

Tables of slots are powers of two in size and never more than half full, so that probing is short.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

I32 = npt.NDArray[np.int32]
U64 = npt.NDArray[np.uint64]
NOTHING = np.uint64(0xFFFFFFFFFFFFFFFF)  # the key of an empty slot
NONE = np.int32(-1)
LONGEST = 256  # letters that a string of one walk may have
SYMBOL_BITS = np.uint64(24)
ONE = np.uint64(1)
S30, S31 = np.uint64(30), np.uint64(31)
MIX_1, MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


class Trie(NamedTuple):
    """Node n > 0 is string ``parent[n]`` longer by letter ``symbol[n]``; node 0 is the empty string. An edge's key is ``parent << 24 | symbol``.

    ``slots``: uint64, keys of edges; ``slot_node``: int32, the node that each leads to.
    """

    slots: U64
    slot_node: I32
    parent: I32
    symbol: I32


@kernel
def mix(x: np.uint64) -> np.uint64:
    """A bijection of 64 bits whose output bits each depend on all input bits (steele2014)."""
    x = (x ^ (x >> S30)) * MIX_1
    x = (x ^ (x >> np.uint64(27))) * MIX_2
    return x ^ (x >> S31)


@kernel
def slot_of(key: np.uint64, slots: U64) -> np.uint64:
    """Where a key is, or the empty slot where it would go."""
    mask = np.uint64(len(slots) - 1)
    slot = mix(key) & mask
    while slots[slot] != NOTHING and slots[slot] != key:
        slot = (slot + ONE) & mask
    return slot


@kernel
def insert_keys(keys: U64, first: int, slots: U64, used: int) -> tuple[int, int]:
    """Put keys into a set that holds ``used`` of them.

    Returns the first key for which there is no room (or how many keys there are), and how many the set holds now.
    """
    i = first
    while i < len(keys):
        slot = slot_of(keys[i], slots)
        if slots[slot] == NOTHING:
            if 2 * (used + 1) > len(slots):
                return i, used
            slots[slot] = keys[i]
            used += 1
        i += 1
    return i, used


@kernel
def number_keys(keys: U64, numbers: I32, slots: U64, slot_number: I32) -> None:
    """Give distinct keys their numbers, in slots with room for all of them."""
    for i in range(len(keys)):
        slot = slot_of(keys[i], slots)
        slots[slot] = keys[i]
        slot_number[slot] = numbers[i]


@kernel
def find_numbers(keys: U64, slots: U64, slot_number: I32, numbers: I32) -> None:
    """The number of each key; -1 for a key that has none."""
    for i in range(len(keys)):
        slot = slot_of(keys[i], slots)
        numbers[i] = NONE if slots[slot] == NOTHING else slot_number[slot]


@kernel
def child(trie: Trie, node: np.int32, letter: np.int32, nodes: int) -> np.int32:
    """The node of a string longer by one letter: ``nodes`` itself, written as a new one, where no such node is known."""
    key = (np.uint64(node) << SYMBOL_BITS) | np.uint64(letter)
    slot = slot_of(key, trie.slots)
    if trie.slots[slot] == NOTHING:
        trie.slots[slot] = key
        trie.slot_node[slot] = nodes
        trie.parent[nodes] = node
        trie.symbol[nodes] = letter
    return np.int32(trie.slot_node[slot])


@kernel
def grow(trie: Trie, nodes: int, order: I32, above: I32, letters: I32, found: I32) -> int:
    """The node of each word, prefixes (``above``) before words; ``found`` holds that of a root and -1 elsewhere. Returns how many nodes there are."""
    for i in range(len(order)):
        word = order[i]
        node = found[above[word]]
        if node >= 0:
            found[word] = child(trie, node, letters[word], nodes)
            nodes += found[word] == nodes
    return nodes


@kernel
def append_reversed(trie: Trie, nodes: int, first: int, heads: I32, tails: I32, other: Trie, joined: I32) -> tuple[int, int]:
    """The node of each head followed by a tail of another trie, read backward: as that trie's nodes are met on the way to its root.

    Returns the first pair for which there might be no room (or how many pairs there are), and how many nodes there are now.
    """
    i = first
    while i < len(heads):
        if nodes + LONGEST > len(trie.parent):
            return i, nodes
        node, tail = heads[i], tails[i]
        while tail > 0:
            node = child(trie, node, other.symbol[tail], nodes)
            nodes += node == nodes
            tail = other.parent[tail]
        joined[i] = node
        i += 1
    return i, nodes
