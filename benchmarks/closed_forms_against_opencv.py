"""Are our closed forms as accurate as OpenCV's of the same name?

OpenCV 5.0 lost the hand-eye functions in Python, so this runs in an environment of its own:

    uv venv .venv-cv4
    uv pip install --python .venv-cv4/bin/python numpy scipy opencv-python-headless==4.14.0.94
    PYTHONPATH=src .venv-cv4/bin/python benchmarks/closed_forms_against_opencv.py

Tables: agreement on exact shots, mean errors on noisy random sets (OpenCV once in metres and once in
millimetres, since three of its methods depend on the unit), scatter on public recordings, and time against
the number of shots. Figures of the last run stand in ``closed_forms_against_opencv.md``.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from sixthlink.calibrate.head.closed_form import CLOSED_FORMS
from sixthlink.geometry import (
    Floats,
    apply_motion,
    exp_rotation,
    inverse,
    mean_transform,
    rotation_angle,
    transform,
)

HAND_EYE = {
    "tsai": cv2.CALIB_HAND_EYE_TSAI,
    "park": cv2.CALIB_HAND_EYE_PARK,
    "horaud": cv2.CALIB_HAND_EYE_HORAUD,
    "andreff": cv2.CALIB_HAND_EYE_ANDREFF,
    "daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,
}
ROBOT_WORLD = {"shah": cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH, "li": cv2.CALIB_ROBOT_WORLD_HAND_EYE_LI}

Scene = tuple[Floats, Floats, Floats]
Poses = Callable[[np.random.Generator, int], Floats]


def opencv(method: str, A: Floats, B: Floats, scale: float = 1.0) -> Floats:
    """OpenCV's head [m], computed with lengths in 1/scale metres; NaN where it raises."""
    try:
        if method in HAND_EYE:
            R, t = cv2.calibrateHandEye(*_split(A, scale), *_split(B, scale), method=HAND_EYE[method])
            return transform(R, t.ravel() / scale)
        answer = cv2.calibrateRobotWorldHandEye(
            *_split(B, scale), *_split(inverse(A), scale), method=ROBOT_WORLD[method]
        )
        return inverse(transform(answer[2], answer[3].ravel() / scale))
    except cv2.error:
        return np.full((4, 4), np.nan)


def ours(method: str, A: Floats, B: Floats) -> Floats:
    return CLOSED_FORMS[method](A, B, np.zeros(len(A), dtype=np.int64))


def tilted(rng: np.random.Generator, shots: int) -> Floats:
    """Target poses of a head that looks at a target from within 35° of its normal, rolled by up to 86°."""
    tilt, azimuth = rng.uniform(0, np.deg2rad(35), shots), rng.uniform(0, 2 * np.pi, shots)
    zero = np.zeros(shots)
    R_tilt = exp_rotation(np.stack([tilt * np.cos(azimuth), tilt * np.sin(azimuth), zero], axis=1))
    R_roll = exp_rotation(np.stack([zero, zero, rng.uniform(-1.5, 1.5, shots)], axis=1))
    t = np.column_stack([rng.uniform(-0.1, 0.1, (shots, 2)), rng.uniform(0.4, 0.9, shots)])
    return transform(R_roll @ np.diag([1.0, -1.0, -1.0]) @ R_tilt, t)


