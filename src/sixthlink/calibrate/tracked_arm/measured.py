"""Which points of a tracker record can speak about the arm, and in which form does the joint estimate take them?

A point needs the values of all joints that move its reflector. The tracker stands still, so that all points are of one
station; a probe whose orientation was measured says six numbers, a reflector three.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.joint import JointData, repeatability_of
from sixthlink.calibrate.observations import MeasuredPoints, MeasuredPoses
from sixthlink.errors import TooFewShotsError
from sixthlink.geometry import Floats, Ints
from sixthlink.recording import TrackerRecord
from sixthlink.robot import Arm

__all__ = ["TrackerData", "by_point", "needed_joints", "tracker_data"]

SPARE_NUMBERS = 12
"""Numbers that the points must say beyond where tracker and reflectors are: below, nothing of an arm is seen."""


@dataclass(frozen=True, eq=False)
class TrackerData:
    """The usable points of a record.

    Attributes:
        data: What the estimate takes.
        rows: Per kind of ``data.outside`` the indices of its points in the record.
        reflectors: ``(r,)`` index in the record of each reflector that is estimated.
        aside: Indices of the points whose joints were not recorded.
    """

    data: JointData
    rows: tuple[Ints, ...]
    reflectors: Ints
    aside: Ints


def needed_joints(arm: Arm, link: int) -> Ints:
    """Indices of the joints that move a link (from 1)."""
    return np.flatnonzero(arm.joint_map[: arm.link_ends[link - 1]].any(axis=0))


def tracker_data(record: TrackerRecord, arm: Arm) -> TrackerData:
    """The points of a record as measured reflectors of an arm.

    Args:
        record: The record.
        arm: Its arm as known beforehand.

    Raises:
        TooFewShotsError: The points say hardly more than where tracker and reflectors are.
    """
    links = np.array([r.link for r in record.reflectors])
    usable = np.zeros(len(record), dtype=bool)
    for link in np.unique(links[record.reflector_of]).tolist():
        mine = links[record.reflector_of] == link
        usable[mine] = record.joints_known[mine][:, needed_joints(arm, link)].all(axis=1)
    oriented = np.asarray(record.oriented)
    kinds = [np.flatnonzero(usable & ~oriented), np.flatnonzero(usable & oriented)]
    used = np.unique(record.reflector_of[usable])
    said = 3 * len(kinds[0]) + 6 * len(kinds[1])
    unknown = 6 + 3 * len(used) + 3 * len(np.unique(record.reflector_of[kinds[1]]))
    if said < unknown + SPARE_NUMBERS:
        needed = -(-(unknown + SPARE_NUMBERS) // 3)
        raise TooFewShotsError(
            f"{int(usable.sum())} points with all their joint values recorded say hardly more than where tracker and "
            f"reflectors are; at least {needed} are needed; 60 all over the joint ranges and a sweep of every joint "
            "are good",
            needed=needed,
            usable=int(usable.sum()),
        )
    points, poses = (_seen(record, arm, rows, used) if len(rows) else None for rows in kinds)
    probed = None
    if poses is not None and record.rotations is not None:
        probed = MeasuredPoses(
            **vars(poses), rotations=record.rotations[kinds[1]], rotation_sigma_rad=record.rotation_sigma_rad
        )
    rows = tuple(k for k in kinds if len(k))
    return TrackerData(JointData(arm, measured=points, probed=probed), rows, used, np.flatnonzero(~usable))


def by_point(record: TrackerRecord, seen: TrackerData, parts: list[Floats]) -> Floats:
    """Values ``(M, ...)`` of all points of the record from one array per kind; NaN-free: 0 where none was used."""
    values = np.zeros((len(record), *parts[0].shape[1:]), dtype=parts[0].dtype)
    for rows, part in zip(seen.rows, parts, strict=True):
        values[rows] = part
    return values


def _seen(record: TrackerRecord, arm: Arm, rows: Ints, used: Ints) -> MeasuredPoints:
    return MeasuredPoints(
        joints=record.joints[rows],
        points_m=record.points[rows],
        stations=np.zeros(len(rows), dtype=np.int64),
        reflectors=np.searchsorted(used, record.reflector_of[rows]),
        repeatability_rad=repeatability_of(arm),
        covariances=None if record.covariances is None else record.covariances[rows],
        links=tuple(record.reflectors[k].link for k in used),
        names=tuple(record.reflectors[k].name for k in used),
    )
