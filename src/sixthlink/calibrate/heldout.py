"""How far off is a calibration on shots that it has not seen?"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.heldout_error import HeldOut
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.turns import turn_transforms
from sixthlink.calibrate.usable import located_targets
from sixthlink.geometry import Floats, inverse, rotation_angle
from sixthlink.recording import EYE_IN_HAND, Recording, Rejection, flange_poses_of, shots_of_kind
from sixthlink.robot import Arm

__all__ = ["held_out"]


def held_out(
    recording: Recording,
    cameras: RigCalibration | None,
    arm: Arm | None,
    *,
    X: Floats,
    placements: tuple[str, ...],
    Ts_stand_target: Floats,
) -> tuple[HeldOut | None, tuple[Rejection, ...]]:
    """Judge a calibration by the recording's shots of kind ``judge``.

    Args:
        recording: The recording.
        cameras: The cameras as the calibration has them, or None for recorded target poses.
        arm: The calibrated arm; None where the controller's flange poses count.
        X: ``(4, 4)`` the head.
        placements: Names of the P placements that the calibration knows.
        Ts_stand_target: ``(P, 4, 4)`` where it puts them.

    Returns:
        The error, None where no such shot could be judged; and the shots that could not, with the reason.
    """
    if len(shots_of_kind(recording, "judge")) == 0:
        return None, ()
    shots, targets, Ts_head_target = located_targets(recording, cameras, "judge")
    known = np.array([recording.placements[s] in placements for s in shots], dtype=bool)
    rejections = (targets.rejections if targets else ()) + tuple(
        Rejection(recording.ids[s], "", f"nothing to judge it by: no calibration shot of {recording.placements[s]!r}")
        for s in shots[~known]
    )
    if not known.any():
        return None, rejections
    shots, Ts_head_target = shots[known], Ts_head_target[known]
    Ts_base_flange = flange_poses_of(recording, arm=arm)[shots]
    Ts_stand_carrier = Ts_base_flange if recording.mount == EYE_IN_HAND else inverse(Ts_base_flange)
    expected = Ts_stand_target[[placements.index(recording.placements[s]) for s in shots]]
    target = recording.target
    renamed = turn_transforms(target.points_m, target.turn) if target else np.eye(4)[None]
    misses = [inverse(expected) @ Ts_stand_carrier @ X @ Ts_head_target @ T for T in renamed]
    angles = np.stack([rotation_angle(miss[:, :3, :3]) for miss in misses])
    best = np.argmin(angles, axis=0)
    chosen = np.stack(misses)[best, np.arange(len(shots))]
    return HeldOut(
        shots=len(shots),
        rms_translation_m=float(np.sqrt(np.mean(np.sum(chosen[:, :3, 3] ** 2, axis=1)))),
        rms_rotation_rad=float(np.sqrt(np.mean(angles.min(axis=0) ** 2))),
    ), rejections
