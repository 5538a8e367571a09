"""Which poses shall the robot go to, as a table of a person or an off-line program?

One row per target: the programmed joint values, each column named after its joint with its unit (``q1_deg``). Where the
columns ``x_mm``, ``y_mm``, ``z_mm`` and those of an orientation stand beside them, these are the desired pose of the
flange in the base frame; otherwise it is where the nominal arm goes with the programmed values.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text
from sixthlink.files.csv_table import check_columns, column, numbers, read_csv
from sixthlink.geometry import ORIENTATIONS, Floats, rotations_from_values, transform
from sixthlink.robot import Arm, Compensation
from sixthlink.units import ANGLE_UNITS, DEG, LENGTH_UNITS, MM

__all__ = ["Targets", "read_targets", "write_targets"]


@dataclass(frozen=True, eq=False)
class Targets:
    """N targets.

    Attributes:
        names: Name of each, its row number where the table has none.
        joints: ``(N, J)`` programmed joint values [rad or m].
        Ts_base_flange: ``(N, 4, 4)`` desired poses, or None where the programmed joints mean them.
        columns: Names of the joint columns, with their units.
        units: ``(J,)`` radians or metres per unit of each of them.
    """

    names: tuple[str, ...]
    joints: Floats
    Ts_base_flange: Floats | None
    columns: tuple[str, ...]
    units: Floats


def read_targets(path: Path, arm: Arm, *, orientation: str | None = None) -> Targets:
    """The targets of a table.

    Args:
        path: A CSV file.
        arm: The arm whose joints the columns are named after.
        orientation: Name of an orientation (``docs/formats.md`` lists them) whose columns the table has, or None.

    Raises:
        InputError: Everything that is wrong with the table.
    """
    findings: list[Finding] = []
    if orientation is not None and orientation not in ORIENTATIONS:
        expected = f"one of {', '.join(ORIENTATIONS)}"
        raise InputError([Finding("--orientation", "orientation", f"is {orientation!r}", expected, "choose one")])
    table = read_csv(path, findings)
    if table is None:
        raise InputError(findings)
    columns, units = _joint_columns(table.header, arm)
    pose = () if orientation is None else ("x_mm", "y_mm", "z_mm", *ORIENTATIONS[orientation].fields)
    check_columns(table, (*columns, *pose), ("name",), f"the joints of {arm.name}", findings)
    if not table.rows:
        findings.append(Finding(str(path), "rows", "there are none", "one row per target", "add them", 1))
    values, poses = numbers(table, columns, findings), numbers(table, pose, findings) if pose else None
    Ts: Floats | None = None
    if poses is not None and orientation is not None and not findings:
        try:
            Ts = transform(rotations_from_values(ORIENTATIONS[orientation], poses[:, 3:]), poses[:, :3] * MM)
        except ValueError as error:
            findings.append(Finding(str(path), orientation, str(error), "rotations", "correct them"))
    if findings or values is None:
        raise InputError(findings)
    names = tuple(n or str(k + 1) for k, n in enumerate(column(table, "name")))
    return Targets(names, values * units, Ts, columns, units)


def write_targets(path: Path, targets: Targets, found: Compensation) -> None:
    """Write the corrected joint values in the columns and units of the table, with what they correct."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", *targets.columns, "x-corrected_mm", "x-corrected_deg"])
    for name, q, (shift_m, turn_rad) in zip(
        targets.names, (found.joints / targets.units).tolist(), found.before.tolist(), strict=True
    ):
        writer.writerow([name, *q, shift_m / MM, turn_rad / DEG])
    atomic_write_text(path, text.getvalue())


def _joint_columns(header: Sequence[str], arm: Arm) -> tuple[tuple[str, ...], Floats]:
    """The column of every joint, as it is or should be, and its unit."""
    columns, units = [], []
    for j, name in enumerate(arm.joints):
        known = ANGLE_UNITS if arm.turns[arm.own_steps[j]] else LENGTH_UNITS
        unit = next((u for u in known if f"{name}_{u}" in header), "deg" if "deg" in known else "mm")
        columns.append(f"{name}_{unit}")
        units.append(known[unit])
    return tuple(columns), np.array(units)
