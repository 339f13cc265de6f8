"""Random samples of paths, for tests of bundles."""

import numpy as np

from queries.path_sample import PathSample
from renderer.tables import EMITTER, LENS, NO_OBJECT


def random_sample(count: int, seed: int, objects: int = 4, longest: int = 6) -> PathSample:
    """So many paths of 2 to ``longest`` vertices, in the cube from -1 to 1."""
    generator = np.random.default_rng(seed)
    start = np.concatenate([[0], np.cumsum(generator.integers(2, longest + 1, count))]).astype(np.int64)
    rows = int(start[-1])
    event = generator.choice([8, 9, 10, 13], rows).astype(np.uint8)
    thing = generator.integers(0, objects, rows).astype(np.int32)
    event[start[:-1]], event[start[1:] - 1], thing[start[1:] - 1] = EMITTER, LENS, NO_OBJECT
    return PathSample(
        start=start,
        points=generator.uniform(-1, 1, (rows, 3)).astype(np.float32),
        event=event,
        object=thing,
        owner=np.arange(count, dtype=np.int64),
        path=np.zeros(count, np.int32),
        infinite=np.zeros(count, np.bool_),
        contribution=generator.exponential(1, (count, 3)).astype(np.float32),
        raster=np.zeros((count, 2), np.float32),
        scale=np.ones(count),
        found=count,
    )


def permuted(sample: PathSample, seed: int) -> tuple[PathSample, np.ndarray]:
    """The same paths in another order, and that order."""
    order = np.random.default_rng(seed).permutation(len(sample))
    return sample.take(order), order
