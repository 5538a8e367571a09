"""Where are the discs of a circle grid, and which is the first?

The symmetric grid and OpenCV's asymmetric grid; ``dot_grid`` has the one in which larger dots mark the origin. A point
is the middle of the ellipse as which its disc is seen, which is not the image of the disc's centre: ``circle_radii_m``
says so to whoever projects points.

x runs along the columns, y along the rows, right-handed as seen from the front. The dots of an image are read in every
way in which the pattern can be laid over them; a reading that fits only mirrored is a board seen from behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints
from sixthlink.target.blobs import SMALLEST_RADIUS_PX, Blobs, find_blobs
from sixthlink.target.dot_lattice import readings_of, step_sizes, walk_grids
from sixthlink.target.drawing import Drawing
from sixthlink.target.ellipse import Ellipses, fit_discs
from sixthlink.target.failings import failing_of
from sixthlink.target.other_boards import another_board
from sixthlink.target.other_kinds import other_tags
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["AsymmetricCircleGrid", "CircleGrid", "DiscGrid"]

Bools = npt.NDArray[np.bool_]

SEARCH_WIDTHS_PX = (640, 1280, 100_000, 320)
"""Image widths at which the grid is looked for: small, closer, in full; the last brings very large discs in reach."""

FEWEST_DOTS = 6
"""Fewer dots carry no pose."""

MOST_UNLIKE_SIZE = 1.4
"""Ratio of a dot's diameter as seen and as declared beyond which a number in the recording is wrong."""

GROUND_SHARE = 0.85
"""Part of the half way to a neighbour's rim that is taken for plain ground."""


