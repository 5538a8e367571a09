"""How does a tracker record become a folder that a person can open, and that reads back as the same record?

Millimetres and degrees, with all the digits that a number has. Points stand in measured order; a new table begins
where other joints, or orientations, were recorded.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text
from sixthlink.files.shot_positions import joint_units
from sixthlink.files.tracker_folder import TRACKER_FILE
from sixthlink.files.tracker_schema import FREE, GROUND_WORD, SCHEMA, SIGMA_COLUMNS, UNKNOWN
from sixthlink.files.tracker_text import guarded_name
from sixthlink.files.yaml_marks import yaml_text
from sixthlink.geometry import ORIENTATIONS, Floats, Ints, values_from_rotations
from sixthlink.recording import GROUND, TrackerRecord
from sixthlink.units import DEG, MM

__all__ = ["write_tracker_record"]

_ORIENTATION = "quaternion-wxyz"
_COVARIANCE = {"cxx": (0, 0), "cxy": (0, 1), "cxz": (0, 2), "cyy": (1, 1), "cyz": (1, 2), "czz": (2, 2)}


def write_tracker_record(
    folder: Path, record: TrackerRecord, *, robot: Mapping[str, object], overwrite: bool = False
) -> None:
    """Write ``tracker.yaml`` and one or more tables of points.

    Args:
        folder: The folder; it is created when missing.
        record: The record.
        robot: Who the robot is, as tracker.yaml says it, for example ``{"name": "abb_irb1400"}`` or
            ``{"kinematics": "none", "label": "positioner", "joints": ["turning", "turning"]}``.
        overwrite: Whether an existing record may be replaced.

    Raises:
        InputError: The folder has a record already.
        OSError: The folder cannot be written.
    """
    runs = _runs(record)
    names = [f"points_{k}.csv" for k in range(1, len(runs) + 1)]
    taken = [p for p in (folder / name for name in (TRACKER_FILE, *names)) if p.exists()]
    if taken and not overwrite:
        cure = "choose another folder, or ask for overwriting"
        raise InputError([Finding(str(p), "file", "exists already", "a new folder", cure) for p in taken])
    turning = _turning(record, robot)
    folder.mkdir(parents=True, exist_ok=True)
    tables = []
    for name, rows in zip(names, runs, strict=True):
        table, text = _table(record, rows, turning)
        atomic_write_text(folder / name, text)
        tables.append({"file": name, **table})
    # Last: a folder without it is no record.
    atomic_write_text(folder / TRACKER_FILE, yaml_text(_sections(record, robot, tables, turning)))


def _turning(record: TrackerRecord, robot: Mapping[str, object]) -> Floats:
    """``(J,)`` radians or metres per written unit."""
    if record.arm is not None:
        return joint_units(record.arm, MM, DEG)
    kinds = robot.get("joints")
    if not isinstance(kinds, list) or len(kinds) != record.joints.shape[1]:
        raise ValueError("robot must say which of its joints turn and which slide")
    return np.array([DEG if kind == "turning" else MM for kind in kinds])


def _sections(
    record: TrackerRecord, robot: Mapping[str, object], tables: list[dict[str, Any]], units: Floats
) -> dict[str, Any]:
    angles = np.abs((record.joints / units)[:, units == DEG])
    sections: dict[str, Any] = {
        "schema": SCHEMA,
        "name": record.name,
        "instrument": record.instrument,
        "units": {"length": "mm", "angle": "deg"},
        "robot": {**robot, **({"joints_confirmed": True} if angles.size and angles.max() < 2 * np.pi else {})},
        "sigma": _sigma(record),
        "reflectors": {r.name: GROUND_WORD if r.link == GROUND else r.link for r in record.reflectors},
        "sweeps": {s.name: FREE if s.joint is None else s.joint + 1 for s in record.sweeps},
        "tables": tables,
    }
    if record.rotation_sigma_rad is not None:
        sections["rotation_sigma"] = float(record.rotation_sigma_rad / DEG)
    return sections


def _sigma(record: TrackerRecord) -> float | str:
    """One number where every point has the same round covariance."""
    if record.covariances is None:
        return UNKNOWN
    covariances = _merged(record, "covariances")
    variance = float(covariances[0, 0, 0]) if len(covariances) else 0.0
    same = variance > 0 and bool((covariances == variance * np.eye(3)).all())
    return float(np.sqrt(variance) / MM) if same else SIGMA_COLUMNS


def _runs(record: TrackerRecord) -> list[Ints]:
    """Rows of each table: index of a point, or -1 - k for reference point k, in measured order."""
    rows = np.arange(len(record), dtype=np.int64)
    if record.references is not None:
        ground = -1 - np.arange(len(record.references), dtype=np.int64)
        rows = np.insert(rows, record.references.after, ground)
    kinds = np.concatenate([record.joints_known, np.asarray(record.oriented)[:, None]], axis=1)
    kind_of = np.full(len(rows), -1)
    kind_of[rows >= 0] = np.unique(kinds, axis=0, return_inverse=True)[1].ravel()[rows[rows >= 0]]
    for i in range(1, len(rows)):  # a reference point goes with the point before it, the first ones with the next
        kind_of[i] = kind_of[i - 1] if kind_of[i] < 0 else kind_of[i]
    if len(rows) and (kind_of >= 0).any():
        kind_of[kind_of < 0] = kind_of[kind_of >= 0][0]
    return list(np.split(rows, np.flatnonzero(np.diff(kind_of)) + 1))


def _merged(record: TrackerRecord, name: str) -> Floats:
    """A column of the points and, behind them in reverse, of the reference points: negative rows find theirs."""
    points: Floats = getattr(record, name)
    return points if record.references is None else np.concatenate([points, getattr(record.references, name)[::-1]])


def _table(record: TrackerRecord, rows: Ints, units: Floats) -> tuple[dict[str, Any], str]:
    """What tracker.yaml says of a table, and its text."""
    measured = rows >= 0
    first = rows[measured][0] if measured.any() else None
    columns: dict[str, list[Any]] = dict(zip("xyz", (_merged(record, "points")[rows] / MM).T.tolist(), strict=True))
    named: dict[str, Any] = {name: name for name in ("x", "y", "z", "point", "sweep", "reflector")}
    columns["point"] = [guarded_name(record.names[i]) if i >= 0 else "" for i in rows]
    columns["sweep"] = [guarded_name(record.sweeps[record.sweep_of[i]].name) if i >= 0 else "" for i in rows]
    ground = record.references.reflectors if record.references is not None else np.empty(0, dtype=np.int64)
    places = [record.reflector_of[i] if i >= 0 else ground[-1 - i] for i in rows]
    columns["reflector"] = [guarded_name(record.reflectors[k].name) for k in places]
    table: dict[str, Any] = {"separator": "comma", "decimal": "point", "columns": named}
    if first is not None and record.joints_known[first].any():
        known = record.joints_known[first]
        named["joints"] = [f"q{j + 1}" if known[j] else None for j in range(len(known))]
        for j in np.flatnonzero(known):
            columns[f"q{j + 1}"] = [float(record.joints[i, j] / units[j]) if i >= 0 else "" for i in rows]
    if first is not None and record.rotations is not None and record.oriented is not None and record.oriented[first]:
        fields = ORIENTATIONS[_ORIENTATION].fields
        rotations = np.where(measured[:, None, None], record.rotations[np.maximum(rows, 0)], np.eye(3))
        values = values_from_rotations(ORIENTATIONS[_ORIENTATION], rotations)
        columns |= dict(zip(fields, values.T.tolist(), strict=True))
        named["orientation"] = list(fields)
        table |= {"orientation": _ORIENTATION, "direction": "T_tracker_reflector"}
    if _sigma(record) == SIGMA_COLUMNS:
        covariances = _merged(record, "covariances")[rows] / MM**2
        columns |= {name: covariances[:, a, b].tolist() for name, (a, b) in _COVARIANCE.items()}
        named["covariance"] = list(_COVARIANCE)
    if record.times_s is not None:
        columns["time"] = _merged(record, "times_s")[rows].tolist()
        named["time"] = "time"
        table["time"] = {"unit": "s"}
    return table, _csv(columns)


def _csv(columns: Mapping[str, list[Any]]) -> str:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()
