"""Which units may a file speak, and how many metres or radians is one of them?

Inside the package every length is in metres and every angle in radians; only the floors that read files or
write for people call this module.
"""

from __future__ import annotations

import math

__all__ = ["ANGLE_UNITS", "DEG", "LENGTH_UNITS", "MM"]

MM = 1e-3
"""One millimetre in metres."""

DEG = math.pi / 180.0
"""One degree in radians."""

LENGTH_UNITS: dict[str, float] = {"m": 1.0, "cm": 1e-2, "mm": MM, "um": 1e-6, "in": 25.4e-3}
"""Metres per unit of length that a file may declare."""

ANGLE_UNITS: dict[str, float] = {"rad": 1.0, "mrad": 1e-3, "deg": DEG}
"""Radians per unit of angle that a file may declare."""
