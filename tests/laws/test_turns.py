"""A target that looks the same after a turn is read alike in the end, however each image was read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import case
from sixthlink.calibrate.turns import readings, turn_transforms
from sixthlink.geometry import transform_points
from sixthlink.target import Charuco, Chessboard, CircleGrid, turn_names

KINDS = {
    "one": (Charuco(7, 5, 0.04, 0.03, "DICT_5X5_100"), 1),
    "half": (Chessboard(8, 6, 0.02), 2),
    "half of a square": (Chessboard(7, 7, 0.02), 2),
    "quarter": (Chessboard(8, 8, 0.02), 4),
    "quarter of circles": (CircleGrid(7, 7, 0.02, 0.01), 4),
}
TARGETS = pytest.mark.parametrize(("target", "order"), KINDS.values(), ids=list(KINDS))


@TARGETS
def test_turns_are_motions_of_the_target_and_close(target, order):
    names = turn_names(target.turn, len(target.points_m))
    assert len(names) == order
    for name, T in zip(names, turn_transforms(target.points_m, target.turn), strict=True):
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
        # What was named i is named name[i] now; the renamed target's points lie where the points were.
        assert transform_points(T, target.points_m[name]) == pytest.approx(target.points_m, abs=1e-12)


@TARGETS
@pytest.mark.parametrize("seed", range(5))
def test_the_robot_tells_how_every_shot_was_read(target, order, seed):
    """Each shot read at random, with noise: all come out alike but for one common turn per placement."""
    rng = np.random.default_rng(seed)
    problem = case(rng, shots=60, placements=3, sigma_m=1e-3, sigma_rad=5e-3).problem
    Ts = turn_transforms(target.points_m, target.turn)
    read = rng.integers(0, order, len(problem.placements))
    turns = readings(replace(problem, Ts_inner=problem.Ts_inner @ Ts[read]), Ts)
    for p in range(3):
        of_placement = (read + turns)[problem.placements == p] % order
        assert np.ptp(of_placement) == 0
        assert np.bincount(turns[problem.placements == p])[0] >= len(of_placement) / order, "most are left as they are"


@pytest.mark.parametrize(("tilt_deg", "roll_deg"), [(35.0, 180.0), (20.0, 60.0), (35.0, 20.0)])
@pytest.mark.parametrize("shots", [4, 8, 20])
def test_a_camera_that_mostly_rolls_is_enough(shots, tilt_deg, roll_deg):
    """A camera above a board on a table: little tilt, much roll, where quarter turns are most easily mistaken."""
    target, _ = KINDS["quarter"]
    Ts = turn_transforms(target.points_m, target.turn)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        angles = np.column_stack(
            [rng.uniform(-tilt_deg, tilt_deg, (shots, 2)), rng.uniform(-roll_deg, roll_deg, shots)]
        )
        outer = np.tile(np.eye(4), (shots, 1, 1))
        outer[:, :3, :3] = Rotation.from_euler("xyz", angles, degrees=True).inv().as_matrix()
        problem = case(rng, placements=1, sigma_rad=5e-3, Ts_outer=outer).problem
        read = rng.integers(0, 4, shots)
        turns = readings(replace(problem, Ts_inner=problem.Ts_inner @ Ts[read]), Ts)
        assert np.ptp((read + turns) % 4) == 0
