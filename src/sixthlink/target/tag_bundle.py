"""Where are the corners of one tag, or of a few tags with numbers of any kind?

The tags are laid out row by row in the order in which they are named, x to the right along the columns, y down along
the rows, z into the board; the origin is the upper left corner of the first one. Point ``4 t + i`` is corner i of the
tag named in place t: upper left, upper right, lower right, lower left. One visible tag is enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sixthlink.geometry import Floats, Ints
from sixthlink.target.drawing import Drawing
from sixthlink.target.tags import TagLayout, check_dictionary, check_sizes, find_tags, row_by_row, tag_drawing
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["TagBundle"]


@dataclass(frozen=True)
class TagBundle:
    """Square tags of one size at even distances.

    Attributes:
        dictionary: OpenCV's name of the dictionary, for example ``DICT_4X4_50``.
        tag_m: Side of a tag, from outer edge to outer edge of its black border [m].
        ids: Numbers of the tags, separated by commas, for example ``5, 9, 12``.
        columns: Tags in a row.
        spacing_m: Free distance between neighbouring tags, and of other things from them [m].
    """

    dictionary: str
    tag_m: float
    ids: str
    columns: int
    spacing_m: float

    def __post_init__(self) -> None:
        numbers = self.numbers
        if self.columns < 1:
            raise ValueError(f"{self.columns} columns of tags, expected at least 1")
        check_dictionary(self.dictionary, max(numbers), "ids go")
        check_sizes(self.tag_m, self.spacing_m, self._layout.cells)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the tags in the order of their places.

        Raises:
            ValueError: ``ids`` does not name different tags.
        """
        words = [word.strip() for word in self.ids.split(",")]
        if not all(word.isascii() and word.isdigit() for word in words):
            raise ValueError(f"ids are {self.ids!r}, expected numbers of tags separated by commas, like 5, 9, 12")
        numbers = tuple(int(word) for word in words)
        twice = sorted({k for k in numbers if numbers.count(k) > 1})
        if twice:
            raise ValueError(f"ids name tag {twice[0]} more than once, expected each tag once")
        return numbers

    @property
    def points_m(self) -> Floats:
        """``(4 T, 3)`` corners in the bundle's frame [m]."""
        return self._layout.points_m

    @property
    def turn(self) -> Ints | None:
        """None: the pictures on the tags tell the ends apart."""
        return None

    @property
    def circle_radii_m(self) -> Floats:
        """Zeros: the points are corners."""
        return np.zeros(len(self.points_m))

    @property
    def drawing(self) -> Drawing:
        """The tags with their white space."""
        return tag_drawing(self._layout, squares=False)

    def find(self, image: GreyImage) -> Found | NotFound:
        """The visible corners in one image, refined."""
        return find_tags(image, self._layout, fewest=1)

    @cached_property
    def _layout(self) -> TagLayout:
        numbers = np.array(self.numbers, dtype=np.int64)
        places = row_by_row(len(numbers), self.columns, self.tag_m + self.spacing_m)
        return TagLayout(self.dictionary, numbers, places, self.tag_m, self.spacing_m)
