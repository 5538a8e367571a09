"""How far off was a calibration on shots that it has not seen?"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["HeldOut"]


@dataclass(frozen=True)
class HeldOut:
    """Error on shots that were kept out of the fit.

    Attributes:
        shots: How many.
        rms_translation_m: RMS distance of their target to its placement [m].
        rms_rotation_rad: RMS angle [rad].
    """

    shots: int
    rms_translation_m: float
    rms_rotation_rad: float
