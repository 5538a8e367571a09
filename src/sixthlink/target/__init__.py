"""What we look at: calibration targets (one file per kind) and the length standard."""

from sixthlink.target.length_standard import LengthStandard
from sixthlink.target.target import Found, GreyImage, NotFound, Target

__all__ = ["Found", "GreyImage", "LengthStandard", "NotFound", "Target"]
