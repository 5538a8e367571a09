"""What is the length standard, and how well is it certified?"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SOCKET", "LengthStandard"]

SOCKET = "socket"
"""Mark of a standard whose ends are touched, not seen: a ball on the flange comes to rest in it."""


@dataclass(frozen=True)
class LengthStandard:
    """A bar with two marked ends (the paper's ruler of 1234.15 mm).

    Attributes:
        length_m: Certified distance between the marks [m].
        uncertainty_m: Standard uncertainty (k = 1) of that length [m].
        mark: How an end is marked: ``quadrant``, a disc of alternating black and white quarters, or ``socket``.
        mark_diameter_m: Diameter of that disc [m]; 0 for a socket.
        marks: Names of the two ends; their order is the point index in detections.
    """

    length_m: float
    uncertainty_m: float
    mark: str
    mark_diameter_m: float = 0.0
    marks: tuple[str, str] = ("A", "B")

    def __post_init__(self) -> None:
        if self.length_m <= 0.0:
            raise ValueError(f"certified length is {self.length_m} m, expected above 0")
        if self.uncertainty_m <= 0.0:
            raise ValueError(f"uncertainty of the length is {self.uncertainty_m} m, expected above 0")
        if self.mark != SOCKET and self.mark_diameter_m <= 0.0:
            raise ValueError(f"mark diameter is {self.mark_diameter_m} m, expected above 0")
        if self.marks[0] == self.marks[1]:
            raise ValueError("the two marks need different names")
