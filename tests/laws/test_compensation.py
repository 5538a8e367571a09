"""Corrected joint values bring the calibrated arm to where the nominal one was sent, and say where that cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sixthlink.calibrate.arm import arm_with_steps, link_parameters, optional_parameters
from sixthlink.files import load_arm
from sixthlink.robot import compensated_joints, flange_poses


def calibrated(robot: str, seed: int = 0):
    """An arm off by its tolerances, with joints that err once per turn."""
    nominal = load_arm(robot, folder=Path())
    free = (*link_parameters(nominal), *optional_parameters(nominal, "harmonics"))
    rng = np.random.default_rng(seed)
    return nominal, arm_with_steps(nominal, free, np.array([p.sigma for p in free]) * rng.standard_normal(len(free)))


@pytest.mark.parametrize("robot", ["abb_irb1400", "ur10e", "franka_fr3"])
def test_the_round_trip_closes(robot):
    nominal, arm = calibrated(robot)
    q = np.random.default_rng(1).uniform(*(0.7 * nominal.limits.T), (50, len(nominal.joints)))
    wanted = flange_poses(nominal, q)
    found = compensated_joints(arm, wanted, q)
    assert found.reached.all()
    assert flange_poses(arm, found.joints) == pytest.approx(wanted, abs=1e-9)
    assert found.before[:, 0].min() > 1e-5
    assert np.median(np.abs(found.joints - q).max(axis=1)) < 0.1  # the configuration is kept


def test_an_exact_arm_is_left_alone():
    nominal = load_arm("ur5e", folder=Path())
    q = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 6))
    assert compensated_joints(nominal, flange_poses(nominal, q), q).joints == pytest.approx(q, abs=1e-12)


def test_what_cannot_be_reached_is_said():
    nominal, arm = calibrated("abb_irb1400")
    q = np.zeros((2, 6))
    wanted = flange_poses(nominal, q)
    wanted[1, 0, 3] += 3.0
    found = compensated_joints(arm, wanted, q)
    assert found.reached.tolist() == [True, False]
    assert found.after[1, 0] > 1.0


def test_a_joint_beyond_its_limit_is_said():
    nominal, arm = calibrated("abb_irb1400")
    q = np.array([nominal.limits[:, 1] - 1e-6, nominal.limits.mean(axis=1)])
    q[0, 4] = 0.5
    found = compensated_joints(arm, flange_poses(nominal, q), q)
    assert found.reached.all()
    assert found.inside.tolist() == [False, True]
