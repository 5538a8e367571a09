"""How often are tags found, and how well are their corners placed, beside OpenCV's own refinements?

Renders Kalibr-style grids of 6 x 5 tags over tilt, blur, noise and distance and prints a table:

    python benchmarks/tag_detection.py [--images 8]

Found: share of the tags. RMS: error of the corners against the rendered truth. Honest: root mean square of error over
stated standard deviation, 1 when the statement is true. OpenCV detects in the same image with the same parameters.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from time import perf_counter

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from sixthlink.camera import Camera
from sixthlink.geometry import Floats
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import Found
from sixthlink.target.april_grid import AprilGrid

WIDTH, HEIGHT, FOCAL = 800, 640, 1200.0
CAMERA = Camera(WIDTH, HEIGHT, np.full(2, FOCAL), np.array([WIDTH - 1, HEIGHT - 1]) / 2, np.zeros(5))
REFINEMENTS = {"SUBPIX": cv2.aruco.CORNER_REFINE_SUBPIX, "APRILTAG": cv2.aruco.CORNER_REFINE_APRILTAG}


@dataclass(frozen=True)
class Case:
    """Circumstances of some images: tilt, distance, blur and light."""

    tilt_deg: float
    distance_m: float
    blur_px: float
    electrons_per_grey: float


CASES = [
    Case(0.0, 0.6, 0.7, 40.0),
    Case(20.0, 0.6, 0.7, 40.0),
    Case(45.0, 0.6, 0.7, 40.0),
    Case(60.0, 0.6, 0.7, 40.0),
    Case(20.0, 0.6, 1.5, 40.0),
    Case(20.0, 0.6, 2.5, 40.0),
    Case(20.0, 0.6, 0.7, 2.0),
    Case(20.0, 0.6, 1.5, 0.5),
    Case(20.0, 1.1, 0.7, 40.0),
    Case(20.0, 1.4, 0.7, 40.0),
    Case(20.0, 1.4, 1.2, 10.0),
]


def image_and_truth(grid: AprilGrid, case: Case, seed: int) -> tuple[np.ndarray, Floats]:
    rng = np.random.default_rng(seed)
    about = rng.uniform(0.0, 2.0 * np.pi)
    tilt = Rotation.from_rotvec(np.deg2rad(case.tilt_deg) * np.array([np.cos(about), np.sin(about), 0.0]))
    T = np.eye(4)
    T[:3, :3] = (tilt * Rotation.from_euler("z", rng.uniform(0.0, 360.0), degrees=True)).as_matrix()
    x0, y0, x1, y1 = grid.drawing.paper
    T[:3, 3] = [0.0, 0.0, case.distance_m] - T[:3, :3] @ np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.0])
    exposure = Exposure(blur_px=case.blur_px, electrons_per_grey=case.electrons_per_grey)
    image = render_target(grid.drawing, CAMERA, T, exposure, rng)
    return image, sensor_positions(CAMERA, grid.points_m @ T[:3, :3].T + T[:3, 3])


def opencvs(image: np.ndarray, grid: AprilGrid, truth: Floats, method: int) -> tuple[float, Floats]:
    """Share of the tags, and errors of their corners."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = 2 if grid.kalibr else 1
    parameters.cornerRefinementMethod = method
    names = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, grid.dictionary))
    quads, ids, _ = cv2.aruco.ArucoDetector(names, parameters).detectMarkers(image)
    if ids is None:
        return 0.0, np.empty((0, 2))
    rows = np.flatnonzero(np.asarray(ids).ravel() < grid.columns * grid.rows)
    tags = np.asarray(ids).ravel()[rows]
    seen = np.asarray(quads).reshape(-1, 4, 2)[rows]
    seen = np.roll(seen, 2, axis=1) if grid.kalibr else seen
    return len(np.unique(tags)) / (grid.columns * grid.rows), (seen - truth.reshape(-1, 4, 2)[tags]).reshape(-1, 2)


def rms(errors: Floats) -> str:
    return f"{np.sqrt(np.mean(np.square(errors))):.4f}" if len(errors) else "-"


def row(grid: AprilGrid, case: Case, images: int) -> str:
    shares, errors, scaled, seconds = [], [], [], []
    theirs: dict[str, list[tuple[float, Floats]]] = {name: [] for name in REFINEMENTS}
    for seed in range(images):
        image, truth = image_and_truth(grid, case, seed)
        start = perf_counter()
        answer = grid.find(image)
        seconds.append(perf_counter() - start)
        shares.append(len(answer.points) / len(truth) if isinstance(answer, Found) else 0.0)
        if isinstance(answer, Found):
            off = answer.pixels - truth[answer.points]
            errors.append(off)
            scaled.append(off / answer.sigmas_px[:, None])
        for name, method in REFINEMENTS.items():
            theirs[name].append(opencvs(image, grid, truth, method))
    ours = [f"{100 * np.mean(shares):.0f} %", rms(np.concatenate(errors)) if errors else "-"]
    ours += [f"{float(rms(np.concatenate(scaled))):.2f}" if scaled else "-", f"{1e3 * np.median(seconds):.0f}"]
    others = []
    for answers in theirs.values():
        others += [f"{100 * np.mean([share for share, _ in answers]):.0f} %"]
        others += [rms(np.concatenate([off for _, off in answers]))]
    head = [f"{case.tilt_deg:.0f}°", f"{case.distance_m}", f"{case.blur_px}", f"{case.electrons_per_grey:g}"]
    return f"| {' | '.join([*head, *ours, *others])} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--images", type=int, default=8, help="images per row")
    images = parser.parse_args().images
    for grid in (AprilGrid(6, 5, 0.03, 0.009), AprilGrid(6, 5, 0.03, 0.009, kalibr=True)):
        print(f"\n{'Kalibr, border of two cells' if grid.kalibr else 'Plain tags, border of one cell'}\n")
        print(
            "| tilt | distance m | blur px | e⁻/grey | found | RMS px | honest | ms | SUBPIX | RMS | APRILTAG | RMS |"
        )
        print("|" + "---|" * 12)
        for case in CASES:
            print(row(grid, case, images), flush=True)


if __name__ == "__main__":
    main()
