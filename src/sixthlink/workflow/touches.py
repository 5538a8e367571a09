"""How does a folder of touches become an arm, and how does that arm read a gauge?"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sixthlink.calibrate.touches import (
    ArmCalibration,
    Touches,
    calibrate_arm,
    length_under,
    read_gauge,
    touches_of,
    unreadable,
)
from sixthlink.errors import CalibrationError, Finding, IndependenceError
from sixthlink.files import atomic_write_text, read_arm_result, write_arm, write_arm_result
from sixthlink.measure import COVERAGE_95, LengthCheck
from sixthlink.progress import Progress
from sixthlink.recording import Recording, Rejection
from sixthlink.report import touch_page
from sixthlink.workflow.outcome import ARM, REPORT, RESULT, Outcome, now, versions

__all__ = ["calibrate_touches", "verify_touches"]


def calibrate_touches(
    recording: Recording, target: Path, *, noise: str, progress: Progress
) -> tuple[ArmCalibration, Outcome]:
    """Calibrate the arm of a recording of touches and leave result, arm and report in ``target``."""
    calibration = calibrate_arm(recording, progress, noise=noise, versions=versions())
    page = touch_page(calibration, created=now())
    target.mkdir(parents=True, exist_ok=True)
    files = {"result": target / RESULT, "report": target / REPORT, "arm": target / ARM}
    write_arm(files["arm"], calibration.arm)
    write_arm_result(files["result"], calibration)
    atomic_write_text(files["report"], page)
    return calibration, Outcome(files)


def verify_touches(
    folder: Path, recording: Recording, path: Path, *, given_arm: bool, progress: Progress
) -> tuple[LengthCheck, Outcome]:
    """Read the gauge at every place of kind ``verify``.

    Args:
        folder: The recording's folder, for messages.
        recording: The recording, with touches of kind ``verify``.
        path: The calibration's ``result.json``.
        given_arm: Whether the recording's arm was given by the user: it then reads alone, taken as exact.
        progress: Listener.

    Raises:
        IndependenceError: A touch was used for the calibration.
        CalibrationError: There is no standard, or no place where both of its sockets were touched.
    """
    calibration = read_arm_result(path)
    touches = touches_of(recording, "verify")
    _check_independent(recording, touches, calibration, folder)
    if recording.standard is None:
        raise CalibrationError("the recording declares no length standard; add length_standard to recording.yaml")
    names, before, after, stds, rejections = [], [], [], [], list[Rejection]()
    for k, name in enumerate(touches.places):
        progress.step("read the gauge", k, len(touches.places))
        part = _at(touches, name)
        reason = unreadable(part, recording.standard)
        if reason is not None:
            rejections.append(reason)
            continue
        reading = read_gauge(calibration, part, recording.standard, coverage=COVERAGE_95)
        names.append(name)
        before.append(reading.before_m)
        if given_arm and recording.arm is not None:
            after.append(length_under(recording.arm, part, recording.standard))
        else:
            after.append(reading.after_m)
        stds.append(reading.std_m)
        rejections += reading.rejections
    progress.step("read the gauge", len(touches.places), len(touches.places))
    if not names:
        reasons = "".join(f"\n  {r.shot}: {r.reason}" for r in rejections)
        raise CalibrationError(f"no place of kind verify has touches of both sockets of the length standard{reasons}")
    check = LengthCheck(
        recording.standard,
        tuple(names),
        np.array(before),
        np.array(after),
        tuple(rejections),
        None if given_arm else np.array(stds),
    )
    report = path.parent / REPORT
    atomic_write_text(report, touch_page(calibration, check=check, created=now()))
    return check, Outcome({"report": report, "result": path})


def _at(touches: Touches, place: str) -> Touches:
    here = [i for i, name in enumerate(touches.placements) if name == place]
    return Touches(
        tuple(touches.shots[i] for i in here),
        tuple(touches.placements[i] for i in here),
        tuple(touches.marks[i] for i in here),
        touches.joints[here],
        touches.standard,
    )


def _check_independent(recording: Recording, touches: Touches, calibration: ArmCalibration, folder: Path) -> None:
    """Refuse touches that the calibration has used: of the same name in the same recording, or of the same joints."""
    names = {t.shot for t in calibration.touches} if calibration.recording == recording.name else set()
    joints = {tuple(t.joints.tolist()) for t in calibration.touches}
    findings = [
        Finding(
            str(folder / "shots.csv"),
            f"shot {shot}",
            "was used for the calibration",
            "touches that the calibration has not used",
            "touch the gauge at another place; a calibration cannot judge itself",
        )
        for shot, q in zip(touches.shots, touches.joints.tolist(), strict=True)
        if shot in names or tuple(q) in joints
    ]
    if findings:
        raise IndependenceError(findings)
