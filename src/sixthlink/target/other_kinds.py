"""Which other target is in a picture in which the declared one was not found?

Only a target that shows itself beyond doubt is named: three tags of one dictionary without a wrong cell, a whole grid
of dots, a chessboard.
"""

from __future__ import annotations

import numpy as np

from sixthlink.target.blobs import find_blobs
from sixthlink.target.coarse import reduced_image
from sixthlink.target.dot_lattice import walk_grids
from sixthlink.target.markers import exact_markers
from sixthlink.target.other_boards import another_board
from sixthlink.target.target import GreyImage

__all__ = ["other_dots", "other_kind", "other_tags"]

WIDTH_PX = 1300
"""Image width at which tags and dots are looked for."""

FEWEST_TAGS, FEWEST_DOTS = 3, 12
"""Fewer may be something else."""

LONGEST = 40
"""Steps of the largest grid of dots that is looked for."""

FAMILIES = {
    **{f"DICT_{n}X{n}_250": f"DICT_{n}X{n}" for n in (4, 5, 6, 7)},
    **{
        name: name
        for name in ("DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h11")
    },
}
"""Dictionaries that hold the tags that boards usually have, and what is said of them."""


def other_kind(image: GreyImage) -> str:
    """The tags, dots or chessboard that are in the picture, in words that begin with a semicolon; empty without any."""
    return other_tags(image) or other_dots(image) or another_board(image)


def other_tags(image: GreyImage) -> str:
    """Tags of a dictionary, if three different ones are seen."""
    small = reduced_image(image, WIDTH_PX)
    seen = {family: np.unique(exact_markers(small, dictionary)) for dictionary, family in FAMILIES.items()}
    family, numbers = max(seen.items(), key=lambda entry: len(entry[1]))
    if len(numbers) < FEWEST_TAGS:
        return ""
    return (
        f"; the wrong board? tags of {family} are in the picture, numbers {numbers[0]} to {numbers[-1]}: show the "
        "declared board, or declare this one"
    )


def other_dots(image: GreyImage) -> str:
    """A grid of dots."""
    grids = walk_grids(find_blobs(image, min(WIDTH_PX, image.shape[1])), LONGEST)
    dots = max((len(dots) for _, dots in grids), default=0)
    if dots < FEWEST_DOTS:
        return ""
    return f"; the wrong board? a grid of {dots} dots is in the picture: show the declared board, or declare this one"
