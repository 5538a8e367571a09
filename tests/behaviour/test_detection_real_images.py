"""Real images: everything is found that older detectors found, as sharply or more so, and cameras agree with theirs."""

import csv
from collections import defaultdict

import cv2
import numpy as np
import pytest

from data import real
from sixthlink.calibrate import calibrate_rig
from sixthlink.detect import detect
from sixthlink.recording import CameraDescription, Head, Recording
from sixthlink.target import Charuco, Chessboard

SETS = {
    "denso_tabb_ds1": (Chessboard(8, 6, 28.5e-3), 30),
    "rendered_flat_board": (Chessboard(14, 9, 12.1e-3), 13),
    "rosi_charuco_static_camera": (Charuco(5, 7, 36.195e-3, 18.256e-3, "DICT_6X6_250"), 9),
}


def walked(name):
    """Recording of all images of one set, what was detected in them, and the corners in the set's own file."""
    folder = real(name)
    target, number = SETS[name]
    paths = sorted((folder / "images").iterdir())
    assert len(paths) == number
    images = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths]
    height, width = images[0].shape
    recording = Recording(
        name=name,
        mount="eye-in-hand",
        robot="",
        arm=None,
        head=Head((CameraDescription("camera", width, height),)),
        target=target,
        standard=None,
        ids=tuple(path.name for path in paths),
        placements=("p",) * number,
        kinds=("calibrate",) * number,
        marks=("",) * number,
        Ts_base_flange=np.tile(np.eye(4), (number, 1, 1)),
        images={"camera": tuple(path.name for path in paths)},
    )
    detections, rejections = detect(recording, lambda shot, camera: images[shot])
    assert rejections == ()
    return recording, detections, published(folder)


def published(folder):
    corners = defaultdict(dict)
    with (folder / "corners.csv").open() as lines:
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            corners[row["image"]][int(row["point_id"])] = (float(row["u_px"]), float(row["v_px"]))
    return corners


def differences(recording, detections, corners, rename=None):
    """Ours minus theirs for the points in both."""
    points = detections.points if rename is None else rename[detections.points]
    return np.array(
        [
            pixel - corners[recording.ids[shot]][int(point)]
            for shot, point, pixel in zip(detections.shots, points, detections.pixels, strict=True)
            if int(point) in corners[recording.ids[shot]]
        ]
    )


def report(name, result):
    camera, evidence = result.rig.cameras[0], result.cameras[0]
    rms = np.sqrt(2.0) * evidence.rms_px
    print(f"{name}: RMS per point {rms:.4f} pixel, f {camera.focal_px.round(2)}, c {camera.centre_px.round(2)}")
    return camera, rms


def test_denso_in_hand():
    recording, detections, corners = walked("denso_tabb_ds1")
    assert len(detections) == 30 * 48
    apart = differences(recording, detections, corners)
    assert np.sqrt(np.mean(apart**2)) < 0.1
    assert np.abs(apart.mean(axis=0)).max() < 0.03
    camera, rms = report("denso", calibrate_rig(recording, detections))
    assert rms < 0.13
    assert camera.focal_px == pytest.approx([1081.6, 1083.5], abs=15.0), "the data's first publication"


def test_rendered_board_against_its_truth():
    recording, detections, corners = walked("rendered_flat_board")
    # Its y runs up the board and its z towards the viewer; ours runs down and away.
    apart = differences(recording, detections, corners, rename=np.arange(126).reshape(9, 14)[::-1].ravel())
    assert np.sqrt(np.mean(apart**2)) < 0.1
    assert np.abs(apart.mean(axis=0)).max() < 0.02
    result = calibrate_rig(recording, detections)
    camera, rms = report("rendered", result)
    assert rms < 0.04
    K = np.loadtxt(real("rendered_flat_board") / "truth" / "K.txt")
    assert camera.focal_px == pytest.approx([K[0, 0], K[1, 1]], abs=1.0)
    assert camera.centre_px == pytest.approx([K[0, 2], K[1, 2]], abs=1.0)


def test_charuco_without_the_half_pixel_of_older_detectors():
    recording, detections, corners = walked("rosi_charuco_static_camera")
    assert len(detections) == 9 * 24, "every corner of every image"
    apart = differences(recording, detections, corners)
    assert apart.mean(axis=0) == pytest.approx([-0.5, -0.5], abs=0.04), "uneven light pulls theirs by up to 0.03"
    assert apart.std(axis=0).max() < 0.1
    _, rms = report("rosi", calibrate_rig(recording, detections))
    assert rms < 0.55
