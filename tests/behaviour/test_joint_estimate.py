"""Arm and head together: what comes out when the truth is known, and what when shots are wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import Estimate, HeadShots, JointData, estimate
from sixthlink.files import load_arm
from sixthlink.geometry import apply_motion, exp_rotation, inverse, motion_between
from sixthlink.robot import arm_with_values, flange_poses
from sixthlink.simulate import SCENARIOS, SimulatedCell, simulate_cell
from sixthlink.target import Chessboard

SIGMA_M, SIGMA_RAD = 2e-5, 5e-5


@cache
def cell() -> SimulatedCell:
    board = Chessboard(columns=12, rows=9, square_m=0.02)
    plan = replace(SCENARIOS["paper"], placements=2, poses=10)
    return simulate_cell(plan, load_arm("abb_irb1400", folder=Path()), board, seed=1, images=False)


@dataclass(frozen=True, eq=False)
class Drawn:
    arm: object
    Ts_head_target: np.ndarray
    data: JointData


def drawn(rng: np.random.Generator, *, exact: bool = False, wrong=lambda Ts: Ts) -> Drawn:
    """Twenty shots of the paper's cell with a fresh arm and fresh noise."""
    recording, truth = cell().recording, cell().truth
    nominal, n = recording.arm, 20
    q, placements = recording.joints[:n], np.repeat([0, 1], 10)
    sigmas = np.where(nominal.turns, np.deg2rad(0.03), 5e-4)
    arm = arm_with_values(nominal, nominal.values + sigmas * rng.standard_normal(len(sigmas)))
    noise = 0.0 if exact else 1.0
    Ts_base_flange = flange_poses(arm, q + noise * 50e-6 * rng.standard_normal(q.shape))
    Ts_base_target = np.stack([truth.Ts_base_placement[p] for p in ("p1", "p2")])
    Ts_head_target = inverse(Ts_base_flange @ truth.T_flange_head) @ Ts_base_target[placements]
    sigma = np.repeat([SIGMA_M, SIGMA_RAD], 3)
    Ts_head_target = wrong(apply_motion(Ts_head_target, noise * sigma * rng.standard_normal((n, 6))))
    problem = HeadProblem(flange_poses(nominal, q), Ts_head_target, placements)
    covariances = np.tile(np.diag(sigma**2), (n, 1, 1))
    return Drawn(arm, Ts_head_target, JointData(nominal, HeadShots(q, problem, covariances=covariances)))


def camera_error_m(found: Estimate, arm) -> float:
    """RMS error of where the camera stands relative to the first shot: free of the base's gauge."""
    q = cell().recording.joints[:20]
    Ts_base_found = flange_poses(found.fit.state.arm, q) @ found.fit.state.X
    Ts_base_true = flange_poses(arm, q) @ cell().truth.T_flange_head
    moved = motion_between(inverse(Ts_base_true[:1]) @ Ts_base_true, inverse(Ts_base_found[:1]) @ Ts_base_found)
    return float(np.sqrt(np.mean(np.sum(moved[:, :3] ** 2, axis=1))))


def test_exact_shots_give_the_arm_back_as_far_as_it_can_be_seen():
    draw = drawn(np.random.default_rng(0), exact=True)
    loose = [replace(p, sigma=100 * p.sigma) for p in estimate(draw.data, noise="stated").parameters]
    found = estimate(draw.data, parameters=loose, noise="stated")
    assert camera_error_m(found, draw.arm) < 2e-6


def test_parameters_that_repeat_others_stay_nominal_and_say_why():
    found = estimate(drawn(np.random.default_rng(1)).data)
    reasons = {p.name: v.reason for p, v in zip(found.parameters, found.visibility, strict=True) if not v.seen}
    assert set(reasons) >= {"theta1", "d1", "theta6", "d6", "a6", "alpha6"}
    assert len({"d2", "d3"} & set(reasons)) == 1
    assert any("d3" in r or "d2" in r for r in reasons.values())
    assert all(reasons.values())


