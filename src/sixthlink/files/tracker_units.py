"""Does a table speak of the units that tracker.yaml declares?

Instruments write units behind a name, ``X [mm]``, or in a row under the header. Neither replaces the declaration;
they are held against it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from sixthlink.files.tracker_numbers import looks_like_number

__all__ = ["bare_name", "is_unit_row", "unit_of_name", "unit_of_text"]

_UNITS = {
    "m": "m", "meter": "m", "metre": "m", "meters": "m", "metres": "m", "米": "m",
    "cm": "cm", "mm": "mm", "millimeter": "mm", "millimeters": "mm", "millimetre": "mm", "millimetres": "mm",
    "毫米": "mm", "um": "um", "µm": "um", "μm": "um", "in": "in", "inch": "in", "inches": "in", "zoll": "in",
    "ft": "ft", "feet": "ft", "rad": "rad", "radian": "rad", "radians": "rad", "mrad": "mrad", "deg": "deg",
    "degree": "deg", "degrees": "deg", "grad": "grad", "gon": "gon", "°": "deg", "度": "deg", "弧度": "rad",
    "s": "s", "sec": "s", "ms": "ms", "us": "us", "µs": "us", "μs": "us",
}  # fmt: skip
"""Units by the ways in which they are written, in small letters."""

_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*)\))\s*$")
_BEHIND = re.compile(r"^(?P<name>.*?)[\s_/,]+(?P<a>mm|cm|um|µm|μm|inch|deg|rad|mrad)$", re.IGNORECASE)


def unit_of_text(text: str) -> str | None:
    """Unit that a cell names, for example ``[mm]``; None when it names none."""
    return _UNITS.get(text.strip().strip("[]()").strip().lower())


def unit_of_name(name: str) -> str | None:
    """Unit behind a column's name, as in ``X [mm]`` and ``x_mm``; None when there is none."""
    if match := _IN_BRACKETS.match(name):
        return unit_of_text(match["a"] or match["b"] or "")
    return unit_of_text(match["a"]) if (match := _BEHIND.match(name)) else None


def bare_name(name: str) -> str:
    """A column's name without a unit behind it."""
    match = _IN_BRACKETS.match(name) or _BEHIND.match(name)
    return match["name"] if match and unit_of_name(name) is not None else name


def is_unit_row(cells: Sequence[str], numbers: Sequence[int]) -> bool:
    """Whether a row gives units: no number where numbers belong, and at least one unit."""
    inside = [cells[k].strip() for k in numbers if k < len(cells)]
    return any(unit_of_text(c) for c in inside) and not any(looks_like_number(c) for c in inside)
