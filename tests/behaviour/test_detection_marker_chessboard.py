"""OpenCV's chessboard with three dots: one frame whichever way up it is seen, and however little of it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.camera import Camera
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import Found, NotFound
from sixthlink.target.marker_chessboard import MarkerChessboard

WIDTH, HEIGHT = 640, 512
CAMERA = Camera(WIDTH, HEIGHT, np.full(2, 1000.0), np.array([WIDTH - 1, HEIGHT - 1]) / 2, np.zeros(5))
EVEN, ODD = MarkerChessboard(8, 6, 0.02), MarkerChessboard(9, 6, 0.02)


def shot(board, angles_deg=(25.0, -15.0, 20.0), distance=0.5, *, aside=(0.0, 0.0), seed=0, **exposure):
    """An image of a board, and the true pixels of its corners."""
    x0, y0, x1, y1 = board.drawing.paper
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", angles_deg, degrees=True).as_matrix()
    T[:3, 3] = np.array([*aside, distance]) - T[:3, :3] @ np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.0])
    image = render_target(board.drawing, CAMERA, T, Exposure(**exposure), np.random.default_rng(seed))
    return image, sensor_positions(CAMERA, board.points_m @ T[:3, :3].T + T[:3, 3])


def found(board, image) -> Found:
    answer = board.find(image)
    assert isinstance(answer, Found), answer
    return answer


def rms(errors) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="module")
def whole():
    return shot(EVEN)


@pytest.mark.parametrize("board", [EVEN, ODD, MarkerChessboard(6, 9, 0.02)])
@pytest.mark.parametrize(
    ("angles", "settings"),
    [
        ((25.0, -15.0, 20.0), {}),
        ((25.0, -15.0, 200.0), {}),
        ((-20.0, 30.0, 110.0), {"blur_px": 1.5}),
        ((40.0, 10.0, 290.0), {"electrons_per_grey": 5.0}),
        ((0.0, 0.0, 180.0), {"distance": 0.9}),
    ],
)
def test_every_corner_has_its_name_whichever_way_up(board, angles, settings):
    image, truth = shot(board, angles, **settings)
    answer = found(board, image)
    assert answer.points.tolist() == list(range(len(truth)))
    assert rms(answer.pixels - truth) < 0.03
    assert np.abs(answer.pixels - truth).max() < 0.12


def test_corners_beside_dots_are_as_good_as_the_others(whole):
    errors = []
    for seed in range(4):
        image, truth = shot(EVEN, (20.0, -10.0, 15.0 + 20.0 * seed), seed=seed)
        errors.append(found(EVEN, image).pixels - truth)
    column, row = EVEN.angle
    beside = [(row + i) * EVEN.columns + column + j for i in range(3) for j in range(3) if i + j < 4]
    assert rms(np.array(errors)[:, beside]) < 0.02


def test_the_stated_uncertainty_is_honest_within_a_half(whole):
    image, truth = whole
    answer = found(EVEN, image)
    assert 0.6 < rms((answer.pixels - truth) / answer.sigmas_px[:, None]) < 1.6


@pytest.mark.parametrize(
    ("angles", "distance", "aside"),
    [
        ((10.0, 15.0, 5.0), 0.4, (0.09, 0.03)),
        ((15.0, -10.0, 185.0), 0.4, (-0.09, 0.0)),
        ((30.0, 20.0, 40.0), 0.25, (0.0, 0.0)),
        ((20.0, -30.0, 240.0), 0.25, (0.01, 0.01)),
    ],
)
def test_a_part_that_shows_the_dots_is_enough(angles, distance, aside):
    image, truth = shot(EVEN, angles, distance, aside=aside)
    answer = found(EVEN, image)
    visible = ((truth > 5) & (truth < [WIDTH - 6, HEIGHT - 6])).all(axis=1)
    assert 0.7 * np.count_nonzero(visible) < len(answer.points) < len(truth)
    assert rms(answer.pixels - truth[answer.points]) < 0.03
    assert np.abs(answer.pixels - truth[answer.points]).max() < 0.15


def test_something_lying_on_the_board_costs_only_what_it_hides(whole):
    image, truth = whole[0].copy(), whole[1]
    cv2.circle(image, np.rint(truth[5]).astype(int).tolist(), 30, 120, -1)
    answer = found(EVEN, image)
    assert 30 < len(answer.points) < 48
    assert 5 not in answer.points
    off = np.abs(answer.pixels - truth[answer.points]).max(axis=1)
    assert np.count_nonzero(off > 0.15) <= 3, "only where the rim of the cover is in a corner's window"
    assert off.max() < 1.5


def test_a_part_without_the_dots_is_refused(whole):
    image, truth = whole[0].copy(), whole[1]
    image[:, : int(truth.reshape(6, 8, 2)[:, 5, 0].min())] = 76
    answer = EVEN.find(image)
    assert isinstance(answer, NotFound)
    assert "is the part with the dots visible" in answer.reason


def test_a_mirror_image_is_refused(whole):
    answer = EVEN.find(np.ascontiguousarray(whole[0][:, ::-1]))
    assert isinstance(answer, NotFound)
    assert "mirror" in answer.reason


def test_columns_and_rows_exchanged_are_refused(whole):
    answer = MarkerChessboard(6, 8, 0.02).find(whole[0])
    assert isinstance(answer, NotFound)
    assert "exchanged" in answer.reason


def test_a_chessboard_without_dots_is_refused(whole):
    image, truth = whole[0].copy(), whole[1].reshape(6, 8, 2)
    column, row = EVEN.angle
    for i, j in ((row, column), (row, column + 1), (row + 1, column)):
        square = np.array([truth[i, j], truth[i, j + 1], truth[i + 1, j + 1], truth[i + 1, j]])
        middle = square.mean(axis=0)
        edge = image[tuple(np.rint(middle + 0.65 * (square[0] - middle)).astype(int)[::-1])]
        cv2.circle(image, np.rint(middle).astype(int).tolist(), int(0.26 * np.ptp(square[:, 0])), int(edge), -1)
    answer = EVEN.find(image)
    assert isinstance(answer, NotFound)
    assert "0 dots found" in answer.reason


def test_opencv_finds_its_marker_on_our_drawing(whole):
    flags = cv2.CALIB_CB_MARKER
    seen, _, meta = cv2.findChessboardCornersSBWithMeta(whole[0], (8, 6), flags)
    assert seen
    assert sorted(meta[meta > 2].tolist()) == [3, 3, 4], "two white dots on black, one black dot on white"


def test_a_board_printed_by_opencvs_own_tool_is_read():
    """Documented example: 15 x 10 squares with dots in (7, 4), (7, 5), (8, 5); its angle opens upwards and right."""
    size = 30
    page = np.full((12 * size, 17 * size), 255, np.uint8)
    for y in range(10):
        for x in range(15):
            if x % 2 == y % 2:
                page[(y + 1) * size : (y + 2) * size, (x + 1) * size : (x + 2) * size] = 0
    for x, y in ((7, 4), (7, 5), (8, 5)):
        cv2.circle(page, (int((x + 1.5) * size), int((y + 1.5) * size)), 5, 255 if x % 2 == y % 2 else 0, -1)
    answer = found(MarkerChessboard(9, 14, 0.0121), cv2.GaussianBlur(page, (0, 0), 0.8))
    assert len(answer.points) == 9 * 14
    first, along_x = answer.pixels[0], answer.pixels[1] - answer.pixels[0]
    assert np.abs(first - [2 * size - 0.5, 11 * size - 0.5 - size]).max() < 0.1, "lower left"
    assert np.abs(along_x - [0.0, -size]).max() < 0.1, "x runs up the page"


@pytest.mark.parametrize(
    ("change", "words"),
    [({"columns": 4}, "too small"), ({"columns": 6}, "in a mirror"), ({"square_m": 0.0}, "above 0")],
)
def test_boards_that_cannot_exist_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        MarkerChessboard(**({"columns": 8, "rows": 6, "square_m": 0.02} | change))


def test_what_it_says_of_itself():
    assert EVEN.turn is None
    assert not EVEN.circle_radii_m.any()
    assert np.allclose(EVEN.points_m[9], [0.02, 0.02, 0.0])
