"""From where does the head look at a target, and can the arm take it there?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.camera import CameraRig
from sixthlink.geometry import Floats, exp_rotation, inverse, transform, transform_points
from sixthlink.simulate.kinematics import Chain, chain_poses, joints_for_poses
from sixthlink.simulate.optics import sensor_positions

__all__ = ["Cell", "board_views", "gaze", "mark_views", "reached_views", "seen_inside"]

LIMIT_RESERVE = 0.02
"""Part of each joint's range that a planned pose keeps from the limits."""
START_SPREAD = 0.35
"""Starts of the inverse kinematics lie in this part of each joint's range, to both sides of its middle."""


@dataclass(frozen=True, eq=False)
class Cell:
    """What the operator drives by (the drawings) and what the cameras really see.

    Attributes:
        nominal: The arm of the drawing.
        T_flange_drawing: ``(4, 4)`` head of the drawing.
        built: The arm as built.
        T_flange_head: ``(4, 4)`` head as mounted.
        rig: The cameras as built.
    """

    nominal: Chain
    T_flange_drawing: Floats
    built: Chain
    T_flange_head: Floats
    rig: CameraRig


def gaze(baseline_m: float, convergence_m: float) -> Floats:
    """``T_head_gaze`` ``(4, 4)``: origin where the optical axes meet, z between the lines of sight."""
    half_rad = 0.5 * np.arctan2(baseline_m, convergence_m)
    return transform(exp_rotation(np.array([0.0, half_rad, 0.0])), np.array([0.0, 0.0, convergence_m]))


def board_views(
    random: np.random.Generator,
    tilts_rad: Floats,
    azimuths_rad: Floats,
    rolls_rad: Floats,
    depths_m: tuple[float, float],
) -> Floats:
    """Poses ``Ts_gaze_middle`` ``(N, 4, 4)`` of the middle of a board in front of the head.

    Args:
        random: Random numbers, for where the middle lies.
        tilts_rad: ``(N,)`` tilt of each board against the line of sight [rad].
        azimuths_rad: ``(N,)`` direction in the image of the axis of that tilt [rad].
        rolls_rad: ``(N,)`` turn of each board in its own plane [rad].
        depths_m: Nearest and farthest depth against the point of convergence [m].
    """
    N = len(tilts_rad)
    axes = np.stack([np.cos(azimuths_rad), np.sin(azimuths_rad), np.zeros(N)], axis=1)
    rolls = np.stack([np.zeros(N), np.zeros(N), rolls_rad], axis=1)
    shifts = random.uniform(-0.015, 0.015, (N, 3))
    shifts[:, 2] = random.uniform(*depths_m, N)
    return transform(exp_rotation(tilts_rad[:, None] * axes) @ exp_rotation(rolls), shifts)


def mark_views(random: np.random.Generator, count: int, largest_tilt_rad: float) -> Floats:
    """Poses ``Ts_gaze_mark`` ``(N, 4, 4)`` of a mark near the point of convergence, roughly from in front."""
    tilts = largest_tilt_rad * np.sqrt(random.uniform(size=count))
    azimuths, rolls = random.uniform(-np.pi, np.pi, (2, count))
    return board_views(random, tilts, azimuths, rolls, (-0.02, 0.02))


def seen_inside(rig: CameraRig, Ts_head_target: Floats, points_m: Floats, margin_px: float) -> npt.NDArray[np.bool_]:
    """Whether both cameras see all points of a target with a margin: ``(N,)`` for ``(N, 4, 4)`` poses."""
    inside = np.ones(len(Ts_head_target), dtype=bool)
    for camera, T_camera_head in zip(rig.cameras, rig.Ts_camera_head, strict=True):
        points_camera = transform_points((T_camera_head @ Ts_head_target)[:, None], points_m)
        in_front = (points_camera[..., 2] > 0.1).all(axis=1)
        pixels = sensor_positions(camera, np.maximum(points_camera, [-np.inf, -np.inf, 0.1]))
        last_px = np.array([camera.width_px, camera.height_px]) - 1.0 - margin_px
        inside &= in_front & ((pixels >= margin_px) & (pixels <= last_px)).all(axis=(1, 2))
    return inside


def reached_views(
    cell: Cell,
    T_base_target: Floats,
    Ts_head_target: Floats,
    sees: Callable[[Floats], npt.NDArray[np.bool_]],
    random: np.random.Generator,
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Joint values that take the head to views of a target.

    The operator drives by the drawings; whether a view is good is judged by what the built head sees.

    Args:
        cell: The cell.
        T_base_target: ``(4, 4)`` pose of the target.
        Ts_head_target: ``(N, 4, 4)`` wanted views.
        sees: Whether a head that sees the target at ``(N, 4, 4)`` poses sees all that it needs.
        random: Random numbers, for the starts of the inverse kinematics.

    Returns:
        ``(N, J)`` joint values and ``(N,)`` whether they can be used.
    """
    Ts_base_head = T_base_target @ inverse(Ts_head_target)
    Ts_base_flange = Ts_base_head @ inverse(cell.T_flange_drawing)
    lower, upper = cell.nominal.limits[:, 0], cell.nominal.limits[:, 1]
    spread = random.uniform(-START_SPREAD, START_SPREAD, (len(Ts_head_target), len(lower)))
    starts = 0.5 * (lower + upper) + spread * (upper - lower)
    joints, reached = joints_for_poses(cell.nominal, Ts_base_flange, starts, LIMIT_RESERVE)
    Ts_base_built = chain_poses(cell.built, joints) @ cell.T_flange_head
    return joints, reached & sees(inverse(Ts_base_built) @ T_base_target)
