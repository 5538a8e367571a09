"""How often is a circle grid found, how far off are its points, and how long does it take, beside OpenCV's finder?

Prints two tables; the truth is the middle of the ellipse as which a disc is seen, for both finders:

    python benchmarks/circle_detection.py [--views 6]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from sixthlink.camera import Camera
from sixthlink.geometry import Floats
from sixthlink.simulate.optics import sensor_positions
from sixthlink.simulate.render import Exposure, render_target
from sixthlink.target import AsymmetricCircleGrid, CircleGrid, GreyImage

Grid = CircleGrid | AsymmetricCircleGrid
Finder = Callable[[Grid, GreyImage], Floats | None]

GRIDS: dict[str, Grid] = {
    "symmetric 9 x 7": CircleGrid(9, 7, 0.02, 0.010),
    "asymmetric 4 x 11": AsymmetricCircleGrid(4, 11, 0.015, 0.012),
}
TILTS_DEG = (0.0, 30.0, 50.0, 65.0)
LIGHTS = {
    "blur 0.7, default noise": Exposure(),
    "blur 0.7, much noise": Exposure(electrons_per_grey=4.0, read_noise_grey=2.0),
    "blur 1.5, default noise": Exposure(blur_px=1.5),
}


def camera(width: int, height: int, focal: float) -> Camera:
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    return Camera(width, height, np.array([focal, focal]), centre, np.array([-0.15, 0.03, 0.001, -0.001, 0.0]))


def view(grid: Grid, lens: Camera, tilt_deg: float, exposure: Exposure, seed: int) -> tuple[GreyImage, Floats]:
    """An image of the whole grid, tilted towards a random side, and the true middles of its ellipses."""
    random = np.random.default_rng(seed)
    side, turn = random.uniform(0.0, 2.0 * np.pi, 2)
    tilted = Rotation.from_rotvec(np.deg2rad(tilt_deg) * np.array([np.cos(side), np.sin(side), 0.0]))
    R = (tilted * Rotation.from_rotvec([0.0, 0.0, turn])).as_matrix()
    middle = 0.5 * (grid.points_m.min(axis=0) + grid.points_m.max(axis=0))
    T_camera_target = np.eye(4)
    T_camera_target[:3, :3] = R
    T_camera_target[:3, 3] = np.array([0.0, 0.0, random.uniform(0.36, 0.6)]) - R @ middle
    angle = np.arange(120) * (2.0 * np.pi / 120)
    rim = grid.circle_radius_m * np.stack([np.cos(angle), np.sin(angle), np.zeros(120)], axis=1)
    rims = (grid.points_m[:, None] + rim) @ R.T + T_camera_target[:3, 3]
    seen = sensor_positions(lens, rims)
    middles = np.array([cv2.fitEllipseDirect((r - r.mean(axis=0)).astype(np.float32))[0] for r in seen])
    image = render_target(grid.drawing, lens, T_camera_target, exposure, random)
    return image, middles + seen.mean(axis=1)


def ours(grid: Grid, image: GreyImage) -> Floats | None:
    answer = grid.find(image)
    return answer.pixels if answer else None


def opencvs(grid: Grid, image: GreyImage) -> Floats | None:
    kind = cv2.CALIB_CB_SYMMETRIC_GRID if isinstance(grid, CircleGrid) else cv2.CALIB_CB_ASYMMETRIC_GRID
    ok, centres = cv2.findCirclesGrid(image, (grid.columns, grid.rows), flags=kind)
    return np.asarray(centres, dtype=np.float64).reshape(-1, 2) if ok else None


def squares(pixels: Floats, middles: Floats) -> Floats:
    """Squared errors of the points, each against the nearest true middle: the names are not at issue here."""
    off = pixels[:, None] - middles
    nearest = (off**2).sum(axis=-1).argmin(axis=1)
    return np.square(off[np.arange(len(pixels)), nearest])


def cell(finder: Finder, grid: Grid, views: list[tuple[GreyImage, Floats]]) -> str:
    answers = [(finder(grid, image), middles) for image, middles in views]
    errors = [squares(pixels, middles) for pixels, middles in answers if pixels is not None]
    rms = f"{np.sqrt(np.mean(np.concatenate(errors))):.4f}" if errors else "-"
    return f"{len(errors)} of {len(views)} | {rms}"


def milliseconds(finder: Finder, grid: Grid, image: GreyImage) -> str:
    times = []
    for _ in range(5):
        began = time.perf_counter()
        found = finder(grid, image) is not None
        times.append(1e3 * (time.perf_counter() - began))
    return f"{min(times):.0f}{'' if found else ' (not found)'}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--views", type=int, default=6, help="images per row")
    views = parser.parse_args().views
    cv2.setNumThreads(1)
    lens = camera(800, 600, 900.0)
    print("800 x 600 pixel; RMS error of a coordinate [pixel]\n")
    print("| grid | image | tilt | found | RMS | OpenCV found | RMS |\n|---|---|---|---|---|---|---|")
    for name, grid in GRIDS.items():
        for light, exposure in LIGHTS.items():
            for tilt in TILTS_DEG:
                seen = [view(grid, lens, tilt, exposure, seed) for seed in range(views)]
                print(f"| {name} | {light} | {tilt:.0f}° | {cell(ours, grid, seen)} | {cell(opencvs, grid, seen)} |")
    lens = camera(2452, 2056, 2000.0)  # discs stay below the 5000 square pixels at which OpenCV's blob finder ends
    print("\n2452 x 2056 pixel, one thread, best of five [ms]\n")
    print("| grid | tilt | sixthlink | OpenCV |\n|---|---|---|---|")
    for name, grid in GRIDS.items():
        for tilt in TILTS_DEG:
            image, _ = view(grid, lens, tilt, Exposure(), 0)
            mine, theirs = milliseconds(ours, grid, image), milliseconds(opencvs, grid, image)
            print(f"| {name} | {tilt:.0f}° | {mine} | {theirs} |")


if __name__ == "__main__":
    main()
