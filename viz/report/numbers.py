"""Numbers as a report's tables say them: of any kind, unknown ones too, with as many digits as a reader may want to copy."""

import math
from typing import Any

from viz.numbers import power_of_ten

UNKNOWN = "–"


def number(value: Any, digits: int = 4) -> str:
    """A number with so many digits, or the whole part of one below a million; integers in full, with groups of three; unknown ones as a dash.

    >>> number(1234567), number(0.000123456), number(0.5), number(None)
    ('1,234,567', '1.235 × 10⁻⁴', '0.5', '–')
    """
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return UNKNOWN
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    text = f"{value:.{digits}g}"
    if "e" in text and not 1_000 <= abs(value) < 1e6:
        mantissa, exponent = text.split("e")
        return f"{mantissa} × {power_of_ten(int(exponent))}".replace("-", "−")
    if abs(value) >= 1_000:
        return f"{value:,.0f}".replace("-", "−")
    if 0 < abs(value) < 1e-3:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        return f"{mantissa} × {power_of_ten(int(exponent))}".replace("-", "−")
    return text.replace("-", "−")


def with_error(value: Any, error: Any) -> str:
    """A value and its standard error, both to the error's second digit.

    >>> with_error(0.274512, 0.00123), with_error(12.0, None), with_error(2.4677e10, 1.6957e10)
    ('0.2745 ± 0.0012', '12', '(2.5 ± 1.7) × 10¹⁰')
    """
    if value is None or error is None or not math.isfinite(value) or not math.isfinite(error) or error <= 0:
        return number(value)
    places = 1 - math.floor(math.log10(error))
    large = max(abs(value), error) >= 1e6
    if large or 0 < abs(value) < 1e-3:
        power = math.floor(math.log10(max(abs(value), error) if large else abs(value)))
        scale = 10.0**power
        shown = max(0, places + power)
        return f"({value / scale:.{shown}f} ± {error / scale:.{shown}f}) × {power_of_ten(power)}".replace("-", "−")
    return f"{value:,.{max(0, places)}f} ± {error:,.{max(0, places)}f}".replace("-", "−")


def percent(share: Any, digits: int = 3) -> str:
    """A share 0 … 1 in percent.

    >>> percent(0.56104), percent(0.05), percent(0.0012345), percent(0.0000021)
    ('56.1 %', '5.00 %', '0.123 %', '< 0.001 %')
    """
    if share is None or math.isnan(share):
        return UNKNOWN
    if 0 < share < 1e-5:
        return "< 0.001 %"
    shown = 100 * share
    if 0 < abs(shown) < 1:
        return f"{shown:.{digits}f} %".replace("-", "−")
    return f"{shown:,.{max(0, digits - len(str(int(abs(shown)))))}f} %".replace("-", "−")


def size(count: float) -> str:
    """Bytes in decimal units.

    >>> size(1_288_870_008), size(512)
    ('1.29 GB', '512 bytes')
    """
    for unit, one in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= one:
            return f"{count / one:.3g} {unit}"
    return f"{count:,.0f} bytes"


def seconds(value: float) -> str:
    """A length of time.

    >>> seconds(0.0187), seconds(9.2972), seconds(754.0)
    ('19 ms', '9.3 s', '12 min 34 s')
    """
    if value < 0.1:
        return f"{1000 * value:.0f} ms" if value >= 0.001 else "< 1 ms"
    if value < 120:
        return f"{value:.1f} s"
    return f"{int(value) // 60} min {int(value) % 60} s"
