"""The contract of an estimator: two kernels, how its walks start and what one bounce does.

``start(scene, samples, lanes, rays, t, n, max_depth, recording, shadow, vertices, paths) -> Counters`` gives the first n
lanes their first ray, in ``t`` how far it reaches, and connects the walks' first vertex where that is sampled.

``interact(scene, samples, lanes, rays, t, primitives, depth, max_depth, rr_depth, recording, out, shadow, vertices, paths,
words, counters) -> Counters`` advances all rays by the bounce at ``depth``, given what they met: primitive ids (-1: nothing)
and distances ``t``. Walks that go on are written to ``out``, connections to test to ``shadow``, and what is recorded to the
other buffers (``integrators.buffers``), which have room.
"""

from collections.abc import Callable
from dataclasses import dataclass

from renderer.integrators.buffers import Counters


@dataclass(frozen=True)
class Estimator:
    """The two kernels of an estimator; both return the new numbers of rows."""

    start: Callable[..., Counters]
    interact: Callable[..., Counters]