def tumbling(rng: np.random.Generator, shots: int) -> Floats:
    """Target poses of any orientation, about 0.6 m away."""
    q = rng.normal(size=(shots, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    angle = 2 * np.arctan2(np.linalg.norm(q[:, 1:], axis=1), q[:, 0])[:, None]
    R = exp_rotation(angle * q[:, 1:] / np.linalg.norm(q[:, 1:], axis=1, keepdims=True))
    return transform(R, rng.uniform([-0.6, -0.6, 0.0], [0.6, 0.6, 1.2], (shots, 3)))


def scene(seed: int, poses: Poses, noise: str) -> Scene:
    """Head, flange poses and target poses of 5 to 40 shots.

    Args:
        seed: Seed of the set.
        poses: Which way the head looks.
        noise: ``none``, ``robot``, ``head``, ``same`` (one level for both) or ``own`` (a level for each). Levels are
            drawn log-uniformly from 0.01° to 0.5° and from 0.02 mm to 1 mm.
    """
    rng = np.random.default_rng(seed)
    X = transform(exp_rotation(1.5 * rng.normal(size=3)), rng.uniform(-0.2, 0.2, 3))
    T_base_target = transform(exp_rotation(rng.normal(size=3)), rng.uniform(-1, 1, 3))
    B = poses(rng, int(rng.integers(5, 41)))
    A = T_base_target @ inverse(B) @ inverse(X)
    turns = np.deg2rad(np.exp(rng.uniform(np.log(0.01), np.log(0.5), 2)))
    shifts = np.exp(rng.uniform(np.log(2e-5), np.log(1e-3), 2))
    robot, head = (rng.normal(size=(len(A), 6)) for _ in range(2))
    levels = np.column_stack([shifts, shifts, shifts, turns, turns, turns])
    if noise in {"robot", "same", "own"}:
        A = apply_motion(A, robot * levels[0])
    if noise in {"head", "same", "own"}:
        B = apply_motion(B, head * levels[1 if noise == "own" else 0])
    return X, A, B


def rigid_scene(seed: int, noisy: str, side: str) -> Scene:
    """Head and poses of 5, 10, 20 or 50 shots whose noise moves rigid bodies.

    Args:
        seed: Seed of the set.
        noisy: ``robot``, ``head`` or ``both``, at one level.
        side: ``near``, T · noise: each errs about the origin of what it measures (flange, target); ``far``, noise · T:
            about its own (base, head).
    """
    rng = np.random.default_rng(100_000 + seed)
    X = transform(exp_rotation(1.5 * rng.normal(size=3)), rng.uniform(-0.2, 0.2, 3))
    T_base_target = transform(exp_rotation(rng.normal(size=3)), rng.uniform(-1, 1, 3))
    B = tilted(rng, (5, 10, 20, 50)[seed % 4])
    A = T_base_target @ inverse(B) @ inverse(X)
    shift, turn = np.exp(rng.uniform(np.log([2e-5, 0.01]), np.log([1e-3, 0.5])))
    levels = np.repeat([shift, np.deg2rad(turn)], 3)
    robot, head = (apply_motion(np.eye(4)[None], rng.normal(size=(len(A), 6)) * levels) for _ in range(2))
    if noisy in {"robot", "both"}:
        A = A @ robot if side == "near" else robot @ A
    if noisy in {"head", "both"}:
        B = B @ head if side == "near" else head @ B
    return X, A, B


def errors(found: Floats, X: Floats) -> tuple[float, float]:
    """Rotation [rad] and translation [m] error; no finite answer counts as half a turn and 1 m."""
    if not np.isfinite(found).all():
        return np.pi, 1.0
    return float(rotation_angle(X[:3, :3].T @ found[:3, :3])), float(np.linalg.norm(found[:3, 3] - X[:3, 3]))


def print_agreement(sets: int) -> None:
    print(f"\nExact shots, {sets} sets of each kind: largest difference from OpenCV, largest error of ours\n")
    print("| method | difference, rad | difference, m | error, rad | error, m |\n|---|---|---|---|---|")
    for method in CLOSED_FORMS:
        apart, off = [], []
        for poses in (tilted, tumbling):
            for seed in range(sets):
                X, A, B = scene(seed, poses, "none")
                found, other = ours(method, A, B), opencv(method, A, B)
                # OpenCV's Tsai gives up on some sets and returns the identity.
                if errors(other, X)[0] < 1e-3:
                    apart.append(errors(found, other))
                off.append(errors(found, X))
        figures = [*np.max(apart, axis=0), *np.max(off, axis=0)]
        print(f"| {method} ({len(apart)} compared) | " + " | ".join(f"{f:.1e}" for f in figures) + " |")


def print_accuracy(title: str, poses: Poses, noise: str, sets: int) -> None:
    found = {method: np.zeros((sets, 3, 2)) for method in CLOSED_FORMS}
    seconds = {method: np.zeros(2) for method in CLOSED_FORMS}
    for seed in range(sets):
        X, A, B = scene(seed, poses, noise)
        for method in CLOSED_FORMS:
            start = time.perf_counter()
            found[method][seed, 0] = errors(ours(method, A, B), X)
            middle = time.perf_counter()
            found[method][seed, 1] = errors(opencv(method, A, B), X)
            seconds[method] += middle - start, time.perf_counter() - middle
            found[method][seed, 2] = errors(opencv(method, A, B, 1000.0), X)
    print(f"\n{title}, {sets} sets: mean errors in degrees and millimetres\n")
    print("| method | ours | OpenCV, m | OpenCV, mm | ratio, m | ratio, mm | lost, m / mm | time ratio |")
    print("|---|---|---|---|---|---|---|---|")
    for method, all_errors in found.items():
        mean = all_errors.mean(axis=0) * [np.rad2deg(1.0), 1e3]
        lost = (all_errors[:, 1:, 0] > np.deg2rad(10)).sum(axis=0)
        cells = [f"{turn:.4f}°, {shift:.3f}" for turn, shift in mean]
        cells += [f"{turn:.5f}, {shift:.3f}" for turn, shift in mean[:1] / mean[1:]]
        ratio = seconds[method][0] / seconds[method][1]
        print(f"| {method} | " + " | ".join(cells) + f" | {lost[0]} / {lost[1]} | {ratio:.2f} |")


def print_sides(sets: int) -> None:
    print(f"\nNoise as motions of rigid bodies, {sets} sets of each kind: ratios of mean errors, OpenCV in m / mm\n")
    print("| noise | " + " | ".join(CLOSED_FORMS) + " |\n|---|" + "---|" * len(CLOSED_FORMS))
    for side in ("near", "far"):
        for noisy in ("robot", "head", "both"):
            found = np.zeros((sets, len(CLOSED_FORMS), 3, 2))
            for seed in range(sets):
                X, A, B = rigid_scene(seed, noisy, side)
                for k, method in enumerate(CLOSED_FORMS):
                    answers = ours(method, A, B), opencv(method, A, B), opencv(method, A, B, 1000.0)
                    found[seed, k] = [errors(answer, X) for answer in answers]
            mean = found.mean(axis=0)
            ratio = mean[:, :1] / mean[:, 1:]
            cells = [f"{r[0, 0]:.3f} / {r[1, 0]:.3f}, {r[0, 1]:.3f} / {r[1, 1]:.3f}" for r in ratio]
            print(f"| {noisy}, {side} | " + " | ".join(cells) + " |")


def print_time() -> None:
    print("\nMilliseconds for N shots, ours / OpenCV\n\n| method | 20 | 100 | 400 |\n|---|---|---|---|")
    for method in CLOSED_FORMS:
        cells = []
        for shots in (20, 100, 400):
            rng = np.random.default_rng(1)
            B = tilted(rng, shots)
            A = apply_motion(inverse(B), 1e-3 * rng.normal(size=(shots, 6)))
            best = [_seconds(solve, method, A, B) for solve in (ours, opencv)]
            cells.append(" / ".join(f"{1e3 * b:.1f}" for b in best))
        print(f"| {method} | " + " | ".join(cells) + " |")


def print_recordings(data: Path) -> None:
    print("\nPublic recordings: RMS scatter of the target poses in millimetres and degrees")
    for name, (A, B) in recordings(data).items():
        print(f"\n{name}, {len(A)} shots\n")
        print("| method | ours | OpenCV, m | ours: X translation, mm |\n|---|---|---|---|")
        for method in CLOSED_FORMS:
            X = ours(method, A, B)
            cells = [_scatter(A, B, X), _scatter(A, B, opencv(method, A, B))]
            position = ", ".join(f"{v:.1f}" for v in X[:3, 3] * 1e3)
            print(f"| {method} | " + " | ".join(cells) + f" | {position} |")


def recordings(data: Path) -> dict[str, tuple[Floats, Floats]]:
    denso, fr3, moveit = (data / f for f in ("denso_tabb_ds1", "fr3_joint_camera", "moveit_eye_to_hand_poses"))
    return {
        "Denso VS-6577, 8×6 chessboard (target poses with intrinsics calibrated here)": _denso(denso),
        "Franka Research 3, nominal kinematics": (
            _poses(fr3 / "controller_tcp_poses.csv")[1],
            inverse(_poses(fr3 / "board_T_cam.csv")[1]),
        ),
        "MoveIt, fixed camera": (
            inverse(_poses(moveit / "poses.csv")[1]),
            _poses(moveit / "cam_T_target.csv")[1],
        ),
    }


def _denso(folder: Path) -> tuple[Floats, Floats]:
    names, poses = _poses(folder / "poses.csv")
    points: dict[str, list[list[float]]] = {name: [] for name in names}
    for row in _rows(folder / "corners.csv"):
        points[row[0]].append([float(v) for v in row[2:]])
    seen = [k for k, name in enumerate(names) if points[name]]
    tables = [np.array(points[names[k]], dtype=np.float32) for k in seen]
    objects = [np.column_stack([t[:, :2] / 1e3, np.zeros(len(t))]).astype(np.float32) for t in tables]
    _, _, _, rotvecs, shifts = cv2.calibrateCamera(objects, [t[:, 2:].copy() for t in tables], (640, 480), None, None)
    B = transform(exp_rotation(np.array(rotvecs)[..., 0]), np.array(shifts)[..., 0])
    return poses[seen], B


def _poses(path: Path) -> tuple[list[str], Floats]:
    rows = _rows(path)
    T = np.array([[float(v) for v in row[1:]] for row in rows]).reshape(-1, 4, 4)
    T[:, :3, 3] /= 1e3
    return [row[0] for row in rows], T


def _rows(path: Path) -> list[list[str]]:
    with path.open(newline="") as file:
        return list(csv.reader(line for line in file if not line.startswith("#")))[1:]


def _scatter(A: Floats, B: Floats, X: Floats) -> str:
    if not np.isfinite(X).all():
        return "none"
    T = A @ X @ B
    away = inverse(mean_transform(T)) @ T
    shift = np.sqrt(np.mean(np.sum(away[:, :3, 3] ** 2, axis=1)))
    turn = np.sqrt(np.mean(rotation_angle(away[:, :3, :3]) ** 2))
    return f"{1e3 * shift:.2f}, {np.rad2deg(turn):.3f}°"


def _seconds(solve: Callable[[str, Floats, Floats], Floats], method: str, A: Floats, B: Floats) -> float:
    """Shortest of three runs."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        solve(method, A, B)
        times.append(time.perf_counter() - start)
    return min(times)


def _split(T: Floats, scale: float) -> tuple[list[Floats], list[Floats]]:
    return list(T[:, :3, :3].copy()), list(T[:, :3, 3] * scale)


def main() -> None:
    parser = argparse.ArgumentParser(description="Closed forms against OpenCV's.")
    parser.add_argument("--sets", type=int, default=1000, help="noisy sets of each kind")
    parser.add_argument("--data", type=Path, default=Path("../shared/data"), help="folder of public recordings")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    print(f"OpenCV {cv2.__version__}, numpy {np.__version__}")
    print_agreement(100)
    print_accuracy("Looking at the target, robot and head equally noisy", tilted, "same", options.sets)
    print_accuracy("Tumbling, robot and head equally noisy", tumbling, "same", options.sets)
    print_accuracy("Looking at the target, each with its own noise", tilted, "own", options.sets)
    print_accuracy("Looking at the target, only the head noisy", tilted, "head", options.sets)
    print_accuracy("Looking at the target, only the robot noisy", tilted, "robot", options.sets)
    print_sides(options.sets // 2)
    print_time()
    if options.data.is_dir():
        print_recordings(options.data)
    else:
        print(f"\nno public recordings at {options.data}")


if __name__ == "__main__":
    main()
