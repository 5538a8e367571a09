"""How does a tracker record become an arm, and how does that arm correct a program?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate.tracked_arm import TrackedArm, calibrate_arm_by_tracker
from sixthlink.errors import Finding, InputError
from sixthlink.files import (
    atomic_write_text,
    load_arm,
    read_targets,
    read_tracker_record,
    write_arm,
    write_targets,
    write_tracked_arm,
)
from sixthlink.progress import Progress
from sixthlink.recording import TrackerRecord
from sixthlink.report import tracked_page
from sixthlink.robot import Compensation, compensated_joints, flange_poses
from sixthlink.units import DEG, MM
from sixthlink.workflow.outcome import ARM, REPORT, RESULT, Outcome, now, versions

__all__ = ["arm_from_record", "compensate_table", "tracker_record"]


def arm_from_record(
    path: Path, *, out: Path | None, arm: Path | None, noise: str, progress: Progress
) -> tuple[TrackedArm, TrackerRecord, Outcome]:
    """Calibrate the arm of a tracker record and leave arm, result and report.

    Args:
        path: The record: its folder, or its ``tracker.yaml`` by any name.
        out: Where to write; ``result`` beside the record when None.
        arm: Arm file that replaces the record's own kinematics.
        noise: Joint repeatability: ``estimated``, or ``stated`` by the arm's file.
        progress: Listener.
    """
    record = tracker_record(path, arm)
    result = calibrate_arm_by_tracker(record, progress, noise=noise, versions=versions())
    page = tracked_page(result, record, created=now())
    target = out or (path if path.is_dir() else path.parent) / "result"
    target.mkdir(parents=True, exist_ok=True)
    files = {"result": target / RESULT, "report": target / REPORT, "arm": target / ARM}
    write_arm(files["arm"], result.arm)
    write_tracked_arm(files["result"], result, record)
    atomic_write_text(files["report"], page)
    return result, record, Outcome(files)


def tracker_record(path: Path, arm: Path | None = None) -> TrackerRecord:
    """A tracker record, with another arm where one is given.

    Raises:
        InputError: The record or the arm file is wrong, or they differ in their number of joints.
    """
    record = read_tracker_record(path)
    if arm is None:
        return record
    given = load_arm(str(arm.resolve()) if arm.exists() else str(arm), folder=Path())
    joints = record.joints.shape[1]
    if len(given.joints) != joints:
        what = f"{given.name} has {len(given.joints)} joints"
        raise InputError([Finding("--arm", "arm", what, f"{joints}, as the record has", "give the arm of the record")])
    return replace(record, arm=given, robot=given.name)


def compensate_table(
    path: Path, *, arm: Path, nominal: str | None, orientation: str | None, out: Path
) -> tuple[Compensation, Outcome]:
    """Correct the programmed joint values of a table for a calibrated arm.

    Args:
        path: The table of targets.
        arm: The calibrated arm.
        nominal: The arm as the controller believes it to be: a known robot's name or an arm file; not needed where the
            table has poses.
        orientation: Name of the orientation of the table's poses, where it has some.
        out: Where to write the corrected table.

    Raises:
        InputError: A file is wrong, or a target cannot be reached; nothing is written.
    """
    calibrated = load_arm(str(arm.resolve()) if arm.exists() else str(arm), folder=Path())
    targets = read_targets(path, calibrated, orientation=orientation)
    if targets.Ts_base_flange is not None:
        wanted = targets.Ts_base_flange
    elif nominal is None:
        expected = "the arm as the controller believes it to be"
        cure = "give --nominal, for example a known robot's name, or poses with --orientation"
        raise InputError([Finding("--nominal", "nominal", "is missing", expected, cure)])
    else:
        drawn = load_arm(nominal, folder=Path())
        if len(drawn.joints) != len(calibrated.joints):
            what = f"{drawn.name} has {len(drawn.joints)} joints"
            expected = f"{len(calibrated.joints)}, as {calibrated.name} has"
            raise InputError([Finding("--nominal", "nominal", what, expected, "give the same robot's arm")])
        wanted = flange_poses(drawn, targets.joints)
    found = compensated_joints(calibrated, wanted, targets.joints)
    findings = []
    for k in np.flatnonzero(~(found.reached & found.inside)).tolist():
        shift_m, turn_rad = found.after[k].tolist()
        what = (
            "needs a joint beyond its limit"
            if found.reached[k]
            else f"cannot be reached: {shift_m / MM:.3g} mm and {turn_rad / DEG:.3g}° are left"
        )
        cure = "move the target, or give joint values of another configuration"
        findings.append(Finding(str(path), targets.names[k], what, "a pose inside the arm's reach", cure))
    if findings:
        raise InputError(findings)
    write_targets(out, targets, found)
    return found, Outcome({"targets": out})
