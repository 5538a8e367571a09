"""How fast and how well are boards found, beside reading the same files and beside OpenCV's detectors?

    python benchmarks/detection_speed.py [--cell FOLDER] [--sample 10]

One hundred images of the paper's cell (5 megapixels): the time to decode them all, the time to decode, detect and
refine them all, on as many threads as there are processors; on a sample OpenCV's findChessboardCornersSB with its
accuracy flags and findChessboardCorners with cornerSubPix. Errors are RMS per coordinate against the truth.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np

from sixthlink.camera import Camera
from sixthlink.detect import detect
from sixthlink.files import image_reader, read_recording
from sixthlink.geometry import Floats, inverse, transform_points
from sixthlink.progress import Silent
from sixthlink.recording import Recording, shots_of_kind, subset
from sixthlink.robot import flange_poses
from sixthlink.simulate import sensor_positions
from sixthlink.workflow import simulate_folder

SB_FLAGS = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
SUBPIX = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-3)


def truth_of(folder: Path, recording: Recording) -> Callable[[int, int], Floats]:
    """Function that gives the true pixels ``(P, 2)`` of a shot and a camera."""
    truth = json.loads((folder / "truth" / "truth.json").read_text(encoding="utf-8"))
    arm = read_recording(folder, arm=folder / "truth" / "arm.yaml").arm
    cameras = [
        Camera(d.width_px, d.height_px, c["focal_px"], c["centre_px"], c["distortion"])
        for d, c in zip(recording.head.cameras, truth["cameras"], strict=True)
    ]
    points, X = np.array(truth["points_m"]), np.array(truth["T_flange_head"])

    def pixels(shot: int, camera: int) -> Floats:
        T_base_flange = flange_poses(arm, np.array([truth["joints_rad"][recording.ids[shot]]]))[0]
        T_head_target = inverse(T_base_flange @ X) @ np.array(truth["Ts_base_placement"][recording.placements[shot]])
        T_camera_target = np.array(truth["cameras"][camera]["T_camera_head"]) @ T_head_target
        return sensor_positions(cameras[camera], transform_points(T_camera_target, points))

    return pixels


def nearest_rms_px(found: Floats, true: Floats) -> float:
    """RMS per coordinate, the corners named as fits best: other detectors begin at any corner."""
    order = [int(np.argmin(np.linalg.norm(true - p, axis=1))) for p in found]
    return float(np.sqrt(np.mean((found - true[order]) ** 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cell", type=Path, help="a simulated cell with images, instead of a new one")
    parser.add_argument("--sample", type=int, default=10)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.cell or Path(temporary) / "cell"
        if options.cell is None:
            simulate_folder(folder, scenario="paper", seed=5, images=True, scale_placements=0, progress=Silent())
        measure(folder, options.sample)


def measure(folder: Path, sample: int) -> None:
    whole = read_recording(folder)
    recording = subset(whole, shots_of_kind(whole, "calibrate"))
    read, true = image_reader(folder, recording), truth_of(folder, recording)
    jobs = [(s, c) for s in range(len(recording.ids)) for c in range(len(recording.head.cameras))]
    workers = os.cpu_count() or 1
    cv2.setNumThreads(1)
    times = []
    for _ in range(3):
        begun = time.perf_counter()
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(lambda job: read(*job).shape, jobs))
        decoded = time.perf_counter()
        detections, rejections = detect(recording, read, workers=workers)
        times.append((decoded - begun, time.perf_counter() - decoded))
    decode_s, total_s = np.median(times, axis=0)
    off, sizes = [], []
    for s, c in jobs:
        rows = (detections.shots == s) & (detections.cameras == c)
        off.append(detections.pixels[rows] - true(s, c)[detections.points[rows]])
        sizes.append(detections.sigmas_px[rows])
    errors, sigmas = np.concatenate(off), np.concatenate(sizes)
    found = len(jobs) - len(rejections)
    print(f"{len(jobs)} images, {workers} threads: decode {decode_s:.2f} s; decode, detect and refine {total_s:.2f} s")
    print(f"ratio {total_s / decode_s:.2f}; found {found} of {len(jobs)}")
    print(
        f"error {np.sqrt(np.mean(errors**2)):.4f} px RMS, stated {np.sqrt(np.mean(sigmas**2)):.4f} px, normalised "
        f"residuals {np.sqrt(np.mean((errors / sigmas[:, None]) ** 2)):.3f}"
    )
    alone = time.perf_counter()
    pictures = [read(*job) for job in jobs[:: max(len(jobs) // sample, 1)]]
    alone = (time.perf_counter() - alone) / len(pictures)
    chosen = jobs[:: max(len(jobs) // sample, 1)]
    size = (recording.target.columns, recording.target.rows)
    begun = time.perf_counter()
    for picture in pictures:
        recording.target.find(picture)
    ours = (time.perf_counter() - begun) / len(pictures)
    print(f"one thread: decode {1e3 * alone:.1f} ms, find {1e3 * ours:.1f} ms an image")
    for name, look in (
        ("findChessboardCornersSB, accuracy", lambda p: cv2.findChessboardCornersSB(p, size, flags=SB_FLAGS)),
        ("findChessboardCorners, cornerSubPix", lambda p: refined(p, size)),
    ):
        seen, rms, begun = 0, [], time.perf_counter()
        answers = [look(p) for p in pictures]
        each = (time.perf_counter() - begun) / len(pictures)
        for (good, corners), job in zip(answers, chosen, strict=True):
            if good:
                seen += 1
                rms.append(nearest_rms_px(np.asarray(corners, dtype=np.float64).reshape(-1, 2), true(*job)))
        error = np.sqrt(np.mean(np.square(rms))) if rms else float("nan")
        print(
            f"{name}: {each:.3f} s an image, {each / ours:.0f} times as long; {seen} of {len(pictures)}; {error:.4f} px"
        )


def refined(picture: np.ndarray, size: tuple[int, int]) -> tuple[bool, np.ndarray]:
    good, corners = cv2.findChessboardCorners(picture, size)
    return good, cv2.cornerSubPix(picture, corners, (11, 11), (-1, -1), SUBPIX) if good else np.zeros((0, 1, 2))


if __name__ == "__main__":
    main()
