"""How well does the paper's cell measure its ruler: nominal arm, true arm, and the floor that repeatability sets?

    python benchmarks/paper_cell.py [--images] [SEED ...]

Prints one row per simulated cell (RMS error of the 1234.15 mm ruler at 15 placements, mm) and the mean. The floor
measures the same shots with the true arm, head and cameras: only joint repeatability and pixels are left.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from sixthlink.calibrate import SolveOptions, mark_points
from sixthlink.camera import Camera, CameraRig
from sixthlink.detect import detect
from sixthlink.files import image_reader, read_recording
from sixthlink.measure import base_points, lengths_of_placements, statistics
from sixthlink.progress import Silent
from sixthlink.recording import flange_poses_of, selected, shots_of_kind
from sixthlink.workflow import calibrate_folder, simulate_folder, verify_folder


def floor_rms_mm(folder: Path) -> float:
    """RMS error with everything true but the joints' readings and the pixels."""
    truth = json.loads((folder / "truth" / "truth.json").read_text(encoding="utf-8"))
    recording = read_recording(folder, arm=folder / "truth" / "arm.yaml")
    detections, _ = detect(recording, image_reader(folder, recording))
    marks = selected(detections, np.isin(detections.shots, shots_of_kind(recording, "verify")))
    cameras = [
        Camera(d.width_px, d.height_px, c["focal_px"], c["centre_px"], c["distortion"])
        for d, c in zip(recording.head.cameras, truth["cameras"], strict=True)
    ]
    poses = np.array([c["T_camera_head"] for c in truth["cameras"]])
    rig = CameraRig(tuple(c["name"] for c in truth["cameras"]), tuple(cameras), poses)
    points, _ = mark_points(rig, marks, recording.ids)
    found = base_points(points, flange_poses_of(recording), np.array(truth["T_flange_head"]))
    _, lengths = lengths_of_placements(points, found, recording.placements)
    return statistics(lengths, recording.standard.length_m).rms_m * 1e3


def calibrated_rms_mm(folder: Path, arm: Path | None, out: Path) -> tuple[float, float]:
    """RMS error after and before, with the recording's nominal arm or another one."""
    calibrate_folder(folder, out=out, arm=arm, options=SolveOptions(), progress=Silent())
    check, _ = verify_folder(folder, result=out, arm=None, progress=Silent())
    length_m = check.standard.length_m
    return statistics(check.after_m, length_m).rms_m * 1e3, statistics(check.before_m, length_m).rms_m * 1e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seeds", nargs="*", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--images", action="store_true", help="render images instead of noisy pixels of 0.05 px")
    options = parser.parse_args()
    rows = []
    print("| seed | nominal arm and head | nominal arm, eq. (11) | true arm, eq. (11) | floor |\n|---|---|---|---|---|")
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            cell = Path(folder) / "cell"
            simulate_folder(
                cell, scenario="paper", seed=seed, images=options.images, scale_placements=0, progress=Silent()
            )
            nominal, before = calibrated_rms_mm(cell, None, Path(folder) / "nominal")
            true, _ = calibrated_rms_mm(cell, cell / "truth" / "arm.yaml", Path(folder) / "true")
            rows.append((before, nominal, true, floor_rms_mm(cell)))
        print(f"| {seed} | " + " | ".join(f"{v:.4f}" for v in rows[-1]) + " |", flush=True)
    print("| mean | " + " | ".join(f"{v:.4f}" for v in np.mean(rows, axis=0)) + " |")


if __name__ == "__main__":
    main()
