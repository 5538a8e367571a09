"""Where did the joints stand when each row of a table was measured?

In columns of the table, in a file of the controller beside it, in one column for the joint that a sweep moves, or
once for a whole table. What was not recorded stays unknown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sixthlink.errors import Finding
from sixthlink.files.recording_robot import file_sha256
from sixthlink.files.shot_positions import FEWEST_TO_JUDGE, LIMIT_TOLERANCE, MOST_RADIANS
from sixthlink.files.tracker_columns import find_column
from sixthlink.files.tracker_grid import Grid, column_texts, note_rows, note_texts, read_grid
from sixthlink.files.tracker_numbers import as_numbers, number_words
from sixthlink.files.tracker_schema import JointsFileSection
from sixthlink.files.tracker_sheets import Sheet, TableTask, check_units, inside, sheet_mark, table_finding
from sixthlink.files.yaml_marks import Keys
from sixthlink.geometry import Floats, Ints

__all__ = ["check_joints", "row_joints"]

Bools = npt.NDArray[np.bool_]


def check_joints(task: TableTask) -> bool:
    """Whether the table speaks of the joints that the robot has, of each once; findings go to the task."""
    before, table, robot = len(task.findings), task.table, task.description.robot
    ways: tuple[tuple[Keys, Sequence[object] | None], ...] = (
        (("columns", "joints"), table.columns.joints),
        (("joints_file", "columns"), None if table.joints_file is None else table.joints_file.columns),
        (("at",), table.at),
    )
    taken: dict[int, str] = {}
    for way, given in ways:
        if given is not None and len(given) != len(robot.turning):
            what, expected = f"is a list of {len(given)}", f"{len(robot.turning)}, one per joint of {robot.name}"
            table_finding(task, way, what, expected, "write ~ for a joint that was not recorded")
            continue
        for j, spec in enumerate(given or ()):
            if spec is not None and j in taken:
                what = f"gives joint {j + 1}, as {taken[j]} does"
                table_finding(task, way, what, "each joint once", "write ~ for it in one of them")
            elif spec is not None:
                taken[j] = ".".join(map(str, way))
    if table.columns.angle is not None and table.columns.joints is not None:
        cure = "keep columns.joints if it has the joint that the sweep moves"
        table_finding(task, ("columns", "angle"), "is given beside columns.joints", "", cure, at_key=True)
    return len(task.findings) == before


def row_joints(task: TableTask, sheet: Sheet, sweep_of: Ints) -> tuple[Floats, Bools] | None:
    """Joint values ``(N, J)`` [rad or m] and whether each was recorded, or None with findings.

    Args:
        task: The table.
        sheet: Its cells.
        sweep_of: ``(N,)`` index of the sweep, -1 for rows of the ground, whose joints are nobody's concern.
    """
    before, robot = len(task.findings), task.description.robot
    measured = np.flatnonzero(sweep_of >= 0)
    values = np.zeros((len(sweep_of), len(robot.turning)))
    known = np.zeros(values.shape, dtype=np.bool_)
    for j, value in enumerate(task.table.at or ()):
        if value is not None:
            values[measured, j], known[measured, j] = value, True
    source = (sheet.grid, sheet.columns.joints, sheet.mark)
    if task.table.joints_file is not None:
        beside = _beside(task, task.table.joints_file, len(sweep_of))
        if beside is None:
            return None
        source = beside
    for j, k in enumerate(source[1]):
        if k is not None:
            values[measured, j], known[measured, j] = _column(source[0], k, measured, source[2], task.findings), True
    if sheet.columns.angle is not None:
        _moved_joint(task, sheet, measured, sweep_of, (values, known))
    if len(task.findings) > before:
        return None
    if not _angles_are_plausible(task, values, known):
        return None
    length_m, angle_rad = task.factors
    factors = np.where(robot.turning, angle_rad, length_m)
    _check_limits(task, source[0], source[1], np.where(known, values, np.nan), factors)
    return (values * factors, known) if len(task.findings) == before else None


def _beside(task: TableTask, section: JointsFileSection, N: int) -> tuple[Grid, tuple[int | None, ...], str] | None:
    """The controller's file, its columns and its decimal mark."""
    path, before = inside(task, ("joints_file", "file"), section.file), len(task.findings)
    if path is None:
        return None

    def places(header: Sequence[str], line: int, found: list[Finding]) -> tuple[int | None, ...]:
        specs = section.columns
        return tuple(None if s is None else find_column(str(path), line, header, s, found) for s in specs)

    def numbers(header: tuple[str, ...]) -> list[int] | None:
        found: list[Finding] = []
        got = places(header, 0, found)
        return None if found else [k for k in got if k is not None]

    grid = read_grid(path, section, numbers, task.findings)
    if grid is None:
        return None
    task.inputs[section.file] = file_sha256(path)
    specs = places(grid.header, grid.header_line, task.findings)
    if len(task.findings) > before:
        return None
    mark = sheet_mark(section, grid, [k for k in specs if k is not None], task.findings)
    for k, turns in zip(specs, task.description.robot.turning, strict=True):
        if k is not None:
            check_units(grid, [k], task.units[1] if turns else task.units[0], task.findings)
    if len(grid) != N:
        what, cure = f"has {len(grid)} rows", "give both files one row per measurement"
        task.findings.append(Finding(str(path), "table", what, f"{N}, as the table of points beside it", cure))
    return (grid, specs, mark) if len(task.findings) == before else None