def test_residuals_are_as_large_as_the_noise_says():
    rng = np.random.default_rng(2)
    found = [estimate(drawn(rng).data, noise="stated") for _ in range(40)]
    # 40 recordings of some 100 degrees of freedom: their mean is known to 1/sqrt(2000), the bound is four of that.
    assert np.mean([f.chi2_per_dof for f in found]) == pytest.approx(1.0, abs=4 * np.sqrt(2.0 / (40 * found[0].dof)))


def test_the_noise_of_the_joints_is_found():
    rng = np.random.default_rng(3)
    scales = [estimate(replace(drawn(rng).data)).scales["joints"] for _ in range(20)]
    assert np.mean(scales) == pytest.approx(1.0, abs=0.08)


HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
HALF_TURN[:2, 3] = [0.22, 0.16]


def flipped(Ts):
    Ts = Ts.copy()
    Ts[[3, 14]] = Ts[[3, 14]] @ HALF_TURN
    return Ts


def swapped(Ts):
    Ts = Ts.copy()
    Ts[[3, 14]] = Ts[[14, 3]]
    return Ts


def tilted(Ts):
    Ts = Ts.copy()
    Ts[[3, 14], :3, :3] = exp_rotation(np.deg2rad([[5.0, 0, 0], [0, 3.0, 4.0]])) @ Ts[[3, 14], :3, :3]
    return Ts


@pytest.mark.parametrize("wrong", [flipped, swapped, tilted])
def test_wrong_shots_are_named_and_do_no_harm(wrong):
    for seed in range(5):
        bad = drawn(np.random.default_rng(seed), wrong=wrong)
        found = estimate(bad.data)
        assert np.flatnonzero(~found.kept[0]).tolist() == [3, 14]
        good = estimate(drawn(np.random.default_rng(seed)).data)
        assert camera_error_m(found, bad.arm) < 2.0 * camera_error_m(good, bad.arm) + 5e-5


def test_good_shots_are_not_called_wrong():
    rng = np.random.default_rng(5)
    assert sum(int((~estimate(drawn(rng).data).kept[0]).sum()) for _ in range(30)) == 0


def test_a_fixed_head_that_watches_a_target_on_the_flange_shows_the_arm_as_well():
    rng = np.random.default_rng(7)
    recording, truth = cell().recording, cell().truth
    nominal, q = recording.arm, recording.joints[:20]
    sigmas = np.where(nominal.turns, np.deg2rad(0.03), 5e-4)
    arm = arm_with_values(nominal, nominal.values + sigmas * rng.standard_normal(len(sigmas)))
    T_base_head = truth.Ts_base_placement["p1"] @ np.diag([1.0, -1.0, -1.0, 1.0])
    T_flange_target = truth.T_flange_head
    Ts_head_target = (
        inverse(T_base_head) @ flange_poses(arm, q + 50e-6 * rng.standard_normal(q.shape)) @ T_flange_target
    )
    sigma = np.repeat([SIGMA_M, SIGMA_RAD], 3)
    Ts_head_target = apply_motion(Ts_head_target, sigma * rng.standard_normal((20, 6)))
    problem = HeadProblem(inverse(flange_poses(nominal, q)), Ts_head_target, np.zeros(20, dtype=int))
    covariances = np.tile(np.diag(sigma**2), (20, 1, 1))
    found = estimate(JointData(nominal, HeadShots(q, problem, fixed_head=True, covariances=covariances)))
    assert found.kept[0].all()
    assert 0.6 < found.chi2_per_dof < 1.5

    def predicted(arm, X, T_flange_target):
        return inverse(X) @ flange_poses(arm, q) @ T_flange_target

    seen = predicted(found.fit.state.arm, found.fit.state.X, found.fit.state.Ts_stand_target[0])
    moved = motion_between(predicted(arm, T_base_head, T_flange_target), seen)
    assert np.sqrt(np.mean(np.sum(moved[:, :3] ** 2, axis=1))) < 1.5e-4
