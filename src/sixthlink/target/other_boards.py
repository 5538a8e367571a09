"""Is what was found really the whole of the one declared board?

A chessboard of fewer corners than the real one fits into it at several places, and a second board in the picture may be
found instead of the first: both give right-looking corners with wrong names.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.coarse import reduced_image
from sixthlink.target.target import GreyImage

__all__ = ["another_board", "goes_on", "second_board"]

FEWEST, MATCHING = 6, 0.9
"""Squares beyond a side that must be in the picture, and the share of them that must go on as a chessboard does."""

FEWEST_CORNERS = 4
"""Rows of inner corners of another board at least: dots and tags from afar look like a board of three."""

WIDTH_PX, SQUARE_PX = 640, 15.0
"""Image width at which another board is looked for when none was found, and size of its squares when one was."""


def goes_on(image: GreyImage, grid: Floats) -> str:
    """Why the board is larger than declared: squares go on, black and white in turn, beyond its outermost ones.

    Args:
        image: The image.
        grid: ``(rows, columns, 2)`` inner corners of the declared board [pixel].

    Returns:
        The reason in words; empty where a margin surrounds the board.
    """
    black, white = _levels(image, _centres(grid))
    turned = np.swapaxes(grid, 0, 1)
    for side, name in ((grid, "rows"), (grid[::-1], "rows"), (turned, "columns"), (turned[::-1], "columns")):
        # Centres of the squares beyond the outermost ones: a step and a half before the first row of corners.
        edge, next_edge = (0.5 * (row[:-1] + row[1:]) for row in side[:2])
        grey, even = _greys(image, (edge + 1.5 * (edge - next_edge))[None])
        dark = grey < 0.5 * (black + white)
        if len(dark) >= FEWEST and max(np.mean(dark == even), np.mean(dark != even)) >= MATCHING:
            rows, columns, _ = grid.shape
            return (
                f"the board goes on beyond {columns} x {rows} inner corners, it has more {name}: the target is "
                "declared too small, or it is another board; count the inner corners again"
            )
    return ""


def second_board(image: GreyImage, reduced: GreyImage, grid: Floats) -> str:
    """Why it is not clear which board is meant: there is another one of the same kind.

    Args:
        image: The image.
        reduced: The same from as far as the board can be found, to be reduced further.
        grid: ``(rows, columns, 2)`` inner corners of the declared board [pixel].
    """
    import cv2

    square = float(np.median(np.linalg.norm(np.diff(grid, axis=1), axis=2)))
    small = reduced_image(reduced, max(int(image.shape[1] * SQUARE_PX / square), 1)).copy()
    factor = image.shape[1] // small.shape[1]
    middle = grid.reshape(-1, 2).mean(axis=0)
    hull = cv2.convexHull(((1.35 * (grid.reshape(-1, 2) - middle) + middle) / factor).astype(np.int32))
    cv2.fillConvexPoly(small, hull, int(np.median(small)))
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
    found, corners = cv2.findChessboardCorners(small, (grid.shape[1], grid.shape[0]), flags=flags)
    if not found:
        return ""
    (u, v), (a, b) = middle, factor * np.asarray(corners).reshape(-1, 2).mean(axis=0)
    places = f"({u:.0f}, {v:.0f}) and ({a:.0f}, {b:.0f})"
    return f"two boards are in the picture, near {places}: cover one of them, or cut it off"


def another_board(image: GreyImage, columns: int = 0, rows: int = 0) -> str:
    """Which chessboard is in the picture instead of the declared one, if any was; empty where none is seen."""
    import cv2

    small = reduced_image(image, WIDTH_PX)
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_LARGER
    found, _, meta = cv2.findChessboardCornersSBWithMeta(small, (3, 3), flags)
    if not found or min(np.shape(meta)) < FEWEST_CORNERS or sorted(np.shape(meta)) == sorted((columns, rows)):
        return ""
    b, a = sorted(np.shape(meta)) if columns >= rows else sorted(np.shape(meta))[::-1]
    return (
        f"; the wrong board? a chessboard of {a} x {b} inner corners is in the picture: count them again, or show the "
        "declared board"
    )


def _centres(grid: Floats) -> Floats:
    return np.asarray(0.25 * (grid[:-1, :-1] + grid[:-1, 1:] + grid[1:, :-1] + grid[1:, 1:]), dtype=np.float64)


def _levels(image: GreyImage, centres: Floats) -> tuple[float, float]:
    """Grey of the black and of the white squares of a board."""
    grey, even = _greys(image, centres)
    a, b = float(np.median(grey[even])), float(np.median(grey[~even]))
    return min(a, b), max(a, b)


def _greys(image: GreyImage, centres: Floats) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Grey values at those places of a grid ``(r, c, 2)`` that are in the image, and whether each is an even one."""
    place = np.rint(centres).astype(np.int64)
    height, width = image.shape
    inside = ((place >= 0) & (place < [width, height])).all(axis=2)
    row, column = np.indices(inside.shape)
    grey = image[place[inside][:, 1], place[inside][:, 0]].astype(np.float64)
    return grey, ((row + column) % 2 == 0)[inside]
