"""What does one table of a tracker record say, in metres and radians?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.files.recording_robot import file_sha256
from sixthlink.files.tracker_columns import columns_of
from sixthlink.files.tracker_grid import note_rows, read_grid
from sixthlink.files.tracker_joints import check_joints, row_joints
from sixthlink.files.tracker_noise import check_noise, row_covariances
from sixthlink.files.tracker_places import check_places, row_places
from sixthlink.files.tracker_sheets import (
    Sheet,
    TableTask,
    check_units,
    inside,
    numbers_of,
    sheet_mark,
    table_finding,
)
from sixthlink.files.tracker_times import check_time, row_times
from sixthlink.geometry import ORIENTATIONS, Floats, Ints, inverse, rotations_from_values, transform

__all__ = ["TableRows", "read_table"]


@dataclass(frozen=True)
class TableRows:
    """Rows of one table, N of them.

    Attributes:
        names: Name of each point.
        sweep_of: ``(N,)`` index of the sweep, -1 on the ground.
        reflector_of: ``(N,)`` index of the reflector.
        points: ``(N, 3)`` [m].
        joints: ``(N, J)`` [rad or m], 0 where they were not recorded.
        joints_known: ``(N, J)``.
        covariances: ``(N, 3, 3)`` [m²], or None.
        rotations: ``(N, 3, 3)``, or None.
        times_s: ``(N,)`` [s], or None.
    """

    names: tuple[str, ...]
    sweep_of: Ints
    reflector_of: Ints
    points: Floats
    joints: Floats
    joints_known: npt.NDArray[np.bool_]
    covariances: Floats | None
    rotations: Floats | None
    times_s: Floats | None


def read_table(task: TableTask) -> TableRows | None:
    """One table, or None with findings."""
    checks = (check_places(task), check_joints(task), check_noise(task), check_time(task), _check_orientation(task))
    path = inside(task, ("file",), task.table.file)
    if path is None or not all(checks):
        return None
    where, before = str(path), len(task.findings)

    def numbers(header: tuple[str, ...]) -> Sequence[int] | None:
        columns = columns_of(where, 0, header, task.table, [])
        return None if columns is None else columns.numbers()

    grid = read_grid(path, task.table, numbers, task.findings)
    if grid is None:
        return None
    task.inputs[task.table.file] = file_sha256(path)
    columns = columns_of(where, grid.header_line, grid.header, task.table, task.findings)
    if columns is None:
        return None
    timed = (columns.time,) if columns.time is not None and task.table.time and task.table.time.unit else ()
    mark = sheet_mark(task.table, grid, (*columns.numbers(), *columns.joint_numbers(), *timed), task.findings)
    sheet = Sheet(grid, columns, mark)
    _check_units(task, sheet)
    rows = _rows(task, sheet)
    return rows if len(task.findings) == before else None


def _rows(task: TableTask, sheet: Sheet) -> TableRows | None:
    places = row_places(task, sheet)
    points = numbers_of(sheet, sheet.columns.xyz, task.findings) * task.factors[0]
    rotations = _rotations(task, sheet)
    if rotations is not None and task.table.direction == "T_reflector_tracker":
        poses = inverse(transform(rotations, points))
        rotations, points = poses[:, :3, :3], poses[:, :3, 3]
    covariances = row_covariances(task, sheet, points)
    times = row_times(task, sheet)
    if places is None:  # only the reflectors tell which rows need no joints
        return None
    joints = row_joints(task, sheet, places[1])
    if joints is None:
        return None
    return TableRows(*places, points, *joints, covariances, rotations, times)


def _check_units(task: TableTask, sheet: Sheet) -> None:
    columns, turning = sheet.columns, task.description.robot.turning
    check_units(sheet.grid, (*columns.xyz, *columns.sigma), task.units[0], task.findings)
    for k, turns in zip(columns.joints, turning, strict=False):
        if k is not None:
            check_units(sheet.grid, [k], task.units[1] if turns else task.units[0], task.findings)
    if columns.angle is not None:
        check_units(sheet.grid, [columns.angle], task.units[1], task.findings)


def _check_orientation(task: TableTask) -> bool:
    """An orientation comes with its columns, the way it is written, and the way it points."""
    before, columns = len(task.findings), task.table.columns.orientation
    examples = {"orientation": "quaternion-xyzw", "direction": "T_tracker_reflector"}
    for key, example in examples.items():
        value = getattr(task.table, key)
        if columns is None and value is not None:
            cure = "write for example 'columns: {orientation: [qx, qy, qz, qw]}', or remove it"
            table_finding(task, (key,), "has no columns", "columns.orientation", cure, at_key=True)
        if columns is not None and value is None:
            expected = "the way an orientation is written, and the way it points, beside columns.orientation"
            table_finding(task, (key,), "is missing", expected, f'write for example "{key}: {example}"')
    if columns is not None and task.table.orientation is not None:
        fields = ORIENTATIONS[task.table.orientation].fields
        if len(fields) != len(columns):
            expected = f"{len(fields)}: {' '.join(fields)}"
            what = f"is a list of {len(columns)}"
            table_finding(task, ("columns", "orientation"), what, expected, "write them in that order")
    return len(task.findings) == before


def _rotations(task: TableTask, sheet: Sheet) -> Floats | None:
    """Orientations ``(N, 3, 3)`` as they are written, or None without them."""
    name, places = task.table.orientation, sheet.columns.orientation
    if not places or name is None:
        return None
    before, orientation = len(task.findings), ORIENTATIONS[name]
    values = numbers_of(sheet, places, task.findings)
    if len(task.findings) > before:
        return None
    values = values * task.factors[1] if orientation.is_angle else values
    try:
        return rotations_from_values(orientation, values)
    except ValueError:
        bad = [i for i in range(len(values)) if not _is_rotation(name, values[i])]
    what = f"with the columns after it is no {name}"
    cure = "check the order of the columns and the orientation in tracker.yaml"
    rows = np.array(bad, dtype=np.int64)
    note_rows(sheet.grid, places[0], rows, lambda _: what, task.findings, expected="a rotation", cure=cure)
    return None


def _is_rotation(name: str, values: Floats) -> bool:
    try:
        rotations_from_values(ORIENTATIONS[name], values[None])
    except ValueError:
        return False
    return True
