"""What does a recording hold that begins with pixels: the cameras are calibrated from it too.

Everything that a user's recording goes through from its detected pixels on: cameras, target poses, marks. Slower than
poses by far, and without the assumption that the pixels' noise reaches the poses linearly.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sixthlink.calibrate import RigCalibration, calibrate_rig, locate_targets, mark_points
from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import HeadShots, JointData
from sixthlink.calibrate.observations import KnownLengths
from sixthlink.camera import CameraRig, lens_vector
from sixthlink.geometry import Floats, inverse, motion_between
from sixthlink.recording import Recording, selected, shots_of_kind
from sixthlink.robot import flange_poses
from sixthlink.simulate import GroundTruth, built_arm, built_rig, chain_of_arm, chain_poses, printed_points, true_pixels
from sixthlink.study.draw import Draw, drawn_head_of
from sixthlink.study.plan import Plan

__all__ = ["drawn_pixels"]


def drawn_pixels(plan: Plan, random: np.random.Generator) -> Draw:
    """A recording that begins with pixels: fresh arm, head, cameras, print, stops of the joints and pixel noise.

    Raises:
        CalibrationError: The cameras cannot be calibrated from it.
    """
    recording, truth = _recorded(plan, random)
    assert recording.pixels is not None  # noqa: S101 - they were just drawn
    cameras = calibrate_rig(recording, recording.pixels)
    # The noise is told, not found: what the images show of it is the scale of their residuals.
    ratio = cameras.noise_px / plan.scenario.pixel_noise_px
    shots = _shots(plan, recording, cameras)
    Ts_base_head = chain_poses(chain_of_arm(truth.arm), plan.joints) @ truth.T_flange_head
    return Draw(
        truth.arm,
        truth.T_flange_head,
        exact=inverse(Ts_base_head) @ plan.Ts_base_target[plan.placements],
        data=JointData(plan.arm, shots, lens_covariance=cameras.covariance / ratio**2),
        lengths=_marks(plan, recording, cameras),
        lens_truth=_lens_step(cameras, truth.rig),
        lens_names=cameras.names,
    )


def _recorded(plan: Plan, random: np.random.Generator) -> tuple[Recording, GroundTruth]:
    scenario, recording = plan.scenario, plan.cell.recording
    assert recording.joints is not None  # noqa: S101 - a simulated robot tells its joints
    truth = replace(
        plan.cell.truth,
        arm=built_arm(scenario, plan.arm, random),
        T_flange_head=drawn_head_of(plan, random),
        rig=built_rig(scenario, random),
        points_m=printed_points(plan.cell.target.points_m, scenario.print_sigma_m, random),
        joints=recording.joints + scenario.joint_repeatability_rad * random.standard_normal(recording.joints.shape),
    )
    pixels = true_pixels(recording, truth, scenario.pixel_noise_px)
    noisy = pixels.pixels + scenario.pixel_noise_px * random.standard_normal(pixels.pixels.shape)
    return replace(recording, pixels=replace(pixels, pixels=noisy)), truth


def _shots(plan: Plan, recording: Recording, cameras: RigCalibration) -> HeadShots:
    at_board = shots_of_kind(recording, "calibrate")
    seen = selected(cameras.detections, np.isin(cameras.detections.shots, at_board))
    seen = replace(seen, sigmas_px=np.full(len(seen), plan.scenario.pixel_noise_px))
    # The simulator names every point rightly, so that no half turn of the board has to be found.
    found = locate_targets(cameras.rig, cameras.points_m, seen, recording.ids, unknowns=cameras.unknowns)
    rows = np.searchsorted(at_board, found.shots)
    joints = plan.joints[rows]
    problem = HeadProblem(flange_poses(plan.arm, joints), found.Ts_head_target, plan.placements[rows])
    covariances = np.asarray(np.linalg.inv(found.informations), dtype=np.float64)
    return HeadShots(joints, problem, covariances=covariances, by_lens=found.by_rig)


def _marks(plan: Plan, recording: Recording, cameras: RigCalibration) -> KnownLengths:
    at_ruler = shots_of_kind(recording, "verify")
    detections = recording.pixels
    assert detections is not None  # noqa: S101 - they were just drawn
    seen = selected(detections, np.isin(detections.shots, at_ruler))
    points = mark_points(cameras.rig, seen, recording.ids, cameras.unknowns)[0]
    rows = np.searchsorted(at_ruler, np.array([p.shot for p in points]))
    return KnownLengths(
        plan.ruler_joints[rows],
        np.array([p.point_head for p in points]),
        np.array([p.covariance for p in points]),
        plan.lengths[rows],
        plan.ends[rows],
        plan.length_m,
        0.0,
        np.full(plan.joints.shape[1], plan.scenario.joint_repeatability_rad),
        np.array([p.by_rig for p in points]),
    )


def _lens_step(cameras: RigCalibration, true: CameraRig) -> Floats:
    """Step ``(g,)`` of the free unknowns from the calibrated cameras to the true ones."""
    free, parts = cameras.unknowns, []
    for c, (found, built) in enumerate(zip(cameras.rig.cameras, true.cameras, strict=True)):
        parts.append((lens_vector(built) - lens_vector(found))[free.lens[c]])
    motions = motion_between(cameras.rig.Ts_camera_head, true.Ts_camera_head)
    return np.concatenate([*parts, motions[free.pose].ravel()])
