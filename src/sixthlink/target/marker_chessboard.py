"""Where are the inner corners of OpenCV's chessboard with three dots, and which of them is which?

Three squares in the middle carry dots: a white one and, right of it and below it, two black ones
(``CALIB_CB_MARKER`` of ``findChessboardCornersSB``). They form an angle whose arms are the board's x and y: it tells
the ends apart whatever the numbers of columns and rows are, and a part of the board is enough if it shows the dots.

Point ``row * columns + column``: x runs along the columns, y along the rows, z into the board; the origin is the first
inner corner. A board seen in a mirror shows the same angle with columns and rows exchanged; as these differ in number,
it is refused when it is seen as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.geometry import Floats, Ints
from sixthlink.target.chessboard import SMALLEST_SQUARE_PX, Chessboard
from sixthlink.target.corner_walk import walk_corners
from sixthlink.target.drawing import Drawing
from sixthlink.target.failings import failing_of
from sixthlink.target.other_kinds import other_kind
from sixthlink.target.rooms import cell_sides, marker_room_px, square_room_px
from sixthlink.target.saddle import LARGEST_HALF_WINDOW_PX, SMALLEST_HALF_WINDOW_PX, refine_saddles
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["MarkerChessboard"]

DOT_RADIUS = 0.17
"""Radius of a dot in squares, as OpenCV's pattern generator prints it."""

DOT_BARS = 24
"""Crossed bars that make up a white dot: it is there to be told, not to be measured."""

SEARCH_WIDTHS_PX = (640, 1280)
"""Image widths at which a part of a board is looked for."""

FEWEST_POINTS = 12
"""A part of a board with fewer corners says little."""

DOT_SHARE = 0.35
"""How far a dot is from its square's grey towards that of the neighbours, at least: small ones are blurred."""

FINAL = ("two boards", "over-exposed")
"""What refuses a whole chessboard also where its dots are to be seen."""

WINDOW_SHARE, SPREAD_PX = 0.5, 2.0
"""Half window of the refinement, against one that touches the next edges; by how much it ends before the square around
a dot, which is blurred."""


@dataclass(frozen=True)
class MarkerChessboard:
    """A chessboard with three dots, counted by its inner corners.

    Attributes:
        columns: Inner corners along x, at least 5.
        rows: Inner corners along y, at least 5 and not as many as columns.
        square_m: Side of a square [m].
    """

    columns: int
    rows: int
    square_m: float

    def __post_init__(self) -> None:
        if self.columns < 5 or self.rows < 5:
            raise ValueError(
                f"a chessboard with dots of {self.columns} x {self.rows} inner corners is too small, expected at least "
                "5 x 5; count the corners where four squares meet"
            )
        if self.columns == self.rows:
            raise ValueError(
                f"a chessboard with dots of {self.columns} x {self.rows} inner corners looks the same in a mirror; use "
                "one with different numbers of columns and rows"
            )
        if self.square_m <= 0.0:
            raise ValueError(f"side of a square is {self.square_m} m, expected above 0")

    @property
    def points_m(self) -> Floats:
        """``(rows * columns, 3)`` inner corners in the board frame [m]."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        return self.square_m * np.stack([column, row, np.zeros(len(row))], axis=1)

    @property
    def turn(self) -> Ints | None:
        """None: the dots tell the ends apart."""
        return None

    @property
    def circle_radii_m(self) -> Floats:
        """Zeros: the points are corners."""
        return np.zeros(len(self.points_m))

    @property
    def angle(self) -> tuple[int, int]:
        """Column and row of the white square where the arms meet; square (0, 0) is down and right of point 0."""
        return (self.columns - 2) // 2, (self.rows - 2) // 2

    @property
    def drawing(self) -> Drawing:
        """Black squares, so that the angle's is white, two white dots and a black one, and a margin of one square."""
        column, row = self.angle
        j, i = np.meshgrid(np.arange(-1, self.columns), np.arange(-1, self.rows))
        dark = (i + j + column + row) % 2 == 1
        corners = np.stack([j, i, j + 1, i + 1], axis=2)[dark].astype(np.float64)
        turns = (np.arange(DOT_BARS) + 0.5) * (0.5 * np.pi / DOT_BARS)
        half = DOT_RADIUS * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        bars = np.concatenate([-half, half], axis=1)
        dots = [bars + np.tile(np.array(c) + 0.5, 2) for c in ((column + 1, row), (column, row + 1))]
        ink = np.r_[np.ones(len(corners), dtype=bool), np.zeros(2 * DOT_BARS, dtype=bool)]
        paper = np.array([-2.0, -2.0, self.columns + 1.0, self.rows + 1.0])
        disc = np.array([[column + 0.5, row + 0.5, DOT_RADIUS]])
        rectangles = np.concatenate([corners, *dots])
        return Drawing(self.square_m * paper, self.square_m * rectangles, ink, self.square_m * disc)

    def find(self, image: GreyImage) -> Found | NotFound:
        """The visible inner corners in one image, refined: all of them, or those that hang together around the dots."""
        whole = Chessboard(self.columns, self.rows, self.square_m).whole(image)
        if isinstance(whole, NotFound) and whole.reason.startswith(FINAL):
            return whole
        grids = self._grids(image, whole)
        if not grids:
            return NotFound(
                f"no chessboard found, neither all of its {self.columns} x {self.rows} inner corners nor a part of it; "
                f"is the part with the dots visible and sharp?{self._why_not(image)}"
            )
        dots = [_dots(image, grid) for grid in grids]
        for grid, cells in zip(grids, dots, strict=True):
            angle = _angle(cells)
            if angle is not None:
                return self._named(image, grid, cells, angle)
        return NotFound(
            f"{len(dots[0])} dots found on the chessboard, expected three that form an angle; is the part with the "
            f"dots visible and sharp?{self._why_not(image)}"
        )

    def _why_not(self, image: GreyImage) -> str:
        paper = self.columns + 3.0, self.rows + 3.0  # in squares
        return failing_of(image, paper, SMALLEST_SQUARE_PX) or other_kind(image)

    def _grids(self, image: GreyImage, whole: Found | NotFound | None) -> list[Floats]:
        """Corners ``(R, C, 2)`` by column and row, NaN where there is none, the largest grid first [pixel]."""
        if isinstance(whole, Found):
            return [whole.pixels.reshape(self.rows, self.columns, 2)]
        widths = sorted({min(width, image.shape[1]) for width in SEARCH_WIDTHS_PX})
        grids = [grid for grid in (walk_corners(image, width) for width in widths) if grid is not None]
        return sorted(grids, key=lambda grid: -np.count_nonzero(np.isfinite(grid)))

    def _named(self, image: GreyImage, grid: Floats, cells: Ints, angle: tuple[Ints, Ints, Ints]) -> Found | NotFound:
        """The corners of a grid, refined and with their names, from the dots' squares and their angle."""
        elbow, x, y = angle
        row, column = np.nonzero(np.isfinite(grid[..., 0]))
        away = np.stack([column, row], axis=1) - (elbow + 0.5)
        j, i = (np.rint(away @ arm + at + 0.5).astype(np.int64) for arm, at in zip((x, y), self.angle, strict=True))
        if min(i.min(), j.min()) < 0 or i.max() >= self.rows or j.max() >= self.columns:
            return NotFound(
                f"the dots are not where this board of {self.columns} x {self.rows} inner corners has them; is it seen "
                "in a mirror, are columns and rows exchanged, or were other squares given dots?"
            )
        near_dot = (np.abs(np.stack([row, column], axis=1)[:, None] - cells - 0.5) < 1.0).all(axis=2).any(axis=1)
        smallest = _smallest_square(grid)
        points, pixels = i * self.columns + j, grid[row, column]
        sigmas_px, good = np.zeros(len(points)), np.zeros(len(points), dtype=np.bool_)
        a, b = cell_sides(grid)
        room = WINDOW_SHARE * square_room_px(a, b)
        beside = min(room, marker_room_px(a, b, 0.5 - DOT_RADIUS) - SPREAD_PX)
        for these, half_px in ((~near_dot, room), (near_dot, beside)):
            window = float(np.clip(half_px, SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX))
            refined = refine_saddles(image, pixels[these], window, max(1.5, 0.3 * smallest))
            pixels[these], sigmas_px[these], good[these] = refined.pixels, refined.sigmas_px, refined.good
        if np.count_nonzero(good) < FEWEST_POINTS:
            return NotFound(
                f"{np.count_nonzero(good)} corners left after refinement, expected at least {FEWEST_POINTS}; is enough "
                "of the board visible and sharp?"
            )
        order = np.flatnonzero(good)[np.argsort(points[good])]
        return Found(points[order], pixels[order], sigmas_px[order])


