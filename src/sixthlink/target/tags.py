"""Where are the corners of the square tags on a flat target, as far as it is visible?

Tags are read in a reduced image first, then in the whole one if some are missing. Every tag says by its number which
place it has; one that stands elsewhere than the others allow is another's. The corners are then refined in the image
itself, edge by edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints, frozen_floats
from sixthlink.target.clipping import cut_off
from sixthlink.target.coarse import full_pixels, reduced_image
from sixthlink.target.drawing import Drawing
from sixthlink.target.failings import failing_of
from sixthlink.target.markers import (
    dictionary_names,
    marker_bits,
    marker_cells,
    marker_count,
    marker_sides,
    read_markers,
)
from sixthlink.target.other_kinds import other_kind
from sixthlink.target.tag_edges import refine_quads
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["TagLayout", "check_dictionary", "check_sizes", "find_tags", "row_by_row", "tag_drawing"]

Bools = npt.NDArray[np.bool_]

QUICK_WIDTH_PX = 1300
"""Image width at which tags are looked for first; a smaller image is looked at in double size too."""

SMALLEST_CELL_PX = 1.8
"""Tags with smaller cells cannot be told from their glow."""

MISREAD = 3
"""So many tags may be read in the mirror image of a target of which they are no tags."""

AGREEMENT = 0.5
"""Tags farther than this from where the others say they must be, in tag sides, are misread or another target's."""


@dataclass(frozen=True, eq=False)
class TagLayout:
    """Tags on a plane.

    Attributes:
        dictionary: OpenCV's name of their dictionary.
        numbers: ``(T,)`` their numbers, all different.
        corners_m: ``(T, 2)`` upper left corner of each in the target frame [m].
        side_m: Side of each, its black border included [m].
        gap_m: White space around each [m].
        border: Width of the black border [cells].
        upside_down: Whether they are printed turned by 180° against OpenCV's pictures of them.
    """

    dictionary: str
    numbers: Ints
    corners_m: Floats
    side_m: float
    gap_m: float
    border: int = 1
    upside_down: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners_m", frozen_floats(self.corners_m, (len(self.numbers), 2), "corners_m"))

    @property
    def points_m(self) -> Floats:
        """``(4 T, 3)`` corners of each tag: upper left, upper right, lower right, lower left [m]."""
        square = self.side_m * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        flat = (self.corners_m[:, None] + square).reshape(-1, 2)
        return np.concatenate([flat, np.zeros((len(flat), 1))], axis=1)

    @property
    def cells(self) -> int:
        """Cells along a side, the border's included."""
        return marker_bits(self.dictionary) + 2 * self.border

    def as_printed(self, of_picture: Floats) -> Floats:
        """Corners ``(M, 4, ...)`` of OpenCV's pictures in the order of the printed tags, or the other way round."""
        return np.roll(of_picture, 2, axis=1) if self.upside_down else of_picture


def row_by_row(count: int, columns: int, step_m: float) -> Floats:
    """Upper left corners ``(T, 2)`` of tags in rows, the first at the origin [m]."""
    row, column = np.divmod(np.arange(count), columns)
    return step_m * np.stack([column, row], axis=1).astype(np.float64)


def check_dictionary(dictionary: str, largest: int, asked: str) -> None:
    """Refuse a dictionary that does not exist or has no tag of that number, for which the user ``asked``.

    Raises:
        ValueError: Says which dictionaries, or how many tags, there are.
    """
    names = dictionary_names()
    if dictionary not in names:
        raise ValueError(f"unknown dictionary {dictionary!r}, expected one of {', '.join(names)}")
    count = marker_count(dictionary)
    if largest >= count:
        raise ValueError(f"{dictionary} has tags 0 to {count - 1}, but {asked} up to {largest}")


def check_sizes(side_m: float, gap_m: float, cells: int) -> None:
    """Refuse tags without the white space that finding them needs.

    Raises:
        ValueError: Says how much it must be.
    """
    if side_m <= 0.0:
        raise ValueError(f"side of a tag is {side_m} m, expected above 0")
    if gap_m < side_m / cells * (1.0 - 1e-9):
        raise ValueError(
            f"spacing of {gap_m} m between tags of {side_m} m is too narrow to tell them apart, expected at least one "
            f"cell: {side_m / cells:.6g} m"
        )


