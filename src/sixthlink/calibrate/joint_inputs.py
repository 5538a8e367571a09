"""What of a recording enters the estimate of arm and head together, and with which noise?"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.joint import HeadShots, JointData, repeatability_of
from sixthlink.calibrate.marks import mark_points
from sixthlink.calibrate.observations import MarkSightings, SocketDistances, carried
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.turns import turn_transforms
from sixthlink.calibrate.usable import Usable
from sixthlink.geometry import Floats
from sixthlink.recording import EYE_TO_HAND, Recording, placement_indices, selected, shots_of_kind
from sixthlink.robot import Arm

__all__ = ["joint_data", "middle_of_target"]


def joint_data(
    recording: Recording, nominal: Arm, usable: Usable, cameras: RigCalibration | None, offset: Floats
) -> JointData:
    """Shots, lenses and scale bars of a recording as one set of observations.

    Args:
        recording: The recording, with joint values.
        nominal: Its arm as the maker describes it.
        usable: Its usable shots.
        cameras: The cameras that located them, or None for recorded target poses.
        offset: ``(g,)`` how far these cameras are from what the images alone say.
    """
    assert recording.joints is not None  # noqa: S101 - the caller made sure
    covariances, by_lens = None, np.zeros((0, 6, 0))
    if usable.targets is not None and cameras is not None:
        covariances, by_lens = _pixel_noise(recording, usable, cameras)
    shots = HeadShots(
        recording.joints[usable.shots], usable.problem, recording.mount == EYE_TO_HAND, covariances, by_lens
    )
    bars = _scale_bars(recording, nominal, cameras)
    return JointData(
        arm=nominal,
        shots=shots,
        lens_covariance=cameras.covariance if cameras else np.zeros((0, 0)),
        lens_offset=offset,
        sightings=bars[0] if bars else None,
        certificate=bars[1] if bars else None,
    )


def _pixel_noise(recording: Recording, usable: Usable, cameras: RigCalibration) -> tuple[Floats, Floats]:
    """Covariances ``(S, 6, 6)`` of the poses from the noise that the images show, and their derivatives by the rig."""
    assert usable.targets is not None  # noqa: S101 - the caller made sure
    covariances: Floats = np.asarray(np.linalg.inv(usable.targets.informations)) * cameras.noise_ratio**2
    by_lens = usable.targets.by_rig
    if recording.target is not None and usable.turns.any():
        # A target read from another end has its origin elsewhere: noise and derivative are carried there.
        Ts_target_renamed = turn_transforms(recording.target.points_m, recording.target.turn)[usable.turns]
        levers = usable.targets.Ts_head_target[:, :3, :3] @ Ts_target_renamed[:, :3, 3:]
        to_origin = carried(levers[:, :, 0])
        covariances = to_origin @ covariances @ np.swapaxes(to_origin, 1, 2)
        by_lens = to_origin @ by_lens
    return covariances, by_lens


def _scale_bars(
    recording: Recording, nominal: Arm, cameras: RigCalibration | None
) -> tuple[MarkSightings, SocketDistances] | None:
    """Marks of the placements of kind ``scale`` where both were seen, and their certified distance."""
    wanted = shots_of_kind(recording, "scale")
    if cameras is None or recording.standard is None or recording.joints is None or len(wanted) == 0:
        return None
    seen = selected(cameras.detections, np.isin(cameras.detections.shots, wanted))
    points, _ = mark_points(cameras.rig, seen, recording.ids, cameras.unknowns)
    ends: dict[str, set[int]] = {}
    for p in points:
        ends.setdefault(recording.placements[p.shot], set()).add(p.mark)
    points = tuple(p for p in points if ends[recording.placements[p.shot]] >= {0, 1})
    if not points:
        return None
    shots = np.array([p.shot for p in points], dtype=np.int64)
    places, names = placement_indices(recording, shots)
    sightings = MarkSightings(
        joints=recording.joints[shots],
        points_head=np.array([p.point_head for p in points]),
        covariances=np.array([p.covariance for p in points]) * cameras.noise_ratio**2,
        places=places,
        marks=np.array([p.mark for p in points], dtype=np.int64),
        repeatability_rad=repeatability_of(nominal),
        by_lens=np.array([p.by_rig for p in points]),
        fixed_head=recording.mount == EYE_TO_HAND,
    )
    standard = recording.standard
    distances = SocketDistances(np.arange(len(names)), standard.length_m, standard.uncertainty_m, block="marks")
    return sightings, distances


def middle_of_target(recording: Recording) -> Floats:
    """Middle ``(3,)`` of the target in its own frame [m]; the origin where only poses were recorded."""
    return np.zeros(3) if recording.target is None else np.asarray(recording.target.points_m.mean(axis=0))
