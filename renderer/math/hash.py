"""Integer hashes: the source of every random number, and of the words of walks.

All constants carry their width, since numba would turn a product of mixed widths into float64.
"""

from typing import Any

import numpy as np

from renderer.kernel import kernel

Index = int | np.signedinteger[Any]
"""An integer as kernels pass it: Python's or numpy's."""

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
MIX_2 = np.uint64(0x94D049BB133111EB)
S27, S30, S31, S32 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(32)
LOW_32 = np.uint64(0xFFFFFFFF)


@kernel
def mix64(x: np.uint64) -> np.uint64:
    """A bijection of 64 bits whose output bits each depend on all input bits (steele2014, the finalizer of SplitMix)."""
    x = (x ^ (x >> S30)) * MIX_1
    x = (x ^ (x >> S27)) * MIX_2
    return x ^ (x >> S31)


@kernel
def extend_word(word: np.uint64, event: Index, object_id: Index) -> np.uint64:
    """The rolling hash of a walk's prefix, longer by one event at one object."""
    symbol = (np.uint64(event) << S32) | np.uint64(object_id)
    return mix64((word + GOLDEN) ^ (symbol * MIX_1))
