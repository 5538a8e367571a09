"""What do recordings say of their boards: how bent, how large, and does the stereo calibration still fit?

    python benchmarks/boards.py

Reads ../shared/data. Size: true over declared, by the robot's motion, with the board declared right and 2 % too large
(1 / 1.02 = 0.9804 is true then). Bend: the largest height over a flat board, and how far the head would move if the
board counted as flat. The simulated cell is the paper's with 50 shots and pixels instead of images.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate import (
    Calibration,
    RigCalibration,
    SolveOptions,
    calibrate_cameras,
    calibrate_head,
    calibrate_jointly,
)
from sixthlink.detect import detect
from sixthlink.files import image_reader, load_arm, read_recording
from sixthlink.geometry import Floats, motion_between
from sixthlink.progress import Silent
from sixthlink.recording import Detections, Recording
from sixthlink.simulate import SCENARIOS, simulate_cell
from sixthlink.target import Chessboard

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from recordings import denso_tabb_ds1, rendered_flat_board, rosi_charuco_static_camera

DATA = Path(__file__).parents[2] / "shared" / "data"
TOO_LARGE = 1.02

Solve = Callable[..., Calibration]


def seen(recording: Recording, folder: Path) -> Detections:
    return detect(recording, image_reader(folder, recording))[0]


def solved(recording: Recording, cameras: RigCalibration, solve: Solve) -> Calibration:
    return solve(recording, cameras, SolveOptions(), Silent())


def row(name: str, recording: Recording, detections: Detections, solve: Solve = calibrate_head) -> Floats:
    """Print what one recording says of its board; the head."""
    cameras = calibrate_cameras(recording, detections)
    right = solved(recording, cameras, solve)
    target = recording.target
    lengths = {k: TOO_LARGE * v for k, v in vars(target).items() if k.endswith("_m")}
    larger = replace(recording, target=replace(target, **lengths))
    wrong = solved(larger, calibrate_cameras(larger, detections), solve)
    bend = "none shows"
    if cameras.shape is not None:
        flat = solved(recording, calibrate_cameras(recording, detections, flat=True), solve)
        moved = motion_between(right.X[None], flat.X[None])[0]
        bend = (
            f"{cameras.shape.sag_m * 1e3:.3f} ± {cameras.shape.sag_std_m * 1e3:.3f} mm; flat, the head is "
            f"{np.linalg.norm(moved[:3]) * 1e3:.2f} mm / {np.rad2deg(np.linalg.norm(moved[3:])):.3f}° off"
        )
    sizes = [f"{c.board.scale:.5f} ± {c.board.scale_std:.5f}" for c in (right, wrong)]
    told = "yes" if any(g.name == "board as large as declared" and not g.passed for g in wrong.gates) else "no"
    print(f"| {name} | {sizes[0]} | {sizes[1]} | {told} | {bend} |", flush=True)
    return right.X


def main() -> None:
    print("| recording | size | size, declared 2 % too large | refused then | bend |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as out:
        for convert in (rendered_flat_board, denso_tabb_ds1, rosi_charuco_static_camera):
            folder = convert(DATA, Path(out))
            recording = read_recording(folder)
            X = row(f"`{recording.name}`", recording, seen(recording, folder))
            if convert is rendered_flat_board:
                truth = np.linalg.inv(np.loadtxt(DATA / "rendered_flat_board" / "truth" / "flange2cam.txt"))
                head = X
    board = Chessboard(12, 9, 0.02)
    cell = simulate_cell(SCENARIOS["paper"], load_arm("abb_irb1400", folder=Path()), board, seed=0, images=False)
    for name, solve in (("head alone", calibrate_head), ("arm and head together", calibrate_jointly)):
        row(f"simulated cell, {name}", cell.recording, cell.recording.pixels, solve)
    off = motion_between(truth[None], head[None])[0]
    print(
        f"\n`rendered_flat_board`: head {np.linalg.norm(off[:3]) * 1e3:.3f} mm and "
        f"{np.rad2deg(np.linalg.norm(off[3:])):.4f}° from the truth"
    )


if __name__ == "__main__":
    main()
