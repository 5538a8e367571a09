"""The calibrated robot as a measuring machine: points in the base frame and the length check."""

from sixthlink.measure.length_check import LengthCheck, LengthStatistics, lengths_of_placements, statistics
from sixthlink.measure.points import base_points

__all__ = [
    "LengthCheck",
    "LengthStatistics",
    "base_points",
    "lengths_of_placements",
    "statistics",
]
