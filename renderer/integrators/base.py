"""The contract of an estimator: how its walks start, and what one bounce does."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from renderer.integrators.buffers import Counters, TileBuffers


class Estimator(Protocol):
    """Both steps fill the tile's buffers and return the new numbers of rows."""

    def start(self, buffers: TileBuffers, n: int, recording: bool) -> Counters:
        """Start the first n lanes' walks: rays to follow, and connections of the walks' first vertex where it is sampled."""

    def interact(
        self, buffers: TileBuffers, t: npt.NDArray[np.float32], primitives: npt.NDArray[np.int32], depth: int, recording: bool, counters: Counters
    ) -> Counters:
        """Advance all rays by the bounce at ``depth``, given what they met: primitive ids (-1: nothing) and distances."""
