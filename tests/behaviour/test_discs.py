"""Discs all the way: found, corrected for the eccentricity of their images, good for lenses and stereo heads."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from data import real
from sixthlink.calibrate import calibrate_rig, stereo_checks
from sixthlink.calibrate.disc_centres import eccentricities, with_disc_centres
from sixthlink.camera import Camera, CameraRig
from sixthlink.geometry import exp_rotation, transform, transform_points
from sixthlink.recording import CameraDescription, Detections, Head, Recording, joined
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import CircleGrid, Found, NotFound

CAMERA = Camera(1000, 800, np.full(2, 1300.0), np.array([505.0, 393.0]), np.array([-0.09, 0.08, 0.0, 0.0, 0.0]))
GRID = CircleGrid(7, 5, 0.035, 0.022)


def placed(rng, tilt_rad: float):
    azimuth = rng.uniform(0.0, 2.0 * np.pi)
    R = exp_rotation(tilt_rad * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
    R = R @ exp_rotation(np.array([0.0, 0.0, rng.uniform(-0.4, 0.4)]))
    place = np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(0.46, 0.6)])
    return transform(R, place - R @ GRID.points_m.mean(axis=0))


def recorded(tables: list[Detections], grid=GRID, cameras: tuple[CameraDescription, ...] = ()) -> Recording:
    shots = len(np.unique(np.concatenate([t.shots for t in tables])))
    cameras = cameras or (CameraDescription("camera", 1000, 800),)
    return Recording(
        name="discs",
        mount="eye-in-hand",
        robot="",
        arm=None,
        head=Head(cameras),
        target=grid,
        standard=None,
        ids=tuple(f"s{k}" for k in range(shots)),
        placements=("p",) * shots,
        kinds=("calibrate",) * shots,
        marks=("",) * shots,
        Ts_base_flange=np.tile(np.eye(4), (shots, 1, 1)),
        pixels=joined(tables),
    )


def table(shot: int, found: Found, camera: int = 0) -> Detections:
    rows = len(found.points)
    return Detections(np.full(rows, shot), np.full(rows, camera), found.points, found.pixels, found.sigmas_px)


def seen(seed: int, tilt_rad: float):
    rng = np.random.default_rng(seed)
    T = placed(rng, tilt_rad)
    found = GRID.find(render_target(GRID.drawing, CAMERA, T, Exposure(), rng))
    assert isinstance(found, Found), found
    return T, found


@pytest.mark.parametrize("seed", range(3))
def test_the_middle_of_the_ellipse_is_where_the_formula_says(seed):
    """Against the rim of every disc, projected by the simulator's own lens, and the area of what it encloses."""
    rng = np.random.default_rng(seed)
    plain = replace(CAMERA, distortion=np.zeros(5))
    T = placed(rng, 0.7)
    turn = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    radii = GRID.circle_radii_m
    for k in (0, 17, 34):
        rim = GRID.points_m[k] + radii[k] * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
        u, v = sensor_positions(plain, transform_points(T, rim)).T
        cross = u * np.roll(v, -1) - np.roll(u, -1) * v
        middle = np.array([np.sum((a + np.roll(a, -1)) * cross) for a in (u, v)]) / (3.0 * np.sum(cross))
        centre = sensor_positions(plain, transform_points(T, GRID.points_m[k : k + 1]))[0]
        (predicted,) = eccentricities(plain, T, GRID.points_m[k : k + 1], radii[k : k + 1])
        assert predicted == pytest.approx(middle - centre, abs=2e-4)
        assert np.linalg.norm(middle - centre) > 0.1