def tag_drawing(layout: TagLayout, *, squares: bool) -> Drawing:
    """The printed tags with their white space, and black squares in the corners of it if asked for."""
    shapes, inks = [], []
    side, gap = layout.side_m, layout.gap_m
    for number, (x, y) in zip(layout.numbers.tolist(), layout.corners_m.tolist(), strict=True):
        cells, black = marker_cells(layout.dictionary, number, side, layout.border)
        if layout.upside_down:
            cells = side - cells[:, [2, 3, 0, 1]]
        shapes.append(cells + np.array([x, y, x, y]))
        inks.append(black)
        if squares:
            low = np.array([[x - gap, y - gap], [x + side, y - gap], [x + side, y + side], [x - gap, y + side]])
            shapes.append(np.concatenate([low, low + gap], axis=1))
            inks.append(np.ones(4, dtype=np.bool_))
    margin = 2.0 * gap if squares else max(gap, side / layout.cells)
    low, high = layout.corners_m.min(axis=0) - margin, layout.corners_m.max(axis=0) + side + margin
    return Drawing(np.r_[low, high], np.concatenate(shapes), np.concatenate(inks))


def find_tags(image: GreyImage, layout: TagLayout, fewest: int) -> Found | NotFound:
    """Corners of the visible tags in one image, refined; point ``4 t + i`` is corner i of tag t of the layout.

    Args:
        image: ``(height, width)`` grey image.
        layout: The tags.
        fewest: Fewer tags than this are not enough.
    """
    read, quads = _read(image, layout)
    known = np.isin(read, layout.numbers)
    tags, quads, strangers = _places(layout, read[known]), quads[known], read[~known]
    if len(tags) < min(MISREAD, len(layout.numbers)) and _mirrored(image, layout, len(tags)):
        return NotFound("the image is mirrored: its mirror image shows the tags; turn off flipping in the camera")
    if len(tags) < fewest:
        why = "" if len(strangers) else _why_not(image, layout) or other_kind(image)
        return NotFound(_too_few(layout, f"{len(tags)} of its tags found", fewest, strangers) + why)
    together = _together(layout, tags, quads)
    if len(tags) > 1 and 2 * np.count_nonzero(together) <= len(tags):
        if len(tags) >= 2 * len(np.unique(tags)) - 1:
            return NotFound("two boards are in the picture, the same tags twice: cover one of them, or cut it off")
        return NotFound("the wrong board? the tags are not where they should be to each other")
    tags, first = np.unique(tags[together], return_index=True)
    quads = quads[together][first]
    cell = np.linalg.norm(np.roll(quads, -1, axis=1) - quads, axis=2).min(axis=1) / layout.cells
    if cell.max(initial=0.0) < SMALLEST_CELL_PX:
        return NotFound(
            f"too small: the cells of the tags are {cell.max():.1f} pixel wide, expected at least {SMALLEST_CELL_PX:g}"
        )
    tags, quads, cell = (k[cell >= SMALLEST_CELL_PX] for k in (tags, quads, cell))
    gap = layout.gap_m / layout.side_m
    refined = refine_quads(image, quads, marker_sides(layout.dictionary, layout.numbers[tags]), layout.border, gap)
    white_gone = cut_off(image, quads, cell)
    good = refined.good & ~white_gone[:, None]
    whole = np.count_nonzero(good.all(axis=1))
    if whole < fewest and white_gone.any():
        return NotFound(
            f"over-exposed: around {np.count_nonzero(white_gone)} of {len(tags)} tags the white is cut off at the end "
            "of the range, and their edges have moved: less light or a shorter exposure"
        )
    if whole < fewest:
        why = _why_not(image, layout)
        return NotFound(_too_few(layout, f"{whole} tags left after refinement", fewest, strangers) + why)
    points = (4 * tags[:, None] + (np.arange(4) + (2 if layout.upside_down else 0)) % 4)[good]
    order = np.argsort(points)
    return Found(points[order], refined.corners[good][order], refined.sigmas_px[good][order])


