"""How long is a gauge, read by a calibrated arm that touches its two sockets?

The touches of the place where it is read enter the estimate together with those of the calibration, its length
unknown: touches of one socket must agree with each other whatever the length, so reading improves the arm where it
reads. Every place is read by itself: what else was recorded does not change its length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.joint import estimate, start_of
from sixthlink.calibrate.touches.arm_calibration import ArmCalibration
from sixthlink.calibrate.touches.recipe import wrong_touches
from sixthlink.calibrate.touches.settle import settled_touches
from sixthlink.calibrate.touches.sockets import Touches, touch_data
from sixthlink.recording import Rejection
from sixthlink.robot import Arm
from sixthlink.target import LengthStandard

__all__ = ["Reading", "length_under", "read_gauge", "unreadable"]

FEWEST_TOUCHES = 3
"""Touches of each socket from which its place is more than the ball's own errors."""


@dataclass(frozen=True)
class Reading:
    """The length of a gauge at one place.

    Attributes:
        before_m: Length under the nominal arm, with the ball where these touches agree best [m].
        after_m: Length under the calibrated arm [m].
        std_m: Standard uncertainty, widened for what few sockets say of its own size [m].
        rejections: Touches that do not belong.
    """

    before_m: float
    after_m: float
    std_m: float
    rejections: tuple[Rejection, ...]


def read_gauge(calibration: ArmCalibration, touches: Touches, standard: LengthStandard, *, coverage: float) -> Reading:
    """Read the length between the two sockets of a standard at one place.

    Args:
        calibration: The calibrated arm.
        touches: Touches of that place, of both sockets (:func:`unreadable`).
        standard: Which sockets; its length is not used here.
        coverage: Multiples of the standard uncertainty that hold 95 %.
    """
    here = f"{touches.places[0]} (read)"
    used = calibration.touches
    together = Touches(
        shots=(*(t.shot for t in used), *touches.shots),
        placements=(*(t.placement for t in used), *(here for _ in touches.shots)),
        marks=(*(t.mark for t in used), *touches.marks),
        joints=np.concatenate([np.array([t.joints for t in used]), touches.joints]),
        standard=calibration.standard,
    )
    data = touch_data(calibration.nominal, together, unknown=(here,))
    found = estimate(data)
    settled = settled_touches(data, found)
    ends = (together.points.index(standard.marks[0]), together.points.index(standard.marks[1]))
    length_m, std_m = settled.distance(together.places.index(here), ends, coverage=coverage)
    wrong = wrong_touches(together, found.kept[0], settled.state)
    mine = tuple(r for r in wrong if r.shot in touches.shots)
    return Reading(length_under(calibration.nominal, touches, standard), length_m, std_m, mine)


def length_under(arm: Arm, touches: Touches, standard: LengthStandard) -> float:
    """Length [m] under an arm taken as exact, with the ball where the touches of this place agree best."""
    sockets = start_of(touch_data(arm, touches, unknown=touches.places))[0].points_m[0]
    first, second = (sockets[touches.points.index(mark)] for mark in standard.marks)
    return float(np.linalg.norm(second - first))


def unreadable(touches: Touches, standard: LengthStandard) -> Rejection | None:
    """Why the touches of a place do not give the length of a standard; None where they do."""
    for mark in standard.marks:
        count = touches.marks.count(mark)
        if count < FEWEST_TOUCHES:
            reason = f"{count} touches of socket {mark!r}, at least {FEWEST_TOUCHES} are needed to read a length"
            return Rejection(touches.places[0], "", reason)
    return None
