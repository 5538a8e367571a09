"""Boards bent in every way that boards are bent, projected by OpenCV: their shape is told, and lens and head are right.

A sheet that was printed flat and bent afterwards keeps its lengths along the surface; a plate that was bent when it was
printed keeps its lengths as seen from the front.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.calibrate import SolveOptions, calibrate_cameras, calibrate_head, calibrate_rig
from sixthlink.geometry import inverse, motion_between, transform
from sixthlink.progress import Silent
from sixthlink.recording import CameraDescription, Detections, Head, Recording
from sixthlink.target import Chessboard, MarkerChessboard, turn_names

BOARD = MarkerChessboard(14, 9, 0.0121)
K = np.array([[1400.0, 0.0, 955.0], [0.0, 1402.0, 545.0], [0.0, 0.0, 1.0]])
LENS = np.array([-0.1, 0.05, 2e-4, -3e-4, 0.0])
X = transform(Rotation.from_euler("xyz", [5.0, -8.0, 90.0], degrees=True).as_matrix(), np.array([0.05, 0.02, 0.08]))
NOISE_PX = 0.02


def cylinder(p, radius_m):
    return np.column_stack(
        [radius_m * np.sin(p[:, 0] / radius_m), p[:, 1], radius_m * (1 - np.cos(p[:, 0] / radius_m))]
    )


def askew(p, radius_m):
    """A cylinder whose axis runs along the diagonal."""
    turn = Rotation.from_euler("z", 45.0, degrees=True).as_matrix()
    return cylinder(p @ turn, radius_m) @ turn.T


def printed_bent(p, radius_m):
    return p + np.column_stack([np.zeros((len(p), 2)), np.sum(p**2, axis=1) / (2.0 * radius_m)])


def snaking(p, radius_m):
    z = (p[:, 0] / 0.08) ** 3 / (1000.0 * radius_m)
    return p + np.column_stack([np.zeros((len(p), 2)), z - p[:, 0] * (p[:, 0] @ z) / (p[:, 0] @ p[:, 0])])


def recorded(points, target=BOARD, *, seed=0, shots=20, tilt_deg=30.0, turned=False):
    """A camera in the hand before points of a board, in its frame about the middle; ends as they come if ``turned``."""
    random, frames, rows, names = np.random.default_rng(seed), [], [], turn_names(target.turn, len(points))
    T_base_board = transform(np.diag([1.0, -1.0, -1.0]), np.array([0.6, 0.1, 0.05]))
    for _ in range(shots):
        angles = [*random.uniform(-tilt_deg, tilt_deg, 2), random.uniform(-180.0, 180.0)]
        place = np.array([*random.uniform(-0.05, 0.05, 2), random.uniform(0.25, 0.35)])
        T = transform(Rotation.from_euler("xyz", angles, degrees=True).as_matrix(), place)
        frames.append(T_base_board @ inverse(T) @ inverse(X))
        seen, _ = cv2.projectPoints(points, cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], K, LENS)
        pixels = seen.reshape(-1, 2) + NOISE_PX * random.standard_normal((len(points), 2))
        rows.append(pixels[names[random.integers(len(names))]] if turned else pixels)
    n = len(points)
    detections = Detections(
        np.repeat(np.arange(shots), n),
        np.zeros(shots * n, dtype=np.int64),
        np.tile(np.arange(n), shots),
        np.concatenate(rows),
        np.full(shots * n, NOISE_PX),
    )
    return Recording(
        name="bent",
        mount="eye-in-hand",
        robot="",
        arm=None,
        head=Head((CameraDescription("camera", 1920, 1080),)),
        target=target,
        standard=None,
        ids=tuple(f"s{i}" for i in range(shots)),
        placements=("p",) * shots,
        kinds=("calibrate",) * shots,
        marks=("",) * shots,
        Ts_base_flange=np.stack(frames),
        pixels=detections,
    )


def centred(target):
    return target.points_m - target.points_m.mean(axis=0)


def sag_m(points):
    plane = np.column_stack([np.ones(len(points)), points[:, :2]])
    return np.ptp(points[:, 2] - plane @ np.linalg.lstsq(plane, points[:, 2], rcond=None)[0])


def head_off(recording, cameras):
    found = calibrate_head(recording, cameras, SolveOptions(), Silent())
    return motion_between(X[None], found.X[None])[0], found


@pytest.mark.parametrize("radius_m", [5.0, 1.0, 0.4])
@pytest.mark.parametrize("bend", [cylinder, askew, printed_bent, snaking])
def test_a_bent_board_leaves_lens_and_head_right(bend, radius_m):
    points = bend(centred(BOARD), radius_m)
    recording = recorded(points)
    cameras = calibrate_cameras(recording, recording.pixels)
    assert cameras.shape.sag_m == pytest.approx(sag_m(points), abs=0.02e-3)
    camera, std = cameras.rig.cameras[0], cameras.cameras[0].std
    assert np.abs((camera.focal_px - [1400.0, 1402.0]) / std[:2]).max() < 4.0
    assert cameras.noise_px == pytest.approx(NOISE_PX, rel=0.1)
    off, found = head_off(recording, cameras)
    assert np.linalg.norm(off[:3]) < 0.02e-3
    assert found.accepted


@pytest.mark.parametrize("columns_rows", [(8, 6), (8, 8)], ids=["half turn", "quarter turn"])
def test_the_robot_tells_the_ends_and_then_the_bend_shows(columns_rows):
    target = Chessboard(*columns_rows, 0.016)
    points = cylinder(centred(target), 0.8)
    recording = recorded(points, target, turned=True)
    cameras = calibrate_cameras(recording, recording.pixels)
    assert cameras.shape.sag_m == pytest.approx(sag_m(points), abs=0.02e-3)
    off, found = head_off(recording, cameras)
    assert np.linalg.norm(off[3:]) < np.deg2rad(0.02)
    assert found.accepted


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("tilt_deg", [12.0, 30.0])
@pytest.mark.parametrize("misprint_m", [0.02e-3, 0.1e-3])
def test_a_misprinted_board_is_not_called_bent_and_the_lens_is_right(misprint_m, tilt_deg, seed):
    random = np.random.default_rng(seed)
    points = centred(BOARD) + np.pad(misprint_m * random.standard_normal((126, 2)), ((0, 0), (0, 1)))
    recording = recorded(points, seed=seed, tilt_deg=tilt_deg)
    cameras = calibrate_rig(recording, recording.pixels)
    assert cameras.shape is None
    assert cameras.print_sigma_m == pytest.approx(misprint_m, rel=0.25)
    camera, std = cameras.rig.cameras[0], cameras.cameras[0].std
    off = np.concatenate([camera.focal_px - [1400.0, 1402.0], camera.centre_px - [955.0, 545.0]])
    assert np.abs(off / std[:4]).max() < 4.0


def test_before_the_robot_has_spoken_misprints_of_a_symmetric_board_are_no_bend():
    target = Chessboard(8, 6, 0.016)
    for seed in range(4):
        random = np.random.default_rng(seed)
        points = centred(target) + np.pad(0.1e-3 * random.standard_normal((48, 2)), ((0, 0), (0, 1)))
        recording = recorded(points, target, seed=seed, tilt_deg=15.0, turned=True)
        assert calibrate_rig(recording, recording.pixels).shape is None


@pytest.mark.parametrize("seed", range(3))
def test_a_wrongly_declared_size_does_not_drag_the_lens_along(seed):
    """With its size taken for granted, the focal length would take up a part of the 2 %."""
    right = recorded(centred(BOARD), seed=seed, tilt_deg=12.0)
    recording = replace(right, target=replace(BOARD, square_m=1.02 * BOARD.square_m))
    _, found = head_off(recording, calibrate_cameras(recording, recording.pixels))
    assert [gate.name for gate in found.gates if not gate.passed] == ["board as large as declared"]
    assert found.board.scale == pytest.approx(1.0 / 1.02, abs=3.0 * found.board.scale_std)
    assert np.abs((found.rig.cameras[0].focal_px - [1400.0, 1402.0]) / found.cameras[0].std[:2]).max() < 4.0
