"""Primary samples: random numbers as a pure function of seed, walk and dimension (thesis 5.11.7's primary sample space).

Counter-based numbers make any subset of walks, in any order and on any number of threads, reproduce its rows bit for bit.
Dimensions are fixed by depth and purpose, so a walk that ends early leaves the others' numbers alone.

``independent`` hashes (walk, dimension). ``sobol`` draws the leading pairs from a shuffled, Owen-scrambled Sobol'
sequence for each pixel (owen1995, burley2020) and hashes the rest. Passes go to R independent scramblings in turn
(replicate = pass mod R, index = pass div R), so that a standard error can be computed from R independent estimates.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernel import kernel
from renderer.math.hash import GOLDEN, LOW_32, S32, mix64
from renderer.settings import TraceSettings

# Dimensions: two numbers each. The walk's start, then one block for each depth.
FILM, LENS = 0, 1  # camera walks
EMITTER_CHOICE, EMISSION_POINT, EMISSION_DIRECTION, LENS_OF_EMITTER = 0, 1, 2, 3  # light walks
FIRST_BLOCK, BLOCK = 4, 4
DIRECT_POINT, DIRECT_CHOICE, DIRECTION, LOBE_ROULETTE = 0, 1, 2, 3  # within a block; DIRECT_POINT is the lens for light walks

SOBOL_DIMENSIONS = 8  # the walk's start and its first depth, where stratification pays; later dimensions are hashed

S8, S40 = np.uint64(8), np.uint64(40)
MASK_24 = np.uint64(0xFFFFFF)
TO_FLOAT = np.float32(2.0**-24)


class PrimarySamples(NamedTuple):
    """What a kernel needs to draw numbers; ``sobol`` is None or True, which kernels are specialized on."""

    seed: Any  # uint64
    walks_per_pass: Any  # uint64
    replicates: Any  # uint64
    sobol: bool | None


def primary_samples(settings: TraceSettings) -> PrimarySamples:
    """The numbers that a render with these settings draws."""
    sobol = True if settings.sampler == "sobol" else None
    return PrimarySamples(np.uint64(settings.seed), np.uint64(settings.walks_per_pass), np.uint64(settings.replicates), sobol)


class WalkSamples(NamedTuple):
    """One walk's numbers: a key for the hashed dimensions; a scramble and a point index for the Sobol' ones."""

    key: Any  # uint64
    scramble: Any  # uint64
    index: Any  # uint32


@kernel
def sobol_point(sobol: bool | None, samples: PrimarySamples, walk: np.uint64) -> tuple[np.uint64, np.uint32]:
    """The scramble of a walk's pixel and replicate, and which point of that sequence it takes."""
    if sobol is None:
        return np.uint64(0), np.uint32(0)
    number = walk // samples.walks_per_pass
    pixel = walk - number * samples.walks_per_pass
    index = number // samples.replicates
    replicate = number - index * samples.replicates
    return mix64(mix64(samples.seed + GOLDEN) ^ ((pixel * samples.replicates + replicate) * GOLDEN)), np.uint32(index)


@kernel
def walk_samples(samples: PrimarySamples, walk: np.uint64) -> WalkSamples:
    """What all numbers of a walk derive from."""
    scramble, index = sobol_point(samples.sobol, samples, walk)
    return WalkSamples(mix64(mix64(samples.seed + GOLDEN) ^ (walk * GOLDEN)), scramble, index)


@kernel
def hashed_pair(key: np.uint64, dimension: int) -> tuple[np.float32, np.float32]:
    """Two independent uniform numbers of [0, 1), multiples of 2^-24 (so float32 never rounds up to 1)."""
    bits = mix64(key + np.uint64(dimension + 1) * GOLDEN)
    return np.float32(np.uint32(bits >> S40)) * TO_FLOAT, np.float32(np.uint32((bits >> S8) & MASK_24)) * TO_FLOAT


