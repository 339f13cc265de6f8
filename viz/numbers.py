"""Numbers as captions and legends say them: few digits, powers of ten as such, errors of two digits."""

import math

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PLAIN = range(-3, 6)  # powers of ten of measured numbers that are written without an exponent


def power_of_ten(exponent: int) -> str:
    """A power of ten as it is printed.

    >>> power_of_ten(-7)
    '10⁻⁷'
    """
    return "10" + str(exponent).translate(_SUPERSCRIPTS)


def number(value: float) -> str:
    """A number with three digits.

    >>> number(0.0123456), number(1234.5), number(2.5e-7), number(1e5)
    ('0.0123', '1230', '2.5·10⁻⁷', '10⁵')
    """
    if value == 0 or not math.isfinite(value):
        return f"{value:g}".replace("-", "−")
    digits, _, exponent = f"{value:.2e}".partition("e")
    power = int(exponent)
    if -3 <= power <= 3:
        return f"{float(f'{value:.3g}'):.10g}".replace("-", "−")
    mantissa = f"{float(digits):g}".replace("-", "−")
    times = "" if mantissa == "1" else "−" if mantissa == "−1" else f"{mantissa}·"
    return times + power_of_ten(power)


def measured(value: float, error: float) -> str:
    """A value and its standard error, which has two digits; the value has as many decimals.

    >>> measured(12.3456, 0.1234), measured(1234.5, 67.8), measured(3.0, 0.0)
    ('12.35 ± 0.12', '1,234 ± 68', '3')
    """
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return number(value)
    power = int(f"{error:.1e}".partition("e")[2])
    largest = max(power, int(f"{value:e}".partition("e")[2]))
    if largest in _PLAIN and power >= -7:
        decimals = max(0, 1 - power)
        return f"{value:,.{decimals}f} ± {error:,.{decimals}f}"
    decimals = max(0, largest - power + 1)
    return f"({value / 10.0**largest:.{decimals}f} ± {error / 10.0**largest:.{decimals}f}) × {power_of_ten(largest)}"


def percent(share: float) -> str:
    """A share in percent.

    >>> percent(0.624), percent(0.0123), percent(0.00042)
    ('62 %', '1.2 %', '0.042 %')
    """
    value = 100 * share
    return f"{value:.0f} %" if abs(value) >= 9.95 else f"{value:.2g} %"


def share_of(share: float, error: float) -> str:
    """A share in percent and its standard error, with the decimals that the error is worth.

    >>> share_of(0.6243, 0.0098), share_of(0.05, 0.0012), share_of(0.05, 0)
    ('62 ± 1 %', '5.0 ± 0.1 %', '5 %')
    """
    if not error > 0:
        return percent(share)
    decimals = min(6, max(0, -int(f"{100 * error:.0e}".partition("e")[2])))
    return f"{100 * share:.{decimals}f} ± {100 * error:.{decimals}f} %"


def count(found: int, one: str, many: str = "") -> str:
    """So many of something.

    >>> count(1, "arrival"), count(12345, "arrival")
    ('1 arrival', '12,345 arrivals')
    """
    return f"{found:,} {one if found == 1 else many or one + 's'}"
