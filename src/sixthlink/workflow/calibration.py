"""How does a recording folder become a calibration?"""

from __future__ import annotations

from pathlib import Path

from sixthlink.calibrate import (
    Calibration,
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
from sixthlink.recording import Rejection
from sixthlink.report import report_page
from sixthlink.workflow.outcome import DETECTIONS, REPORT, RESULT, Outcome, now, shots_for, versions

__all__ = ["calibrate_folder", "compare_folder"]


def compare_folder(
    folder: Path, *, arm: Path | None, options: SolveOptions, progress: Progress
) -> tuple[SolverScore, ...]:
    """Every solver on a recording folder, judged on shots and placements that it did not see; writes nothing."""
    recording = shots_for(read_recording(folder, arm=arm), ("calibrate",))
    detections, cameras = None, None
    if recording.Ts_head_target is None:
        detections, _ = detect(recording, image_reader(folder, recording), progress=progress)
        cameras = calibrate_rig(recording, detections, progress=progress)
    problem = problem_of_recording(recording, detections, cameras, options, progress)
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
    read_image = image_reader(folder, recording)
    detections, cameras = None, None
    rejections: tuple[Rejection, ...] = ()
    if recording.Ts_head_target is None:
        detections, rejections = detect(recording, read_image, progress=progress)
        cameras = calibrate_rig(recording, detections, progress=progress)
        detections = cameras.detections
    calibration = calibrate_head(
        recording,
        detections,
        cameras,
        options,
        progress,
        rejections=rejections,
        versions=versions(),
    )
    page = report_page(
        calibration,
        recording=recording,
        detections=detections,
        read_image=read_image,
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
