"""How does a folder become artefacts? The staircase: the only module that knows every room.

Each function takes paths and options and returns nouns plus the files it wrote. Nothing is written before everything
has succeeded, and every write is atomic.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from sixthlink.calibrate import Calibration, SolveOptions, calibrate_head, calibrate_rig
from sixthlink.detect import detect
from sixthlink.errors import CalibrationError, Finding, IndependenceError, InputError
from sixthlink.files import (
    atomic_write_bytes,
    atomic_write_text,
    image_reader,
    load_arm,
    read_detections,
    read_recording,
    read_result,
    write_arm,
    write_detections,
    write_recording,
    write_result,
    write_truth,
)
from sixthlink.geometry import Floats, inverse
from sixthlink.measure import (
    LengthCheck,
    MarkPoint,
    base_points,
    lengths_of_placements,
    mark_points,
)
from sixthlink.progress import Progress
from sixthlink.recording import (
    EYE_IN_HAND,
    Detections,
    Recording,
    Rejection,
    flange_poses_of,
    shots_of_kind,
    subset,
    with_arm,
)
from sixthlink.report import report_page
from sixthlink.simulate import SCENARIOS, SimulatedCell, render_image, simulate_cell
from sixthlink.target import Chessboard

__all__ = ["Outcome", "calibrate_folder", "simulate_folder", "verify_folder"]

RESULT, REPORT, DETECTIONS = "result.json", "report.html", "detections.csv"
"""Names of what a calibration leaves in its result folder."""


@dataclass(frozen=True)
class Outcome:
    """Files that a step wrote, by what they are."""

    files: Mapping[str, Path]


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
    recording = _of_kinds(read_recording(folder, arm=arm), ("calibrate", "scale"))
    read_image = image_reader(folder, recording)
    detections, cameras, rejections = None, None, ()
    if recording.Ts_head_target is None:
        detections, rejections = detect(recording, read_image, progress=progress)
        cameras = calibrate_rig(recording, detections, progress=progress)
    calibration = calibrate_head(
        recording,
        detections,
        cameras,
        options,
        progress,
        rejections=rejections,
        versions=_versions(),
    )
    page = report_page(
        calibration,
        recording=recording,
        detections=detections,
        read_image=read_image,
        created=_now(),
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
    calibration = read_result(path)
    whole = read_recording(folder, arm=arm)
    recording = _of_kinds(whole, ("verify",))
    _check_independent(recording, calibration, folder)
    if calibration.rig is None:
        raise CalibrationError(
            "the calibration has no cameras (it was made from target poses), so that no mark can be measured; "
            "calibrate from images or pixels"
        )
    read_image = image_reader(folder, recording)
    detections, rejections = detect(recording, read_image, progress=progress)
    points, unmeasured = mark_points(calibration.rig, detections, recording.ids)
    check = _length_check(recording, calibration, points, rejections + unmeasured, given_arm=arm is not None)
    page = _report_with_check(path.parent, folder, whole, calibration, check, progress)
    report = path.parent / REPORT
    atomic_write_text(report, page)
    return check, Outcome({"report": report, "result": path})


def simulate_folder(
    out: Path,
    *,
    scenario: str,
    seed: int,
    images: bool,
    scale_placements: int,
    progress: Progress,
) -> Outcome:
    """Write a simulated recording to ``out`` and the truth to ``out/truth``.

    Raises:
        InputError: The scenario is unknown, or the folder holds a recording already.
    """
    if scenario not in SCENARIOS:
        finding = Finding(
            "--scenario", "scenario", f"{scenario!r} is unknown", f"one of {sorted(SCENARIOS)}", "choose one of them"
        )
        raise InputError([finding])
    plan = SCENARIOS[scenario]
    arm = load_arm("abb_irb1400", folder=out)
    board = Chessboard(columns=plan.columns, rows=plan.rows, square_m=plan.square_m)
    cell = simulate_cell(plan, arm, board, seed=seed, scale_placements=scale_placements, images=images)
    write_recording(out, cell.recording, robot={"name": "abb_irb1400"})
    truth = out / "truth"
    truth.mkdir(exist_ok=True)
    files = {"recording": out / "recording.yaml", "shots": out / "shots.csv", "arm": truth / "arm.yaml"}
    write_arm(files["arm"], cell.truth.arm)
    files["truth"] = truth / "truth.json"
    write_truth(files["truth"], cell)
    if images:
        _render_all(out, cell, progress)
    return Outcome(files)


def _of_kinds(recording: Recording, kinds: tuple[str, ...]) -> Recording:
    """The recording's shots of some kinds, knowing only the input files that those shots are made of."""
    keep = np.sort(np.concatenate([shots_of_kind(recording, kind) for kind in kinds]))
    part = subset(recording, keep)
    images = {name for names in recording.images.values() for name in names}
    used = {name for names in part.images.values() for name in names}
    inputs = {name: digest for name, digest in recording.inputs.items() if name in used or name not in images}
    return replace(part, inputs=inputs)


