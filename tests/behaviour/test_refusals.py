"""An image that shows nothing usable is refused by the name of what is wrong with it."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.camera import Camera
from sixthlink.geometry import exp_rotation, transform
from sixthlink.simulate import Exposure, render_target
from sixthlink.target import Charuco, Chessboard, Found, NotFound

CAMERA = Camera(800, 600, np.full(2, 1200.0), np.array([399.5, 299.5]), np.zeros(5))
BOARD, CODED = Chessboard(8, 5, 0.03), Charuco(7, 5, 0.04, 0.03, "DICT_5X5_100")


def image_of(target, *, far_m: float = 0.6, exposure: Exposure | None = None, tilt_rad: float = 0.3):
    middle = 0.5 * (target.points_m.min(axis=0) + target.points_m.max(axis=0))
    R = exp_rotation(np.array([tilt_rad, 0.1, 0.2]))
    T = transform(R, np.array([0.0, 0.0, far_m]) - R @ middle)
    return render_target(target.drawing, CAMERA, T, exposure or Exposure(), np.random.default_rng(0))


def refused(found: Found | NotFound) -> str:
    assert isinstance(found, NotFound)
    return found.reason


@pytest.mark.parametrize("target", [BOARD, CODED], ids=type)
def test_good_images_are_found(target):
    assert isinstance(target.find(image_of(target)), Found)


@pytest.mark.parametrize("target", [BOARD, CODED], ids=type)
@pytest.mark.parametrize(
    ("exposure", "word"),
    [
        (Exposure(light=40.0), "over-exposed"),
        (Exposure(light=0.001), "under-exposed"),
        (Exposure(blur_px=14.0), "blurred"),
    ],
)
def test_light_and_focus_are_blamed(target, exposure, word):
    assert word in refused(target.find(image_of(target, exposure=exposure)))


def test_a_board_too_far_away_is_too_small():
    assert "smallest square is" in refused(BOARD.find(image_of(BOARD, far_m=5.2, exposure=Exposure(blur_px=0.4))))


@pytest.mark.parametrize("declared", [Chessboard(7, 5, 0.03), Chessboard(8, 4, 0.03), Chessboard(6, 5, 0.03)])
def test_a_board_larger_than_declared_is_named(declared):
    words = refused(declared.find(image_of(BOARD)))
    assert "the board goes on beyond" in words or "a chessboard of 8 x 5 inner corners is in the picture" in words


def test_two_boards_are_named():
    half = image_of(BOARD, far_m=0.9)
    both = np.concatenate([half, half], axis=1)
    assert "two boards are in the picture" in refused(BOARD.find(both))


def test_a_mirrored_picture_is_named():
    assert "mirrored" in refused(CODED.find(np.ascontiguousarray(image_of(CODED)[:, ::-1])))


def test_nothing_is_blamed_on_a_sound_picture_without_a_board():
    words = refused(BOARD.find(image_of(CODED)))
    assert "exposed" not in words
    assert "blurred" not in words


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_deeper_images_give_the_same_corners(bits):
    image = image_of(BOARD)
    deep = image.astype(np.uint16) * (2 ** (bits - 8))
    found, plain = BOARD.find(deep), BOARD.find(image)
    assert isinstance(found, Found)
    assert found.pixels == pytest.approx(plain.pixels, abs=0.01)
