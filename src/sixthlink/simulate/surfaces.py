"""What is painted where on the board and on the ruler?

A surface maps plane coordinates to labels; :data:`REFLECTANCE` gives each label its shade. Edges lie where
labels differ, so a surface says nothing of cameras or pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats

__all__ = ["REFLECTANCE", "ChessSurface", "RulerSurface", "Surface"]

Singles = npt.NDArray[np.float32]
Labels = npt.NDArray[np.uint8]

BACKGROUND, WHITE, BLACK, BAR = range(4)
REFLECTANCE = np.array([0.30, 0.80, 0.06, 0.55], dtype=np.float32)
"""Part of the light that each label sends back; 1 fills the sensor's 8 bits in the middle of the image."""

BAR_WIDTH_M, BAR_END_M = 0.040, 0.030
"""Width of the ruler, and how far it goes on behind each mark."""


class Surface(Protocol):
    """A painted plane."""

    @property
    def unit_m(self) -> float:
        """Length of one unit of the plane coordinates [m]."""
        ...

    def labels(self, a: Singles, b: Singles) -> Labels:
        """Label at plane coordinates a along x and b along y, of any shape."""
        ...

    def shifts(self, a: Singles, b: Singles) -> tuple[Singles, Singles]:
        """How far the paint at ``(M,)`` places lies off the drawing, along a and along b."""
        ...


@dataclass(frozen=True, eq=False)
class ChessSurface:
    """A chessboard in units of a square, with a white margin of one square around it.

    Attributes:
        unit_m: Size of a square [m].
        offsets: ``(rows, columns, 2)`` print error of each inner corner [squares].
    """

    unit_m: float
    offsets: Floats

    def labels(self, a: Singles, b: Singles) -> Labels:
        """Squares by the parity of column and row; the one up-left of the first inner corner is black."""
        rows, columns, _ = self.offsets.shape
        i, j = np.floor(a).astype(np.int16), np.floor(b).astype(np.int16)
        painted = (i >= -1) & (i < columns) & (j >= -1) & (j < rows)
        paper = (i >= -2) & (i <= columns) & (j >= -2) & (j <= rows)
        labels = np.where(paper, np.uint8(WHITE), np.uint8(BACKGROUND))
        labels[painted & ((i + j) % 2 == 0)] = BLACK
        return labels

    def shifts(self, a: Singles, b: Singles) -> tuple[Singles, Singles]:
        """Print errors, bilinear between the inner corners and outside them as at the nearest."""
        rows, columns, _ = self.offsets.shape
        a, b = np.clip(a, 0, columns - 1), np.clip(b, 0, rows - 1)
        i, j = np.minimum(a.astype(np.intp), columns - 2), np.minimum(b.astype(np.intp), rows - 2)
        u, v = (a - i)[:, None], (b - j)[:, None]
        o = self.offsets
        above, below = o[j, i] * (1 - u) + o[j, i + 1] * u, o[j + 1, i] * (1 - u) + o[j + 1, i + 1] * u
        shift = (above * (1 - v) + below * v).astype(np.float32)
        return shift[:, 0], shift[:, 1]


@dataclass(frozen=True, eq=False)
class RulerSurface:
    """A light-grey bar with a disc of four quarters at each end: metres from mark A, x towards mark B.

    The quarters meet along the bar's axis and across it; those with x and y of equal sign are black.

    Attributes:
        length_m: Distance between the marks [m].
        mark_diameter_m: Diameter of the discs [m].
    """

    length_m: float
    mark_diameter_m: float
    unit_m: float = 1.0

    def labels(self, a: Singles, b: Singles) -> Labels:
        """Background, bar, and the quarters of the nearer mark."""
        x = np.where(a > 0.5 * self.length_m, a - np.float32(self.length_m), a)
        bar = (np.abs(b) < 0.5 * BAR_WIDTH_M) & (a > -BAR_END_M) & (a < self.length_m + BAR_END_M)
        labels = np.where(bar, np.uint8(BAR), np.uint8(BACKGROUND))
        disc = x * x + b * b < (0.5 * self.mark_diameter_m) ** 2
        labels[disc] = np.where(x[disc] * b[disc] > 0, BLACK, WHITE)
        return labels

    def shifts(self, a: Singles, b: Singles) -> tuple[Singles, Singles]:
        """None: the ruler's marks are where its length says."""
        return np.zeros_like(a), np.zeros_like(b)
