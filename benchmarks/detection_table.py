"""How often is each kind of target found, how far off are its points, and is what we say of their errors true?

Renders every kind in a grid of views, one factor varied at a time about a base view, and prints a table per kind:

    python benchmarks/detection_table.py [--views 5] [--kinds Chessboard Charuco]

Base: tilt 20°, blur 0.7 px, 2.3 grey values of noise on white paper, the whole target in the image, no distortion; the
turn in the image, the side that is tilted away, distance and place are random and the same in all rows. Found: views,
and share of the points that are in the image. RMS: error of a coordinate against the simulator's truth; for discs the
truth is the middle of the ellipse, for both. Residual: RMS of error over stated standard deviation, 1 when it is true.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from sixthlink.camera import Camera
from sixthlink.geometry import Floats, Ints, exp_rotation, transform, transform_points
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import (
    AprilGrid,
    AsymmetricCircleGrid,
    Charuco,
    Chessboard,
    CircleGrid,
    DotGrid,
    GreyImage,
    MarkerChessboard,
    TagBundle,
    Target,
)

Answer = tuple[Ints, Floats] | None
"""Which points a detector found, and where; None where it found no target."""

WIDTH_PX, HEIGHT_PX, FOCAL_PX = 1200, 900, 1300.0
MARGIN_PX = 12.0
"""White paper stays so far from the image's edge where the whole target is in view."""

FARTHER, SLACK_SHARE = 1.25, 0.5
"""Distance against the nearest at which the target fits, at most, and how much of the free place is used for shifts."""


@dataclass(frozen=True)
class Setting:
    """What is varied: name of the row, tilt, share of the points in view, exposure, and the lens's k1 and k2."""

    name: str = "base"
    tilt_deg: float = 20.0
    visible: float = 1.0
    exposure: Exposure = field(default_factory=Exposure)
    k1_k2: tuple[float, float] = (0.0, 0.0)

    @property
    def camera(self) -> Camera:
        """The camera with that lens."""
        centre = np.array([(WIDTH_PX - 1) / 2, (HEIGHT_PX - 1) / 2])
        return Camera(WIDTH_PX, HEIGHT_PX, np.full(2, FOCAL_PX), centre, np.array([*self.k1_k2, 0.0, 0.0, 0.0]))


SETTINGS = [
    Setting(),
    Setting("blur 1.5 px", exposure=Exposure(blur_px=1.5)),
    Setting("blur 3 px", exposure=Exposure(blur_px=3.0)),
    Setting("noise 7 grey", exposure=Exposure(electrons_per_grey=4.0, read_noise_grey=2.0)),
    Setting("noise 15 grey", exposure=Exposure(electrons_per_grey=1.0, read_noise_grey=4.0)),
    *(Setting(f"tilt {tilt:.0f}°", tilt_deg=tilt) for tilt in (0.0, 30.0, 50.0, 65.0)),
    *(Setting(f"{100 * visible:.0f} % in view", visible=visible) for visible in (0.7, 0.5)),
    Setting("light 0.15", exposure=Exposure(light=0.15)),
    Setting("light 1.3, saturated", exposure=Exposure(light=1.3)),
    *(Setting(f"k1 {k[0]:+.2f}", k1_k2=k) for k in ((-0.05, 0.01), (-0.25, 0.08), (0.15, -0.04))),
]

TARGETS: list[Target] = [
    Chessboard(11, 8, 0.02),
    MarkerChessboard(11, 8, 0.02),
    Charuco(11, 8, 0.02, 0.014, "DICT_5X5_100"),
    CircleGrid(10, 7, 0.02, 0.010),
    AsymmetricCircleGrid(4, 11, 0.015, 0.012),
    DotGrid(10, 7, 0.02, 0.009, 0.013, "0, 1, 20"),
    AprilGrid(6, 4, 0.03, 0.009),
    TagBundle("DICT_4X4_50", 0.04, "3, 7, 11, 19, 23, 42", 3, 0.012),
]


