"""The tracker: points of a reflector while one joint turns, and the joint's axis that they show."""

from sixthlink.calibrate.tracker.axis import AxisFit, axis_covariance, circle_covariance, fit_axis
from sixthlink.calibrate.tracker.drift import TrackerMotion, drift_findings, tracker_motion
from sixthlink.calibrate.tracker.findings import CircleFinding, NoCircleError, degrees, millimetres
from sixthlink.calibrate.tracker.sweep import Sweep, sweep_of
from sixthlink.calibrate.tracker.turning import Turning, arc_of

__all__ = [
    "AxisFit",
    "CircleFinding",
    "NoCircleError",
    "Sweep",
    "TrackerMotion",
    "Turning",
    "arc_of",
    "axis_covariance",
    "circle_covariance",
    "degrees",
    "drift_findings",
    "fit_axis",
    "millimetres",
    "sweep_of",
    "tracker_motion",
]
