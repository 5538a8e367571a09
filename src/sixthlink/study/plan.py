"""Where do board, ruler and robot stand in every recording of one cell, and how well do its pixels show them?

Planning the views takes a second or two, drawing errors and noise a millisecond: a cell is planned once, and every
recording of it has the same commanded joint values. The covariances come from the simulator's own optics, differenced.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sixthlink.camera import CameraRig
from sixthlink.geometry import Floats, Ints, apply_motion, inverse, transform_points
from sixthlink.recording import joined, placement_indices, shots_of_kind
from sixthlink.robot import Arm
from sixthlink.simulate import (
    Scenario,
    SimulatedCell,
    chain_of_arm,
    chain_poses,
    ruler_marks,
    sensor_positions,
    simulate_cell,
)
from sixthlink.target import Chessboard

__all__ = ["Plan", "planned"]

STEP_M, STEP_RAD = 1e-6, 1e-6
"""Half the step of the central differences."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A cell whose every recording has the same N shots of the board and M sightings of ruler marks.

    Attributes:
        cell: The cell, without pixels.
        arm: The nominal arm, with the tolerances and the repeatability that are true of the cell.
        joints: ``(N, J)`` commanded joint values of the board's shots [rad or m].
        placements: ``(N,)`` number of the board's placement.
        Ts_base_target: ``(P, 4, 4)`` placements of the board.
        covariances: ``(N, 6, 6)`` of the board's pose from the pixels of a shot, as motions in head axes.
        ruler_joints: ``(M, J)`` commanded joint values of the ruler's shots [rad or m].
        lengths: ``(M,)`` number of the ruler's placement.
        ends: ``(M,)`` which mark.
        marks_base: ``(M, 3)`` where the mark is [m].
        mark_covariances: ``(M, 3, 3)`` of the mark from its pixels, in head axes [m²].
        length_m: True length of the ruler [m].
        length_names: Names of the ruler's placements.
    """

    cell: SimulatedCell
    arm: Arm
    joints: Floats
    placements: Ints
    Ts_base_target: Floats
    covariances: Floats
    ruler_joints: Floats
    lengths: Ints
    ends: Ints
    marks_base: Floats
    mark_covariances: Floats
    length_m: float
    length_names: tuple[str, ...]

    @property
    def scenario(self) -> Scenario:
        """The numbers of the cell."""
        return self.cell.scenario


def planned(scenario: Scenario, nominal_arm: Arm, *, seed: int) -> Plan:
    """Plan a cell.

    Args:
        scenario: The numbers of the cell.
        nominal_arm: The arm as its maker draws it.
        seed: Seed of the placements and views.

    Raises:
        ValueError: The arm does not reach the placements.
    """
    board = Chessboard(columns=scenario.columns, rows=scenario.rows, square_m=scenario.square_m)
    cell = simulate_cell(scenario, nominal_arm, board, seed=seed, images=False)
    recording, truth = cell.recording, cell.truth
    assert recording.joints is not None  # noqa: S101 - a simulated robot tells its joints
    at_board, at_ruler = shots_of_kind(recording, "calibrate"), shots_of_kind(recording, "verify")
    (placements, boards), (lengths, rulers) = (placement_indices(recording, s) for s in (at_board, at_ruler))
    marks = recording.standard.marks if recording.standard else ()
    ends = np.array([marks.index(recording.marks[i]) for i in at_ruler])
    Ts_base_target = np.stack([truth.Ts_base_placement[n] for n in boards])
    Ts_base_ruler = np.stack([truth.Ts_base_placement[n] for n in rulers])
    marks_base = transform_points(Ts_base_ruler[lengths], ruler_marks(truth.standard_length_m)[ends])
    Ts_head_base = inverse(chain_poses(chain_of_arm(truth.arm), recording.joints) @ truth.T_flange_head)
    boards_head = Ts_head_base[at_board] @ Ts_base_target[placements]
    marks_head = transform_points(Ts_head_base[at_ruler], marks_base)
    rig, noise_px = truth.rig, scenario.pixel_noise_px
    empty = joined([])
    return Plan(
        cell=replace(cell, recording=replace(recording, pixels=empty), truth=replace(truth, pixels=empty)),
        arm=replace(
            nominal_arm,
            length_tolerance_m=scenario.length_sigma_m,
            angle_tolerance_rad=scenario.angle_sigma_rad,
            joint_repeatability_rad=scenario.joint_repeatability_rad,
        ),
        joints=recording.joints[at_board],
        placements=placements,
        Ts_base_target=Ts_base_target,
        covariances=np.stack([_pose_covariance(rig, T, board.points_m, noise_px) for T in boards_head]),
        ruler_joints=recording.joints[at_ruler],
        lengths=lengths,
        ends=ends,
        marks_base=marks_base,
        mark_covariances=np.stack([_mark_covariance(rig, p, noise_px) for p in marks_head]),
        length_m=truth.standard_length_m,
        length_names=rulers,
    )


def _pose_covariance(rig: CameraRig, T_head_target: Floats, points_m: Floats, noise_px: float) -> Floats:
    def pixels(motion: Floats) -> Floats:
        return _pixels(rig, transform_points(apply_motion(T_head_target, motion), points_m))

    return _covariance(pixels, np.repeat([STEP_M, STEP_RAD], 3), noise_px)


def _mark_covariance(rig: CameraRig, mark_head: Floats, noise_px: float) -> Floats:
    return _covariance(lambda shift: _pixels(rig, mark_head + shift), np.full(3, STEP_M), noise_px)


def _pixels(rig: CameraRig, points_head: Floats) -> Floats:
    seen = [
        sensor_positions(camera, transform_points(T_camera_head, points_head)).ravel()
        for camera, T_camera_head in zip(rig.cameras, rig.Ts_camera_head, strict=True)
    ]
    return np.concatenate(seen)


def _covariance(pixels: Callable[[Floats], Floats], steps: Floats, noise_px: float) -> Floats:
    """Covariance of what moves pixels, by central differences about zero."""
    columns = [(pixels(step) - pixels(-step)) / (2.0 * step.max()) for step in np.diag(steps)]
    J = np.column_stack(columns)
    return np.asarray(noise_px**2 * np.linalg.inv(J.T @ J), dtype=np.float64)
