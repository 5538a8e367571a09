"""How well does the paper's cell measure its ruler: nominal arm, true arm, and the floor that repeatability sets?

    python benchmarks/paper_cell.py [--images] [SEED ...]

Prints one row per simulated cell (RMS error of the 1234.15 mm ruler at 15 placements, mm) and the mean. The floor
measures the same shots with the true arm, head and cameras: only joint repeatability and pixels are left.
"""

from __future__ import annotations

import argparse
import json
import shutil
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


def ruler_rms_mm(folder: Path, out: Path, *, solve: str, arm: Path | None = None) -> tuple[float, float, float]:
    """RMS error after and before, and the standard uncertainty that the calibration states (RMS over placements)."""
    calibrate_folder(folder, out=out, arm=arm, options=SolveOptions(), progress=Silent(), solve=solve)
    check, _ = verify_folder(folder, result=out, arm=None, progress=Silent())
    length_m = check.standard.length_m
    stated = 0.0 if check.std_m is None else float(np.sqrt(np.mean(check.std_m**2)))
    after, before = (statistics(lengths, length_m).rms_m for lengths in (check.after_m, check.before_m))
    return after * 1e3, before * 1e3, stated * 1e3


def without_scale(cell: Path, out: Path, views: int = 0) -> Path:
    """The same recording with so many views per mark of the scale bar, none by default."""
    shutil.copytree(cell, out)
    _, *rows = (out / "shots.csv").read_text(encoding="utf-8").splitlines()
    dropped = {row.split(",")[0] for row in rows if ",scale," in row and int(row.split(",")[0][-1]) > views}
    for table in filter(Path.is_file, (out / "shots.csv", out / "pixels.csv")):
        lines = table.read_text(encoding="utf-8").splitlines()
        kept = [line for line in lines if line.split(",")[0] not in dropped]
        table.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seeds", nargs="*", type=int, default=list(range(10)))
    parser.add_argument("--images", action="store_true", help="render images instead of noisy pixels of 0.05 px")
    options = parser.parse_args()
    rows = []
    titles = (
        "nominal",
        "nominal arm, eq. (11)",
        "joint",
        "joint + 6 bars, 1 view",
        "joint + 6 bars, 5 views",
        "true arm, eq. (11)",
        "floor",
        "stated: joint",
        "stated: 5 views",
    )
    print(f"| seed | {' | '.join(titles)} |\n|{'---|' * (len(titles) + 1)}")
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            cell = Path(folder) / "cell"
            simulate_folder(
                cell, scenario="paper", seed=seed, images=options.images, scale_placements=6, progress=Silent()
            )
            plain = without_scale(cell, Path(folder) / "plain")
            glance = without_scale(cell, Path(folder) / "glance", views=1)
            nominal, before, _ = ruler_rms_mm(plain, Path(folder) / "1", solve="paper")
            joint, _, stated = ruler_rms_mm(plain, Path(folder) / "2", solve="joint")
            one, _, _ = ruler_rms_mm(glance, Path(folder) / "3", solve="joint")
            five, _, stated_five = ruler_rms_mm(cell, Path(folder) / "4", solve="joint")
            true, _, _ = ruler_rms_mm(plain, Path(folder) / "5", solve="paper", arm=cell / "truth" / "arm.yaml")
            rows.append((before, nominal, joint, one, five, true, floor_rms_mm(cell), stated, stated_five))
        print(f"| {seed} | " + " | ".join(f"{v:.4f}" for v in rows[-1]) + " |", flush=True)
    print("| mean | " + " | ".join(f"{v:.4f}" for v in np.mean(rows, axis=0)) + " |")


if __name__ == "__main__":
    main()
