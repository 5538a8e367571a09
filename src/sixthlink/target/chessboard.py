"""Where are the inner corners of a chessboard, and which of them is the first?

Point ``row * columns + column``: x runs along the columns, y along the rows, right-handed as seen from the front.
With one of the two numbers even and the other odd, the two ends of the board look different, and the first point
is the one whose outer diagonal square (up and left of it) is black. Otherwise the board looks the same after half a
turn, with as many rows as columns and both even after a quarter: each image may come out any way round, and ``turn``
says so to whoever compares images.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints
from sixthlink.target.clipping import burnt_out
from sixthlink.target.coarse import full_pixels, reduced_image
from sixthlink.target.drawing import Drawing
from sixthlink.target.failings import failing_of
from sixthlink.target.other_boards import another_board, goes_on, second_board
from sixthlink.target.other_kinds import other_dots, other_tags
from sixthlink.target.rooms import cell_sides, square_room_px
from sixthlink.target.saddle import LARGEST_HALF_WINDOW_PX, SMALLEST_HALF_WINDOW_PX, Saddles, refine_saddles
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["Chessboard"]

QUICK_WIDTH_PX, CLOSER_WIDTH_PX = 640, 1280
"""Image widths at which the board is looked for before the full size is tried."""

SMALLEST_SQUARE_PX = 8.0
"""Squares smaller than this leave no window for refinement."""

WINDOW_SHARE = 0.5
"""Half window of the refinement, against one that touches the next edges: they stay outside with their blur."""


@dataclass(frozen=True)
class Chessboard:
    """A chessboard, counted by its inner corners.

    Attributes:
        columns: Inner corners along x, at least 3.
        rows: Inner corners along y, at least 3.
        square_m: Side of a square [m].
    """

    columns: int
    rows: int
    square_m: float

    def __post_init__(self) -> None:
        if self.columns < 3 or self.rows < 3:
            raise ValueError(
                f"a chessboard of {self.columns} x {self.rows} inner corners is too small, expected at least "
                "3 x 3; count the corners where four squares meet"
            )
        if self.square_m <= 0.0:
            raise ValueError(f"side of a square is {self.square_m} m, expected above 0")

    @property
    def points_m(self) -> Floats:
        """``(rows * columns, 3)`` inner corners in the board frame [m]."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        return np.stack([column * self.square_m, row * self.square_m, np.zeros(len(row))], axis=1)

    @property
    def turn(self) -> Ints | None:
        """``(rows * columns,)`` index of each point after half or a quarter turn; None where colours tell the ends."""
        if self._ends_differ:
            return None
        number = np.arange(self.rows * self.columns, dtype=np.int64).reshape(self.rows, self.columns)
        return np.rot90(number, 1 if self.columns == self.rows and self.columns % 2 == 0 else 2).ravel()

    @property
    def _ends_differ(self) -> bool:
        return (self.columns + self.rows) % 2 == 1

    @property
    def circle_radii_m(self) -> Floats:
        """Zeros: the points are corners."""
        return np.zeros(self.rows * self.columns)

    @property
    def drawing(self) -> Drawing:
        """The black squares, the one up and left of the first corner among them, and a margin of one square."""
        row, column = np.divmod(np.arange((self.rows + 1) * (self.columns + 1)), self.columns + 1)
        black = (row + column) % 2 == 0
        corners = np.stack([column, row, column + 1, row + 1], axis=1)[black] - 1.0
        paper = np.array([-2.0, -2.0, self.columns + 1.0, self.rows + 1.0])
        return Drawing(self.square_m * paper, self.square_m * corners)

    def find(self, image: GreyImage) -> Found | NotFound:
        """All inner corners in one image, refined; a board that is partly hidden is not found."""
        whole = self.whole(image)
        if whole is not None:
            return whole
        return NotFound(
            f"no chessboard of {self.columns} x {self.rows} inner corners found; is the whole board "
            f"visible, with a white margin around it?{self._why_not(image)}"
        )

    def whole(self, image: GreyImage) -> Found | NotFound | None:
        """All inner corners in one image; None where none are seen, without a search for the reason."""
        failed = None
        for coarse, reduced in self._coarse(image):
            refined = self._refined(image, coarse)
            if isinstance(refined, NotFound):  # a closer look may do better
                failed = failed or refined
                continue
            grid = refined.pixels.reshape(self.rows, self.columns, 2)
            wrong = burnt_out(image, refined.pixels) or goes_on(image, grid) or second_board(image, reduced, grid)
            if wrong:
                return NotFound(wrong)
            return self._ordered(image, grid, refined.sigmas_px.reshape(self.rows, self.columns))
        return failed

    def _refined(self, image: GreyImage, coarse: Floats) -> Saddles | NotFound:
        """All corners to hundredths of a pixel, in a regular grid."""
        smallest = _smallest_square(coarse)
        if smallest < SMALLEST_SQUARE_PX:
            return NotFound(
                f"too small: the smallest square is {smallest:.1f} pixel wide, expected at least {SMALLEST_SQUARE_PX:g}"
            )
        room = square_room_px(*cell_sides(coarse))
        window = float(np.clip(WINDOW_SHARE * room, SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX))
        refined = refine_saddles(image, coarse.reshape(-1, 2), window, 0.3 * smallest)
        if not refined.good.all():
            u, v = coarse.reshape(-1, 2)[~refined.good][0]
            return NotFound(
                f"{np.count_nonzero(~refined.good)} corners could not be refined, the first near ({u:.0f}, {v:.0f}): "
                "at the image's edge, covered, glaring or blurred"
            )
        if not _regular(refined.pixels.reshape(self.rows, self.columns, 2)):
            return NotFound("the corners do not form a regular grid: something else was taken for a chessboard")
        return refined

    def _why_not(self, image: GreyImage) -> str:
        return (
            failing_of(image, (self.columns + 3.0, self.rows + 3.0), SMALLEST_SQUARE_PX)  # in squares
            or other_tags(image)
            or other_dots(image)
            or another_board(image, self.columns, self.rows)
        )

    def _coarse(self, image: GreyImage) -> Iterator[tuple[Floats, GreyImage]]:
        """``(rows, columns, 2)`` first estimates [pixel] in OpenCV's order, and the reduced images that show them."""
        import cv2

        usual = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
        widths = [w for w in (QUICK_WIDTH_PX, CLOSER_WIDTH_PX) if w < image.shape[1]] + [image.shape[1]]
        size = (self.columns, self.rows)
        for width in widths:
            reduced = reduced_image(image, width)
            # The quick refusal costs more than it saves while the image is small.
            flags = usual if width <= QUICK_WIDTH_PX else usual | cv2.CALIB_CB_FAST_CHECK
            found, corners = cv2.findChessboardCorners(reduced, size, flags=flags)
            if found:
                yield full_pixels(corners, reduced, image).reshape(self.rows, self.columns, 2), reduced
        reduced = reduced_image(image, CLOSER_WIDTH_PX)
        found, corners = cv2.findChessboardCornersSB(reduced, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        if found:
            yield full_pixels(corners, reduced, image).reshape(self.rows, self.columns, 2), reduced

    def _ordered(self, image: GreyImage, grid: Floats, sigmas_px: Floats) -> Found | NotFound:
        """The corners in the board's own order: right-handed, and black first where that means something."""
        grid = np.concatenate([grid, sigmas_px[..., None]], axis=2)
        if _handedness(grid) < 0.0:
            grid = grid[:, ::-1]
        if self._ends_differ or (self.columns == self.rows and self.columns % 2 == 1):
            contrast, spread = _first_colour(image, grid[..., :2])
            if abs(contrast) < 4.0 * spread:
                return NotFound("the squares' colours cannot be told apart: too dark, too bright or too blurred")
            if contrast > 0.0:  # the first square is white
                grid = grid[::-1, ::-1] if self._ends_differ else np.swapaxes(grid, 0, 1)[:, ::-1]
        named = grid.reshape(-1, 3)
        points = np.arange(len(named), dtype=np.int64)
        return Found(points, np.ascontiguousarray(named[:, :2]), np.ascontiguousarray(named[:, 2]))


def _smallest_square(grid: Floats) -> float:
    """Smallest distance of neighbouring corners [pixel]."""
    along = np.linalg.norm(np.diff(grid, axis=1), axis=-1)
    down = np.linalg.norm(np.diff(grid, axis=0), axis=-1)
    return float(min(along.min(), down.min()))


def _regular(grid: Floats) -> bool:
    """Do steps along each row and column change slowly, as perspective and a lens allow?"""
    for axis in (0, 1):
        bend = np.linalg.norm(np.diff(grid, n=2, axis=axis), axis=-1)
        step = np.linalg.norm(np.diff(grid, axis=axis), axis=-1)
        if bend.max() > 0.3 * step.min():
            return False
    return True


def _handedness(grid: Floats) -> float:
    """Positive when x, then y turns the way it does on a board seen from the front."""
    x, y = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return float(x[0] * y[1] - x[1] * y[0])


def _first_colour(image: GreyImage, grid: Floats) -> tuple[float, float]:
    """Mean grey of the squares coloured like the first minus that of the others, and its standard error.

    The square up and left of the first corner has the colour of the one down and right of it, so that only squares
    between corners are read, each as the mean of nine pixels around its centre.
    """
    centres = 0.25 * (grid[:-1, :-1] + grid[:-1, 1:] + grid[1:, :-1] + grid[1:, 1:])
    u, v = np.rint(centres).astype(np.int64)[..., 0], np.rint(centres).astype(np.int64)[..., 1]
    grey = np.mean([image[v + dv, u + du].astype(np.float64) for du in (-1, 0, 1) for dv in (-1, 0, 1)], axis=0)
    row, column = np.indices(grey.shape)
    first: npt.NDArray[np.bool_] = (row + column) % 2 == 0
    a, b = grey[first], grey[~first]
    error = np.sqrt(a.var() / len(a) + b.var() / len(b))
    return float(a.mean() - b.mean()), float(max(error, 0.25))
