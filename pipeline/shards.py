"""Shards: fixed ranges of walk ids, the unit of work, of files and of resumption.

The plan is a function of the number of walks alone, so that neither threads nor interruptions can change a file.
"""

from dataclasses import dataclass

SMALLEST, LARGEST = 1 << 14, 1 << 19  # walks; a tile of the tracer at least, half a second or so of work at most
WANTED = 16  # shards of a small job, so that every core has some


@dataclass(frozen=True)
class Shard:
    """The walks ``first … first + count - 1``; ``name`` is that of its files."""

    index: int
    first: int
    count: int

    @property
    def name(self) -> str:
        """The number as files carry it."""
        return f"{self.index:05d}"


def shard_size(walks: int) -> int:
    """Walks of each shard but the last: a power of two between the bounds.

    >>> shard_size(1000), shard_size(256 * 256 * 64), shard_size(1920 * 1080 * 64)
    (16384, 262144, 524288)
    """
    size = SMALLEST
    while size < LARGEST and size * WANTED < walks:
        size *= 2
    return size


def shard_count(walks: int) -> int:
    """How many shards a job of ``walks`` walks has."""
    return -(-walks // shard_size(walks))


def plan_shards(walks: int) -> tuple[Shard, ...]:
    """All the shards of a job of ``walks`` walks, in order."""
    size = shard_size(walks)
    return tuple(Shard(i, first, min(size, walks - first)) for i, first in enumerate(range(0, walks, size)))
