"""An automaton run along walks: at each vertex, whether the walk so far, ended there, is a word of the expression."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.vertices import DEAD, Vertices, read

I32 = npt.NDArray[np.int32]
U8 = npt.NDArray[np.uint8]
Chosen = npt.NDArray[np.bool_]


class WalkAutomaton(NamedTuple):
    """An automaton that reads walks from their beginning. ``places`` are the 2^k combinations of bits of a vertex and of the segment that led to it.

    ``symbols``: int32 (events, objects, places), -1 for what the run has not; ``starts``: int32 (kinds of beginnings, places), the state after
    the emitter or the camera, -1 where none can be; ``accepted``: (states, places), whether the word may end with a receiver there.
    A vertex is read with its own bits under ``own`` and with those of the next row, which the next segment set, under ``onward``; a receiver is
    read with its own bits under ``receiving``.
    """

    symbols: I32
    starts: I32
    transitions: npt.NDArray[np.int32]
    accepted: Chosen
    own: np.uint8
    onward: np.uint8
    receiving: np.uint8


@kernel
def fold_arrivals(automaton: WalkAutomaton, depth: U8, vertices: Vertices, beginning: I32, chosen: Chosen) -> None:
    """Whether the automaton accepts what arrives at each vertex. Rows are in the order of (walk, depth).

    ``beginning``: for rows of depth 0, the row of ``automaton.starts``; one entry alone: all walks begin alike, recorded or not.
    """
    alike = len(beginning) == 1
    state = DEAD
    for i in range(len(depth)):
        chosen[i] = False
        if depth[i] == 0:
            continue
        here = vertices.bits[i]
        before = vertices.bits[i - 1] if i > 0 else np.uint8(0)
        bits = (before & automaton.own) | (here & automaton.onward)
        if depth[i] > 1:
            state = read(automaton.symbols, automaton.transitions, state, vertices.event[i - 1], vertices.object[i - 1], bits)
        elif alike:
            state = automaton.starts[0, bits]
        elif i > 0 and depth[i - 1] == 0:
            state = automaton.starts[beginning[i - 1], bits]
        else:
            state = DEAD
        chosen[i] = state >= 0 and automaton.accepted[state, here & automaton.receiving]


@kernel
def keep_reached(depth: U8, inside: Chosen, chosen: Chosen) -> None:
    """Keep of ``chosen`` the vertices whose walk has been ``inside`` at a vertex by then, its own included."""
    reached = False
    for i in range(len(depth)):
        if depth[i] <= 1:
            reached = False
        if depth[i] >= 1 and inside[i]:
            reached = True
        if not reached:
            chosen[i] = False