def _column(grid: Grid, k: int, rows: Ints, mark: str, findings: list[Finding]) -> Floats:
    texts = column_texts(grid, k)
    chosen = texts if len(rows) == len(texts) else [texts[i] for i in rows]
    values, wrong = as_numbers(chosen, mark)
    expected, cure = number_words(mark)
    note_texts(grid, k, rows[wrong], findings, expected=expected, cure=cure)
    return values


def _moved_joint(task: TableTask, sheet: Sheet, measured: Ints, sweep_of: Ints, joints: tuple[Floats, Bools]) -> None:
    """One column for the joint that the sweep moves."""
    k, sweeps = sheet.columns.angle or 0, task.description.sweeps
    angles = _column(sheet.grid, k, measured, sheet.mark, task.findings)
    moved = np.array([-1 if s.joint is None else s.joint for s in sweeps], dtype=np.int64)[sweep_of[measured]]
    free = measured[moved < 0]
    if len(free):
        what = f"sweep {sweeps[int(sweep_of[free[0]])].name!r} moves no single joint"
        cure, expected = "write columns.joints instead of columns.angle", "a sweep of one joint"
        note_rows(sheet.grid, k, free[:1], lambda _: what, task.findings, expected=expected, cure=cure)
        return
    joints[0][measured, moved], joints[1][measured, moved] = angles, True


def _angles_are_plausible(task: TableTask, values: Floats, known: Bools) -> bool:
    """Whether the values do not look like the other unit of angle, or the user confirmed them."""
    robot = task.description.robot
    turning = np.abs(values[:, robot.turning])[known[:, robot.turning]]
    if robot.confirmed or not turning.size:
        return True
    largest, unit, suspicion = float(turning.max()), task.units[1], ""
    if unit == "rad" and largest > MOST_RADIANS:
        suspicion = f"is rad, but a joint is at {largest:g}, more than two turns: that looks like degrees"
    if unit == "deg" and 0.0 < largest < 2.0 * math.pi and known.any(axis=1).sum() >= FEWEST_TO_JUDGE:
        suspicion = f"is deg, but no joint of the table is beyond {largest:.3g}: that looks like radians"
    if suspicion:
        cure = "correct units.angle; or, if it is right, write robot.joints_confirmed: true"
        table_finding(task, ("units", "angle"), suspicion, "the unit of the joint values", cure)
    return not suspicion


def _check_limits(task: TableTask, grid: Grid, places: Sequence[int | None], values: Floats, factors: Floats) -> None:
    """Find joints outside the limits of the arm; values that were not recorded are not a number here."""
    arm = task.description.robot.arm
    if arm is None:
        return
    low, high = (arm.limits / factors[:, None]).T
    slack = LIMIT_TOLERANCE / factors
    for j, k in enumerate(places):
        if k is not None:
            column = values[:, j]
            rows = np.flatnonzero((column < low[j] - slack[j]) | (column > high[j] + slack[j]))
            expected = f"{low[j]:g} to {high[j]:g}, the limits of joint {j + 1} of {arm.name}"
            cure = "check unit, sign and order of the joints; other limits belong in an arm file"
            note_texts(grid, k, rows, task.findings, expected=expected, cure=cure)
