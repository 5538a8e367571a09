"""Where are the corners of a grid of tags, as far as it is visible?

Tag k of the grid has the number ``first + k``; k counts the tags row by row from the upper left one, x to the right
along the columns, y down along the rows, z into the board. The origin is the upper left corner of that tag. Point
``4 k + i`` is corner i of tag k: upper left, upper right, lower right, lower left. The numbers tell every corner apart,
so that a part of the grid is enough.

Grids that Kalibr printed differ: the rows are counted from the bottom, the tags stand upside down against OpenCV's
pictures, their border is two cells wide, and black squares fill the corners between them. Frame and corners are named
as above.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sixthlink.geometry import Floats, Ints
from sixthlink.target.drawing import Drawing
from sixthlink.target.tags import TagLayout, check_dictionary, check_sizes, find_tags, row_by_row, tag_drawing
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["AprilGrid"]

FEWEST_TAGS = 3
"""Two tags that were misread may agree by chance."""


@dataclass(frozen=True)
class AprilGrid:
    """A grid of square tags with consecutive numbers.

    Attributes:
        columns: Tags along x.
        rows: Tags along y.
        tag_m: Side of a tag, from outer edge to outer edge of its black border [m].
        spacing_m: Free distance between neighbouring tags [m]; Kalibr's ``tagSpacing`` is this as a share of the side.
        dictionary: OpenCV's name of the dictionary, for example ``DICT_APRILTAG_36h11``.
        first: Number of the first tag.
        kalibr: True for grids printed by Kalibr.
    """

    columns: int
    rows: int
    tag_m: float
    spacing_m: float
    dictionary: str = "DICT_APRILTAG_36h11"
    first: int = 0
    kalibr: bool = False

    def __post_init__(self) -> None:
        if self.columns < 1 or self.rows < 1:
            raise ValueError(f"a grid of {self.columns} x {self.rows} tags has no tags, expected at least 1 x 1")
        if self.first < 0:
            raise ValueError(f"first tag is {self.first}, expected 0 or more")
        largest = self.first + self.columns * self.rows - 1
        check_dictionary(self.dictionary, largest, f"{self.columns} x {self.rows} from first = {self.first} on go")
        check_sizes(self.tag_m, self.spacing_m, self._layout.cells)

    @property
    def points_m(self) -> Floats:
        """``(4 * rows * columns, 3)`` corners in the grid's frame [m]."""
        return self._layout.points_m

    @property
    def turn(self) -> Ints | None:
        """None: the numbers tell the ends apart."""
        return None

    @property
    def circle_radii_m(self) -> Floats:
        """Zeros: the points are corners."""
        return np.zeros(len(self.points_m))

    @property
    def drawing(self) -> Drawing:
        """The tags with their white space, for Kalibr's grids with the squares between them."""
        return tag_drawing(self._layout, squares=self.kalibr)

    def find(self, image: GreyImage) -> Found | NotFound:
        """The visible corners in one image, refined: three tags at least, where the grid has so many."""
        return find_tags(image, self._layout, fewest=min(FEWEST_TAGS, self.columns * self.rows))

    @cached_property
    def _layout(self) -> TagLayout:
        k = np.arange(self.columns * self.rows)
        places = row_by_row(len(k), self.columns, self.tag_m + self.spacing_m)
        border = 2 if self.kalibr else 1
        if self.kalibr:
            places[:, 1] = places[::-1, 1]
        return TagLayout(
            self.dictionary, k + self.first, places, self.tag_m, self.spacing_m, border, upside_down=self.kalibr
        )