@dataclass(frozen=True)
class DiscGrid:
    """What all grids of discs have in common; columns and rows count discs."""

    columns: int
    rows: int
    spacing_m: float
    diameter_m: float

    def __post_init__(self) -> None:
        if self.columns < 3 or self.rows < 3:
            raise ValueError(f"a grid of {self.columns} x {self.rows} dots is too small, expected at least 3 x 3")
        if self.spacing_m <= 0.0 or self.diameter_m <= 0.0:
            raise ValueError(f"spacing is {self.spacing_m} m and diameter {self.diameter_m} m, expected both above 0")
        radii, beside = self.circle_radii_m, _beside(self._lattice)
        if (widest := float((radii[:, None] + radii)[beside].max())) >= self._step_m:
            raise ValueError(f"dots that are {self._step_m:g} m apart touch: their radii add up to {widest:g} m")

    @property
    def _steps(self) -> Ints:
        """``(P, 2)`` x and y of the points in spacings."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        return np.stack([column, row], axis=1)

    @property
    def _lattice(self) -> Ints:
        """``(P, 2)`` the points on the square lattice that nearest neighbours form."""
        return self._steps

    @property
    def _step_m(self) -> float:
        """Distance between nearest neighbours [m]."""
        return self.spacing_m

    @property
    def _larger(self) -> Ints:
        """Points with larger discs."""
        return np.zeros(0, dtype=np.int64)

    @property
    def points_m(self) -> Floats:
        """``(rows * columns, 3)`` centres of the discs in the target frame [m]."""
        return np.column_stack([self.spacing_m * self._steps, np.zeros(self.rows * self.columns)])

    @property
    def circle_radius_m(self) -> float:
        """Radius of the discs, of the smaller ones where there are two kinds [m]."""
        return 0.5 * self.diameter_m

    @property
    def circle_radii_m(self) -> Floats:
        """``(rows * columns,)`` radius of each disc [m]."""
        return np.full(self.rows * self.columns, self.circle_radius_m)

    @property
    def turn(self) -> Ints | None:
        """``(rows * columns,)`` index of each point after half or a quarter turn; None where images tell the ends."""
        if len(self._larger):
            return None
        number = np.arange(self.rows * self.columns, dtype=np.int64).reshape(self.rows, self.columns)
        return np.rot90(number, 1 if self._square else 2).ravel()

    @property
    def _square(self) -> bool:
        """Whether a quarter turn maps the pattern to itself."""
        return self.columns == self.rows

    @property
    def drawing(self) -> Drawing:
        """The black discs, and a white margin of one spacing around them."""
        xy, radii = self.points_m[:, :2], self.circle_radii_m
        reach = (radii + self.spacing_m)[:, None]
        paper = np.concatenate([(xy - reach).min(axis=0), (xy + reach).max(axis=0)])
        return Drawing(paper, discs=np.column_stack([xy, radii]))

    def find(self, image: GreyImage) -> Found | NotFound:
        """The discs in one image, refined; a grid that is partly hidden is not found unless larger dots mark it.

        The standard deviations come from the image: from the noise and the residuals around each disc's rim.
        """
        blobs, places, dots = self._coarse(image)
        readings, mirrored = readings_of(places, self._lattice)
        P, larger = self.columns * self.rows, self._larger
        fewest = max(FEWEST_DOTS, (P + 1) // 2) if len(larger) else P
        counts = (readings >= 0).sum(axis=1)
        if counts.max(initial=0) < fewest:
            return NotFound(
                f"{counts.max(initial=0)} of {P} dots seen in a grid; is the whole target of {self.columns} x "
                f"{self.rows} dots in the image, sharp and black on white, or is it the wrong board?"
                f"{self._why_not(image)}"
            )
        ellipses, sizes = _measured(image, blobs, places, dots)
        ratio = float(self.circle_radii_m.max()) / self.circle_radius_m if len(larger) else np.inf
        large = sizes > np.sqrt(ratio) * np.median(sizes)
        expected = np.isin(np.arange(P), larger)
        fits = (((readings >= 0) & large[readings]) == expected).all(axis=1) & (counts >= fewest)
        if not fits.any():
            return NotFound(
                "the wrong board? the larger dots are not where origin_dots says, at points "
                f"{', '.join(map(str, larger))}; {np.count_nonzero(large)} larger and {np.count_nonzero(~large)} "
                "smaller dots are seen"
            )
        fits &= counts == counts[fits].max()
        reading = self._only(readings[fits], mirrored[fits], len(dots))
        if isinstance(reading, NotFound):
            return reading
        if self._seen_twice(blobs, dots):
            return NotFound("two boards are in the picture, each with these dots: cover one of them, or cut it off")
        return self._checked(reading, ellipses, sizes, fewest)

    def _why_not(self, image: GreyImage) -> str:
        x_m, y_m = (np.ptp(self.points_m[:, :2], axis=0) + 2.0 * self.spacing_m + self.diameter_m).tolist()
        failing = failing_of(image, (x_m, y_m), 2.0 * SMALLEST_RADIUS_PX / self.diameter_m)
        return failing or other_tags(image) or another_board(image)

    def _seen_twice(self, blobs: Blobs, dots: Ints) -> bool:
        """Whether the blobs that are not in the grid form such a grid of their own."""
        P, rest = self.columns * self.rows, np.setdiff1d(np.arange(len(blobs.centres)), dots)
        if len(rest) < P:
            return False
        others = walk_grids(Blobs(blobs.centres[rest], blobs.shapes[rest], blobs.grain_px), self._longest)
        return any((readings_of(places, self._lattice)[0] >= 0).all(axis=1).any() for places, _ in others)

    @property
    def _longest(self) -> int:
        """Steps on the lattice from one end to the other."""
        return int(np.ptp(self._lattice, axis=0).max())

    def _coarse(self, image: GreyImage) -> tuple[Blobs, Ints, Ints]:
        """Blobs, column and row of those in a grid and which these are, for the grid most like the pattern."""
        P, none = self.columns * self.rows, np.zeros((0, 2), dtype=np.int64)
        best, most = (Blobs(np.zeros((0, 2)), np.zeros((0, 2, 2)), 1.0), none, none[:, 0]), 0
        for width in dict.fromkeys(min(width, image.shape[1]) for width in SEARCH_WIDTHS_PX):
            blobs = find_blobs(image, width)
            for places, dots in walk_grids(blobs, self._longest):
                count = int((readings_of(places, self._lattice)[0] >= 0).sum(axis=1).max())
                if 2 * count - len(dots) > most:  # dots of the pattern less those beside it
                    best, most = (blobs, places, dots), 2 * count - len(dots)
                if count == P and 2 * (len(dots) - P) < min(self.columns, self.rows):
                    return best
        return best

    def _only(self, readings: Ints, mirrored: Bools, seen: int) -> Ints | NotFound:
        """``(P,)`` dot of each point in the only reading that is right-handed."""
        # Where the ends look the same, readings that differ by a turn are one.
        keys = np.sort(readings, axis=1) if self.turn is not None else readings
        more = seen - np.count_nonzero(readings[0] >= 0)
        if 2 * more >= min(self.columns, self.rows) or len(np.unique(keys[~mirrored], axis=0)) > 1:
            return NotFound(
                f"the wrong board? {seen} dots seen in a grid larger than {self.columns} x {self.rows}, or one that "
                "can be read in several ways; are columns and rows right?"
            )
        if mirrored.all():
            return NotFound("the grid is mirrored: the target is seen from behind, or the image is flipped")
        return np.asarray(readings[~mirrored][0])

    def _checked(self, reading: Ints, ellipses: Ellipses, sizes: Floats, fewest: int) -> Found | NotFound:
        """The points of one reading, if their discs could be measured and are as large as declared."""
        points = np.flatnonzero(reading >= 0)
        good = ellipses.good[reading[points]]
        if np.count_nonzero(good) < fewest:
            u, v = ellipses.centres[reading[points][~good][0]]
            return NotFound(
                f"{np.count_nonzero(~good)} dots could not be measured, the first near ({u:.0f}, {v:.0f}): at the "
                "image's edge, covered, blurred or too small"
            )
        points, at = points[good], reading[points][good]
        unlike = sizes[at] * self._step_m / self.circle_radii_m[points]
        worst = int(np.argmax(np.abs(np.log(unlike))))
        if not 1.0 / MOST_UNLIKE_SIZE < unlike[worst] < MOST_UNLIKE_SIZE:
            (u, v), most = ellipses.centres[at[worst]], unlike[worst]
            return NotFound(
                f"the wrong board? the dot near ({u:.0f}, {v:.0f}) is {most:.2f} times as large for the spacing as "
                "declared; check both"
            )
        return Found(points, ellipses.centres[at], ellipses.sigmas_px[at])


@dataclass(frozen=True)
class CircleGrid(DiscGrid):
    """A symmetric grid of equal discs, which looks the same after half a turn; point row * columns + column.

    With as many rows as columns it looks the same after a quarter turn, too.

    Attributes:
        columns: Discs along x, at least 3.
        rows: Discs along y, at least 3.
        spacing_m: Distance between neighbouring centres [m].
        diameter_m: Diameter of the discs [m].
    """


@dataclass(frozen=True)
class AsymmetricCircleGrid(DiscGrid):
    """OpenCV's asymmetric grid (``CALIB_CB_ASYMMETRIC_GRID``): every other row is shifted by half a step.

    Point i * columns + j, of row i and place j in it, is at x = (2 j + i mod 2) spacing and y = i spacing.

    Attributes:
        columns: Discs in a row, at least 3.
        rows: Rows, at least 3. If odd, the ends differ: the outer rows begin farther left than their neighbours.
        spacing_m: Distance between successive rows, which is half the distance between neighbours in a row; nearest
            neighbours are √2 of it apart, diagonally [m].
        diameter_m: Diameter of the discs [m].
    """

    @property
    def _steps(self) -> Ints:
        row, place = np.divmod(np.arange(self.rows * self.columns), self.columns)
        return np.stack([2 * place + row % 2, row], axis=1)

    @property
    def _lattice(self) -> Ints:
        x, y = self._steps.T
        return np.stack([(y + x) // 2, (y - x) // 2], axis=1)

    @property
    def _step_m(self) -> float:
        return float(np.sqrt(2.0) * self.spacing_m)

    @property
    def _square(self) -> bool:
        return False

    @property
    def turn(self) -> Ints | None:
        """``(rows * columns,)`` index of each point after half a turn; None if rows are odd: the ends differ."""
        return super().turn if self.rows % 2 == 0 else None


def _beside(places: Ints) -> Bools:
    """``(M, M)`` which places are one step apart."""
    return np.asarray(np.abs(places[:, None] - places).sum(axis=2) == 1)


def _measured(image: GreyImage, blobs: Blobs, places: Ints, dots: Ints) -> tuple[Ellipses, Floats]:
    """The ellipses of dots in a grid, and their radii in steps of the grid; rims are looked at half way to the next."""
    centres, shapes = blobs.centres[dots], blobs.shapes[dots]
    steps, radii = step_sizes(places, centres), np.linalg.det(shapes) ** 0.25
    neighbour = np.where(_beside(places), radii, 0.0).max(axis=1)
    room = np.maximum(1.0 + GROUND_SHARE * 0.5 * (steps - radii - neighbour) / radii, 1.05)
    ellipses = fit_discs(image, centres, shapes, room, 0.3 + 0.5 * blobs.grain_px)
    return ellipses, ellipses.radii_px / steps