def _read(image: GreyImage, layout: TagLayout) -> tuple[Ints, Floats]:
    """Numbers ``(M,)`` and rough corners ``(M, 4, 2)`` of all tags of the dictionary, in the order of its pictures."""
    corners_m = layout.as_printed(layout.points_m[:, :2].reshape(-1, 4, 2))
    best: tuple[Ints, Floats] = (np.empty(0, dtype=np.int64), np.empty((0, 4, 2)))
    quick, whole = (reduced_image(image, width) for width in (QUICK_WIDTH_PX, image.shape[1]))
    # Tags that are too small for the reader's contours are not too small for its eye.
    for reduced, larger in ((quick, 1), (whole, 1)) if quick.shape != whole.shape else ((whole, 1), (whole, 2)):
        seen = reduced if larger == 1 else _enlarged(reduced, larger)
        numbers, quads = read_markers(seen, layout.dictionary, layout.border, layout.numbers, corners_m)
        if len(numbers) > len(best[0]):
            quads = (quads + 0.5) / larger - 0.5
            best = numbers, full_pixels(quads, reduced, image).reshape(-1, 4, 2)
        if np.isin(layout.numbers, numbers).all():
            break
    return best


def _mirrored(image: GreyImage, layout: TagLayout, seen: int) -> bool:
    """Whether the mirror image shows more tags of the layout than were seen."""
    return int(np.count_nonzero(np.isin(_read(image[:, ::-1].copy(), layout)[0], layout.numbers))) > seen


def _why_not(image: GreyImage, layout: TagLayout) -> str:
    width_m, height_m = (np.ptp(layout.corners_m, axis=0) + layout.side_m + 2.0 * layout.gap_m).tolist()
    return failing_of(image, (width_m, height_m), SMALLEST_CELL_PX * layout.cells / layout.side_m)


def _enlarged(image: npt.NDArray[np.uint8], factor: int) -> npt.NDArray[np.uint8]:
    """The image so many times as large; pixel centres are whole numbers in both."""
    import cv2

    larger = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_CUBIC)
    return np.asarray(larger, dtype=np.uint8)


def _places(layout: TagLayout, numbers: Ints) -> Ints:
    """Index in the layout of each tag of it."""
    order = np.argsort(layout.numbers)
    return np.asarray(order[np.searchsorted(layout.numbers, numbers, sorter=order)], dtype=np.int64)


def _together(layout: TagLayout, tags: Ints, quads: Floats) -> Bools:
    """Which tags lie where most of them say that they must, as far as an undistorted view of a plane tells."""
    import cv2

    if len(tags) < 2:
        return np.ones(len(tags), dtype=np.bool_)
    points = layout.points_m[:, :2].reshape(-1, 4, 2)[tags] / layout.side_m
    seen = layout.as_printed(quads)
    sides = np.linalg.norm(np.roll(quads, -1, axis=1) - quads, axis=2).mean(axis=1)
    reach = AGREEMENT * float(np.median(sides))
    found: npt.NDArray[Any] | None = cv2.findHomography(points.reshape(-1, 2), seen.reshape(-1, 2), cv2.RANSAC, reach)[
        0
    ]
    if found is None:
        return np.zeros(len(tags), dtype=np.bool_)
    expected = cv2.perspectiveTransform(points, found)
    return np.asarray(np.linalg.norm(expected - seen, axis=2).max(axis=1) <= AGREEMENT * sides, dtype=np.bool_)


def _too_few(layout: TagLayout, what: str, fewest: int, strangers: Ints) -> str:
    low, high = int(layout.numbers.min()), int(layout.numbers.max())
    wanted = f"{layout.dictionary} number {low}" + (f" to {high}" if high > low else "")
    start = f"{what}, expected at least {fewest} ({wanted}, border of {layout.border} cells)"
    if len(strangers):
        others = ", ".join(str(k) for k in sorted(set(strangers.tolist()))[:8])
        return f"{start}; the wrong board? others of this dictionary are in view: {others}"
    return f"{start}; is enough of it in view, sharp and with white around it, and are dictionary and border right?"
