"""What must a calibration target be able to say?

A target kind is one file in this package: a frozen dataclass whose fields are what a user writes in
``recording.yaml`` (a field ``square_m`` is the key ``square`` in the recording's unit of length), the points it
carries, and how to find them in an image. It is entered in ``TARGET_KINDS`` and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints
from sixthlink.target.drawing import Drawing

__all__ = ["Found", "GreyImage", "NotFound", "Target", "turn_names"]

GreyImage = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
"""``(height, width)`` grey image, 8 or 16 bit."""


@dataclass(frozen=True, eq=False)
class Found:
    """Points of a target in one image.

    Attributes:
        points: ``(M,)`` indices of the target's points.
        pixels: ``(M, 2)`` where they are [pixel].
        sigmas_px: ``(M,)`` standard deviation of each coordinate [pixel].
    """

    points: Ints
    pixels: Floats
    sigmas_px: Floats


@dataclass(frozen=True)
class NotFound:
    """The target was not found in one image; false in a test, and says why."""

    reason: str

    def __bool__(self) -> bool:
        return False


class Target(Protocol):
    """A calibration target with named points."""

    @property
    def points_m(self) -> Floats:
        """``(P, 3)`` points in the target frame [m].

        Seen from the front, x runs to the right along the columns, y down along the rows and z into the board; the
        kind says where the origin is.
        """
        ...

    @property
    def turn(self) -> Ints | None:
        """``(P,)`` index that each point gets in the least turn after which the target looks the same.

        None if there is no such turn, and an image can tell.
        """
        ...

    @property
    def circle_radii_m(self) -> Floats:
        """``(P,)`` radius of the disc whose centre each point is [m]; 0 where the points are corners.

        A disc is seen as an ellipse whose middle is not the image of the disc's; whoever projects points needs to know.
        """
        ...

    @property
    def drawing(self) -> Drawing:
        """What is printed on the target, with the white margin that finding it needs."""
        ...

    def find(self, image: GreyImage) -> Found | NotFound:
        """Find the points in one image, refined to sub-pixel positions."""
        ...


def turn_names(turn: Ints | None, points: int) -> Ints:
    """``(K, P)`` name that each point gets after 0, 1 ... K - 1 turns; K is 1 for a target that an image can tell."""
    names = [np.arange(points, dtype=np.int64)]
    while turn is not None and not np.array_equal(turn[names[-1]], names[0]):
        names.append(turn[names[-1]])
    return np.stack(names)
