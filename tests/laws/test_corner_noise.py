"""The standard deviation that comes with a corner is that of its error, whatever blur, noise and tilt."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.camera import Camera
from sixthlink.geometry import exp_rotation, transform, transform_points
from sixthlink.simulate import Exposure, render_target, sensor_positions
from sixthlink.target import Charuco, Chessboard, Found
from sixthlink.target.saddle import SAMPLING_PX, SAMPLING_PX2, refine_saddles

CAMERA = Camera(900, 700, np.full(2, 1400.0), np.array([449.5, 349.5]), np.array([-0.08, 0.06, 0.0, 0.0, 0.0]))


def placed(target, rng, largest_tilt_rad: float = 0.9):
    azimuth, tilt = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, largest_tilt_rad)
    R = exp_rotation(tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
    middle = 0.5 * (target.points_m.min(axis=0) + target.points_m.max(axis=0))
    return transform(R, np.array([0.0, 0.0, 0.75]) - R @ middle)


@pytest.mark.parametrize("target", [Chessboard(12, 9, 0.02), Charuco(9, 7, 0.028, 0.02, "DICT_5X5_100")], ids=type)
def test_normalised_residuals_have_unit_size(target):
    normalised = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        T = placed(target, rng)
        electrons = (40.0, 5.0, 2.0)[seed % 3]
        exposure = Exposure((0.4, 0.7, 1.2)[seed // 4], 1.0, electrons, 0.3 + seed % 4)
        found = target.find(render_target(target.drawing, CAMERA, T, exposure, rng))
        assert isinstance(found, Found)
        true = sensor_positions(CAMERA, transform_points(T, target.points_m))[found.points]
        normalised.append((found.pixels - true) / found.sigmas_px[:, None])
    every = np.concatenate(normalised)
    assert np.abs(every).max() < 7.0
    assert 0.9 < np.sqrt(np.mean(every**2)) < 1.1


@pytest.mark.parametrize("noise_grey", [2.0, 8.0])
def test_repeated_images_scatter_as_stated(noise_grey):
    """One scene, many noises: the scatter alone, without what sampling does to all of them alike."""
    board = Chessboard(8, 6, 0.03)
    T = placed(board, np.random.default_rng(0), 0.4)
    base = render_target(board.drawing, CAMERA, T, Exposure(0.7, 1.0, 1e12, 1e-9), np.random.default_rng(0))
    true = sensor_positions(CAMERA, transform_points(T, board.points_m))
    found = []
    for seed in range(40):
        noise = noise_grey * np.random.default_rng(seed).standard_normal(base.shape)
        image = np.clip(np.rint(base + noise), 0, 255).astype(np.uint8)
        found.append(refine_saddles(image, true, 12.0, 5.0))
    scatter = np.std([f.pixels for f in found], axis=0, ddof=1)
    sampling = np.hypot(SAMPLING_PX, SAMPLING_PX2 / 12.0)
    stated = np.sqrt(np.mean([f.sigmas_px**2 for f in found]) - sampling**2)
    assert np.sqrt(np.mean(scatter**2)) == pytest.approx(stated, rel=0.1)
