"""How do the parts of a simulated cell differ from their drawings?"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from sixthlink.camera import Camera, CameraRig
from sixthlink.geometry import Floats, exp_rotation, inverse, transform
from sixthlink.robot import Arm, arm_with_values, last_link, transform_from_paper_numbers
from sixthlink.simulate.scenario import Scenario

__all__ = [
    "CAMERA_NAMES",
    "built_arm",
    "built_rig",
    "drawn_head",
    "mounted_head",
    "printed_points",
]

CAMERA_NAMES = ("right", "left")
"""The right camera is the reference, as in the paper."""

_LINK_PARAMETER = re.compile(r"(theta|d|a|alpha|beta)(\d+)")


def built_arm(scenario: Scenario, nominal_arm: Arm, random: np.random.Generator) -> Arm:
    """The arm with errors in every DH parameter of its links and in its couplings.

    d stays as drawn where Hayati's β exists: between parallel axes d is one unknown with the next link's.

    Raises:
        ValueError: The arm is not written as a DH table.
    """
    parts = [_LINK_PARAMETER.fullmatch(name) for name in nominal_arm.parameters]
    if not any(parts):
        raise ValueError(
            f"arm {nominal_arm.name} is written as {nominal_arm.dialect!r} without any DH parameter to "
            "disturb; simulate an arm whose dialect is dh or mdh"
        )
    errors = random.standard_normal(len(parts))
    sigmas = np.where(nominal_arm.turns, scenario.angle_sigma_rad, scenario.length_sigma_m)
    names = set(nominal_arm.parameters)
    for k, part in enumerate(parts):
        if part is None or (part[1] == "d" and f"beta{part[2]}" in names):
            sigmas[k] = 0.0
    built = arm_with_values(nominal_arm, nominal_arm.values + sigmas * errors, source="simulated")
    coupled = nominal_arm.joint_map.astype(bool)
    coupled[list(nominal_arm.own_steps), range(len(nominal_arm.joints))] = False
    ratios = nominal_arm.joint_map + scenario.coupling_sigma * coupled * random.standard_normal(coupled.shape)
    return replace(built, joint_map=ratios)


def drawn_head(scenario: Scenario, nominal_arm: Arm) -> Floats:
    """``T_flange_head`` ``(4, 4)`` of the drawing: the scenario's head in place of the arm's last link."""
    T_link5_head = transform_from_paper_numbers(scenario.head)
    return inverse(last_link(nominal_arm)) @ T_link5_head


def mounted_head(scenario: Scenario, T_flange_drawing: Floats, random: np.random.Generator) -> Floats:
    """``T_flange_head`` ``(4, 4)`` as mounted: shifted and turned a little against the drawing."""
    shift = scenario.head_shift_m * random.uniform() * _direction(random)
    turn = scenario.head_turn_rad * random.uniform() * _direction(random)
    T_drawing_head = transform(exp_rotation(turn), shift)
    return T_flange_drawing @ T_drawing_head


def built_rig(scenario: Scenario, random: np.random.Generator) -> CameraRig:
    """The two cameras as they were made and screwed together."""
    drawing = _drawn_rig(scenario)
    cameras = tuple(_built_camera(scenario, camera, random) for camera in drawing.cameras)
    T_drawing_left = transform(
        exp_rotation(scenario.rig_turn_sigma_rad * random.standard_normal(3)),
        scenario.rig_shift_sigma_m * random.standard_normal(3),
    )
    T_left_head = inverse(T_drawing_left) @ drawing.Ts_camera_head[1]
    return CameraRig(drawing.names, cameras, np.stack([np.eye(4), T_left_head]))


def printed_points(points_m: Floats, sigma_m: float, random: np.random.Generator, *, sag_m: float = 0.0) -> Floats:
    """Points ``(P, 3)`` of the board as printer and plate set them: off by ``sigma_m`` in x and y, bent along x [m]."""
    errors = np.zeros_like(points_m)
    errors[:, :2] = sigma_m * random.standard_normal((len(points_m), 2))
    along = points_m[:, 0] - points_m[:, 0].mean()
    errors[:, 2] = sag_m * (1.0 - (along / np.abs(along).max()) ** 2)
    return points_m + errors


def _drawn_rig(scenario: Scenario) -> CameraRig:
    """The two cameras of the drawing; both look at the point of convergence in front of the right one."""
    focal_px = scenario.focal_length_m / scenario.pixel_pitch_m
    centre_px = 0.5 * np.array([scenario.width_px - 1.0, scenario.height_px - 1.0])
    camera = Camera(
        scenario.width_px,
        scenario.height_px,
        np.full(2, focal_px),
        centre_px,
        np.array(scenario.distortion),
    )
    convergence_rad = np.arctan2(scenario.baseline_m, scenario.convergence_m)
    T_head_left = transform(
        exp_rotation(np.array([0.0, convergence_rad, 0.0])), np.array([-scenario.baseline_m, 0.0, 0.0])
    )
    return CameraRig(CAMERA_NAMES, (camera, camera), np.stack([np.eye(4), inverse(T_head_left)]))


def _built_camera(scenario: Scenario, drawing: Camera, random: np.random.Generator) -> Camera:
    focal_px = drawing.focal_px * (1.0 + scenario.focal_sigma * random.standard_normal())
    shift_px = scenario.centre_sigma_m / scenario.pixel_pitch_m * random.standard_normal(2)
    distortion = drawing.distortion[:5] + np.array(scenario.distortion_sigma) * random.standard_normal(5)
    return Camera(drawing.width_px, drawing.height_px, focal_px, drawing.centre_px + shift_px, distortion)


def _direction(random: np.random.Generator) -> Floats:
    v = random.standard_normal(3)
    return v / np.linalg.norm(v)
