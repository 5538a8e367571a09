"""Which points of a tracker record were left out, and why?"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.joint import Estimate, standing
from sixthlink.calibrate.tracked_arm.contradictions import refuse_contradictions
from sixthlink.calibrate.tracked_arm.measured import TrackerData, tracker_data
from sixthlink.errors import CalibrationError
from sixthlink.recording import Rejection, TrackerRecord
from sixthlink.robot import Arm
from sixthlink.units import MM

__all__ = ["points_of_the_same_arm", "wrong_points"]


def points_of_the_same_arm(record: TrackerRecord, arm: Arm) -> TrackerData:
    """The usable points of a record as those of an arm that another recording names.

    Raises:
        TooFewShotsError: The points say hardly more than where tracker and reflectors are.
        CalibrationError: The record has another number of joints, or its points contradict the arm.
    """
    joints = record.joints.shape[1]
    if joints != len(arm.joints):
        raise CalibrationError(
            f"the tracker record {record.name} has {joints} joints, but {arm.name} has {len(arm.joints)}: it is of "
            "another robot"
        )
    seen = tracker_data(record, arm)
    refuse_contradictions(seen.data, standing(arm, seen.data.outside))
    return seen


def wrong_points(record: TrackerRecord, seen: TrackerData, found: Estimate) -> tuple[Rejection, ...]:
    """Points that the estimate left out, and those whose joints are not known.

    Args:
        record: The record.
        seen: Its usable points.
        found: The estimate; the kinds of the tracker are the last of its single observations.
    """
    first = len(found.kept) - len(seen.rows)
    rejections = []
    for rows, kept, part in zip(seen.rows, found.kept[first:], found.fit.linear[first:], strict=False):
        for i in np.flatnonzero(~kept).tolist():
            off = float(np.linalg.norm(part.residuals[i, :3]))
            reflector = record.reflectors[int(record.reflector_of[rows[i]])].name
            reason = f"{off / MM:.3g} mm from where the arm carries reflector {reflector}"
            rejections.append(Rejection(_name(record, int(rows[i])), "", reason))
    for i in seen.aside.tolist():
        reason = "not all joints that move its reflector were recorded: only its sweep's axis is used"
        rejections.append(Rejection(_name(record, i), "", reason))
    return tuple(rejections)


def _name(record: TrackerRecord, index: int) -> str:
    """A point for people: its own name, or its sweep and its place in it."""
    if record.names[index]:
        return record.names[index]
    sweep = int(record.sweep_of[index])
    place = int(np.count_nonzero(record.sweep_of[:index] == sweep)) + 1
    return f"{record.sweeps[sweep].name}, point {place}"
