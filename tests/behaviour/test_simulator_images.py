"""Rendered images show the truth: edges without bias, the right colours, and the noise that was promised."""

import pickle
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sixthlink.camera import rays_from_pixels
from sixthlink.files.arm_file import load_arm
from sixthlink.geometry import inverse, transform_points
from sixthlink.robot import flange_poses
from sixthlink.simulate import SCENARIOS, render_image, simulate_cell
from sixthlink.target import Chessboard

IRB_1400 = load_arm("abb_irb1400", folder=Path())
BOARD = Chessboard(12, 9, 0.02)


@pytest.fixture(scope="module")
def paper():
    return simulate_cell(SCENARIOS["paper"], IRB_1400, BOARD, seed=1)


@pytest.fixture(scope="module")
def small():
    return simulate_cell(SCENARIOS["small"], IRB_1400, BOARD, seed=1)


def truth_pixels(cell, shot, camera):
    table = cell.truth.pixels
    return table.pixels[(table.shots == shot) & (table.cameras == camera)]


def pose_in_camera(cell, shot, camera):
    truth = cell.truth
    T_base_flange = flange_poses(truth.arm, truth.joints[[shot]])[0]
    T_base_target = truth.Ts_base_placement[cell.recording.placements[shot]]
    T_head_target = inverse(T_base_flange @ truth.T_flange_head) @ T_base_target
    return truth.rig.Ts_camera_head[camera] @ T_head_target


def test_corners_of_a_five_megapixel_image_are_where_the_truth_says(paper):
    import cv2

    render_image(paper, 0, 1)  # the rays of a camera are found once
    start = time.perf_counter()
    image = render_image(paper, 3, 1)
    print(f"2452 x 2056 pixels rendered in {time.perf_counter() - start:.2f} s")
    assert image.shape == (2056, 2452)
    truth = truth_pixels(paper, 3, 1)
    begin = (truth + 0.7).astype(np.float32).reshape(-1, 1, 2)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
    errors = cv2.cornerSubPix(image, begin, (10, 10), (-1, -1), stop).reshape(-1, 2) - truth
    assert np.abs(errors.mean(axis=0)).max() < 0.02
    assert np.sqrt(np.mean(errors**2)) < 0.06


def test_an_edge_pixel_is_the_mean_over_its_area(small):
    # Brute force around one corner: 32 x 32 rays per pixel through the calibrator's lens, no blur, no noise.
    crisp = replace(small.scenario, blur_px=0.0, electrons_per_grey=1e12, read_noise_grey=0.0)
    cell = replace(small, scenario=crisp)
    corner = np.rint(truth_pixels(cell, 2, 0)[40]).astype(int)
    patch = slice(corner[1] - 6, corner[1] + 7), slice(corner[0] - 6, corner[0] + 7)
    offsets = (np.arange(32) + 0.5) / 32 - 0.5
    rows, columns = (np.arange(part.start, part.stop) for part in patch)
    v, u, dv, du = np.meshgrid(rows, columns, offsets, offsets, indexing="ij")
    rays = rays_from_pixels(cell.truth.rig.cameras[0], np.stack([u + du, v + dv], axis=-1))
    T = pose_in_camera(cell, 2, 0)
    depth = (T[:3, 2] @ T[:3, 3]) / (rays @ T[:3, 2])
    on_board = transform_points(inverse(T), rays * depth[..., None])[..., :2]
    place = on_board - (cell.truth.points_m[40] - BOARD.points_m[40])[:2]
    black = np.floor(place / BOARD.square_m).astype(int).sum(axis=-1) % 2 == 0
    cosine = 1.0 / np.linalg.norm(rays, axis=-1)
    expected = (255.0 * np.where(black, 0.06, 0.80) * cosine**4).mean(axis=(2, 3))
    assert np.ptp(expected) > 150.0
    errors = render_image(cell, 2, 0)[patch] - expected
    assert np.abs(errors).max() < 6.0  # one ray in 144 is 1.3 grey values here
    assert np.sqrt(np.mean(errors**2)) < 1.0
    assert abs(errors.mean()) < 0.2


def test_the_square_before_the_first_corner_is_black(small):
    image = render_image(small, 4, 0).astype(float)
    grid = truth_pixels(small, 4, 0).reshape(9, 12, 2)
    half_x, half_y = 0.5 * (grid[0, 1] - grid[0, 0]), 0.5 * (grid[1, 0] - grid[0, 0])

    def grey(place):
        u, v = np.rint(place).astype(int)
        return image[v, u]

    # A fifth of a square away from the corner is surely inside the image.
    up_left, down_right = grid[0, 0] - 0.4 * (half_x + half_y), grid[0, 0] + half_x + half_y
    up_right, last = grid[0, 0] + 0.4 * (half_x - half_y), grid[8, 11] + 0.4 * (half_x + half_y)
    assert max(grey(up_left), grey(down_right)) < 40.0
    assert grey(up_right) > 120.0
    assert grey(last) > 120.0  # 12 and 9 differ in parity: the far end looks different


def test_quarters_of_a_mark_meet_at_the_true_pixel(small):
    for shot in (18, 19):
        image = render_image(small, shot, 1).astype(float)
        T = pose_in_camera(small, shot, 1)
        focal_px = small.truth.rig.cameras[1].focal_px[0]
        (centre,) = truth_pixels(small, shot, 1)
        for x, y, black in ((1, 1, True), (-1, -1, True), (1, -1, False), (-1, 1, False)):
            direction = (T[:2, 0] * x + T[:2, 1] * y) * 0.005 * focal_px / 0.6
            u, v = np.rint(centre + direction).astype(int)
            assert (image[v, u] < 40.0) == black
        along = T[:2, 0] * 0.017 * focal_px / 0.6 * (1 if small.recording.marks[shot] == "A" else -1)
        u, v = np.rint(centre + along).astype(int)
        assert 100.0 < image[v, u] < 150.0  # the bar goes on towards the other mark


def test_noise_of_flat_areas_follows_their_brightness(paper):
    scenario = replace(paper.scenario, electrons_per_grey=1e12, read_noise_grey=0.0)
    clean = render_image(replace(paper, scenario=scenario), 3, 1).astype(float)
    noise = render_image(paper, 3, 1).astype(float) - clean
    for low, high in ((8.0, 15.0), (60.0, 80.0), (180.0, 205.0)):
        flat = (clean >= low) & (clean <= high)
        # Both images are rounded: the difference carries up to twice the variance 1/12 of rounding.
        variance = np.mean(clean[flat]) / 40.0 + 0.3**2
        assert variance < noise[flat].var() < variance + 0.2
        assert abs(noise[flat].mean()) < 0.05


def test_an_image_is_the_same_in_any_order_and_any_process(small):
    first, second = render_image(small, 0, 0), render_image(small, 18, 1)
    copy = pickle.loads(pickle.dumps(small))
    assert np.array_equal(render_image(copy, 18, 1), second)
    assert np.array_equal(render_image(copy, 0, 0), first)
    assert not np.array_equal(render_image(small, 0, 1), first)


def test_the_small_cell_has_fewer_shots_and_the_same_field(small):
    assert len(small.recording.ids) == 3 * 6 + 2 * 2
    assert render_image(small, 0, 0).shape == (514, 612)
    field = [612 / small.truth.rig.cameras[0].focal_px[0], 514 / small.truth.rig.cameras[0].focal_px[1]]
    assert np.allclose(field, [0.4976, 0.4173], rtol=0.02)