def placed(target: Target, setting: Setting, random: np.random.Generator) -> Floats:
    """Pose ``(4, 4)`` of the target before the camera, as near as it fits or a little farther."""
    azimuth, turn, direction = random.uniform(0.0, 2.0 * np.pi, 3)
    farther, shift = random.uniform(1.0, FARTHER), random.uniform(-1.0, 1.0, 2)
    tilt = np.deg2rad(setting.tilt_deg) * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    R = exp_rotation(tilt) @ exp_rotation(np.array([0.0, 0.0, turn]))
    x0, y0, x1, y1 = target.drawing.paper
    paper = np.array([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]])
    middle = R @ paper.mean(axis=0)

    def free_px(T: Floats) -> Floats:
        seen = sensor_positions(setting.camera, transform_points(T, paper))
        return np.array([seen.min(axis=0), [WIDTH_PX - 1, HEIGHT_PX - 1] - seen.max(axis=0)]) - MARGIN_PX

    low, high = float(np.ptp(paper, axis=0).max()), 20.0
    for _ in range(40):
        near = 0.5 * (low + high)
        low, high = (low, near) if free_px(transform(R, [0.0, 0.0, near] - middle)).min() > 0.0 else (near, high)
    at = np.array([0.0, 0.0, high * farther])
    slack = free_px(transform(R, at - middle)).min(axis=0)
    at[:2] = SLACK_SHARE * shift * slack * at[2] / FOCAL_PX
    if setting.visible == 1.0:
        return transform(R, at - middle)
    way = np.array([np.cos(direction), np.sin(direction), 0.0]) * at[2] / FOCAL_PX
    low, high = 0.0, 2.0 * WIDTH_PX
    for _ in range(20):
        aside = 0.5 * (low + high)
        seen = sensor_positions(
            setting.camera, transform_points(transform(R, at + aside * way - middle), target.points_m)
        )
        low, high = (aside, high) if in_image(seen).mean() > setting.visible else (low, aside)
    return transform(R, at + high * way - middle)


def in_image(pixels: Floats) -> npt.NDArray[np.bool_]:
    return np.asarray(((pixels >= 0.0) & (pixels <= [WIDTH_PX - 1, HEIGHT_PX - 1])).all(axis=-1))


def truth_of(target: Target, camera: Camera, T_camera_target: Floats) -> Floats:
    """Pixels ``(P, 2)`` of the points; of discs the middles of their images."""
    if not target.circle_radii_m.any():
        return sensor_positions(camera, transform_points(T_camera_target, target.points_m))
    angle = np.arange(240) * (2.0 * np.pi / 240)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    rims = target.points_m[:, None] + target.circle_radii_m[:, None, None] * circle
    seen = sensor_positions(camera, transform_points(T_camera_target, rims.reshape(-1, 3))).reshape(len(rims), -1, 2)
    origins = seen.mean(axis=1, keepdims=True)
    p, q = seen - origins, np.roll(seen, -1, axis=1) - origins
    area = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    return origins[:, 0] + (area[..., None] * (p + q)).sum(axis=1) / (3.0 * area.sum(axis=1)[:, None])


def unnamed(found: bool, pixels: object, truth: Floats) -> Answer:
    """An answer of a detector that begins at any end: each point gets the name of the nearest."""
    if not found:
        return None
    seen = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
    return np.linalg.norm(seen[:, None] - truth, axis=2).argmin(axis=1), seen


def chessboard_sb(board: Chessboard, image: GreyImage, truth: Floats) -> Answer:
    flags = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
    return unnamed(*cv2.findChessboardCornersSB(image, (board.columns, board.rows), flags=flags), truth)


