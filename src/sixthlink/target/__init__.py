"""What we look at: calibration targets (one file per kind) and the length standard with its marks."""

from collections.abc import Callable

from sixthlink.target.charuco import Charuco
from sixthlink.target.chessboard import Chessboard
from sixthlink.target.drawing import Drawing
from sixthlink.target.length_standard import SOCKET, LengthStandard
from sixthlink.target.quadrant import find_quadrant_mark
from sixthlink.target.target import Found, GreyImage, NotFound, Target

__all__ = [
    "MARK_FINDERS",
    "SOCKET",
    "TARGET_KINDS",
    "Charuco",
    "Chessboard",
    "Drawing",
    "Found",
    "GreyImage",
    "LengthStandard",
    "NotFound",
    "Target",
    "find_quadrant_mark",
]

TARGET_KINDS: dict[str, type[Chessboard] | type[Charuco]] = {"chessboard": Chessboard, "charuco": Charuco}
"""Class of each target kind, by the name that ``recording.yaml`` gives it."""

MARK_FINDERS: dict[str, Callable[[GreyImage], Found | NotFound]] = {"quadrant": find_quadrant_mark}
"""How each kind of end mark of a length standard is found, by the name in ``recording.yaml``."""
