"""A chessboard in an image: found or refused by name, corner by corner where it is, and never mirrored."""

import time
from pathlib import Path

import numpy as np
import pytest

from painting import WHITE, chessboard, painted, view
from sixthlink.files import load_arm
from sixthlink.simulate import SCENARIOS, render_image, simulate_cell
from sixthlink.target import Chessboard, Found, NotFound, turn_names

SQUARE = 0.02
BOARD = Chessboard(9, 6, SQUARE)
MIDDLE = (4 * SQUARE, 2.5 * SQUARE)
TILTED = [(25.0, 0.0, 10.0), (-15.0, 20.0, -35.0), (5.0, -28.0, 170.0)]


@pytest.fixture(scope="module")
def images():
    views = [view(MIDDLE, angles_deg=angles) for angles in TILTED]
    return [(seen, painted(chessboard(9, 6, SQUARE), seen, seed=k)) for k, seen in enumerate(views)]


def found(target, image):
    answer = target.find(image)
    assert isinstance(answer, Found), answer
    return answer


def refused(target, image):
    answer = target.find(image)
    assert isinstance(answer, NotFound)
    return answer.reason


def test_corners_are_where_the_painter_put_them(images):
    errors = np.concatenate([found(BOARD, image).pixels - seen.pixels(BOARD.points_m) for seen, image in images])
    assert np.sqrt(np.mean(errors**2)) < 0.03
    assert np.abs(errors).max() < 0.15
    assert np.abs(errors.mean(axis=0)).max() < 0.005, "a bias would move the principal point"


def test_sixteen_bits_give_the_same_corners_and_the_image_is_left_alone(images):
    _, image = images[0]
    deep = image.astype(np.uint16) * 16 + 3
    before = deep.copy()
    assert np.abs(found(BOARD, deep).pixels - found(BOARD, image).pixels).max() < 1e-3
    assert np.array_equal(deep, before)


@pytest.mark.parametrize("quarter_turns", [1, 2, 3])
def test_the_colours_tell_the_first_corner_however_the_image_is_turned(images, quarter_turns):
    seen, image = images[0]
    turned = np.ascontiguousarray(np.rot90(image, quarter_turns))
    pixels = seen.pixels(BOARD.points_m)
    for _ in range(quarter_turns):
        pixels = np.stack([pixels[:, 1], image.shape[1] - 1 - pixels[:, 0]], axis=1)
        image = np.rot90(image)
    assert np.abs(found(BOARD, turned).pixels - pixels).max() < 0.15


def test_a_white_first_square_is_the_other_end(images):
    seen = view(MIDDLE, angles_deg=TILTED[0])
    white_first = painted(chessboard(9, 6, SQUARE, first=WHITE), seen)
    assert np.abs(found(BOARD, white_first).pixels - seen.pixels(BOARD.points_m)[::-1]).max() < 0.15


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("size", [(9, 6), (8, 6), (7, 5), (7, 7)])
def test_orders_are_right_handed_even_of_a_mirrored_image(size, mirror):
    columns, rows = size
    target = Chessboard(columns, rows, SQUARE)
    seen = view((SQUARE * (columns - 1) / 2, SQUARE * (rows - 1) / 2), angles_deg=(20.0, 10.0, 75.0))
    image = painted(chessboard(columns, rows, SQUARE), seen, rays=2)
    grid = found(target, np.ascontiguousarray(image[:, ::-1]) if mirror else image).pixels.reshape(rows, columns, 2)
    along, down = grid[:-1, 1:] - grid[:-1, :-1], grid[1:, :-1] - grid[:-1, :-1]
    assert (along[..., 0] * down[..., 1] - along[..., 1] * down[..., 0] > 0).all()


@pytest.mark.parametrize("size", [(8, 6), (7, 5), (7, 7), (8, 8)])
def test_a_symmetric_board_is_known_up_to_its_turns(size):
    columns, rows = size
    target = Chessboard(columns, rows, SQUARE)
    seen = view((SQUARE * (columns - 1) / 2, SQUARE * (rows - 1) / 2), angles_deg=(15.0, -10.0, 30.0))
    pixels = found(target, painted(chessboard(columns, rows, SQUARE), seen, rays=2)).pixels
    truth = seen.pixels(target.points_m)
    assert min(np.abs(pixels - truth[name]).max() for name in turn_names(target.turn, len(truth))) < 0.15


