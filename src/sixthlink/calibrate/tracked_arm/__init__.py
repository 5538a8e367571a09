"""The arm from a laser tracker: circles to axes, axes to kinematics, all points to a refined arm."""

from sixthlink.calibrate.tracked_arm.measured import TrackerData, tracker_data
from sixthlink.calibrate.tracked_arm.recipe import calibrate_arm_by_tracker
from sixthlink.calibrate.tracked_arm.sweeps import JointSweep
from sixthlink.calibrate.tracked_arm.tracked_arm import (
    PointErrors,
    RecordFinding,
    ReflectorPlace,
    TrackedArm,
    TrackedAxis,
)

__all__ = [
    "JointSweep",
    "PointErrors",
    "RecordFinding",
    "ReflectorPlace",
    "TrackedArm",
    "TrackedAxis",
    "TrackerData",
    "calibrate_arm_by_tracker",
    "tracker_data",
]
