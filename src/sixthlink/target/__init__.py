"""What we look at: calibration targets (one file per kind) and the length standard with its marks."""

from collections.abc import Callable
from typing import Any

from sixthlink.target.april_grid import AprilGrid
from sixthlink.target.charuco import Charuco
from sixthlink.target.chessboard import Chessboard
from sixthlink.target.circle_grid import AsymmetricCircleGrid, CircleGrid
from sixthlink.target.dot_grid import DotGrid
from sixthlink.target.drawing import Drawing
from sixthlink.target.length_standard import SOCKET, LengthStandard
from sixthlink.target.marker_chessboard import MarkerChessboard
from sixthlink.target.quadrant import find_quadrant_mark
from sixthlink.target.tag_bundle import TagBundle
from sixthlink.target.target import Found, GreyImage, NotFound, Target, turn_names

__all__ = [
    "MARK_FINDERS",
    "SOCKET",
    "TARGET_KINDS",
    "AprilGrid",
    "AsymmetricCircleGrid",
    "Charuco",
    "Chessboard",
    "CircleGrid",
    "DotGrid",
    "Drawing",
    "Found",
    "GreyImage",
    "LengthStandard",
    "MarkerChessboard",
    "NotFound",
    "TagBundle",
    "Target",
    "find_quadrant_mark",
    "turn_names",
]

TARGET_KINDS: dict[str, type[Any]] = {
    "chessboard": Chessboard,
    "marker-chessboard": MarkerChessboard,
    "charuco": Charuco,
    "circle-grid": CircleGrid,
    "asymmetric-circle-grid": AsymmetricCircleGrid,
    "dot-grid": DotGrid,
    "april-grid": AprilGrid,
    "tag-bundle": TagBundle,
}
"""Class of each target kind, by the name that ``recording.yaml`` gives it."""

MARK_FINDERS: dict[str, Callable[[GreyImage], Found | NotFound]] = {"quadrant": find_quadrant_mark}
"""How each kind of end mark of a length standard is found, by the name in ``recording.yaml``."""
