"""How does a recording folder become a calibration?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate import (
    BoardEvidence,
    Calibration,
    RigCalibration,
    SolveOptions,
    SolverScore,
    calibrate_cameras,
    calibrate_head,
    calibrate_jointly,
    compare_solvers,
    problem_of_recording,
)
from sixthlink.calibrate.touches import ArmCalibration
from sixthlink.errors import CalibrationError, Finding, InputError, TooFewShotsError
from sixthlink.files import (
    atomic_write_text,
    image_notes,
    image_reader,
    read_recording,
    write_arm,
    write_detections,
    write_result,
)
from sixthlink.geometry import motion_between
from sixthlink.progress import Progress, Silent
from sixthlink.recording import Detections, Recording, Rejection, shots_of_kind
from sixthlink.report import report_page
from sixthlink.workflow.detection import look
from sixthlink.workflow.outcome import ARM, DETECTIONS, REPORT, RESULT, Outcome, now, shots_for, versions
from sixthlink.workflow.touches import calibrate_touches
from sixthlink.workflow.tracker import tracker_record

__all__ = ["calibrate_folder", "compare_folder"]

FEWEST_LEFT = 3
"""Calibration shots that every placement keeps when others are held out."""


def compare_folder(
    folder: Path, *, arm: Path | None, options: SolveOptions, progress: Progress
) -> tuple[SolverScore, ...]:
    """Every solver on a recording folder, judged on shots and placements that it did not see; writes nothing."""
    recording = shots_for(read_recording(folder, arm=arm), ("calibrate",))
    if recording.touched:
        raise CalibrationError("compare judges solvers for a head, and touches have none; use sixthlink calibrate")
    cameras, _, _ = _seen_by_cameras(folder, recording, progress)
    problem = problem_of_recording(recording, cameras, options)
    return compare_solvers(problem, seed=options.seed, progress=progress)


def calibrate_folder(
    folder: Path,
    *,
    out: Path | None,
    arm: Path | None,
    options: SolveOptions,
    progress: Progress,
    solve: str = "auto",
    holdout: int = 0,
    tracker: Path | None = None,
) -> tuple[Calibration | ArmCalibration, Outcome]:
    """Calibrate a recording folder and leave result, detections, report, and the arm where it was calibrated too.

    Args:
        folder: The recording.
        out: Where to write; ``<folder>/result`` when None.
        arm: Arm file that replaces the recording's own kinematics.
        options: Choices of the solver.
        progress: Listener.
        solve: ``joint`` for arm and head together, ``paper`` for the head alone by eq. (11), ``auto`` for joint where
            there are joint values and kinematics.
        holdout: Calibration shots to keep out of the fit and to judge it by, chosen by the seed.
        tracker: A laser tracker's record of the same arm: its points enter one problem with the images.

    Returns:
        The calibration: of a head, or of the arm alone where the recording is of touches.
    """
    recording = shots_for(read_recording(folder, arm=arm), ("calibrate", "judge", "scale"))
    recording = _with_holdout(recording, holdout, options.seed)
    target = out or folder / "result"
    if tracker is not None and (recording.touched or solve == "paper"):
        raise CalibrationError(
            "a tracker record enters the joint estimate of images and arm; leave out --solve paper, or calibrate the "
            "arm by sixthlink arm and give it with --arm"
        )
    if recording.touched:
        if solve == "paper":
            raise CalibrationError("eq. (11) finds a head, and touches have none; leave out --solve paper")
        return calibrate_touches(recording, target, noise=options.noise, progress=progress)
    cameras, seen, rejections = _seen_by_cameras(folder, recording, progress)
    joint = solve == "joint" or (solve == "auto" and recording.joints is not None and not options.observable_rest)
    if tracker is not None and not joint:
        raise CalibrationError("a tracker record needs joint values and kinematics in the recording, to be one problem")
    record = None if tracker is None else tracker_record(tracker)

    def estimate(rig: RigCalibration | None, listener: Progress) -> Calibration:
        if joint:
            return calibrate_jointly(
                recording, rig, options, listener, rejections=rejections, versions=versions(), tracker=record
            )
        return calibrate_head(recording, rig, options, listener, rejections=rejections, versions=versions())

    calibration = replace(estimate(cameras, progress), notes=image_notes(folder, recording))
    if cameras is not None and seen is not None and cameras.shape is not None:
        flat = estimate(calibrate_cameras(recording, seen, flat=True), Silent())
        calibration = replace(calibration, board=_with_effect(calibration, flat))
    page = report_page(
        calibration,
        recording=recording,
        detections=cameras.detections if cameras else None,
        read_image=image_reader(folder, recording),
        created=now(),
        progress=progress,
    )
    target.mkdir(parents=True, exist_ok=True)
    files = {"result": target / RESULT, "report": target / REPORT}
    if seen is not None:
        files["detections"] = target / DETECTIONS
        write_detections(files["detections"], recording, seen)
    if calibration.joint is not None and calibration.arm is not None:
        files["arm"] = target / ARM
        write_arm(files["arm"], calibration.arm)
    else:
        (target / ARM).unlink(missing_ok=True)  # an older arm would not belong to this result
    write_result(files["result"], calibration)
    atomic_write_text(files["report"], page)
    return calibration, Outcome(files)


def _with_effect(bent: Calibration, flat: Calibration) -> BoardEvidence:
    """The board's evidence with what a flat board would have made of the head."""
    motion = motion_between(bent.X[None], flat.X[None])[0]
    moved_m, moved_rad = float(np.linalg.norm(motion[:3])), float(np.linalg.norm(motion[3:]))
    return replace(bent.board, moved_m=moved_m, moved_rad=moved_rad)


