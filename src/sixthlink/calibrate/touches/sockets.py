"""Which touches of a recording are of one socket, and what is known of the sockets' distance?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.joint import JointData, repeatability_of
from sixthlink.calibrate.observations import FixedPointTouches, SocketDistances
from sixthlink.geometry import Floats, Ints
from sixthlink.robot import Arm
from sixthlink.target import LengthStandard

__all__ = ["Touches", "touch_data"]


@dataclass(frozen=True, eq=False)
class Touches:
    """N touches by name, and the numbers that the estimate gives to places and sockets.

    Attributes:
        shots: Id of each touch.
        placements: Place of each touch.
        marks: Socket of each touch.
        joints: ``(N, J)`` joint values [rad or m].
        standard: Length standard, whose two marks are points 0 and 1 of their place; None without one.
    """

    shots: tuple[str, ...]
    placements: tuple[str, ...]
    marks: tuple[str, ...]
    joints: Floats
    standard: LengthStandard | None

    @property
    def places(self) -> tuple[str, ...]:
        """Names of the places, in order of appearance."""
        return tuple(dict.fromkeys(self.placements))

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the sockets, the standard's first."""
        first = () if self.standard is None else self.standard.marks
        return tuple(dict.fromkeys((*first, *self.marks)))

    def numbers(self) -> tuple[Ints, Ints]:
        """Number ``(N,)`` of each touch's place, and of its socket there."""
        place = {name: k for k, name in enumerate(self.places)}
        point = {name: k for k, name in enumerate(self.points)}
        return (
            np.array([place[name] for name in self.placements], dtype=np.int64),
            np.array([point[name] for name in self.marks], dtype=np.int64),
        )

    @property
    def sockets(self) -> tuple[tuple[str, str], ...]:
        """Place and mark of every socket that was touched."""
        return tuple(dict.fromkeys(zip(self.placements, self.marks, strict=True)))


def touch_data(arm: Arm, touches: Touches, *, unknown: Sequence[str] = ()) -> JointData:
    """What the estimate is given.

    Args:
        arm: The nominal arm.
        touches: The touches.
        unknown: Places where the standard's length is not to be used.
    """
    places, points = touches.numbers()
    observed = FixedPointTouches(touches.joints, places, points, repeatability_of(arm))
    standard = touches.standard
    known = [
        k
        for k, name in enumerate(touches.places)
        if standard is not None and name not in unknown and {(name, m) for m in standard.marks} <= {*touches.sockets}
    ]
    distances = None
    if standard is not None and known:
        distances = SocketDistances(np.array(known, dtype=np.int64), standard.length_m, standard.uncertainty_m)
    return JointData(arm, touches=observed, distances=distances)
