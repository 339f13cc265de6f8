"""An automaton run along the vertices of paths: what depends on where light went, words cannot tell."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

I32 = npt.NDArray[np.int32]
I64 = npt.NDArray[np.int64]
U8 = npt.NDArray[np.uint8]
U16 = npt.NDArray[np.uint16]
Chosen = npt.NDArray[np.bool_]
DEAD = np.int32(-1)


class Vertices(NamedTuple):
    """One table of vertices: event, object, and by bits which places each is at (and which its segment crosses)."""

    event: U8
    object: U16
    bits: U8


class Prefixes(NamedTuple):
    """What paths use of walks: the row of the vertex of depth 1, how many vertices scatter light, and the lobe at the last (0: its vertex's)."""

    start: I64
    length: I32
    last: U8


class Automaton(NamedTuple):
    """``symbols``: int32 (events, objects, bits), -1 for what the run has not; ``ends``: int32 (kinds of last events, bits)."""

    symbols: npt.NDArray[np.int32]
    ends: npt.NDArray[np.int32]
    transitions: npt.NDArray[np.int32]
    accepting: Chosen
    start: np.int32


@kernel
def find_walks(path_walk: npt.NDArray[np.uint32], walk: npt.NDArray[np.uint32], depth: U8, start: I64) -> None:
    """The row of the vertex of depth 1 of each path's walk; -1 for a walk without rows. Vertices are in the order of (walk, depth)."""
    at, rows = 0, len(walk)
    for i in range(len(path_walk)):
        wanted = path_walk[i]
        if at > 0 and walk[at - 1] >= wanted:
            # Not in the order of the walks: look from the beginning, by bisection
            low, high = 0, at
            while low < high:
                middle = (low + high) // 2
                if walk[middle] < wanted:
                    low = middle + 1
                else:
                    high = middle
            at = low
        while at < rows and walk[at] < wanted:
            at += 1
        start[i] = -1
        if at < rows and walk[at] == wanted:
            start[i] = at + 1 if depth[at] == 0 else at


@kernel
def mark_used(prefixes: Prefixes, used: Chosen) -> None:
    """Mark the vertices that some path uses."""
    for i in range(len(prefixes.start)):
        row = prefixes.start[i] + prefixes.length[i] - 1
        # The longest prefix comes last: what is before a marked vertex is marked by then, or soon
        if prefixes.start[i] < 0 or row >= len(used):
            continue
        while row >= prefixes.start[i] and not used[row]:
            used[row] = True
            row -= 1


@kernel
def read(
    symbols: npt.NDArray[np.int32], transitions: npt.NDArray[np.int32], state: np.int32, event: np.uint8, thing: np.uint16, bits: np.uint8
) -> np.int32:
    """The state after one more interaction."""
    if state < 0 or event >= symbols.shape[0] or thing >= symbols.shape[1]:
        return DEAD
    symbol = symbols[event, thing, bits]
    if symbol < 0:
        return DEAD
    return np.int32(transitions[state, symbol])


@kernel
def fold_paths(
    automaton: Automaton,
    camera: Vertices,
    prefixes: Prefixes,
    light: Vertices,
    suffixes: Prefixes,
    joint_bits: U8,
    joint_mask: np.uint8,
    ends: I32,
    end_bits: U8,
    matched: Chosen,
) -> None:
    """Whether the automaton accepts each path: camera vertices outward, light vertices back to the emitter, the emitter.

    ``joint_bits``: what holds of the segment between the two walks; ``joint_mask``: the bits of a light vertex that do not belong to a segment.
    ``ends``: the kind of each path's last event, or one for all.
    """
    each = 1 if len(ends) == len(matched) else 0
    known_start, known_count, known = np.int64(-1), np.int64(0), automaton.start  # the longest prefix folded yet of the walk at hand
    for i in range(len(matched)):
        matched[i] = False
        start, count, last = prefixes.start[i], np.int64(prefixes.length[i]), prefixes.last[i]
        if count > 0 and (start < 0 or start + count > len(camera.event)):
            continue

        # ---- camera vertices, the last with the lobe that the path has there ----
        whole = count - 1 if last != 0 else count
        if start != known_start or known_count > whole:
            known_start, known_count, known = start, np.int64(0), automaton.start
        while known_count < whole:
            row = start + known_count
            known = read(automaton.symbols, automaton.transitions, known, camera.event[row], camera.object[row], camera.bits[row])
            known_count += 1
        state = known
        if whole < count:
            row = start + whole
            state = read(automaton.symbols, automaton.transitions, state, last, camera.object[row], camera.bits[row])

        # ---- light vertices, nearest to the camera first ----
        start, count, last = suffixes.start[i], np.int64(suffixes.length[i]), suffixes.last[i]
        if count > 0:
            row = start + count - 1
            if start < 0 or row >= len(light.event):
                continue
            state = read(automaton.symbols, automaton.transitions, state, last, light.object[row], (light.bits[row] & joint_mask) | joint_bits[i])
            while row > start:
                row -= 1
                state = read(automaton.symbols, automaton.transitions, state, light.event[row], light.object[row], light.bits[row])

        # ---- the emitter ----
        if state >= 0:
            matched[i] = automaton.accepting[automaton.transitions[state, automaton.ends[ends[i * each], end_bits[i]]]]