def _result_path(folder: Path, result: Path | None) -> Path:
    path = folder / "result" if result is None else result
    return path / RESULT if path.is_dir() or not path.suffix else path


def _check_independent(recording: Recording, calibration: Calibration, folder: Path) -> None:
    """Refuse verification shots that the calibration has seen, by image content or by name in the same recording."""
    images = {name for names in recording.images.values() for name in names if name}
    seen = {digest for name, digest in calibration.inputs.items() if not name.endswith((".yaml", ".csv"))}
    used = {shot.shot for shot in calibration.shots} if calibration.recording == recording.name else set()
    findings = []
    for i, shot in enumerate(recording.ids):
        names = [per_camera[i] for per_camera in recording.images.values() if per_camera[i] in images]
        if shot in used or any(recording.inputs.get(name) in seen for name in names):
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
    before = None if recording.head.nominal is None else _lengths(recording, points, recording.head.nominal)[1]
    return LengthCheck(recording.standard, placements, before, after, rejections)


def _lengths(recording: Recording, points: tuple[MarkPoint, ...], X: Floats) -> tuple[tuple[str, ...], Floats]:
    Ts_base_flange = flange_poses_of(recording)
    Ts_outer = Ts_base_flange if recording.mount == EYE_IN_HAND else inverse(Ts_base_flange)
    return lengths_of_placements(points, base_points(points, Ts_outer, X), recording.placements)


def _report_with_check(
    target: Path,
    folder: Path,
    whole: Recording,
    calibration: Calibration,
    check: LengthCheck,
    progress: Progress,
) -> str:
    recording = _of_kinds(whole, ("calibrate", "scale"))
    detections: Detections | None = None
    if (target / DETECTIONS).is_file() and recording.target is not None:
        detections = read_detections(target / DETECTIONS, recording)
    return report_page(
        calibration,
        recording=recording,
        detections=detections,
        read_image=image_reader(folder, recording),
        check=check,
        created=_now(),
        progress=progress,
    )


def _render_all(out: Path, cell: SimulatedCell, progress: Progress) -> None:
    jobs = [
        (i, c, out / cell.recording.images[camera.name][i])
        for i in range(len(cell.recording.ids))
        for c, camera in enumerate(cell.recording.head.cameras)
        if cell.recording.images[camera.name][i]
    ]
    for parent in {path.parent for _, _, path in jobs}:
        parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(mp_context=get_context("spawn"), initializer=_adopt, initargs=(cell,)) as pool:
        for done, _ in enumerate(pool.map(_render_one, jobs, chunksize=4), start=1):
            progress.step("render images", done, len(jobs))


_adopted: list[SimulatedCell] = []


def _adopt(cell: SimulatedCell) -> None:
    """Hand the scene to a worker once instead of with every image."""
    _adopted.append(cell)


def _render_one(job: tuple[int, int, Path]) -> None:
    import cv2

    shot, camera, path = job
    encoded = cv2.imencode(".png", render_image(_adopted[0], shot, camera), [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    atomic_write_bytes(path, encoded.tobytes())


def _versions() -> dict[str, str]:
    return {name: version(name) for name in ("sixthlink", "numpy", "scipy", "opencv-python-headless")}


def _now() -> str:
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
