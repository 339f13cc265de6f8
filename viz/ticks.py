"""Ticks of a scale."""

import math

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_MOST_STEPS = 1000


def ticks(low: float, high: float, logarithmic: bool = False, most: int = 6) -> list[tuple[float, float]]:
    """At most about ``most`` round values from ``low`` to ``high``, each with its place on the scale, 0 … 1: pairs (place, value), in order.

    A logarithmic scale has powers of ten, or, where they are too few, 1, 2 and 5 times them. A scale without length has its one value.

    >>> ticks(0, 1, most=3)
    [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0)]
    """
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low or (logarithmic and low <= 0):
        return [(0.5, low)]
    values = _logarithmic(low, high, most) if logarithmic else _linear(low, high, most)
    if len(values) < 2:
        values = [low, high]
    if logarithmic:
        length = math.log(high / low)
        return [(math.log(value / low) / length, value) for value in values]
    return [((value - low) / (high - low), value) for value in values]


def _linear(low: float, high: float, most: int) -> list[float]:
    """Multiples of a round step."""
    power = 10.0 ** math.floor(math.log10((high - low) / max(most - 1, 1)))
    step = next(power * factor for factor in _STEPS if (high - low) / (power * factor) <= most - 1 + 1e-9 or factor == _STEPS[-1])
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [min(max(i * step, low), high) for i in range(first, min(last, first + _MOST_STEPS) + 1)]


def _logarithmic(low: float, high: float, most: int) -> list[float]:
    """Powers of ten, or a few of their multiples."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    slack = 1 + 1e-9
    for factors in ((1, 2, 5), (1, 3), (1,)):
        values = [factor * 10.0**power for power in range(first, last + 1) for factor in factors]
        inside = [min(max(value, low), high) for value in values if low / slack <= value <= high * slack]
        if len(inside) <= most:
            return inside
    powers = [round(math.log10(value)) for value in inside]
    stride = math.ceil(len(powers) / most)
    return [value for value, power in zip(inside, powers) if (power - powers[0]) % stride == 0]
