"""Reflectors on the flange, measured by an instrument beside the robot: the arm comes back, alone and with shots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from problems import random_transforms
from sixthlink.calibrate.arm import arm_with_steps, link_parameters
from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import HeadShots, JointData, estimate, repeatability_of
from sixthlink.calibrate.observations import MeasuredPoints
from sixthlink.files import load_arm
from sixthlink.geometry import apply_motion, inverse, transform_points
from sixthlink.robot import flange_poses

REFLECTORS_M = np.array([[0.1, 0.0, 0.05], [0.0, 0.12, 0.03], [-0.08, -0.03, 0.1]])


def measured(rng, *, noise_m=0.0, stated=False, stations=2, n=60):
    """Points of an arm off by its tolerances, from stations that nobody knows."""
    nominal = load_arm("abb_irb1400", folder=Path())
    links = link_parameters(nominal)
    true = arm_with_steps(nominal, links, [p.sigma * rng.standard_normal() for p in links])
    q = rng.uniform(*(0.6 * nominal.limits.T), (n, 6))
    station, reflector = np.arange(n) % stations, rng.integers(0, 3, n)
    Ts_base_instrument = random_transforms(rng, stations, 3.0)
    points = transform_points(flange_poses(true, q), REFLECTORS_M[reflector])
    points = transform_points(inverse(Ts_base_instrument)[station], points) + noise_m * rng.standard_normal((n, 3))
    covariances = np.tile(noise_m**2 * np.eye(3), (n, 1, 1)) if stated else None
    seen = MeasuredPoints(q, points, station, reflector, repeatability_of(nominal), covariances)
    return nominal, true, seen


def distance_error_m(arm, true, tool_m, found_m) -> float:
    """Largest error of distances that the arm spans: free of where base and flange frame are put."""
    q = np.random.default_rng(9).uniform(*(0.5 * true.limits.T), (40, 6))
    spans = [
        np.linalg.norm(np.diff(transform_points(flange_poses(a, q), np.tile(p, (40, 1))), axis=0), axis=1)
        for a, p in ((arm, found_m), (true, tool_m))
    ]
    return float(np.abs(spans[0] - spans[1]).max())


def test_exact_points_give_the_arm_back():
    nominal, true, seen = measured(np.random.default_rng(0))
    data = JointData(nominal, measured=seen)
    loose = [replace(p, sigma=100 * p.sigma) for p in estimate(data, noise="stated").parameters]
    found = estimate(data, parameters=loose, noise="stated")
    state = found.fit.state
    assert distance_error_m(nominal, true, REFLECTORS_M[0], REFLECTORS_M[0]) > 1e-3
    assert distance_error_m(state.arm, true, REFLECTORS_M[0], state.reflectors_m[0]) < 1e-6


@pytest.mark.parametrize("stated", [True, False])
def test_noise_of_the_instrument_is_taken_as_stated_or_found(stated):
    rng = np.random.default_rng(1)
    nominal, true, seen = measured(rng, noise_m=5e-5, stated=stated, n=150)
    found = estimate(JointData(nominal, measured=seen))
    if not stated:
        assert found.scales["readings"] == pytest.approx(5e-5, rel=0.25)
    assert found.kept[0].all()
    state = found.fit.state
    assert distance_error_m(state.arm, true, REFLECTORS_M[0], state.reflectors_m[0]) < 3e-4


def test_a_wrong_reading_is_named():
    nominal, _, seen = measured(np.random.default_rng(2), noise_m=5e-5, n=100)
    points = seen.points_m.copy()
    points[17] += [0.0, 0.004, 0.0]
    found = estimate(JointData(nominal, measured=replace(seen, points_m=points)))
    assert np.flatnonzero(~found.kept[0]).tolist() == [17]


def test_points_and_target_shots_combine_in_one_problem():
    """Few shots of a target alone leave more of the arm open than together with measured points."""
    rng = np.random.default_rng(3)
    nominal, true, seen = measured(rng, noise_m=3e-5, stated=True, n=60)
    q, placements = rng.uniform(*(0.5 * nominal.limits.T), (16, 6)), np.arange(16) % 2
    X, Ts_base_target = random_transforms(rng, 1, 0.2)[0], random_transforms(rng, 2)
    Ts_head_target = inverse(flange_poses(true, q) @ X) @ Ts_base_target[placements]
    sigma = np.repeat([2e-5, 5e-5], 3)
    Ts_head_target = apply_motion(Ts_head_target, sigma * rng.standard_normal((16, 6)))
    problem = HeadProblem(flange_poses(nominal, q), Ts_head_target, placements)
    shots = HeadShots(q, problem, covariances=np.tile(np.diag(sigma**2), (16, 1, 1)))
    alone = estimate(JointData(nominal, shots), noise="stated")
    both = estimate(JointData(nominal, shots, measured=seen), noise="stated")
    assert len(both.kept) == 2

    def arm_std(found, name):
        names = [p.name for p in found.problem.columns.arm]
        return np.sqrt(np.diag(found.covariance)[found.problem.columns.arm_slice])[names.index(name)]

    for name in ("d4", "alpha4", "theta5"):
        assert arm_std(both, name) < arm_std(alone, name)
    head_std = [np.sqrt(np.diag(f.covariance)[:3]).max() for f in (alone, both)]
    assert head_std[1] < head_std[0]
    errors = [distance_error_m(f.fit.state.arm, true, X[:3, 3], f.fit.state.X[:3, 3]) for f in (alone, both)]
    assert max(errors) < 3e-4