def _with_holdout(recording: Recording, holdout: int, seed: int) -> Recording:
    """The recording with some calibration shots turned into judges, drawn evenly from the placements (and sockets).

    Raises:
        InputError: A placement would be left with fewer than three shots.
    """
    if holdout == 0:
        return recording
    shots = np.random.default_rng(seed).permutation(shots_of_kind(recording, "calibrate"))
    groups = list(zip(recording.placements, recording.marks, strict=True))
    number = {group: k for k, group in enumerate(dict.fromkeys(groups))}
    names = np.array([number[group] for group in groups])[shots]
    # Turn by turn from every placement: the k-th shot of each comes before any k+1-th.
    turn = np.array([np.count_nonzero(names[:k] == name) for k, name in enumerate(names)])
    chosen = set(shots[np.argsort(turn, kind="stable")[:holdout]].tolist())
    kinds = tuple("judge" if i in chosen else kind for i, kind in enumerate(recording.kinds))
    left = [number[groups[i]] for i, kind in enumerate(kinds) if kind == "calibrate"]
    if holdout > len(shots) or min((left.count(name) for name in set(names.tolist())), default=0) < FEWEST_LEFT:
        what = f"{holdout} of {len(shots)} calibrate shots would leave a placement with fewer than {FEWEST_LEFT}"
        expected = f"at least {FEWEST_LEFT} shots left in every placement"
        raise InputError([Finding("--holdout", "holdout", what, expected, "keep fewer out, or record more shots")])
    return replace(recording, kinds=kinds)


def _seen_by_cameras(
    folder: Path, recording: Recording, progress: Progress
) -> tuple[RigCalibration | None, Detections | None, tuple[Rejection, ...]]:
    """The calibrated cameras, what they saw, and refused images; no cameras for a recording of target poses."""
    if recording.Ts_head_target is not None:
        return None, None, ()
    detections, rejections = look(folder, recording, progress)
    try:
        return calibrate_cameras(recording, detections, progress=progress), detections, rejections
    except TooFewShotsError as few:
        raise few.because(str(r) for r in rejections) from None