def chessboard_subpix(board: Chessboard, image: GreyImage, truth: Floats) -> Answer:
    found, corners = cv2.findChessboardCorners(image, (board.columns, board.rows))
    if not found:
        return None
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
    return unnamed(True, cv2.cornerSubPix(image, corners, (11, 11), (-1, -1), stop), truth)


def marker_sb(board: MarkerChessboard, image: GreyImage, truth: Floats) -> Answer:
    """The whole board, or the part of it around the dots."""
    flags = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_MARKER
    for size, more in (((board.columns, board.rows), 0), ((5, 5), cv2.CALIB_CB_LARGER)):
        found, corners, _ = cv2.findChessboardCornersSBWithMeta(image, size, flags | more)
        if found:
            return unnamed(True, corners, truth)
    return None


def charuco(board: Charuco, image: GreyImage, truth: Floats) -> Answer:
    names = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    printed = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, names)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(printed).detectBoard(image)
    return None if ids is None else (np.asarray(ids).ravel(), np.asarray(corners, dtype=np.float64).reshape(-1, 2))


def circles(grid: CircleGrid | DotGrid, image: GreyImage, truth: Floats) -> Answer:
    return unnamed(*cv2.findCirclesGrid(image, (grid.columns, grid.rows), flags=cv2.CALIB_CB_SYMMETRIC_GRID), truth)


def asymmetric_circles(grid: AsymmetricCircleGrid, image: GreyImage, truth: Floats) -> Answer:
    return unnamed(*cv2.findCirclesGrid(image, (grid.columns, grid.rows), flags=cv2.CALIB_CB_ASYMMETRIC_GRID), truth)


def tags(target: AprilGrid | TagBundle, image: GreyImage, refinement: int) -> Answer:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    names = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, target.dictionary))
    quads, ids, _ = cv2.aruco.ArucoDetector(names, parameters).detectMarkers(image)
    if ids is None:
        return None
    count = target.columns * target.rows if isinstance(target, AprilGrid) else 0
    numbers = list(target.numbers) if isinstance(target, TagBundle) else list(range(target.first, target.first + count))
    read = np.asarray(ids).ravel()
    of_target = np.isin(read, numbers)
    places = np.array([numbers.index(k) for k in read[of_target]], dtype=np.int64)
    pixels = np.asarray(quads, dtype=np.float64).reshape(-1, 4, 2)[of_target].reshape(-1, 2)
    return (4 * places[:, None] + np.arange(4)).ravel(), pixels


def tags_subpix(target: AprilGrid | TagBundle, image: GreyImage, truth: Floats) -> Answer:
    return tags(target, image, cv2.aruco.CORNER_REFINE_SUBPIX)


def tags_apriltag(target: AprilGrid | TagBundle, image: GreyImage, truth: Floats) -> Answer:
    return tags(target, image, cv2.aruco.CORNER_REFINE_APRILTAG)


Detector = Callable[[Target, GreyImage, Floats], Answer]
OPENCV: dict[str, dict[str, Detector]] = {
    "Chessboard": {"SB": chessboard_sb, "cornerSubPix": chessboard_subpix},
    "MarkerChessboard": {"SB": marker_sb},
    "Charuco": {"CharucoDetector": charuco},
    "CircleGrid": {"findCirclesGrid": circles},
    "AsymmetricCircleGrid": {"findCirclesGrid": asymmetric_circles},
    "DotGrid": {"findCirclesGrid": circles},
    "AprilGrid": {"SUBPIX": tags_subpix, "APRILTAG": tags_apriltag},
    "TagBundle": {"SUBPIX": tags_subpix, "APRILTAG": tags_apriltag},
}


