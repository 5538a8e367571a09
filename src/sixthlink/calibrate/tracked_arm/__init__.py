"""The arm from a laser tracker: circles to axes, axes to kinematics, all points to a refined arm."""

from sixthlink.calibrate.tracked_arm.measured import TrackerData, needed_joints, tracker_data
from sixthlink.calibrate.tracked_arm.recipe import calibrate_arm_by_tracker
from sixthlink.calibrate.tracked_arm.sweeps import JointSweep
from sixthlink.calibrate.tracked_arm.tracked_arm import (
    PointErrors,
    RecordFinding,
    ReflectorPlace,
    TrackedArm,
    TrackedAxis,
)
from sixthlink.calibrate.tracked_arm.wrong_points import points_of_the_same_arm, wrong_points

__all__ = [
    "JointSweep",
    "PointErrors",
    "RecordFinding",
    "ReflectorPlace",
    "TrackedArm",
    "TrackedAxis",
    "TrackerData",
    "calibrate_arm_by_tracker",
    "needed_joints",
    "points_of_the_same_arm",
    "tracker_data",
    "wrong_points",
]
