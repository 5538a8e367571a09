"""An image that shows nothing usable is refused by the name of what is wrong with it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sixthlink.calibrate import locate_targets
from sixthlink.calibrate.board_scale import BoardScale, board_gate
from sixthlink.camera import Camera, CameraRig
from sixthlink.geometry import exp_rotation, rotation_angle, transform, transform_points
from sixthlink.recording import Detections
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import (
    AprilGrid,
    AsymmetricCircleGrid,
    Charuco,
    Chessboard,
    CircleGrid,
    DotGrid,
    Found,
    MarkerChessboard,
    NotFound,
    TagBundle,
)

CAMERA = Camera(800, 600, np.full(2, 1200.0), np.array([399.5, 299.5]), np.zeros(5))
BOARD, CODED = Chessboard(8, 5, 0.03), Charuco(7, 5, 0.04, 0.03, "DICT_5X5_100")
DISCS, TAGS = CircleGrid(8, 5, 0.03, 0.018), AprilGrid(6, 4, 0.035, 0.0105)
MARKED, DOTS = MarkerChessboard(8, 5, 0.03), DotGrid(8, 5, 0.03, 0.012, 0.02, "9, 10, 18")
SHIFTED, PAIR = AsymmetricCircleGrid(4, 9, 0.025, 0.018), TagBundle("DICT_4X4_50", 0.08, "5, 9", 2, 0.03)
KINDS = [BOARD, CODED, DISCS, TAGS, MARKED, DOTS, SHIFTED, PAIR]
SADDLES = [BOARD, CODED, MARKED]


@cache
def image_of(target, *, far_m: float = 0.6, exposure: Exposure | None = None, tilt_rad: float = 0.3):
    middle = 0.5 * (target.points_m.min(axis=0) + target.points_m.max(axis=0))
    R = exp_rotation(np.array([tilt_rad, 0.1, 0.2]))
    T = transform(R, np.array([0.0, 0.0, far_m]) - R @ middle)
    return render_target(target.drawing, CAMERA, T, exposure or Exposure(), np.random.default_rng(0))


def refused(found: Found | NotFound) -> str:
    assert isinstance(found, NotFound)
    return found.reason


@pytest.mark.parametrize("target", KINDS, ids=type)
def test_good_images_are_found(target):
    assert isinstance(target.find(image_of(target)), Found)


@pytest.mark.parametrize("target", KINDS, ids=type)
@pytest.mark.parametrize(
    ("exposure", "word"),
    [
        (Exposure(light=40.0), "over-exposed"),
        (Exposure(light=0.001), "under-exposed"),
        (Exposure(blur_px=18.0), "blurred"),
    ],
)
def test_light_and_focus_are_blamed(target, exposure, word):
    assert word in refused(target.find(image_of(target, exposure=exposure)))


@pytest.mark.parametrize("blur_px", [0.4, 0.7, 1.2])
@pytest.mark.parametrize("light", [3.0, 8.0])
@pytest.mark.parametrize("target", [TAGS, PAIR], ids=type)
def test_white_that_is_cut_off_moves_the_edges_of_tags(target, light, blur_px):
    """Seen by eye nothing is wrong with them, but half way to a white that is cut off is not where the edge is."""
    assert "over-exposed" in refused(target.find(image_of(target, exposure=Exposure(blur_px, light))))


@pytest.mark.parametrize("target", [TAGS, PAIR], ids=type)
def test_white_at_the_end_of_the_range_is_no_over_exposure(target):
    """As in a page that a program has drawn, or where the camera sets its exposure by the brightest spot."""
    image = image_of(target).astype(np.float64)
    stretched = np.clip(np.rint((image - 15.0) * (255.0 / 170.0)), 0, 255).astype(np.uint8)
    assert np.mean(stretched == 255) > 0.15
    assert isinstance(target.find(stretched), Found)


@pytest.mark.parametrize("target", SADDLES, ids=type)
def test_corners_stand_much_light_until_black_is_bright(target):
    assert isinstance(target.find(image_of(target, exposure=Exposure(light=3.0))), Found)
    assert "over-exposed" in refused(target.find(image_of(target, exposure=Exposure(light=11.0))))


def test_deep_images_are_over_exposed_at_the_end_of_their_own_range():
    image = image_of(BOARD, exposure=Exposure(light=40.0))
    for bits in (10, 12, 14, 16):
        deep = image.astype(np.uint16) * 2 ** (bits - 8)
        assert "over-exposed" in refused(BOARD.find(deep)), bits


@pytest.mark.parametrize("target", KINDS, ids=type)
def test_a_board_too_far_away_is_too_small(target):
    assert "too small" in refused(target.find(image_of(target, far_m=9.0, exposure=Exposure(blur_px=0.4))))


def test_the_squares_of_a_small_board_are_measured():
    assert "smallest square is" in refused(BOARD.find(image_of(BOARD, far_m=5.2, exposure=Exposure(blur_px=0.4))))


@pytest.mark.parametrize("target", KINDS, ids=type)
def test_a_board_seen_from_the_side_is_too_oblique(target):
    assert "too oblique" in refused(target.find(image_of(target, tilt_rad=np.deg2rad(86.0))))


@pytest.mark.parametrize("tilt_deg", [60.0, 70.0])
@pytest.mark.parametrize("target", KINDS, ids=type)
def test_a_tilted_board_is_not(target, tilt_deg):
    assert isinstance(target.find(image_of(target, tilt_rad=np.deg2rad(tilt_deg))), Found)


@pytest.mark.parametrize("declared", [Chessboard(7, 5, 0.03), Chessboard(8, 4, 0.03), Chessboard(6, 5, 0.03)])
def test_a_board_larger_than_declared_is_named(declared):
    words = refused(declared.find(image_of(BOARD)))
    assert "the board goes on beyond" in words or "a chessboard of 8 x 5 inner corners is in the picture" in words


@pytest.mark.parametrize("shown", [BOARD, CODED, DISCS, TAGS], ids=type)
@pytest.mark.parametrize("declared", KINDS, ids=type)
def test_a_board_of_another_kind_is_named(declared, shown):
    chessboards = (Chessboard, MarkerChessboard)
    if isinstance(declared, chessboards) and isinstance(shown, chessboards):
        declared = Chessboard(8, 6, 0.03)
    if declared is not shown:
        assert "the wrong board" in refused(declared.find(image_of(shown)))


@pytest.mark.parametrize(
    ("declared", "shown", "words"),
    [
        (BOARD, Chessboard(8, 6, 0.03), "a chessboard of 8 x 6 inner corners"),
        (BOARD, CODED, "tags of DICT_5X5 are in the picture, numbers 0 to 16"),
        (BOARD, DISCS, "a grid of 40 dots"),
        (CODED, BOARD, "a chessboard of 8 x 5 inner corners"),
        (CODED, Charuco(7, 5, 0.04, 0.03, "DICT_6X6_250"), "tags of DICT_6X6 are"),
        (CODED, Charuco(8, 6, 0.03, 0.022, "DICT_5X5_100"), "numbers 0 to 23"),
        (DISCS, CircleGrid(9, 6, 0.03, 0.018), "54 dots seen in a grid larger than 8 x 5"),
        (DISCS, CircleGrid(7, 5, 0.03, 0.018), "35 of 40 dots"),
        (DISCS, CircleGrid(8, 5, 0.03, 0.01), "times as large for the spacing as declared"),
        (TAGS, AprilGrid(6, 4, 0.035, 0.0105, first=40), "others of this dictionary are in view: 40, 41"),
        (TAGS, AprilGrid(6, 4, 0.035, 0.0105, "DICT_APRILTAG_25h9"), "tags of DICT_APRILTAG_25h9"),
        (TAGS, AprilGrid(5, 4, 0.035, 0.0105), "not where they should be"),
    ],
)
def test_another_board_of_the_same_kind_is_named(declared, shown, words):
    reason = refused(declared.find(image_of(shown)))
    assert "the wrong board" in reason
    assert words in reason


@pytest.mark.parametrize("target", KINDS, ids=type)
def test_two_boards_are_named(target):
    both = np.concatenate([image_of(target, far_m=0.9), image_of(target, far_m=0.9, tilt_rad=-0.2)], axis=1)
    assert "two boards are in the picture" in refused(target.find(both))


@pytest.mark.parametrize("target", [CODED, TAGS, PAIR, DOTS, MARKED], ids=type)
def test_a_mirrored_picture_is_named(target):
    assert "mirror" in refused(target.find(np.ascontiguousarray(image_of(target)[:, ::-1])))


def test_a_mirrored_board_without_numbers_is_named_by_the_motion():
    """One mirrored picture of it is a good picture of another pose; in motion it goes the wrong way."""
    gate = board_gate(BoardScale(-0.99, 0.27))
    assert not gate.passed
    assert "the images are mirrored" in gate.message
    assert "mirrored" not in board_gate(BoardScale(0.97, 0.001)).message


@pytest.mark.parametrize(
    ("scale", "std", "passed", "word"),
    [
        (0.98, 0.004, False, "measure its squares"),
        (0.98, 0.0062, False, "measure its squares"),
        (0.98, 0.009, True, "2.2 standard deviations off"),
        (0.98, 0.012, True, "as large as declared"),
        (1.004, 0.0002, True, "as large as declared"),
        (0.09, 0.2, True, "says nothing of its size"),
    ],
)
def test_a_size_is_wrong_doubtful_or_nothing_is_said(scale, std, passed, word):
    gate = board_gate(BoardScale(scale, std))
    assert gate.passed == passed
    assert word in gate.message
    assert ("deviations off" in gate.message) == ("deviations off" in word)


def sightings(target, far_m: float, noise_px: float, shots: int = 60):
    """Poses of a target before one camera, and what that camera sees of it."""
    random = np.random.default_rng(2)
    middle = 0.5 * (target.points_m.min(axis=0) + target.points_m.max(axis=0))
    Ts, pixels, count = [], [], len(target.points_m)
    for _ in range(shots):
        azimuth, tilt = random.uniform(0.0, 2.0 * np.pi), random.uniform(0.2, 0.7)
        R = exp_rotation(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
        Ts.append(transform(R, np.array([0.0, 0.0, far_m]) - R @ middle))
        seen = sensor_positions(CAMERA, transform_points(Ts[-1], target.points_m))
        pixels.append(seen + noise_px * random.standard_normal(seen.shape))
    every = np.arange(shots * count)
    seen = Detections(every // count, 0 * every, every % count, np.concatenate(pixels), np.full(len(every), noise_px))
    return np.stack(Ts), seen


@pytest.mark.parametrize("target", [BOARD, CODED, DISCS, TAGS], ids=type)
def test_a_view_with_two_explanations_is_a_planar_ambiguity(target):
    rig, ids = CameraRig(("camera",), (CAMERA,), np.eye(4)[None]), tuple(map(str, range(60)))
    near = locate_targets(rig, target.points_m, sightings(target, 0.6, 0.1)[1], ids)
    assert near.rejections == ()
    Ts, seen = sightings(target, 10.0, 0.1)
    far = locate_targets(rig, target.points_m, seen, ids)
    assert len(far.rejections) > 20
    assert all(r.reason.startswith("planar ambiguity") for r in far.rejections)
    off = rotation_angle(np.swapaxes(Ts[far.shots][:, :3, :3], 1, 2) @ far.Ts_head_target[:, :3, :3])
    print(
        f"{len(far.rejections)} of 60 ambiguous; of the others {np.mean(off > np.deg2rad(15.0)):.0%} tilt the wrong way"
    )


def test_nothing_is_blamed_on_a_sound_picture_without_a_board():
    words = refused(BOARD.find(image_of(CODED)))
    for word in ("exposed", "blurred", "small", "oblique", "mirror", "two boards"):
        assert word not in words


@pytest.mark.parametrize("bits", [10, 12, 16])
def test_deeper_images_give_the_same_corners(bits):
    image = image_of(BOARD)
    deep = image.astype(np.uint16) * (2 ** (bits - 8))
    found, plain = BOARD.find(deep), BOARD.find(image)
    assert isinstance(found, Found)
    assert found.pixels == pytest.approx(plain.pixels, abs=0.01)
