"""How does a recording folder prove a calibration on a length standard?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate import Calibration, MarkPoint, changing, mark_points
from sixthlink.errors import CalibrationError, Finding, IndependenceError
from sixthlink.files import atomic_write_text, image_reader, read_detections, read_recording, read_result
from sixthlink.geometry import Floats, inverse
from sixthlink.measure import LengthCheck, base_points, length_stds, lengths_of_placements, uncertain_cameras
from sixthlink.progress import Progress
from sixthlink.recording import (
    EYE_IN_HAND,
    Detections,
    Recording,
    Rejection,
    flange_poses_of,
    joined,
    shots_of_kind,
    with_arm,
)
from sixthlink.report import report_page
from sixthlink.workflow.detection import look
from sixthlink.workflow.outcome import DETECTIONS, REPORT, RESULT, Outcome, now, shots_for
from sixthlink.workflow.touches import verify_touches

__all__ = ["verify_folder"]


def verify_folder(
    folder: Path,
    *,
    result: Path | None,
    arm: Path | None,
    progress: Progress,
) -> tuple[LengthCheck, Outcome]:
    """Measure the length standard of a recording folder with a calibration, before and after.

    Args:
        folder: The recording, with shots of kind ``verify``.
        result: ``result.json`` or the folder that holds it; ``<folder>/result`` when None.
        arm: Arm file that replaces the recording's own kinematics before, and the calibration's after.
        progress: Listener.

    Raises:
        IndependenceError: A verification shot was used for the calibration.
    """
    path = _result_path(folder, result)
    whole = read_recording(folder, arm=arm, calibrating=False)
    if len(shots_of_kind(whole, "verify")) == 0:
        raise CalibrationError(
            f"{folder} has no shots of kind verify, so there is nothing to verify; record the length standard at "
            "places that the calibration has not seen, two marks each, as kind verify"
        )
    recording = shots_for(whole, ("verify",))
    if recording.touched:
        return verify_touches(folder, recording, path, given_arm=arm is not None, progress=progress)
    calibration = read_result(path)
    _check_independent(recording, calibration, folder)
    if calibration.rig is None:
        raise CalibrationError(
            "the calibration has no cameras (it was made from target poses), so that no mark can be measured; "
            "calibrate from images or pixels"
        )
    detections, rejections = look(folder, recording, progress)
    points, unmeasured = mark_points(calibration.rig, detections, recording.ids, uncertain_cameras(calibration))
    check = _length_check(recording, calibration, points, rejections + unmeasured, given_arm=arm is not None)
    page = _report_with_check(
        path.parent, folder, _Verification(whole, recording, detections, calibration, check), progress
    )
    report = path.parent / REPORT
    atomic_write_text(report, page)
    return check, Outcome({"report": report, "result": path})


def _result_path(folder: Path, result: Path | None) -> Path:
    path = folder / "result" if result is None else result
    return path / RESULT if path.is_dir() or not path.suffix else path


def _check_independent(recording: Recording, calibration: Calibration, folder: Path) -> None:
    """Refuse verification shots that the calibration has seen, by image content or by name in the same recording."""
    seen = set(calibration.inputs.values())
    used = (
        {*(shot.shot for shot in calibration.shots), *calibration.scale_shots}
        if calibration.recording == recording.name
        else set()
    )
    findings = []
    for i, shot in enumerate(recording.ids):
        if shot in used or any(recording.inputs.get(names[i]) in seen for names in recording.images.values()):
            findings.append(
                Finding(
                    str(folder / "shots.csv"),
                    f"shot {shot}",
                    "was used for the calibration",
                    "shots that the calibration has not seen",
                    "record separate verify shots; a calibration cannot judge itself",
                )
            )
    if findings:
        raise IndependenceError(findings)


def _length_check(
    recording: Recording,
    calibration: Calibration,
    points: tuple[MarkPoint, ...],
    rejections: tuple[Rejection, ...],
    *,
    given_arm: bool,
) -> LengthCheck:
    if recording.standard is None:
        raise CalibrationError("the recording declares no length standard; add length_standard to recording.yaml")
    chosen = recording if given_arm or calibration.arm is None else with_arm(recording, calibration.arm)
    placements, after = _lengths(chosen, points, calibration.X)
    if not placements:
        reasons = "".join(f"\n  {r.shot} {r.camera}: {r.reason}" for r in rejections)
        raise CalibrationError(f"no placement shows both marks of the length standard{reasons}")
    _refuse_what_was_not_observed(chosen, calibration, points)
    before = None if recording.head.nominal is None else _lengths(recording, points, recording.head.nominal)[1]
    stds = None
    if not given_arm:
        stds = length_stds(calibration, chosen, points, placements, recording.standard)
    return LengthCheck(recording.standard, placements, before, after, rejections, stds)


def _refuse_what_was_not_observed(
    recording: Recording, calibration: Calibration, points: tuple[MarkPoint, ...]
) -> None:
    """Refuse lengths that change where the head moves along what its calibration has not observed."""
    unobserved = calibration.unobserved
    if unobserved is None:
        return
    hidden = changing(lambda X: _lengths(recording, points, X)[1], calibration.X, unobserved)
    if hidden.any():
        raise CalibrationError(
            f"{hidden.sum()} of {len(hidden)} lengths depend on what the calibration has not observed: "
            f"{'; '.join(unobserved.words)}. Measure with the flange's axis as it stood while calibrating, or "
            "calibrate with shots that turn the flange about two axes"
        )


def _lengths(recording: Recording, points: tuple[MarkPoint, ...], X: Floats) -> tuple[tuple[str, ...], Floats]:
    Ts_base_flange = flange_poses_of(recording)
    Ts_outer = Ts_base_flange if recording.mount == EYE_IN_HAND else inverse(Ts_base_flange)
    return lengths_of_placements(points, base_points(points, Ts_outer, X), recording.placements)


@dataclass(frozen=True, eq=False)
class _Verification:
    """A verification as the report wants to show it: the whole recording, and what its verify shots showed."""

    whole: Recording
    part: Recording
    detections: Detections
    calibration: Calibration
    check: LengthCheck


def _report_with_check(target: Path, folder: Path, done: _Verification, progress: Progress) -> str:
    """The calibration's page again, with the length check and the standard's placements in it."""
    number = {shot: k for k, shot in enumerate(done.whole.ids)}
    shots = np.array([number[done.part.ids[s]] for s in done.detections.shots], dtype=np.int64)
    detections = replace(done.detections, shots=shots)
    here = {shot.shot for shot in done.calibration.shots} <= number.keys()
    if (target / DETECTIONS).is_file() and here and done.whole.name == done.calibration.recording:
        detections = joined([read_detections(target / DETECTIONS, done.whole), detections])
    return report_page(
        done.calibration,
        recording=done.whole,
        detections=detections,
        read_image=image_reader(folder, done.whole),
        check=done.check,
        created=now(),
        progress=progress,
    )
