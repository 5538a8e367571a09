"""Where are the inner corners of a ChArUco board, as far as it is visible?

Points and frame are OpenCV's: point 0 is the inner corner next to the board's outer corner, which is the origin;
x to the right along the columns, y down along the rows, z into the board. The markers tell every corner apart, so
that a part of the board is enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints
from sixthlink.target.clipping import burnt_out
from sixthlink.target.coarse import full_pixels, reduced_image
from sixthlink.target.drawing import Drawing
from sixthlink.target.failings import failing_of
from sixthlink.target.markers import dictionary_names, exact_markers, marker_bits, marker_cells
from sixthlink.target.other_kinds import other_kind
from sixthlink.target.rooms import marker_room_px, square_room_px
from sixthlink.target.saddle import LARGEST_HALF_WINDOW_PX, SMALLEST_HALF_WINDOW_PX, refine_saddles
from sixthlink.target.target import Found, GreyImage, NotFound

if TYPE_CHECKING:
    import cv2

__all__ = ["Charuco"]

QUICK_WIDTH_PX = 1300
"""Image width at which the markers are looked for first."""

SMALLEST_CELL_PX = 1.8
"""Markers with smaller cells cannot be read."""

WINDOW_SHARE = 0.5
"""Half window of the refinement, against one that touches the next edges: they stay outside with their blur."""

LARGEST_SIGMA_PX = 0.5
"""A corner less certain is no measurement: its window shows a marker, too."""

FEWEST_POINTS = 6
"""Fewer corners than this leave a pose at the mercy of a single one."""


@dataclass(frozen=True)
class Charuco:
    """A ChArUco board, counted by its squares.

    Attributes:
        columns: Squares along x, at least 3.
        rows: Squares along y, at least 3.
        square_m: Side of a square [m].
        marker_m: Side of a marker [m], below that of a square.
        dictionary: OpenCV's name of the marker dictionary, for example ``DICT_6X6_250``.
        legacy: True for boards with an even number of rows printed before OpenCV 4.6, which begin with a marker.
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str
    legacy: bool = False

    def __post_init__(self) -> None:
        if self.columns < 3 or self.rows < 3:
            raise ValueError(f"a ChArUco board of {self.columns} x {self.rows} squares is too small, expected 3 x 3")
        if not 0.0 < self.marker_m < self.square_m:
            raise ValueError(
                f"marker of {self.marker_m} m in a square of {self.square_m} m, expected 0 < marker < square"
            )
        names = dictionary_names()
        if self.dictionary not in names:
            raise ValueError(f"unknown marker dictionary {self.dictionary!r}, expected one of {', '.join(names)}")

    @property
    def points_m(self) -> Floats:
        """``((rows - 1) * (columns - 1), 3)`` inner corners in the board frame [m]."""
        row, column = np.divmod(np.arange((self.rows - 1) * (self.columns - 1)), self.columns - 1)
        return np.stack([(column + 1) * self.square_m, (row + 1) * self.square_m, np.zeros(len(row))], axis=1)

    @property
    def turn(self) -> Ints | None:
        """None: the markers tell the ends apart."""
        return None

    @property
    def circle_radii_m(self) -> Floats:
        """Zeros: the points are corners."""
        return np.zeros((self.rows - 1) * (self.columns - 1))

    @property
    def drawing(self) -> Drawing:
        """Black squares, and in the white ones a marker each, with a margin of half a square."""
        first = 1 if self.legacy and self.rows % 2 == 0 else 0
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        white = (row + column + first) % 2 == 1
        squares = self.square_m * np.stack([column, row, column + 1, row + 1], axis=1)
        shapes, inks = [squares[~white]], [np.ones(np.count_nonzero(~white), dtype=bool)]
        gap = 0.5 * (self.square_m - self.marker_m)
        for marker, (x, y, _, _) in enumerate(squares[white].tolist()):
            cells, black = marker_cells(self.dictionary, marker, self.marker_m)
            shapes.append(cells + np.array([x, y, x, y]) + gap)
            inks.append(black)
        margin = 0.5 * self.square_m
        paper = [-margin, -margin, self.columns * self.square_m + margin, self.rows * self.square_m + margin]
        return Drawing(np.array(paper), np.concatenate(shapes), np.concatenate(inks))

    def find(self, image: GreyImage) -> Found | NotFound:
        """The visible inner corners in one image, refined, at least six that are not on one line."""
        points, pixels = self._coarse(image)
        if len(points) < FEWEST_POINTS:
            mirrored = len(self._coarse(image[:, ::-1].copy())[0]) >= FEWEST_POINTS
            if mirrored:
                return NotFound(
                    "the image is mirrored: its mirror image shows the board; turn off flipping in the camera"
                )
            return NotFound(self._too_few(f"{len(points)} corners found") + self._why_not(image))
        step = self._smallest_step(points, pixels)
        # Inside the window there may be the corner's own edges but nothing of the nearest marker.
        gap = 0.5 * (1.0 - self.marker_m / self.square_m)
        a, b = self._squares(points, pixels)
        room = min(WINDOW_SHARE * square_room_px(a, b), marker_room_px(a, b, gap))
        window = float(np.clip(room, SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX))
        refined = refine_saddles(image, pixels, window, max(1.5, 0.1 * step))
        good = refined.good & (refined.sigmas_px < LARGEST_SIGMA_PX)
        points = points[good]
        if len(points) < FEWEST_POINTS:
            return NotFound(self._too_few(f"{len(points)} corners left after refinement"))
        if spoilt := burnt_out(image, refined.pixels[good]):
            return NotFound(spoilt)
        flat = np.linalg.svd(self.points_m[points, :2] - self.points_m[points, :2].mean(axis=0), compute_uv=False)
        if flat[1] < 0.5 * self.square_m:
            return NotFound(self._too_few("all corners found are on one line"))
        return Found(points, refined.pixels[good], refined.sigmas_px[good])

    def _why_not(self, image: GreyImage) -> str:
        numbers = exact_markers(reduced_image(image, QUICK_WIDTH_PX), self.dictionary)
        if len(numbers) >= 2 * FEWEST_POINTS and 2 * len(np.unique(numbers)) <= len(numbers) + 1:
            return "; two boards are in the picture, with the same markers: cover one of them, or cut it off"
        cell_m = self.marker_m / (marker_bits(self.dictionary) + 2)
        paper_m = self.square_m * (self.columns + 1), self.square_m * (self.rows + 1)
        return failing_of(image, paper_m, SMALLEST_CELL_PX / cell_m) or other_kind(image)

    def _too_few(self, what: str) -> str:
        return (
            f"{what}, expected at least {FEWEST_POINTS} not on one line; is enough of the {self.columns} x "
            f"{self.rows} board in the image, and are its dictionary {self.dictionary} and legacy pattern right?"
        )

    def _coarse(self, image: GreyImage) -> tuple[Ints, Floats]:
        """Point indices ``(M,)`` and first estimates ``(M, 2)`` [pixel]."""
        import cv2

        # Markers that failed at first are tried again where the board says they must be; a wrong one cannot do harm,
        # because its corners do not survive refinement.
        parameters = cv2.aruco.CharucoParameters()
        parameters.tryRefineMarkers = True
        detector = cv2.aruco.CharucoDetector(self._board(), parameters)
        best: tuple[Ints, Floats] = (np.empty(0, dtype=np.int64), np.empty((0, 2)))
        widths = [w for w in (QUICK_WIDTH_PX,) if w * 1.5 < image.shape[1]] + [image.shape[1]]
        for width in widths:
            reduced = reduced_image(image, width)
            corners, ids, _, _ = detector.detectBoard(reduced)
            if ids is not None and len(ids) > len(best[0]):
                best = np.asarray(ids, dtype=np.int64).ravel(), full_pixels(corners, reduced, image)
            if len(best[0]) == len(self.points_m):
                break
        return best

    def _board(self) -> cv2.aruco.CharucoBoard:
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square_m, self.marker_m, dictionary)
        board.setLegacyPattern(self.legacy)
        return board

    def _squares(self, points: Ints, pixels: Floats) -> tuple[Floats, Floats]:
        """Sides ``(M, 2)`` of the square right of and below each point, as a plane shows them [pixel]."""
        import cv2

        at = self.points_m[points, :2] / self.square_m
        H: npt.NDArray[Any] | None = cv2.findHomography(at, pixels)[0]
        if H is None:
            return np.zeros((0, 2)), np.zeros((0, 2))
        here, right, below = (cv2.perspectiveTransform((at + step)[None], H)[0] for step in ([0, 0], [1, 0], [0, 1]))
        return right - here, below - here

    def _smallest_step(self, points: Ints, pixels: Floats) -> float:
        """Smallest distance between two corners in units of their distance on the board: a square [pixel]."""
        board = self.points_m[points, :2] / self.square_m
        apart = np.linalg.norm(board[:, None] - board, axis=-1)
        seen = np.linalg.norm(pixels[:, None] - pixels, axis=-1)
        first, second = np.nonzero((apart > 0.5) & (apart < 1.5))
        if not len(first):
            first, second = np.nonzero(apart > 0.5)
        return float((seen[first, second] / apart[first, second]).min(initial=np.inf))
