"""Tags in an image: named corners of what is visible, each with the uncertainty of its own edges."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.camera import Camera
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import Found, NotFound
from sixthlink.target.april_grid import AprilGrid
from sixthlink.target.tag_bundle import TagBundle

WIDTH, HEIGHT, FOCAL = 640, 512, 1000.0
GRID = AprilGrid(5, 4, 0.03, 0.009)
KALIBR = AprilGrid(5, 4, 0.03, 0.009, first=7, kalibr=True)
BUNDLE = TagBundle("DICT_4X4_50", 0.04, "5, 9, 12, 1", 2, 0.02)


def camera(*distortion: float) -> Camera:
    lens = np.r_[distortion, np.zeros(5 - len(distortion))]
    return Camera(WIDTH, HEIGHT, np.full(2, FOCAL), np.array([WIDTH - 1, HEIGHT - 1]) / 2, lens)


def pose(target, angles_deg, distance, aside=(0.0, 0.0)) -> np.ndarray:
    """Where a target stands whose middle is in the middle of the image."""
    x0, y0, x1, y1 = target.drawing.paper
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("xyz", angles_deg, degrees=True).as_matrix()
    T[:3, 3] = np.array([*aside, distance]) - T[:3, :3] @ np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.0])
    return T


def shot(target, angles_deg=(20.0, -15.0, 25.0), distance=0.6, *, aside=(0.0, 0.0), lens=(), seed=0, **exposure):
    """An image of a target, and the true pixels of its points."""
    T, eye = pose(target, angles_deg, distance, aside), camera(*lens)
    image = render_target(target.drawing, eye, T, Exposure(**exposure), np.random.default_rng(seed))
    return image, sensor_positions(eye, target.points_m @ T[:3, :3].T + T[:3, 3])


def found(target, image) -> Found:
    answer = target.find(image)
    assert isinstance(answer, Found), answer
    return answer


def rms(errors) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.fixture(scope="module")
def grid():
    return shot(GRID)


@pytest.mark.parametrize(
    ("target", "settings"),
    [
        (GRID, {}),
        (GRID, {"angles_deg": (45.0, 25.0, 100.0)}),
        (GRID, {"lens": (-0.25, 0.1, 0.001)}),
        (GRID, {"blur_px": 1.5}),
        (GRID, {"distance": 1.1}),
        (KALIBR, {}),
        (KALIBR, {"distance": 0.9, "blur_px": 1.0}),
        (BUNDLE, {"distance": 0.4}),
        (TagBundle("DICT_APRILTAG_25h9", 0.05, "3", 1, 0.01), {"distance": 0.3}),
        (TagBundle("DICT_ARUCO_ORIGINAL", 0.04, "500, 7", 1, 0.02), {"distance": 0.5}),
    ],
)
def test_every_corner_has_its_name_and_its_place(target, settings):
    image, truth = shot(target, **settings)
    answer = found(target, image)
    assert answer.points.tolist() == list(range(len(truth)))
    errors = answer.pixels - truth
    assert rms(errors) < 0.03
    assert np.abs(errors).max() < 0.12


def test_the_stated_uncertainty_is_honest():
    scaled = []
    for seed, (target, angles, distance, blur, electrons) in enumerate(
        [
            (GRID, (20.0, -15.0, 25.0), 0.6, 0.7, 40.0),
            (GRID, (-25.0, 20.0, 70.0), 0.6, 1.2, 10.0),
            (GRID, (30.0, 5.0, 200.0), 0.7, 0.7, 2.0),
            (GRID, (-10.0, 30.0, -30.0), 1.1, 0.7, 40.0),
            (KALIBR, (15.0, -25.0, 40.0), 0.6, 1.2, 40.0),
            (KALIBR, (-30.0, 0.0, 300.0), 0.9, 0.7, 10.0),
            (BUNDLE, (20.0, 20.0, 20.0), 0.4, 1.0, 10.0),
        ]
    ):
        image, truth = shot(target, angles, distance, blur_px=blur, electrons_per_grey=electrons, seed=seed)
        answer = found(target, image)
        one = (answer.pixels - truth[answer.points]) / answer.sigmas_px[:, None]
        assert 0.75 < rms(one) < 1.25
        scaled.append(one)
    assert 0.9 < rms(np.concatenate(scaled)) < 1.1


def test_a_tag_square_to_the_pixels_knows_how_well_it_is_known():
    image, truth = shot(GRID, (0.0, 0.0, 0.0))
    straight = found(GRID, image)
    assert rms((straight.pixels - truth[straight.points]) / straight.sigmas_px[:, None]) < 1.2
    assert np.median(straight.sigmas_px) < 0.015


def test_a_part_of_the_grid_is_enough(grid):
    image, truth = grid
    part = image.copy()
    part[:, 330:] = 76
    answer = found(GRID, part)
    assert 12 <= len(answer.points) < len(truth)
    assert np.abs(answer.pixels - truth[answer.points]).max() < 0.1
    assert len(answer.points) % 4 == 0, "a cut tag cannot be read"


def test_a_grid_upside_down_keeps_its_names(grid):
    image, truth = grid
    answer = found(GRID, np.ascontiguousarray(image[::-1, ::-1]))
    turned = np.array([WIDTH - 1, HEIGHT - 1]) - truth[answer.points]
    assert rms(answer.pixels - turned) < 0.03


def test_a_grid_in_a_mirror_is_refused(grid):
    assert isinstance(GRID.find(np.ascontiguousarray(grid[0][:, ::-1])), NotFound)


def test_scratches_across_edges_are_left_out(grid):
    image, truth = grid[0].copy(), grid[1]
    rng = np.random.default_rng(1)
    for place in rng.uniform(0.0, 1.0, (50, 2)) * [WIDTH, HEIGHT]:
        end = place + rng.normal(0.0, 6.0, 2)
        cv2.line(image, place.astype(int).tolist(), end.astype(int).tolist(), int(rng.integers(255)), 2)
    answer = found(GRID, image)
    assert len(answer.points) > 0.7 * len(truth)
    assert rms(answer.pixels - truth[answer.points]) < 0.03


def test_a_large_image_and_sixteen_bits_make_no_difference():
    size = (2000, 1600)
    eye = Camera(*size, np.full(2, 3000.0), (np.array(size) - 1) / 2, np.zeros(5))
    T = pose(GRID, (20.0, -15.0, 25.0), 0.6)
    image = render_target(GRID.drawing, eye, T, Exposure(), np.random.default_rng(0))
    truth = sensor_positions(eye, GRID.points_m @ T[:3, :3].T + T[:3, 3])
    answer = found(GRID, image.astype(np.uint16) * 16)
    assert len(answer.points) == len(truth)
    assert rms(answer.pixels - truth) < 0.02


def test_other_numbers_and_other_dictionaries_are_named(grid):
    image = grid[0]
    others = AprilGrid(5, 4, 0.03, 0.009, first=100).find(image)
    assert isinstance(others, NotFound)
    assert "others of this dictionary are in view: 0, 1, 2" in others.reason
    assert "number 100 to 119" in others.reason
    foreign = AprilGrid(5, 4, 0.03, 0.009, dictionary="DICT_6X6_250").find(image)
    assert isinstance(foreign, NotFound)
    assert "DICT_6X6_250 number 0 to 19" in foreign.reason
    assert "border of 2 cells" in AprilGrid(5, 4, 0.03, 0.009, kalibr=True).find(image).reason
    assert isinstance(GRID.find(np.full_like(image, 128)), NotFound)


def test_the_same_tag_twice_is_refused():
    pair = TagBundle("DICT_4X4_50", 0.04, "5, 9", 2, 0.02)
    image, _ = shot(pair, (0.0, 10.0, 0.0), 0.4)
    image[:, : WIDTH // 2] = image[:, WIDTH - WIDTH // 2 :]
    answer = TagBundle("DICT_4X4_50", 0.04, "9", 1, 0.02).find(image)
    assert isinstance(answer, NotFound)
    assert "twice" in answer.reason


def test_opencvs_own_grid_board_has_the_same_layout():
    names = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    board = cv2.aruco.GridBoard((5, 4), 0.03, 0.009, names)
    assert np.abs(np.concatenate(board.getObjPoints()) - GRID.points_m).max() < 1e-6


def test_kalibrs_grid_is_drawn_as_kalibr_draws_it():
    """Tag 0 of 36h11 is 0xd5d628584; Kalibr prints bit 35 first, row by row, and tag 0 at the lower left."""
    one = AprilGrid(1, 2, 0.1, 0.03, kalibr=True)
    bits = [0xD5D628584 >> (35 - k) & 1 for k in range(36)]
    drawing = one.drawing
    x = (np.arange(10) + 0.5) * 0.01
    lower = 0.13
    for k, white in enumerate(bits):
        u, v = x[2 + k % 6], lower + x[2 + k // 6]
        inside = (drawing.rectangles[:, :2] < [u, v]).all(axis=1) & (drawing.rectangles[:, 2:] > [u, v]).all(axis=1)
        assert bool(drawing.black[np.flatnonzero(inside)[-1]]) != bool(white)
    assert np.allclose(one.points_m[0], [0.0, lower, 0.0])
    assert np.allclose(one.points_m[4], [0.0, 0.0, 0.0])
    assert np.count_nonzero(np.isclose(drawing.rectangles[:, 2] - drawing.rectangles[:, 0], 0.03)) == 8


def test_points_go_round_each_tag():
    first = GRID.points_m[:4, :2] / 0.03
    assert np.allclose(first, [[0, 0], [1, 0], [1, 1], [0, 1]])
    assert np.allclose(GRID.points_m[4 * 5, :2], [0.0, 0.039])
    assert GRID.turn is None
    assert BUNDLE.turn is None
    assert not GRID.circle_radii_m.any()
    assert not BUNDLE.circle_radii_m.any()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"columns": 0}, "no tags"),
        ({"first": -1}, "first tag is -1"),
        ({"first": 570}, "0 to 586"),
        ({"dictionary": "DICT_7X7_3"}, "DICT_APRILTAG_36h11"),
        ({"tag_m": 0.0}, "above 0"),
        ({"spacing_m": 0.001}, "at least one cell"),
    ],
)
def test_grids_that_cannot_exist_are_refused(change, words):
    values = {"columns": 5, "rows": 4, "tag_m": 0.03, "spacing_m": 0.009}
    with pytest.raises(ValueError, match=words):
        AprilGrid(**(values | change))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ids": "5; 9"}, "separated by commas"),
        ({"ids": ""}, "separated by commas"),
        ({"ids": "5, 9, 5"}, "tag 5 more than once"),
        ({"ids": "50"}, "0 to 49, but ids go up to 50"),
        ({"columns": 0}, "at least 1"),
    ],
)
def test_bundles_that_cannot_exist_are_refused(change, words):
    values = {"dictionary": "DICT_4X4_50", "tag_m": 0.04, "ids": "5", "columns": 1, "spacing_m": 0.01}
    with pytest.raises(ValueError, match=words):
        TagBundle(**(values | change))