@dataclass
class Tally:
    """What one detector did in some views, which states standard deviations or does not."""

    stated: bool = False
    found: int = 0
    views: int = 0
    points: int = 0
    in_view: int = 0
    errors_px: list[Floats] = field(default_factory=list)
    normalised: list[Floats] = field(default_factory=list)

    def enter(self, answer: Answer, truth: Floats, sigmas_px: Floats | None = None) -> None:
        """Enter an answer to one view."""
        self.views += 1
        self.in_view += np.count_nonzero(in_image(truth))
        if answer is None or not len(answer[0]):
            return
        self.found += 1
        points, pixels = answer
        self.points += len(np.unique(points))
        self.errors_px.append(pixels - truth[points])
        if sigmas_px is not None:
            self.normalised.append(self.errors_px[-1] / sigmas_px[:, None])

    def add(self, other: Tally) -> None:
        """Enter all that another tally holds."""
        self.found, self.views = self.found + other.found, self.views + other.views
        self.points, self.in_view = self.points + other.points, self.in_view + other.in_view
        self.errors_px += other.errors_px
        self.normalised += other.normalised

    def __str__(self) -> str:
        if not self.found:
            return f"0 of {self.views} | - | -" if self.stated else f"0 of {self.views} | -"
        row = f"{self.found} of {self.views}, {100 * self.points / self.in_view:.0f} % | {rms(self.errors_px):.4f}"
        return f"{row} | {rms(self.normalised):.2f}" if self.stated else row


def rms(parts: list[Floats]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def ours(target: Target, image: GreyImage, truth: Floats, tally: Tally) -> str:
    """Enter what our finder says, by its own names or those after half a turn; the reason if it finds nothing."""
    answer = target.find(image)
    if not answer:
        tally.enter(None, truth)
        return answer.reason
    names = [answer.points, *([] if target.turn is None else [target.turn[answer.points]])]
    points = min(names, key=lambda n: float(np.square(answer.pixels - truth[n]).sum()))
    tally.enter((points, answer.pixels), truth, answer.sigmas_px)
    return ""


def table(target: Target, views: int) -> dict[str, Tally]:
    """Print the rows of one kind; the sums of all its rows by detector."""
    kind = type(target).__name__
    detectors = OPENCV[kind]
    sums = {name: Tally(name == "ours") for name in ("ours", *detectors)}
    print(f"\n{kind}\n\n| view | found | RMS, px | residual |" + "".join(f" {d} found | RMS, px |" for d in detectors))
    print("|---|---|---|---|" + "---|---|" * len(detectors))
    reasons: dict[str, str] = {}
    for setting in SETTINGS:
        tallies = {name: Tally(name == "ours") for name in sums}
        for seed in range(views):
            random = np.random.default_rng(seed)
            T = placed(target, setting, random)
            image = render_target(target.drawing, setting.camera, T, setting.exposure, random)
            truth = truth_of(target, setting.camera, T)
            reason = ours(target, image, truth, tallies["ours"])
            if reason:
                reasons[setting.name] = reason
            for name, look in detectors.items():
                tallies[name].enter(look(target, image, truth), truth)
        print(f"| {setting.name} | " + " | ".join(str(t) for t in tallies.values()) + " |", flush=True)
        for name, tally in tallies.items():
            sums[name].add(tally)
    print("| all | " + " | ".join(str(t) for t in sums.values()) + " |", flush=True)
    for name, reason in reasons.items():
        print(f"\n{name}: {reason}")
    return sums


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", type=int, default=5, help="views per row")
    parser.add_argument("--kinds", nargs="*", default=list(OPENCV), choices=list(OPENCV), help="kinds of target")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    begun = time.perf_counter()
    chosen = {type(target).__name__: target for target in TARGETS if type(target).__name__ in options.kinds}
    sums = {kind: table(target, options.views) for kind, target in chosen.items()}
    print(
        "\nAll rows\n\n| kind | found | RMS, px | residual | OpenCV | found | RMS, px |\n|---|---|---|---|---|---|---|"
    )
    for kind, tallies in sums.items():
        for name in OPENCV[kind]:
            print(f"| {kind} | {tallies['ours']} | {name} | {tallies[name]} |")
    print(f"\n{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
