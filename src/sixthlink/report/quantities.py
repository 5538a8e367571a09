"""How is a number written for a person?

Always with its unit, rounded to what it means, with a true minus sign and never a negative zero. A value that
is not finite is a dash: a page shows no number without meaning.
"""

from __future__ import annotations

import math

from sixthlink.units import DEG, MM

__all__ = ["DASH", "NOT_OBSERVED", "SPACE", "degrees", "fixed", "millimetres", "pixels", "significant", "with_std"]

DASH = "–"
NOT_OBSERVED = "not observed"
"""What is written instead of a number that the recording cannot know."""

SPACE = "\N{NO-BREAK SPACE}"


def fixed(value: float, decimals: int, *, sign: bool = False) -> str:
    """A number with a fixed count of decimals; ``sign`` also writes a plus."""
    if not math.isfinite(value):
        return DASH
    text = f"{abs(value):.{decimals}f}"
    if not text.strip("0."):
        return text
    return ("−" if value < 0 else "+" if sign else "") + text


def significant(value: float, digits: int = 4) -> str:
    """A number with a count of significant digits, as a power of ten where it is far from one."""
    if not math.isfinite(value):
        return DASH
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if -4 <= exponent < 6:
        return fixed(value, max(digits - 1 - exponent, 0))
    return f"{fixed(value / 10.0**exponent, digits - 1)}·10{_raised(exponent)}"


def millimetres(length_m: float, decimals: int = 4, *, sign: bool = False) -> str:
    """A length [m] in millimetres."""
    return fixed(length_m / MM, decimals, sign=sign) + SPACE + "mm"


def degrees(angle_rad: float, decimals: int = 4) -> str:
    """An angle [rad] in degrees."""
    return fixed(angle_rad / DEG, decimals) + "°"


def pixels(value_px: float, decimals: int = 3) -> str:
    """A distance in an image [pixel]."""
    return fixed(value_px, decimals) + SPACE + "px"


def with_std(value: float, std: float, unit: str, decimals: int) -> str:
    """A value ± its standard deviation to its second digit; with ``decimals`` where there is no deviation."""
    ending = SPACE + unit if unit else ""
    if not (math.isfinite(std) and std > 0.0):
        return fixed(value, decimals) + ending
    places = min(max(1 - math.floor(math.log10(std)), 0), 12)
    return f"{fixed(value, places)} ±{SPACE}{fixed(std, places)}{ending}"


def _raised(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
