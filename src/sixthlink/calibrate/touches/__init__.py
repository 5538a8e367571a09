"""An arm from touches of fixed points alone, and lengths that it reads by touching."""

from sixthlink.calibrate.touches.arm_calibration import ArmCalibration, FixedPoint, HeldOutTouches, TouchEvidence
from sixthlink.calibrate.touches.reading import Reading, length_under, read_gauge, unreadable
from sixthlink.calibrate.touches.recipe import calibrate_arm, touches_of
from sixthlink.calibrate.touches.sockets import Touches

__all__ = [
    "ArmCalibration",
    "FixedPoint",
    "HeldOutTouches",
    "Reading",
    "TouchEvidence",
    "Touches",
    "calibrate_arm",
    "length_under",
    "read_gauge",
    "touches_of",
    "unreadable",
]
