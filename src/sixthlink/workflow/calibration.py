"""How does a recording folder become a calibration?"""

from __future__ import annotations

from pathlib import Path

from sixthlink.calibrate import (
    Calibration,
    RigCalibration,
    SolveOptions,
    SolverScore,
    calibrate_head,
    calibrate_rig,
    compare_solvers,
    problem_of_recording,
)
from sixthlink.detect import detect
from sixthlink.files import atomic_write_text, image_reader, read_recording, write_detections, write_result
from sixthlink.progress import Progress
from sixthlink.recording import Recording, Rejection
from sixthlink.report import report_page
from sixthlink.workflow.outcome import DETECTIONS, REPORT, RESULT, Outcome, now, shots_for, versions

__all__ = ["calibrate_folder", "compare_folder"]


def compare_folder(
    folder: Path, *, arm: Path | None, options: SolveOptions, progress: Progress
) -> tuple[SolverScore, ...]:
    """Every solver on a recording folder, judged on shots and placements that it did not see; writes nothing."""
    recording = shots_for(read_recording(folder, arm=arm), ("calibrate",))
    cameras, _ = _seen_by_cameras(folder, recording, progress)
    problem = problem_of_recording(recording, cameras, options)
    return compare_solvers(problem, seed=options.seed, progress=progress)


def calibrate_folder(
    folder: Path,
    *,
    out: Path | None,
    arm: Path | None,
    options: SolveOptions,
    progress: Progress,
) -> tuple[Calibration, Outcome]:
    """Calibrate the head of a recording folder and leave result, detections and report.

    Args:
        folder: The recording.
        out: Where to write; ``<folder>/result`` when None.
        arm: Arm file that replaces the recording's own kinematics.
        options: Choices of the solver.
        progress: Listener.
    """
    recording = shots_for(read_recording(folder, arm=arm), ("calibrate", "scale"))
    cameras, rejections = _seen_by_cameras(folder, recording, progress)
    detections = cameras.detections if cameras else None
    calibration = calibrate_head(recording, cameras, options, progress, rejections=rejections, versions=versions())
    page = report_page(
        calibration,
        recording=recording,
        detections=detections,
        read_image=image_reader(folder, recording),
        created=now(),
        progress=progress,
    )
    target = out or folder / "result"
    target.mkdir(parents=True, exist_ok=True)
    files = {"result": target / RESULT, "report": target / REPORT}
    if detections is not None:
        files["detections"] = target / DETECTIONS
        write_detections(files["detections"], recording, detections)
    write_result(files["result"], calibration)
    atomic_write_text(files["report"], page)
    return calibration, Outcome(files)


def _seen_by_cameras(
    folder: Path, recording: Recording, progress: Progress
) -> tuple[RigCalibration | None, tuple[Rejection, ...]]:
    """The calibrated cameras with what they saw, and refused images; no cameras for a recording of target poses."""
    if recording.Ts_head_target is not None:
        return None, ()
    detections, rejections = detect(recording, image_reader(folder, recording), progress=progress)
    return calibrate_rig(recording, detections, progress=progress), rejections
