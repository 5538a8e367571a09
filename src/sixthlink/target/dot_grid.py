"""Where are the discs of a grid whose larger dots mark the origin?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.geometry import Floats, Ints
from sixthlink.target.circle_grid import DiscGrid

__all__ = ["DotGrid"]

LEAST_LARGER = 1.2
"""Least ratio of diameters that tells larger dots, since the lens changes sizes, too."""


@dataclass(frozen=True)
class DotGrid(DiscGrid):
    """A symmetric grid in which larger dots mark the origin; point row * columns + column.

    ROS-Industrial's modified circle grid has one in its lower left corner, x to the right and y up from there. Its rows
    are columns here and its columns rows: x and y are exchanged, so that z points into the board.

    Attributes:
        columns: Discs along x, at least 3.
        rows: Discs along y, at least 3.
        spacing_m: Distance between neighbouring centres [m].
        diameter_m: Diameter of the smaller discs [m].
        origin_diameter_m: Diameter of the larger discs, at least 1.2 times the other [m].
        origin_dots: Points with larger discs, separated by commas, fewer than half; no turn maps them to themselves.
    """

    origin_diameter_m: float
    origin_dots: str = "0"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.origin_diameter_m < LEAST_LARGER * self.diameter_m:
            raise ValueError(f"larger dots of {self.origin_diameter_m} m are not {LEAST_LARGER:g} times the others")
        number = np.arange(self.rows * self.columns).reshape(self.rows, self.columns)
        for turns in (1, 2, 3) if self.rows == self.columns else (2,):
            if set(np.rot90(number, turns).ravel()[self._larger]) == set(self._larger):
                raise ValueError(f"the grid with larger dots {self.origin_dots!r} looks the same after a turn")

    @property
    def _larger(self) -> Ints:
        P, words = self.columns * self.rows, self.origin_dots.split(",")
        try:
            points = sorted({int(word) for word in words})
        except ValueError:
            points = []
        if not 0 < len(points) == len(words) < 0.5 * P or not 0 <= points[0] <= points[-1] < P:
            raise ValueError(
                f"origin dots are {self.origin_dots!r}, expected a few of 0 to {P - 1} with commas between"
            )
        return np.array(points, dtype=np.int64)

    @property
    def circle_radii_m(self) -> Floats:
        """``(rows * columns,)`` radius of each disc [m]."""
        radii = super().circle_radii_m
        radii[self._larger] = 0.5 * self.origin_diameter_m
        return radii
