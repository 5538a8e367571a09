"""What did the user bring in this folder?

A recording is a folder with ``recording.yaml``, ``shots.csv`` and images (or ``pixels.csv``). Reading goes on
past the first mistake as far as it makes sense, so that one run names everything that has to be corrected.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sixthlink.errors import Finding, InputError
from sixthlink.files.csv_table import CsvTable, read_csv
from sixthlink.files.pixels_table import PixelNames, read_pixels
from sixthlink.files.recording_description import Description, described
from sixthlink.files.recording_robot import file_sha256
from sixthlink.files.recording_schema import IMAGES, JOINTS, PIXELS, TARGET_POSES, TOUCHES
from sixthlink.files.sections import Sections, add_finding, read_sections
from sixthlink.files.shot_positions import (
    check_limits,
    joint_units,
    looks_like_other_unit,
    poses_from_numbers,
)
from sixthlink.files.shots_table import FEWEST_SHOTS, ShotLayout, Shots, check_image_files, read_shots
from sixthlink.files.yaml_marks import MarkedYaml, read_yaml
from sixthlink.geometry import Floats, Orientation, inverse
from sixthlink.recording import Detections, Recording

__all__ = ["PIXELS_FILE", "RECORDING_FILE", "SHOTS_FILE", "read_recording"]

RECORDING_FILE, SHOTS_FILE, PIXELS_FILE = "recording.yaml", "shots.csv", "pixels.csv"


def read_recording(folder: Path, *, arm: Path | None = None, calibrating: bool = True) -> Recording:
    """The recording in a folder (``docs/formats.md`` shows the files).

    Args:
        folder: The folder.
        arm: Arm file whose kinematics replace the robot's own, for example a calibrated arm; anywhere on
            disk.
        calibrating: Whether the recording has to hold enough calibrate shots; a recording that only verifies need not.

    Raises:
        InputError: Something in the folder is missing, ambiguous or impossible; all findings at once.
    """
    sections = _sections(folder)
    description = described(sections, folder, arm)
    table = read_csv(folder / SHOTS_FILE, sections.findings)
    if table is None:
        raise InputError(_in_order(sections.findings))
    shots = read_shots(table, _layout(description, calibrating=calibrating), sections.findings)
    joints = _joints(sections, description, table, shots)
    flange_poses = _flange_poses(sections, description, table, shots)
    target_poses = _target_poses(sections, description, table, shots)
    images = check_image_files(table, shots.images, folder, sections.findings)
    pixels = _pixels(folder, description, shots, sections.findings)
    if sections.findings or description.head is None:
        raise InputError(_in_order(sections.findings))
    return Recording(
        name=description.name,
        mount=description.mount,
        robot=description.robot.name,
        arm=description.robot.arm,
        head=description.head,
        target=description.target,
        standard=description.standard,
        ids=shots.ids,
        placements=shots.placements,
        kinds=shots.kinds,
        marks=shots.marks,
        joints=joints,
        Ts_base_flange=flange_poses,
        images=shots.images,
        pixels=pixels,
        Ts_head_target=target_poses,
        inputs=_inputs(folder, images, with_pixels=pixels is not None) | description.robot.inputs,
    )


def _sections(folder: Path) -> Sections:
    """Sections of recording.yaml; a file that cannot be read has none, and its findings."""
    path = folder / RECORDING_FILE
    try:
        return read_sections(read_yaml(path))
    except InputError as error:
        return Sections(MarkedYaml(str(path), None, {}, {}), findings=list(error.findings))


def _layout(description: Description, *, calibrating: bool) -> ShotLayout:
    """Columns that shots.csv must have."""
    robot = description.robot
    positions, why = None, ""
    if robot.positions == JOINTS and robot.arm is not None:
        count = len(robot.arm.joints)
        positions, why = tuple(f"q{j}" for j in range(1, count + 1)), f"{robot.arm.name} has {count} joints"
    elif robot.positions is not None and robot.positions != JOINTS and robot.orientation is not None:
        positions, why = ("x", "y", "z", *robot.orientation.fields), "for positions: flange-poses"
    observations, head = description.observations, description.head
    cameras: tuple[str, ...] | None = None if observations in {None, IMAGES} else ()
    if observations == IMAGES and head is not None:
        cameras = tuple(c.name for c in head.cameras)
    targets: tuple[str, ...] | None = () if observations in {IMAGES, PIXELS, TOUCHES} else None
    if observations == TARGET_POSES and description.target_orientation is not None:
        targets = _target_columns(description.target_orientation)
    fewest = FEWEST_SHOTS if calibrating else 0
    return ShotLayout(positions, targets, cameras, description.marks, why, fewest, observations == TOUCHES)


def _target_columns(orientation: Orientation) -> tuple[str, ...]:
    return tuple(f"target_{name}" for name in ("x", "y", "z", *orientation.fields))


def _joints(sections: Sections, description: Description, table: CsvTable, shots: Shots) -> Floats | None:
    """Joint values ``(N, J)`` [rad or m], or None when there are none or their unit is unknown."""
    robot, length_m, angle_rad = description.robot, description.length_m, description.angle_rad
    if robot.positions != JOINTS or robot.arm is None or shots.positions is None:
        return None
    if length_m is None or angle_rad is None:
        return None
    units = joint_units(robot.arm, length_m, angle_rad)
    joints: Floats = shots.positions * units
    suspicion = looks_like_other_unit(robot.arm, shots.positions, sections.valid["units"].angle)
    if suspicion and not robot.confirmed:
        cure = "correct units.angle; or, if it is right, write robot.positions_confirmed: true"
        add_finding(sections, ("units", "angle"), suspicion, "the unit of q1, q2 ... in shots.csv", cure)
    else:
        check_limits(table, robot.arm, joints, units, sections.findings)
    return joints


def _flange_poses(sections: Sections, description: Description, table: CsvTable, shots: Shots) -> Floats | None:
    """Flange poses ``Ts_base_flange`` ``(N, 4, 4)``, or None when the recording has none."""
    robot = description.robot
    if robot.positions == JOINTS or robot.orientation is None:
        return None
    numbers = _metric(description, shots.positions, robot.orientation)
    if numbers is None:
        return None
    columns = ("x", "y", "z", *robot.orientation.fields)
    poses = poses_from_numbers(table, columns, numbers, robot.orientation, sections.findings)
    return inverse(poses) if robot.direction == "T_flange_base" else poses


def _target_poses(sections: Sections, description: Description, table: CsvTable, shots: Shots) -> Floats | None:
    """Measured target poses ``Ts_head_target`` ``(N, 4, 4)``, or None when the recording has none."""
    orientation = description.target_orientation
    if orientation is None:
        return None
    numbers = _metric(description, shots.targets, orientation)
    if numbers is None:
        return None
    poses = poses_from_numbers(table, _target_columns(orientation), numbers, orientation, sections.findings)
    return inverse(poses) if description.target_direction == "T_target_head" else poses


def _metric(description: Description, values: Floats | None, orientation: Orientation) -> Floats | None:
    """Poses' numbers in metres, and radians where they are angles; None while a unit is unknown."""
    if values is None or description.length_m is None or description.angle_rad is None:
        return None
    units = np.full(3 + len(orientation.fields), description.angle_rad if orientation.is_angle else 1.0)
    units[:3] = description.length_m
    scaled: Floats = values * units
    return scaled


def _pixels(folder: Path, description: Description, shots: Shots, findings: list[Finding]) -> Detections | None:
    """Detections of pixels.csv, or None when the recording has none."""
    if description.observations != PIXELS:
        return None
    table = read_csv(folder / PIXELS_FILE, findings)
    if table is None or description.head is None or description.target is None:
        return None
    names = PixelNames(
        shots=shots.ids,
        marks=shots.marks,
        cameras=tuple(c.name for c in description.head.cameras),
        points=len(description.target.points_m),
        standard_marks=description.marks or (),
    )
    return read_pixels(table, names, findings)


def _inputs(folder: Path, images: dict[str, Path], *, with_pixels: bool) -> dict[str, str]:
    """SHA-256 of every file that the recording was read from, by its name in the folder."""
    names = [RECORDING_FILE, SHOTS_FILE, *([PIXELS_FILE] if with_pixels else [])]
    return {name: file_sha256(path) for name, path in [*((n, folder / n) for n in names), *images.items()]}


def _in_order(findings: list[Finding]) -> list[Finding]:
    """Findings file by file, from top to bottom."""
    files = list(dict.fromkeys(f.where for f in findings))
    return sorted(findings, key=lambda f: (files.index(f.where), f.line, f.column))
