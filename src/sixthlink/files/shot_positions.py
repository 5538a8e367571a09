"""Do the numbers of the positions mean what their declared units and conventions say?"""

from __future__ import annotations

import math

import numpy as np

from sixthlink.errors import Finding
from sixthlink.files.csv_table import CsvTable, cell_finding
from sixthlink.geometry import Floats, Orientation, rotations_from_values, transform
from sixthlink.robot import Arm

__all__ = ["check_limits", "joint_units", "looks_like_other_unit", "poses_from_numbers"]

LIMIT_TOLERANCE = 1e-6
"""How far beyond a limit [rad or m] a joint may be: rounding of a file."""

MOST_RADIANS = 4.0 * math.pi
"""No industrial joint turns further than two turns to each side: more is another unit."""

FEWEST_TO_JUDGE = 5
"""Fewest shots from which small joint values are taken for radians that were declared as degrees."""


def joint_units(arm: Arm, length_m: float, angle_rad: float) -> Floats:
    """``(J,)`` metres or radians per unit in which each joint is written."""
    driven = np.abs(arm.joint_map) > 0.0
    sliding = np.array([not arm.turns[driven[:, j]].any() for j in range(len(arm.joints))])
    return np.where(sliding, length_m, angle_rad)


def looks_like_other_unit(arm: Arm, values: Floats, angle: str) -> str:
    """Why the joint values look as if the declared unit of angle were wrong, empty when they do not.

    Args:
        arm: The arm.
        values: ``(N, J)`` joint values as the file has them.
        angle: The declared unit.
    """
    turning = values[:, joint_units(arm, 0.0, 1.0) > 0.0]
    if not turning.size:
        return ""
    largest = float(np.abs(turning).max())
    if angle == "rad" and largest > MOST_RADIANS:
        return f"is rad, but a joint is at {largest:g}, more than two turns: that looks like degrees"
    if angle == "deg" and largest < 2.0 * math.pi and len(turning) >= FEWEST_TO_JUDGE:
        return f"is deg, but no joint of any shot is beyond {largest:.3g}: that looks like radians"
    return ""


def check_limits(table: CsvTable, arm: Arm, joints: Floats, units: Floats, findings: list[Finding]) -> None:
    """Find joints outside the limits of the arm.

    Args:
        table: shots.csv, for the places.
        arm: The arm.
        joints: ``(N, J)`` joint values [rad or m].
        units: ``(J,)`` metres or radians per unit of the file.
        findings: Grows.
    """
    below = joints < arm.limits[:, 0] - LIMIT_TOLERANCE
    above = joints > arm.limits[:, 1] + LIMIT_TOLERANCE
    for i, j in np.argwhere(below | above):
        low, high = arm.limits[j] / units[j]
        what = f"is {joints[i, j] / units[j]:g}"
        if "shot" in table.header:
            what += f" in shot {table.rows[i][table.header.index('shot')]}"
        expected = f"{low:g} to {high:g}, the limits of {arm.name}"
        cure = "check unit, sign and order of the joints; other limits belong in an arm file"
        findings.append(cell_finding(table, (int(i), f"q{j + 1}"), what, expected, cure))


def poses_from_numbers(
    table: CsvTable,
    columns: tuple[str, ...],
    values: Floats,
    orientation: Orientation,
    findings: list[Finding],
) -> Floats:
    """Poses ``(N, 4, 4)`` from the numbers of a table; what is no rotation is found, and stands as none.

    Args:
        table: The table, for the places.
        columns: Names of the columns: three of the position, then the fields of the orientation.
        values: ``(N, len(columns))`` numbers [m, and rad where the orientation has angles].
        orientation: How the orientation is written.
        findings: Grows.
    """
    rotations = np.tile(np.eye(3), (len(values), 1, 1))
    for i, turn in enumerate(values[:, 3:]):
        try:
            rotations[i] = rotations_from_values(orientation, turn)[0]
        except ValueError as error:
            what, expected = str(error), "a rotation"
            if orientation.kind == "quaternion":
                what, expected = f"the quaternion has length {np.linalg.norm(turn):.6g}", "length 1"
            cure = "check the order of the columns and the orientation that recording.yaml declares"
            findings.append(cell_finding(table, (i, columns[3]), what, expected, cure))
    return transform(rotations, values[:, :3])
