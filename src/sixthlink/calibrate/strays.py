"""Does a shot contradict the others, where the estimate itself weighs all alike?

Eq. (11) rejects nothing. The head on which three quarters of the shots agree (:mod:`~.joint.consensus`) says how far
off each shot is; one that is many times as far as the middle one was paired or read wrongly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint.consensus import consensus
from sixthlink.units import DEG, MM

__all__ = ["stray_gate"]

TIMES_THE_MEDIAN = 20.0
"""How many times the median distance or angle a shot may be off."""

FLOOR_M, FLOOR_RAD = 1e-4, 1e-4
"""Medians below these are exact data; they do not make a shot a stray."""


def stray_gate(problem: HeadProblem, names: Sequence[str]) -> Gate:
    """Whether no shot stands far out of the others.

    Args:
        problem: The shots.
        names: Their names.
    """
    found = consensus(problem, 1.0)
    medians = (
        max(float(np.median(found.translations_m)), FLOOR_M),
        max(float(np.median(found.rotations_rad)), FLOOR_RAD),
    )
    times = np.maximum(found.translations_m / medians[0], found.rotations_rad / medians[1])
    strays = np.flatnonzero(times > TIMES_THE_MEDIAN)
    worst = (
        f"the farthest is {times.max():.1f} times as far off as the middle one; up to {TIMES_THE_MEDIAN:g} is accepted"
    )
    if len(strays) == 0:
        return Gate("no shot contradicts the others", True, worst)
    listed = ", ".join(
        f"{names[i]} ({found.translations_m[i] / MM:.3g} mm, {found.rotations_rad[i] / DEG:.3g}°)" for i in strays[:5]
    )
    more = f" and {len(strays) - 5} more" if len(strays) > 5 else ""
    cure = "look whether image, pose and target of these shots belong together, or remove their rows"
    return Gate("no shot contradicts the others", False, f"{worst}: {listed}{more}; {cure}")
