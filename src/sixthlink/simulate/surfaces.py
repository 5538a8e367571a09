"""What is painted where on the board and on the ruler?

A surface maps plane coordinates to labels; :data:`REFLECTANCE` gives each label its shade. Edges lie where
labels differ, so a surface says nothing of cameras or pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints
from sixthlink.target import Drawing

__all__ = ["REFLECTANCE", "ChessSurface", "PaintedSurface", "RulerSurface", "Surface"]

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


@dataclass(frozen=True, eq=False)
class PaintedSurface:
    """Any printed drawing, in metres: rectangles by a table over their edges, discs by a table of who is near.

    Attributes:
        drawing: What is printed.
        unit_m: Length of one unit of the plane coordinates: one metre.
    """

    drawing: Drawing
    unit_m: float = 1.0

    def labels(self, a: Singles, b: Singles) -> Labels:
        """Background, paper, and the ink of the uppermost shape."""
        x_edges, y_edges, table = self._rectangles
        labels: Labels = table[np.searchsorted(y_edges, b, side="right"), np.searchsorted(x_edges, a, side="right")]
        if len(self.drawing.discs):
            low, step, near = self._discs
            rows, columns = near.shape
            i, j = np.floor((b - low[1]) / step).astype(np.intp), np.floor((a - low[0]) / step).astype(np.intp)
            inside = (i >= 0) & (i < rows) & (j >= 0) & (j < columns)
            k = np.where(inside, near[np.clip(i, 0, rows - 1), np.clip(j, 0, columns - 1)], -1)
            x, y, radius = np.moveaxis(self.drawing.discs[np.maximum(k, 0)], -1, 0)
            labels = np.where((k >= 0) & ((a - x) ** 2 + (b - y) ** 2 < radius**2), np.uint8(BLACK), labels)
        return labels

    def shifts(self, a: Singles, b: Singles) -> tuple[Singles, Singles]:
        """None: the sheet is printed as drawn."""
        return np.zeros_like(a), np.zeros_like(b)

    @cached_property
    def _rectangles(self) -> tuple[Floats, Floats, Labels]:
        """Edges along x and y, and the label of every cell between them; cell 0 is before the first edge."""
        d = self.drawing
        every = np.concatenate([d.paper[None], d.rectangles])
        x_edges, y_edges = np.unique(every[:, [0, 2]]), np.unique(every[:, [1, 3]])
        table = np.full((len(y_edges) + 1, len(x_edges) + 1), BACKGROUND, dtype=np.uint8)
        inks = [WHITE, *np.where(np.asarray(d.black), BLACK, WHITE).tolist()]
        for (x0, y0, x1, y1), ink in zip(every.tolist(), inks, strict=True):
            rows = slice(np.searchsorted(y_edges, y0) + 1, np.searchsorted(y_edges, y1) + 1)
            table[rows, slice(np.searchsorted(x_edges, x0) + 1, np.searchsorted(x_edges, x1) + 1)] = ink
        return x_edges, y_edges, table

    @cached_property
    def _discs(self) -> tuple[Floats, float, Ints]:
        """Corner and step of a grid so fine that at most one disc reaches into a cell, and which one does."""
        centres, radii = self.drawing.discs[:, :2], self.drawing.discs[:, 2]
        apart = np.linalg.norm(centres[:, None] - centres, axis=2) - radii[:, None] - radii
        np.fill_diagonal(apart, np.inf)
        step = min(float(apart.min(initial=np.inf)) / 1.5, float(radii.min()))
        low = (centres - radii[:, None]).min(axis=0) - step
        size = np.ceil(((centres + radii[:, None]).max(axis=0) - low) / step).astype(np.int64) + 1
        near = np.full((size[1], size[0]), -1, dtype=np.int64)
        for k, (x, y, radius) in enumerate(self.drawing.discs.tolist()):
            j0, i0 = np.floor((np.array([x, y]) - radius - low) / step).astype(np.int64).tolist()
            j1, i1 = np.floor((np.array([x, y]) + radius - low) / step).astype(np.int64).tolist()
            cells = near[i0 : i1 + 1, j0 : j1 + 1]
            cells[self._reached(low, step, (i0, i1, j0, j1), k)] = k
        return low, step, near

    def _reached(self, low: Floats, step: float, cells: tuple[int, int, int, int], disc: int) -> npt.NDArray[np.bool_]:
        """Which cells a disc reaches into."""
        i0, i1, j0, j1 = cells
        x, y, radius = self.drawing.discs[disc]
        left, top = low[0] + step * np.arange(j0, j1 + 1), low[1] + step * np.arange(i0, i1 + 1)
        dx = np.maximum(np.maximum(left - x, x - left - step), 0.0)
        dy = np.maximum(np.maximum(top - y, y - top - step), 0.0)
        reached: npt.NDArray[np.bool_] = dx[None] ** 2 + dy[:, None] ** 2 <= radius**2
        return reached
