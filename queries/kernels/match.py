"""Whether a path's word is accepted: its camera word's state meets its light word's."""

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel

I32 = npt.NDArray[np.int32]


@kernel
def match_camera_words(words: I32, ends: I32, states: I32, suffixes: I32, accepted: npt.NDArray[np.bool_], matched: npt.NDArray[np.bool_]) -> None:
    """Paths of camera walks alone. ``words``: the row of each path's word; ``ends``: each path's last event, or one for all of them.

    ``states``: after each word; ``suffixes``: the backward state after each kind of last event; ``accepted``: (states, backward states).
    """
    each = 1 if len(ends) == len(words) else 0
    for i in range(len(words)):
        word = words[i]
        matched[i] = word >= 0 and states[word] >= 0 and accepted[states[word], suffixes[ends[i * each]]]


@kernel
def match_both_words(
    words: I32,
    light_words: I32,
    ends: I32,
    states: I32,
    suffixes: I32,
    light_states: npt.NDArray[np.int32],
    accepted: npt.NDArray[np.bool_],
    matched: npt.NDArray[np.bool_],
) -> None:
    """Paths that use light walks, and camera walks too or none (``words`` has one entry for all of them then).

    ``suffixes``: for each kind of last event, the row of ``light_states`` (kinds, words), which holds the backward state after each light word.
    """
    each, end_each = 1 if len(words) == len(light_words) else 0, 1 if len(ends) == len(light_words) else 0
    for i in range(len(light_words)):
        word, light = words[i * each], light_words[i]
        if word < 0 or light < 0:
            matched[i] = False
            continue
        state, suffix = states[word], light_states[suffixes[ends[i * end_each]], light]
        matched[i] = state >= 0 and suffix >= 0 and accepted[state, suffix]