def test_corrected_middles_are_where_the_discs_middles_are_seen():
    """A bias of tenths of a pixel becomes hundredths."""
    before, after = [], []
    for shot in range(4):
        T, found = seen(shot, 0.6)
        rig = CameraRig(("camera",), (CAMERA,), np.eye(4)[None])
        detections = table(0, found)
        right = with_disc_centres(rig, GRID.points_m, GRID.circle_radii_m, detections, ("s",), turn=GRID.turn)
        true = sensor_positions(CAMERA, transform_points(T, GRID.points_m))
        naming = found.points
        if np.abs(found.pixels - true[naming]).max() > 5.0:  # read from the other end
            naming = GRID.turn[naming]
        before.append(found.pixels - true[naming])
        after.append(right.pixels - true[naming])
    rms = [float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for e in (before, after)]
    assert rms[0] > 0.08
    assert rms[1] < 0.2 * rms[0]
    assert rms[1] < 0.025


def test_a_lens_from_discs_is_as_true_as_its_interval():
    tables = [table(shot, seen(shot, (0.15, 0.4, 0.6)[shot % 3])[1]) for shot in range(12)]
    found = calibrate_rig(recorded(tables), joined(tables))
    evidence = found.cameras[0]
    assert np.abs(found.rig.cameras[0].focal_px - CAMERA.focal_px).max() < 4.0 * evidence.std[:2].max()
    assert evidence.rms_px < 0.02


ENSENSO = CircleGrid(7, 7, 0.01875, 0.009)


def ensenso(which: str, name: str = "13126031178767_150457"):
    """A real stereo pair of a known dot grid, its head given as its maker calibrated it, at the factory or again."""
    path = real("ensenso_stereo_known_grid") / "locate_pattern_camera" / name
    calib = json.loads(path.with_name(f"{name}_calib.json").read_text(encoding="utf-8"))["Calibration"]
    stereo = calib["Stereo"] if which == "factory" else calib["Dynamic"]["Stereo"]
    lenses = []
    for side in ("Left", "Right"):
        K = np.array(calib["Monocular"][side]["Camera"]).T
        terms = np.array(calib["Monocular"][side]["Distortion"])
        lenses.append(Camera(1280, 1024, np.diag(K)[:2], K[:2, 2], terms))
    left, right = (np.array(stereo[side]["Rotation"]).T for side in ("Left", "Right"))
    baseline_m = calib["Stereo"]["Baseline"] * 1e-3
    T_right_left = transform(right.T @ left, -right.T @ np.array([baseline_m, 0.0, 0.0]))
    cameras = (
        CameraDescription("left", 1280, 1024, camera=lenses[0]),
        CameraDescription("right", 1280, 1024, camera=lenses[1], T_camera_head=T_right_left),
    )
    images = [cv2.imread(str(path.with_name(f"{name}_{side}.png")), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")]
    return cameras, [ENSENSO.find(image) for image in images]


def checked(which: str):
    cameras, found = ensenso(which)
    tables = [table(0, f, c) for c, f in enumerate(found)]
    rig = CameraRig(
        ("left", "right"), tuple(c.camera for c in cameras), np.stack([np.eye(4), cameras[1].T_camera_head])
    )
    detections = with_disc_centres(
        rig, ENSENSO.points_m, ENSENSO.circle_radii_m, joined(tables), ("s0",), turn=ENSENSO.turn
    )
    (check,) = stereo_checks(recorded(tables, ENSENSO, cameras), detections)
    return check


def test_a_real_head_that_was_calibrated_again_measures_a_known_length():
    check = checked("again")
    assert check.points == 49
    assert not check.stale
    assert abs(check.length_m - 0.1125) < 0.06e-3
    assert check.noise_px < 0.03


def test_its_factory_calibration_is_named_as_stale():
    """The data's README: 0.64 pixel of vertical disparity, and 112.25 mm for 112.5."""
    check = checked("factory")
    assert check.stale
    assert check.epipolar_rms_px == pytest.approx(0.65, abs=0.05)
    assert "stale" in check.words


def test_a_picture_without_the_grid_shows_none():
    _, found = ensenso("again", "13126031197675_150457")
    assert all(isinstance(f, NotFound) for f in found)
