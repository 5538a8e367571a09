"""The walk over the recorded images: one answer or one named rejection per image, in recorded order."""

import threading
from dataclasses import replace

import cv2
import numpy as np
import pytest

from painting import chessboard, painted, quadrants, view
from sixthlink.detect import detect
from sixthlink.errors import CalibrationError, Cancelled
from sixthlink.recording import CameraDescription, Detections, Head, Recording
from sixthlink.target import Chessboard, LengthStandard, NotFound

SQUARE = 0.02
TARGET = Chessboard(7, 6, SQUARE)
SIZE = (480, 400)


@pytest.fixture(scope="module")
def images():
    boards = [
        painted(
            chessboard(7, 6, SQUARE),
            view((0.06, 0.05), width=480, height=400, focal=900.0, angles_deg=(20, k, 5 * k)),
            rays=2,
            seed=k,
        )
        for k in (0, 5, 15)
    ]
    mark = painted(quadrants(0.012), view((0.0, 0.0), width=480, height=400, focal=900.0), rays=2)
    return [*boards, mark]


def recording(**changes) -> Recording:
    """Three shots of the board and one of mark B, by two cameras; the left one has no image of the second shot."""
    cameras = tuple(CameraDescription(name, *SIZE) for name in ("right", "left"))
    whole = Recording(
        name="walk",
        mount="eye-in-hand",
        robot="",
        arm=None,
        head=Head(cameras),
        target=TARGET,
        standard=LengthStandard(1.0, 1e-5, "quadrant", 0.024),
        ids=("s0", "s1", "s2", "r1_B"),
        placements=("p1", "p1", "p1", "r1"),
        kinds=("calibrate", "calibrate", "calibrate", "verify"),
        marks=("", "", "", "B"),
        Ts_base_flange=np.tile(np.eye(4), (4, 1, 1)),
        images={"right": ("a", "b", "c", "d"), "left": ("e", "", "f", "g")},
    )
    return replace(whole, **changes)


def test_rows_come_in_recorded_order_whatever_the_number_of_workers(images):
    one, none = detect(recording(), lambda shot, camera: images[shot], workers=1)
    three, _ = detect(recording(), lambda shot, camera: images[shot], workers=3)
    assert none == ()
    pairs = list(dict.fromkeys(zip(one.shots.tolist(), one.cameras.tolist(), strict=True)))
    assert pairs == [(0, 0), (0, 1), (1, 0), (2, 0), (2, 1), (3, 0), (3, 1)]
    assert one.points[:42].tolist() == list(range(42))
    for column in ("shots", "cameras", "points", "pixels", "sigmas_px"):
        assert np.array_equal(getattr(one, column), getattr(three, column)), column


def test_a_mark_carries_its_place_in_the_standard(images):
    found, _ = detect(recording(), lambda shot, camera: images[shot])
    assert found.points[found.shots == 3].tolist() == [1, 1]


def test_each_image_that_fails_is_named_and_the_others_stay(images):
    def read(shot, camera):
        if (shot, camera) == (0, 1):
            return NotFound("the file is cut short")
        if (shot, camera) == (2, 0):
            return np.zeros((480, 640), np.uint8)
        if (shot, camera) == (2, 1):
            return np.full((400, 480), 90, np.uint8)
        return images[shot]

    found, rejections = detect(recording(), read)
    assert [(r.shot, r.camera) for r in rejections] == [("s0", "left"), ("s2", "right"), ("s2", "left")]
    reasons = [r.reason for r in rejections]
    assert reasons[0] == "the file is cut short"
    assert "640 x 480" in reasons[1]
    assert "480 x 400" in reasons[1]
    assert "no chessboard of 7 x 6" in reasons[2]
    assert set(zip(found.shots.tolist(), found.cameras.tolist(), strict=True)) == {(0, 0), (1, 0), (3, 0), (3, 1)}


def test_recorded_pixels_are_the_answer():
    pixels = Detections(np.zeros(1), np.zeros(1), np.zeros(1), np.ones((1, 2)), np.ones(1))
    found, rejections = detect(recording(pixels=pixels), lambda shot, camera: pytest.fail("no image is to be read"))
    assert found is pixels
    assert rejections == ()


def test_without_a_description_there_is_nothing_to_look_for(images):
    _, rejections = detect(recording(target=None, standard=None), lambda shot, camera: images[shot])
    assert len(rejections) == 7
    assert "describes no target" in rejections[0].reason
    assert "describes no length standard" in rejections[-1].reason


def test_without_images_it_is_said_so():
    with pytest.raises(CalibrationError, match="name the images of each shot"):
        detect(recording(images={}), lambda shot, camera: NotFound(""))


def test_progress_counts_every_image_and_may_stop_the_walk(images):
    steps, read = [], []
    release = threading.Event()

    class Listener:
        def step(self, stage, done, total):
            steps.append((done, total))
            if done == 2:
                release.set()
                raise Cancelled

    def slow(shot, camera):
        read.append((shot, camera))
        if len(read) > 2:
            release.wait(10.0)
        return images[shot]

    threads = cv2.getNumThreads()
    with pytest.raises(Cancelled):
        detect(recording(), slow, progress=Listener(), workers=1)
    assert steps == [(1, 7), (2, 7)]
    assert len(read) <= 4, "images that nobody waits for are not begun"
    assert cv2.getNumThreads() == threads