def test_half_a_turn_is_a_motion_of_the_board():
    target = Chessboard(8, 6, SQUARE)
    turn = target.turn
    assert np.array_equal(turn[turn], np.arange(48))
    assert np.ptp(target.points_m + target.points_m[turn], axis=0).max() < 1e-15, "every pair has one midpoint"
    assert BOARD.turn is None


def test_no_board_is_said_so(images):
    assert "no chessboard of 9 x 6 inner corners" in refused(BOARD, np.full((480, 640), 128, np.uint8))
    assert "no chessboard of 10 x 6 inner corners" in refused(Chessboard(10, 6, SQUARE), images[0][1])


def test_a_hidden_or_cut_board_is_not_found(images):
    _, image = images[0]
    hidden = image.copy()
    hidden[250:420, 300:480] = 60
    assert "whole board" in refused(BOARD, hidden)
    cut = painted(
        chessboard(9, 6, SQUARE), view(MIDDLE, width=480, height=400, focal=1000.0, aside_m=(0.09, 0.0)), rays=2
    )
    assert refused(BOARD, cut)


def test_squares_of_a_few_pixels_are_refused_with_their_size():
    seen = view(MIDDLE, distance=0.6, focal=190.0, width=320, height=240)
    reason = refused(BOARD, painted(chessboard(9, 6, SQUARE), seen, blur=0.5))
    assert "pixel wide, expected at least 8" in reason


def test_a_blurred_noisy_dim_board_is_found_or_refused_but_never_wrong():
    answers = []
    for seed, (blur, noise) in enumerate([(2.5, 2.0), (1.0, 12.0), (4.0, 5.0)]):
        seen = view(MIDDLE, angles_deg=TILTED[1])
        image = painted(chessboard(9, 6, SQUARE), seen, rays=2, blur=blur, noise=noise, seed=seed) // 3
        answer = BOARD.find(image)
        if answer:
            answers.append(answer)
            assert np.abs(answer.pixels - seen.pixels(BOARD.points_m)).max() < 1.0
    assert answers


def test_a_small_board_in_a_large_image_is_found():
    seen = view(MIDDLE, width=1500, height=1200, focal=750.0, angles_deg=TILTED[1], aside_m=(0.2, -0.1))
    image = painted(chessboard(9, 6, SQUARE), seen, rays=2)
    assert np.abs(found(BOARD, image).pixels - seen.pixels(BOARD.points_m)).max() < 0.4


def test_five_megapixels_take_a_fraction_of_a_second():
    scenario = SCENARIOS["paper"]
    target = Chessboard(scenario.columns, scenario.rows, scenario.square_m)
    cell = simulate_cell(scenario, load_arm("abb_irb1400", folder=Path()), target, seed=3)
    image = render_image(cell, 4, 1)
    began = time.perf_counter()
    pixels = found(target, image).pixels
    seconds = time.perf_counter() - began
    truth = cell.truth.pixels
    errors = pixels - truth.pixels[(truth.shots == 4) & (truth.cameras == 1)]
    print(f"{image.shape[1]} x {image.shape[0]}: {1e3 * seconds:.0f} ms, RMS {np.sqrt(np.mean(errors**2)):.4f} pixel")
    assert np.sqrt(np.mean(errors**2)) < 0.02
    assert seconds < 0.5, "about 30 ms on an idle core"


@pytest.mark.parametrize(
    ("columns", "rows", "square", "words"),
    [(2, 6, 0.02, "at least 3 x 3"), (9, 6, 0.0, "above 0")],
)
def test_boards_that_cannot_work_are_refused(columns, rows, square, words):
    with pytest.raises(ValueError, match=words):
        Chessboard(columns, rows, square)


def test_what_looks_like_a_board_but_is_bent_out_of_line_is_refused():
    """A grid that jumps by half a square in its middle is no plane in perspective."""
    straight = chessboard(9, 6, SQUARE)

    def sheared(x, y):
        return np.where(x > 4.5 * SQUARE, straight(x, y - 0.6 * SQUARE), straight(x, y))

    assert refused(BOARD, painted(sheared, view(MIDDLE), rays=2))