@kernel
def reverse_bits(x: np.uint32) -> np.uint32:
    """The 32 bits in opposite order."""
    x = np.uint32((x >> np.uint32(1)) & np.uint32(0x55555555)) | np.uint32((x & np.uint32(0x55555555)) << np.uint32(1))
    x = np.uint32((x >> np.uint32(2)) & np.uint32(0x33333333)) | np.uint32((x & np.uint32(0x33333333)) << np.uint32(2))
    x = np.uint32((x >> np.uint32(4)) & np.uint32(0x0F0F0F0F)) | np.uint32((x & np.uint32(0x0F0F0F0F)) << np.uint32(4))
    x = np.uint32((x >> np.uint32(8)) & np.uint32(0x00FF00FF)) | np.uint32((x & np.uint32(0x00FF00FF)) << np.uint32(8))
    return np.uint32(x >> np.uint32(16)) | np.uint32(x << np.uint32(16))


@kernel
def nested_permutation(x: np.uint32, seed: np.uint32) -> np.uint32:
    """A bijection in which each bit depends on lower bits only: Owen scrambling of reversed digits (laine2011, vegdahl2021)."""
    x = np.uint32(x ^ np.uint32(x * np.uint32(0x3D20ADEA)))
    x = np.uint32(x + seed)
    x = np.uint32(x * np.uint32((seed >> np.uint32(16)) | np.uint32(1)))
    x = np.uint32(x ^ np.uint32(x * np.uint32(0x05526C56)))
    return np.uint32(x ^ np.uint32(x * np.uint32(0x53A22864)))


@kernel
def sobol_second(x: np.uint32) -> np.uint32:
    """Digits of the second Sobol' coordinate of index x, in reverse: the Pascal matrix mod 2 as sums over supersets."""
    x = np.uint32(x ^ ((x >> np.uint32(1)) & np.uint32(0x55555555)))
    x = np.uint32(x ^ ((x >> np.uint32(2)) & np.uint32(0x33333333)))
    x = np.uint32(x ^ ((x >> np.uint32(4)) & np.uint32(0x0F0F0F0F)))
    x = np.uint32(x ^ ((x >> np.uint32(8)) & np.uint32(0x00FF00FF)))
    return np.uint32(x ^ ((x >> np.uint32(16)) & np.uint32(0x0000FFFF)))


@kernel
def sobol_pair(index: np.uint32, key: np.uint64) -> tuple[np.float32, np.float32]:
    """Point of a shuffled and Owen-scrambled two-dimensional Sobol' sequence; the key picks shuffle and scrambles."""
    shuffle = np.uint32(key & LOW_32)
    other = mix64(key + GOLDEN)
    x = reverse_bits(nested_permutation(reverse_bits(index), shuffle))
    a = reverse_bits(nested_permutation(x, np.uint32(other & LOW_32)))
    b = reverse_bits(nested_permutation(sobol_second(x), np.uint32(other >> S32)))
    return np.float32(np.uint32(a >> np.uint32(8))) * TO_FLOAT, np.float32(np.uint32(b >> np.uint32(8))) * TO_FLOAT


@kernel
def leading_pair(sobol: bool | None, walk: WalkSamples, dimension: int) -> tuple[np.float32, np.float32]:
    """A pair of the Sobol' dimensions where they are in use, else hashed."""
    if sobol is None:
        return hashed_pair(walk.key, dimension)
    if dimension >= SOBOL_DIMENSIONS:
        return hashed_pair(walk.key, dimension)
    return sobol_pair(walk.index, mix64(walk.scramble + np.uint64(dimension + 1) * GOLDEN))


@kernel
def sample_pair(samples: PrimarySamples, walk: WalkSamples, dimension: int) -> tuple[np.float32, np.float32]:
    """Two numbers of [0, 1): the pair of one dimension of one walk; ``walk`` comes from ``walk_samples``."""
    return leading_pair(samples.sobol, walk, dimension)


@kernel
def block_dimension(depth: int, purpose: int) -> int:
    """The dimension of a purpose at a depth (1, 2, …)."""
    return FIRST_BLOCK + (depth - 1) * BLOCK + purpose
