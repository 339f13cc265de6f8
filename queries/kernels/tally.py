"""Sums of contributions by class and by independent unit, and moments of walks by class."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from queries.kernel import kernel
from queries.kernels.tries import mix

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]
ROWS, WALKS, X, X2, X4, LARGEST = 0, 1, 2, 3, 4, 5  # columns of moments


class UnitRule(NamedTuple):
    """Which unit a walk is of: (walk // ``each``) modulo ``units``; where ``turned`` is 1, after a hashed rotation of each block of ``units``."""

    each: int
    units: int
    turned: int


@kernel
def unit_of(walk: np.uint64, rule: UnitRule) -> np.int64:
    """The unit of a walk."""
    number, count = walk // np.uint64(rule.each), np.uint64(rule.units)
    if rule.turned:
        number += mix(number // count + np.uint64(1)) % count
    return np.int64(number % count)


@kernel
def fill_units(walks: npt.NDArray[np.unsignedinteger], rule: UnitRule, units: I32) -> None:
    """The unit of each walk."""
    for i in range(len(walks)):
        units[i] = unit_of(np.uint64(walks[i]), rule)


def units_of(walks: npt.NDArray[np.unsignedinteger], rule: UnitRule) -> I32:
    """The unit of each walk: int32 (walks)."""
    units = np.empty(len(walks), np.int32)
    fill_units(walks, rule, units)
    return units


@kernel
def tally(
    walks: npt.NDArray[np.unsignedinteger],
    classes: I32,
    r: F32,
    g: F32,
    b: F32,
    weights: tuple[float, float, float],
    rule: UnitRule,
    sums: F64,
    moments: F64,
) -> None:
    """Add rows, those of one walk one after another, to ``sums`` (classes, units) and ``moments`` (classes, 6). Rows of class -1 are left out."""
    first, rows = 0, len(walks)
    while first < rows:
        last = first + 1
        while last < rows and walks[last] == walks[first]:
            last += 1
        unit = unit_of(np.uint64(walks[first]), rule)
        for i in range(first, last):
            number = classes[i]
            if number < 0:
                continue
            # All rows of this walk and class are one sample, which is added at the first of them
            x, count, earlier = 0.0, 0, 0
            for j in range(first, last):
                if classes[j] == number:
                    earlier += j < i
                    count += 1
                    x += weights[0] * np.float64(r[j]) + weights[1] * np.float64(g[j]) + weights[2] * np.float64(b[j])
            if earlier == 0:
                sums[number, unit] += x
                _add(moments, number, count, x)
        first = last


@kernel
def _add(moments: F64, number: np.int32, count: int, x: float) -> None:
    square = x * x
    moments[number, ROWS] += count
    moments[number, WALKS] += 1.0
    moments[number, X] += x
    moments[number, X2] += square
    moments[number, X4] += square * square
    moments[number, LARGEST] = max(moments[number, LARGEST], x)
