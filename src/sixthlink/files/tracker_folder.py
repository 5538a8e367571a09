"""What did the laser tracker write into this folder?

A tracker record is a folder with ``tracker.yaml`` and the tables of the instrument as it exported them. Reading goes
on past the first mistake as far as it makes sense, so that one run names everything that has to be corrected.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sixthlink.errors import Finding, InputError
from sixthlink.files.recording_robot import file_sha256
from sixthlink.files.sections import Sections, add_finding
from sixthlink.files.tracker_description import (
    TrackerDescription,
    tracker_description,
    tracker_sections,
    unit_factors,
)
from sixthlink.files.tracker_rows import TableRows, read_table
from sixthlink.files.tracker_sheets import TableTask
from sixthlink.geometry import Floats
from sixthlink.recording import ReferencePoints, TrackerRecord

__all__ = ["TRACKER_FILE", "read_tracker_record"]

TRACKER_FILE = "tracker.yaml"


def read_tracker_record(path: Path) -> TrackerRecord:
    """The tracker record in a folder, or beside a ``tracker.yaml`` of any name (``docs/formats.md`` shows the files).

    Args:
        path: The folder, or the description itself.

    Raises:
        InputError: Something is missing, ambiguous or impossible; all findings at once.
    """
    file = path if path.is_file() else path / TRACKER_FILE
    folder = file.parent
    sections = tracker_sections(file)
    description = tracker_description(sections, folder)
    inputs: dict[str, str] = {}
    tables: list[TableRows] = []
    if description is not None:
        for t, table in enumerate(description.tables):
            rows = read_table(TableTask(sections, ("tables", t), table, folder, description, inputs))
            if rows is not None:
                tables.append(rows)
        if len(tables) == len(description.tables):
            _check_together(sections, description, tables)
    if sections.findings or description is None:
        raise InputError(_in_order(sections.findings))
    read = {file.name: file_sha256(file), **inputs, **description.robot.inputs}
    return _record(sections, description, tables, read)


def _record(
    sections: Sections, description: TrackerDescription, tables: list[TableRows], inputs: dict[str, str]
) -> TrackerRecord:
    sweep_of = np.concatenate([t.sweep_of for t in tables])
    reflector_of = np.concatenate([t.reflector_of for t in tables])
    points = np.concatenate([t.points for t in tables])
    times = _all(tables, "times_s")
    measured = sweep_of >= 0
    names = tuple(name for t in tables for name in t.names)
    oriented = np.concatenate([np.full(len(t.names), t.rotations is not None) for t in tables])
    sigma = sections.valid.get("rotation_sigma")
    sigma_rad = None if sigma is None else sigma * unit_factors(description.units)[1]
    covariances = _all(tables, "covariances")
    return TrackerRecord(
        name=sections.valid["name"],
        instrument=sections.valid["instrument"],
        robot=description.robot.name,
        arm=description.robot.arm,
        sweeps=description.sweeps,
        reflectors=description.reflectors,
        points=points[measured],
        names=names if measured.all() else tuple(name for name, used in zip(names, measured, strict=True) if used),
        sweep_of=sweep_of[measured],
        reflector_of=reflector_of[measured],
        joints=np.concatenate([t.joints for t in tables])[measured],
        joints_known=np.concatenate([t.joints_known for t in tables])[measured],
        covariances=None if covariances is None else covariances[measured],
        rotations=_rotations(tables)[measured] if oriented[measured].any() else None,
        oriented=oriented[measured],
        rotation_sigma_rad=sigma_rad,
        times_s=None if times is None else times[measured],
        references=None
        if measured.all()
        else ReferencePoints(
            reflectors=reflector_of[~measured],
            points=points[~measured],
            after=np.cumsum(measured, dtype=np.int64)[~measured],
            covariances=None if covariances is None else covariances[~measured],
            times_s=None if times is None else times[~measured],
        ),
        inputs=inputs,
    )


def _rotations(tables: Sequence[TableRows]) -> Floats:
    """Orientations of all rows, the identity where a table has none."""
    rotations = [np.tile(np.eye(3), (len(t.names), 1, 1)) if t.rotations is None else t.rotations for t in tables]
    return np.concatenate(rotations)


def _all(tables: Sequence[TableRows], name: str) -> Floats | None:
    """One column of all tables, or None when they do not have it."""
    parts = [getattr(t, name) for t in tables]
    return None if any(part is None for part in parts) else np.concatenate(parts)


def _check_together(sections: Sections, description: TrackerDescription, tables: list[TableRows]) -> None:
    """What only all tables together show: nothing was declared in vain, and times are in all tables or in none."""
    used = np.unique(np.concatenate([t.sweep_of for t in tables]))
    for i, sweep in enumerate(description.sweeps):
        if i not in used:
            what, cure = "has no point in any table", "add its table, or remove it"
            add_finding(sections, ("sweeps", sweep.name), what, "points of every sweep", cure, at_key=True)
    seen = np.unique(np.concatenate([t.reflector_of for t in tables]))
    for i, reflector in enumerate(description.reflectors):
        if i not in seen:
            what, cure = "has no point in any table", "add its table, or remove it"
            add_finding(sections, ("reflectors", reflector.name), what, "points of every reflector", cure, at_key=True)
    timed = [t.times_s is not None for t in tables]
    if any(timed) and not all(timed):
        keys = ("tables", timed.index(False))
        what = "has no times, but another table has"
        cure = "name the column of times in every table, or in none"
        add_finding(sections, keys, what, "times in all tables or in none", cure)
    if not any((t.sweep_of >= 0).any() for t in tables):
        what = "have points of reflectors on the ground only"
        cure = "add the points that were measured while the arm moved"
        add_finding(sections, ("tables",), what, "points on the arm", cure, at_key=True)


def _in_order(findings: list[Finding]) -> list[Finding]:
    """Findings file by file, from top to bottom, each once."""
    files = list(dict.fromkeys(f.where for f in findings))
    return sorted(dict.fromkeys(findings), key=lambda f: (files.index(f.where), f.line, f.column))