def _dots(image: GreyImage, grid: Floats) -> Ints:
    """Row and column ``(D, 2)`` of the squares between corners ``(R, C, 2)`` whose middle differs from the rest."""
    from scipy.ndimage import map_coordinates

    turns = np.arange(8) * (0.25 * np.pi)
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    # The middle within a dot, the ring clear of it and of the square's edges.
    places = 0.5 + np.concatenate([np.zeros((1, 2)), 0.07 * circle, 0.32 * circle])
    a, b = places[:, 0, None], places[:, 1, None]
    p = grid[:, :, None]
    at = (p[:-1, :-1] * (1 - a) + p[:-1, 1:] * a) * (1 - b) + (p[1:, :-1] * (1 - a) + p[1:, 1:] * a) * b
    known = np.asarray(np.isfinite(at).all(axis=(2, 3)))
    at = np.where(known[..., None, None], at, 0.0)
    grey = map_coordinates(image, [at[..., 1], at[..., 0]], order=1, output=np.float64, mode="nearest")
    middle, own = grey[:, :, :9].mean(axis=2), grey[:, :, 9:].mean(axis=2)
    total, count = (_beside(np.where(known, k, 0.0)) for k in (own, np.ones_like(own)))
    known &= count > 0
    contrast = total / np.maximum(count, 1.0) - own
    least = 0.5 * float(np.median(np.abs(contrast[known]))) if known.any() else 0.0
    share = (middle - own) * np.sign(contrast) / np.maximum(np.abs(contrast), max(least, 1.0))
    return np.argwhere(known & (share > DOT_SHARE))


def _beside(values: Floats) -> Floats:
    """Sum of the four neighbours of each entry of a table."""
    p = np.pad(values, 1)
    return np.asarray(p[:-2, 1:-1] + p[2:, 1:-1] + p[1:-1, :-2] + p[1:-1, 2:])


def _angle(cells: Ints) -> tuple[Ints, Ints, Ints] | None:
    """Column and row of the square where the arms of an angle meet, and the arms x and y; None if it is no angle."""
    if len(cells) != 3:
        return None
    places = cells[:, ::-1]
    for k in range(3):
        elbow, arms = places[k], np.delete(places, k, axis=0) - places[k]
        if (np.abs(arms).sum(axis=1) == 1).all() and arms[0] @ arms[1] == 0:
            turn = arms[0, 0] * arms[1, 1] - arms[0, 1] * arms[1, 0]
            x, y = arms if turn > 0 else arms[::-1]
            return elbow, x, y
    return None


def _smallest_square(grid: Floats) -> float:
    """Smallest distance of neighbouring corners [pixel]."""
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=2) for axis in (0, 1)]
    return float(min(np.nanmin(step) for step in steps))
