"""What do the simulated cameras see of every named point, without noise?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sixthlink.geometry import Floats, inverse, transform_points
from sixthlink.recording import Detections, Recording, joined
from sixthlink.simulate.kinematics import chain_of_arm, chain_poses
from sixthlink.simulate.optics import sensor_positions
from sixthlink.simulate.truth import GroundTruth

__all__ = ["ruler_marks", "target_poses", "true_pixels"]


def target_poses(truth: GroundTruth, placements: Sequence[str], shots: Sequence[int]) -> Floats:
    """True poses ``Ts_head_target`` ``(S, 4, 4)`` of the board or the ruler in some shots.

    Args:
        truth: What is true.
        placements: Name of the placement in every shot of the recording.
        shots: ``(S,)`` indices of the shots.
    """
    Ts_base_head = chain_poses(chain_of_arm(truth.arm), truth.joints[list(shots)]) @ truth.T_flange_head
    return inverse(Ts_base_head) @ np.stack([truth.Ts_base_placement[placements[i]] for i in shots])


def ruler_marks(length_m: float) -> Floats:
    """Marks A and B ``(2, 3)`` of a ruler in its frame [m]."""
    return np.array([[0.0, 0.0, 0.0], [length_m, 0.0, 0.0]])


def true_pixels(recording: Recording, truth: GroundTruth, sigma_px: float) -> Detections:
    """Where every point of every shot falls in every camera: by shot, then camera, then point.

    Args:
        recording: The shots.
        truth: What is true; its own pixels are not read.
        sigma_px: Standard deviation to write beside every pixel [pixel].
    """
    N = len(recording.ids)
    names = recording.standard.marks if recording.standard is not None else ()
    every_point, marks = np.arange(len(truth.points_m)), ruler_marks(truth.standard_length_m)
    tables = []
    for i, T_head_target in enumerate(target_poses(truth, recording.placements, range(N))):
        if recording.marks[i]:
            indices = np.array([names.index(recording.marks[i])])
            points_target = marks[indices]
        else:
            indices, points_target = every_point, truth.points_m
        M = len(indices)
        for c, T_camera_head in enumerate(truth.rig.Ts_camera_head):
            points_camera = transform_points(T_camera_head @ T_head_target, points_target)
            pixels = sensor_positions(truth.rig.cameras[c], points_camera)
            tables.append(Detections(np.full(M, i), np.full(M, c), indices, pixels, np.full(M, sigma_px)))
    return joined(tables)
