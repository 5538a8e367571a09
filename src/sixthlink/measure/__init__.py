"""The calibrated robot as a measuring machine: points in the base frame and the length check."""

from sixthlink.measure.length_check import COVERAGE_95, LengthCheck, LengthStatistics, lengths_of_placements, statistics
from sixthlink.measure.length_uncertainty import length_stds, uncertain_cameras
from sixthlink.measure.points import base_points

__all__ = [
    "COVERAGE_95",
    "LengthCheck",
    "LengthStatistics",
    "base_points",
    "length_stds",
    "lengths_of_placements",
    "statistics",
    "uncertain_cameras",
]
