"""The uniform numbers that samples are drawn by, in whole numbers of plain Python (steele2014)."""

MASK = 2**64 - 1
GOLDEN = 0x9E3779B97F4A7C15


def mix(x: int) -> int:
    """SplitMix64's finalizer."""
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & MASK
    return x ^ (x >> 31)


def uniform(seed: int, owner: int, path: int) -> float:
    """The number in (0, 1] of one path of a walk."""
    stream = mix(mix((seed + GOLDEN) & MASK) ^ owner)
    return ((mix((stream + GOLDEN * (path + 1)) & MASK) >> 11) + 1) * 2.0**-53
