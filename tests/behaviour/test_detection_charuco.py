"""A ChArUco board in an image: named corners, as many as are visible, without the half pixel of older detectors."""

import cv2
import numpy as np
import pytest

from painting import GREY, painted, texture, view
from sixthlink.target import Charuco, Found, NotFound

SQUARE, MARKER = 0.03, 0.022
MIDDLE = (2.5 * SQUARE, 3.5 * SQUARE)
BOARD = Charuco(5, 7, SQUARE, MARKER, "DICT_6X6_250")
CELLS = 80


def printed(columns=5, rows=7, *, legacy=False, dictionary=cv2.aruco.DICT_6X6_250):
    """OpenCV's own print of the board as paint."""
    names = cv2.aruco.getPredefinedDictionary(dictionary)
    board = cv2.aruco.CharucoBoard((columns, rows), SQUARE, MARKER, names)
    board.setLegacyPattern(legacy)
    return board, texture(board.generateImage((CELLS * columns, CELLS * rows)), SQUARE / CELLS)


@pytest.fixture(scope="module")
def seen():
    return view(MIDDLE, angles_deg=(20.0, -15.0, 25.0))


@pytest.fixture(scope="module")
def image(seen):
    return painted(printed()[1], seen)


def found(target, image):
    answer = target.find(image)
    assert isinstance(answer, Found), answer
    return answer


def test_points_are_opencvs():
    board = printed()[0]
    assert np.abs(BOARD.points_m - np.asarray(board.getChessboardCorners())).max() < 1e-7
    assert BOARD.turn is None


def test_every_corner_has_its_name_and_its_place(seen, image):
    answer = found(BOARD, image)
    assert sorted(answer.points) == list(range(24))
    errors = answer.pixels - seen.pixels(BOARD.points_m[answer.points])
    assert np.sqrt(np.mean(errors**2)) < 0.05
    assert np.abs(errors.mean(axis=0)).max() < 0.02, "older detectors are off by half a pixel in both directions"


def test_a_part_of_the_board_is_enough(seen, image):
    part = image.copy()
    part[:, 420:] = int(GREY)
    answer = found(BOARD, part)
    assert 6 <= len(answer.points) < 24
    assert np.abs(answer.pixels - seen.pixels(BOARD.points_m[answer.points])).max() < 0.3


def test_a_board_upside_down_keeps_its_names(seen, image):
    answer = found(BOARD, np.ascontiguousarray(image[::-1, ::-1]))
    turned = np.array([seen.width - 1, seen.height - 1]) - seen.pixels(BOARD.points_m[answer.points])
    assert np.abs(answer.pixels - turned).max() < 0.3


def test_a_large_image_is_searched_small_and_refined_large():
    seen = view(MIDDLE, width=2000, height=1600, focal=4000.0, angles_deg=(20.0, -15.0, 25.0))
    answer = found(BOARD, painted(printed()[1], seen, rays=1, blur=0.9))
    assert len(answer.points) == 24
    errors = answer.pixels - seen.pixels(BOARD.points_m[answer.points])
    assert np.sqrt(np.mean(errors**2)) < 0.05


def test_legacy_boards_begin_with_a_marker():
    seen = view((2.5 * SQUARE, 3 * SQUARE), angles_deg=(15.0, 10.0, 0.0))
    image = painted(printed(5, 6, legacy=True)[1], seen, rays=3)
    legacy = Charuco(5, 6, SQUARE, MARKER, "DICT_6X6_250", legacy=True)
    answer = found(legacy, image)
    assert np.abs(answer.pixels - seen.pixels(legacy.points_m[answer.points])).max() < 0.3


def test_too_little_is_refused_with_what_to_check(image):
    strip = image.copy()
    strip[:, 300:] = int(GREY)
    for poor in (strip, np.full_like(image, 128)):
        answer = BOARD.find(poor)
        assert isinstance(answer, NotFound)
        assert "expected at least 6 not on one line" in answer.reason
        assert "DICT_6X6_250" in answer.reason


def test_another_dictionary_is_not_this_board(image):
    answer = Charuco(5, 7, SQUARE, MARKER, "DICT_4X4_50").find(image)
    assert isinstance(answer, NotFound)
    assert "dictionary DICT_4X4_50" in answer.reason


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"columns": 2}, "too small"),
        ({"marker_m": SQUARE}, "marker < square"),
        ({"dictionary": "DICT_7X7_3"}, "DICT_6X6_250"),
    ],
)
def test_boards_that_cannot_exist_are_refused(change, words):
    values = {"columns": 5, "rows": 7, "square_m": SQUARE, "marker_m": MARKER, "dictionary": "DICT_6X6_250"}
    with pytest.raises(ValueError, match=words):
        Charuco(**(values | change))
